# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""New targets of satellites as they are asked for in flight, checked as those of a scenario are."""

from collections.abc import Mapping, Sequence

from pydantic import ValidationError

from satform.flight.plans import ReconfigurationPlan
from satform.membership.reconfiguration import SatelliteTargetSpec, Target, TargetSpec
from satform.scenario.errors import ScenarioError
from satform.scenario.field_errors import field_sentence
from satform.scenario.reconfiguration_checks import target_complaints
from satform.scenario.yaml_reader import read_value

_LONGEST_TEXT = 10_000
"""Characters of a target's text."""


def requested_targets(
    plan: ReconfigurationPlan,
    satellites: Sequence[str],
    texts: Sequence[str],
    present: Mapping[int, Target],
) -> dict[int, TargetSpec]:
    """Targets by the indices of their satellites.

    Args:
        plan: what they are checked against.
        satellites: names.
        texts: of each one's target, YAML or JSON with the fields of `TargetSpec`.
        present: targets in force, by the indices of their satellites.

    Raises:
        ValueError: the sentence says which satellite cannot have which target.
    """
    if len(satellites) != len(texts):
        raise ValueError(f"{len(satellites)} satellites and {len(texts)} targets; each satellite needs one")
    if not satellites:
        raise ValueError("no satellites: name those that get a new target")
    names = list(plan.satellites)
    found: dict[int, TargetSpec] = {}
    for name, text in zip(satellites, texts, strict=True):
        own = _target(name, text).target
        index = names.index(name) if name in names else -1
        whole = own.over(present[index].spec) if index in present else own
        complaints = target_complaints(
            name, whole, plan.satellites, plan.announces, plan.nominal_period, plan.largest_distance
        )
        if complaints:
            raise ValueError(complaints[0])
        if index in found:
            raise ValueError(f"{name} has two targets; a satellite gets one at a step")
        found[index] = own
    return found


def _target(name: str, text: str) -> SatelliteTargetSpec:
    """One target.

    Raises:
        ValueError: the text is no target.
    """
    if len(text) > _LONGEST_TEXT:
        raise ValueError(f"the target of {name} has {len(text)} characters; at most {_LONGEST_TEXT}")
    try:
        data = read_value(text, f"the target of {name}")
    except ScenarioError as error:
        raise ValueError(f"the target of {name} {error.problems[0].sentence}") from None
    if not isinstance(data, dict):
        raise ValueError(f"the target of {name} has to be fields with values, such as {{phase_offset: 10.0}}")
    if "satellite" in data:
        raise ValueError(f"the target of {name} has a field satellite; its name is given beside it")
    fields = {**data, "satellite": name}
    try:
        return SatelliteTargetSpec.model_validate(fields)
    except ValidationError as error:
        found = error.errors(include_url=False)
        sentences = [field_sentence(details, SatelliteTargetSpec, fields) for details in found]
        raise ValueError(f"the target of {name}: {'; '.join(sentences)}") from None
