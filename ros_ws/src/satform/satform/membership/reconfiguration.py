# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Targets of satellites that change in flight: other curves, scales and phase offsets from a step on.

A target is what a satellite's control law follows, given as in a scenario. A reconfiguration changes the
targets of one or more satellites at one step.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Annotated, Any

from pydantic import Field, model_validator

from satform.common.spec import Number, Plugin, Positive, Spec
from satform.orbits.curve_specs import CurveSpec


class TargetSpec(Spec):
    """What a satellite flies instead of what the scenario gives it; a field left out is as it was before."""

    curve: Annotated[CurveSpec, Plugin("satform.curves")] | None = None
    """The closed relative orbit to be flown."""
    scale: Positive | None = None
    """Metres of arc length per metre of generalised arc length. When left out, an orbit instead of the
    scenario's orbit keeps its generalised arc length per revolution; beside a fixed point, the scenario's
    scale."""
    phase_offset: Number | None = None
    """Generalised arc length by which the satellite leads the formation's agreement, m; its phase goes there
    as the consensus law leads it."""

    def over(self, before: "TargetSpec") -> "TargetSpec":
        """This target with what it leaves out taken from another one.

        Args:
            before: the target until then.
        """
        given = {name: value for name in FIELDS if (value := getattr(self, name)) is not None}
        if "curve" in given and "scale" not in given:
            # The scale until then belongs to the curve until then.
            given["scale"] = None
        return before.model_copy(update=given)

    def different_from(self, other: "TargetSpec") -> frozenset[str]:
        """Names of the fields whose values are not those of another target."""
        return frozenset(name for name in FIELDS if getattr(self, name) != getattr(other, name))

    def flown(self, curve: CurveSpec, scale: float) -> tuple[CurveSpec, float]:
        """Curve and scale that are flown with this target.

        Args:
            curve: of the scenario.
            scale: of the scenario, metres of arc length per metre of generalised arc length.

        Raises:
            ArithmeticError: a curve is too small or too large to be worked with.
        """
        if self.curve is None:
            return curve, scale if self.scale is None else self.scale
        if self.scale is None:
            own, other = float(curve.build().perimeter), float(self.curve.build().perimeter)
            return self.curve, scale * (other / own if own > 0.0 and other > 0.0 else 1.0)
        return self.curve, self.scale

    def to_text(self) -> str:
        """JSON of the fields that are given, from which `target_of` reads the same target."""
        return self.model_dump_json(include=set(FIELDS), exclude_none=True)


FIELDS = tuple(TargetSpec.model_fields)
"""Names of the fields of a target."""

_UNCHANGED = TargetSpec()
"""Target of a satellite that flies what the scenario gives it."""

_PARSED_TEXTS = 10_000
"""Targets whose parsed text is kept: all satellites of a process receive the same texts again and again."""


class SatelliteTargetSpec(TargetSpec):
    """New target of one satellite."""

    satellite: str
    """Name of the satellite."""

    @model_validator(mode="after")
    def _changes_something(self) -> "SatelliteTargetSpec":
        if all(getattr(self, name) is None for name in FIELDS):
            raise ValueError(f"nothing changes for {self.satellite}: give a curve, a scale or a phase_offset")
        return self

    @property
    def target(self) -> TargetSpec:
        """The target without the satellite's name."""
        return TargetSpec(**{name: getattr(self, name) for name in FIELDS})


class ReconfigurationSpec(Spec):
    """Satellites get new targets at one step."""

    at: Positive
    """When, at the first step that does not begin before this simulated time, s."""
    targets: Annotated[tuple[SatelliteTargetSpec, ...], Field(min_length=1, max_length=10_000)]
    """New targets; other satellites keep theirs."""

    @model_validator(mode="after")
    def _each_once(self) -> "ReconfigurationSpec":
        names = [target.satellite for target in self.targets]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"{twice[0]} has two targets; a satellite gets one at a step")
        return self


@dataclass(frozen=True)
class Target:
    """The target of a satellite in force.

    Attributes:
        spec: what is other than in the scenario.
        since: the first step with it.
        fields: names of the fields that were set at this step; parameters of the others that were changed in
            flight stay as they are.
    """

    spec: TargetSpec
    since: int
    fields: frozenset[str] = frozenset()


_NEVER_CHANGED = Target(_UNCHANGED, -1)
"""Target in force of a satellite that has got none in flight."""


@dataclass(frozen=True)
class TargetsChanged:
    """Satellites have other targets from this step on.

    Attributes:
        targets: by the indices of the satellites.
        reason: in words.
        whole: whether a field that a target leaves out is as the scenario has it; otherwise it is as in the
            target before.
        fields: names of the fields that are set, by the indices of the satellites; for one that is not in it,
            these are the fields of its target or, of a whole one, those that are other than before.
    """

    targets: Mapping[int, TargetSpec]
    reason: str
    whole: bool = False
    fields: Mapping[int, frozenset[str]] = field(default_factory=dict)

    def applied(self, targets: Mapping[int, Target], step: int) -> dict[int, Target]:
        """All targets in force after this change, by the indices of the satellites.

        Args:
            targets: in force before.
            step: of the change.
        """
        found = dict(targets)
        for satellite, spec in self.targets.items():
            former = found.get(satellite, _NEVER_CHANGED)
            whole = spec if self.whole else spec.over(former.spec)
            fields = spec.different_from(former.spec if self.whole else _UNCHANGED)
            fields = self.fields.get(satellite, fields)
            if former.since == step:
                fields |= former.fields
            found[satellite] = Target(whole, step, fields)
        return found


def present_targets(targets: Mapping[int, Target], satellites: Mapping[int, Any]) -> dict[int, TargetSpec]:
    """The targets in force of some satellites, to be set again as a whole.

    Args:
        targets: in force, by the indices of the satellites.
        satellites: by their indices.
    """
    return {index: targets[index].spec if index in targets else _UNCHANGED for index in satellites}


@lru_cache(maxsize=_PARSED_TEXTS)
def target_of(text: str) -> TargetSpec:
    """A target from JSON as `TargetSpec.to_text` writes it.

    Raises:
        ValueError: it is no target.
    """
    return TargetSpec.model_validate(json.loads(text))


def targets_in_force(status: Any, names: Sequence[str]) -> dict[int, Target]:
    """The targets that a status carries, by the indices of the satellites.

    Args:
        status: a message FormationStatus of the plant; one of an earlier version has no targets.
        names: of the satellites.

    Raises:
        ValueError: they are no targets of these satellites.
    """
    carried = getattr(status, "targets", ())
    indices = {name: index for index, name in enumerate(names)} if carried else {}
    found = {}
    for own in carried:
        if own.satellite not in indices:
            raise ValueError(f"there is no satellite {own.satellite}")
        target = Target(target_of(own.target), int(own.since), frozenset(own.fields))
        found[indices[own.satellite]] = target
    return found
