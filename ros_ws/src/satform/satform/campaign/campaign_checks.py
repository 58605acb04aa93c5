# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks of the parts of a campaign against each other and against its scenario, made when it is loaded.

What no case has to be built for is checked here. `effects` builds cases to find values that cannot fly and
dispersions without effect; `satform check` prints these as warnings.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from satform.campaign.dispersion import Correlated, Dispersion, value_complaints
from satform.campaign.distributions import Value
from satform.campaign.expectations import CampaignExpectation, OfFigure
from satform.campaign.figure import Figure
from satform.campaign.paths import PathError, Target
from satform.campaign.retained_data import Keep
from satform.campaign.sampling import MOST_CASES, Axis, Sampling
from satform.common.name_list import listed
from satform.common.spec import Complaint
from satform.scenario import ScenarioError, figure_checks
from satform.scenario.definition import ScenarioDefinition
from satform.scenario.field_errors import nearest
from satform.scenario.parts import Timing

_MOST_CASE_BYTES = 256_000_000
"""Size of the stored series of one case at most: it is in memory and in a message as a whole."""


def change_complaints(error: ScenarioError, changes: Mapping[str, Any]) -> list[Complaint]:
    """Why a scenario with the changes of `set` cannot fly, each at the change that it is about.

    Args:
        error: of the scenario with these changes.
        changes: values by the path of a field.
    """
    by_source = {f"with_ {key!r}": key for key in changes}
    return [
        (("set", by_source[problem.file]) if problem.file in by_source else ("set",), sentence)
        for problem in error.problems
        for sentence in [f"{problem.field}: {problem.sentence}" if problem.field else problem.sentence]
    ]


def path_complaints(
    dispersions: Sequence[Dispersion], fields: Sequence[Sequence[Target] | PathError]
) -> list[Complaint]:
    """What is wrong with the fields that are dispersed, and with their values.

    Args:
        dispersions: in their order in the campaign.
        fields: of each dispersion those that its path means, or why it means none.
    """
    complaints: list[Complaint] = []
    seen: dict[str, int] = {}
    for index, (dispersion, found) in enumerate(zip(dispersions, fields, strict=True)):
        field = ("dispersions", index)
        if isinstance(found, PathError):
            complaints.append(((*field, "path"), str(found)))
            continue
        if found[0].path == ("timing", "duration"):
            sentence = "all cases of a campaign last equally long: give the duration by set"
            complaints.append(((*field, "path"), sentence))
        complaints += [(field, sentence) for sentence in value_complaints(dispersion, found)]
        for target in found:
            if target.text in seen:
                other = dispersions[seen[target.text]].path
                sentence = f"{target.text} is dispersed by {other} already"
                complaints.append(((*field, "path"), sentence))
                break
            seen[target.text] = index
    labels = Counter(dispersion.label for dispersion in dispersions)
    for index, dispersion in enumerate(dispersions):
        if dispersion.name is not None and labels[dispersion.name] > 1:
            complaints.append((("dispersions", index, "name"), "another dispersion has this name too"))
    return complaints


def sampling_complaints(
    sampling: Sampling, runs: int | None, dispersions: Sequence[Dispersion], axes: Sequence[Axis] | None
) -> list[Complaint]:
    """Why cases cannot be chosen in this way.

    Args:
        sampling: of the campaign.
        runs: number of cases that is given; None for none.
        dispersions: in their order in the campaign.
        axes: independent coordinates of a case; None where a path of a dispersion means no field.
    """
    kind = _kind(sampling)
    complaints: list[Complaint] = []
    if not sampling.takes_grids:
        complaints += [
            (
                ("dispersions", index, "grid"),
                f"the sampling {kind} draws values and goes through no grid: give a distribution, such "
                "as choice, or use the sampling grid or one_at_a_time",
            )
            for index, dispersion in enumerate(dispersions)
            if dispersion.grid is not None
        ]
    if not sampling.enumerates and runs is None:
        return [*complaints, (("runs",), f"is missing: the sampling {kind} needs a number of cases")]
    if complaints or axes is None:
        return complaints
    if kind == "grid" and not any(axis.count for axis in axes):
        return [(("sampling",), "no dispersion has a grid, of which a combination could be flown")]
    cases = sampling.cases(axes, runs)
    if cases > MOST_CASES:
        return [(("sampling",), f"these values make {cases} cases; at most {MOST_CASES} are allowed")]
    if runs is not None and runs != cases:
        sentence = f"the sampling {kind} has {cases} cases, as many as its values make: leave runs out"
        return [(("runs",), sentence)]
    sentence = sampling.complaint(len(axes), cases)
    return [(("sampling",), sentence)] if sentence else []


def interval_complaints(sampling: Sampling, expectations: Sequence[CampaignExpectation]) -> list[Complaint]:
    """Expectations that ask for a confidence interval of cases that are not drawn at random.

    Args:
        sampling: of the campaign.
        expectations: in their order in the campaign.
    """
    if sampling.is_random:
        return []
    sentence = f"the sampling {_kind(sampling)} draws no cases at random and has no interval: use estimate"
    return [
        (("expect", index, "compare"), sentence)
        for index, wanted in enumerate(expectations)
        if "compare" in wanted.model_fields_set and wanted.compare == "interval"
    ]


def correlation_complaints(
    groups: Sequence[Correlated], dispersions: Sequence[Dispersion], axes: Sequence[Axis] | None
) -> list[Complaint]:
    """Why dispersions cannot depend on each other in this way.

    Args:
        groups: of dispersions that depend on each other, in their order in the campaign.
        dispersions: in their order in the campaign.
        axes: independent coordinates of a case; None where a path of a dispersion means no field.
    """
    complaints: list[Complaint] = []
    grouped: set[str] = set()
    by_label = {dispersion.label: dispersion for dispersion in dispersions}
    draws = Counter(dispersions[axis.dispersion].label for axis in axes or ())
    for index, group in enumerate(groups):
        field = ("correlated", index, "of")
        unknown = [label for label in group.of if label not in by_label]
        if unknown:
            sentence = f"there is no dispersion {unknown[0]}{nearest(unknown[0], sorted(by_label))}"
            complaints.append((field, sentence))
            continue
        complaints += [
            (field, f"{label} goes through a grid, and only draws can depend on each other")
            for label in group.of
            if by_label[label].grid is not None
        ]
        twice = [label for label in group.of if label in grouped]
        if twice:
            complaints.append((field, f"{twice[0]} is in another group too"))
        grouped |= set(group.of)
        if len({draws[label] for label in group.of}) > 1:
            each = ", ".join(f"{label} has {draws[label]}" for label in group.of)
            sentence = f"dispersions of a group have equally many fields; {each}: use shared, or the"
            complaints.append((field, f"{sentence} same wildcard in all"))
    return complaints


def figure_complaints(figures: Sequence[Figure], base: ScenarioDefinition) -> list[Complaint]:
    """What is wrong with the figures of a campaign.

    Args:
        figures: in their order in the campaign.
        base: scenario of all cases.
    """
    complaints: list[Complaint] = []
    names = Counter(figure.name for figure in figures)
    for index, figure in enumerate(figures):
        if names[figure.name] > 1:
            complaints.append((("figures", index, "name"), "another figure has this name too"))
        found = figure_checks.figure_complaints(base, figure.measure)
        complaints += [(("figures", index, "measure", *field), sentence) for field, sentence in found]
    return complaints


def expectation_complaints(
    expectations: Sequence[CampaignExpectation], figure_names: Sequence[str]
) -> list[Complaint]:
    """Expectations of figures that the campaign does not have, and those whose bounds come from nowhere.

    Args:
        expectations: in their order in the campaign.
        figure_names: of the figures of a case.
    """
    complaints: list[Complaint] = []
    for index, expectation in enumerate(expectations):
        if isinstance(expectation, OfFigure) and expectation.figure not in figure_names:
            sentence = f"there is no figure {expectation.figure!r}"
            allowed = f"; there are {listed(figure_names, 20)}" if figure_names else "; the campaign has none"
            complaints.append((("expect", index, "figure"), sentence + allowed))
        if not expectation.origin:
            sentence = (
                "nothing says where the bounds come from: give a source (requirement, paper, theory, another "
                "program), or say regression: true where they follow what this software gave"
            )
            complaints.append((("expect", index), sentence))
    return complaints


def series_complaints(
    keep: Keep,
    dispersions: Sequence[Dispersion],
    fields: Sequence[Sequence[Target] | PathError],
    timing: Timing,
    satellites: int,
) -> list[Complaint]:
    """Why series cannot be stored in this way.

    Args:
        keep: what is stored.
        dispersions: in their order in the campaign.
        fields: of each dispersion those that its path means, or why it means none.
        timing: of the flight.
        satellites: how many fly.
    """
    complaints: list[Complaint] = []
    for index, series in enumerate(keep.series):
        if series.every is None:
            continue
        field = ("keep", "series", index, "every")
        if not _divides(timing.step, series.every):
            sentence = f"{series.every:g} s is not a whole number of steps of {timing.step:g} s"
            complaints.append((field, sentence))
        elif series.every > timing.duration * (1.0 + 1e-9):
            complaints.append((field, f"{series.every:g} s is longer than the flight"))
    complaints = complaints or _dispersed_step_complaints(keep, dispersions, fields)
    names = Counter(series.quantity for series in keep.series)
    complaints += [
        (("keep", "series", index, "quantity"), "is kept twice")
        for index, series in enumerate(keep.series)
        if names[series.quantity] > 1
    ]
    size = keep.series_bytes(timing, satellites)
    if not complaints and size > _MOST_CASE_BYTES:
        sentence = (
            f"the series of one case take {size / 1e6:.0f} MB, and at most "
            f"{_MOST_CASE_BYTES / 1e6:.0f} MB are allowed: give them a longer every, or store fewer"
        )
        complaints.append((("keep", "series"), sentence))
    return complaints


def _dispersed_step_complaints(
    keep: Keep, dispersions: Sequence[Dispersion], fields: Sequence[Sequence[Target] | PathError]
) -> list[Complaint]:
    """Series of which the cases of a dispersed step would have values at unlike times."""
    paths_are_right = not any(isinstance(found, PathError) for found in fields)
    dispersed = next((i for i, found in enumerate(fields) if _is_step(found)), None)
    if not paths_are_right or dispersed is None:
        return []
    dispersion = dispersions[dispersed]
    steps = dispersion.values() if dispersion.applied == "replace" else ()
    return [
        (
            ("keep", "series", index),
            "timing.step is dispersed, and all cases have values at the same times only if `every` is a "
            "whole number of each step: replace the step by listed values, and give such an every",
        )
        for index, series in enumerate(keep.series)
        if not steps or series.every is None or not all(_divides(step, series.every) for step in steps)
    ]


def _is_step(found: Sequence[Target] | PathError) -> bool:
    """Whether a dispersion means the control period."""
    return not isinstance(found, PathError) and found[0].path == ("timing", "step")


def _kind(sampling: Sampling) -> str:
    return str(getattr(sampling, "kind", "sampling"))


def _divides(step: Value, every: float) -> bool:
    """Whether a time is a whole number of steps."""
    if not isinstance(step, int | float) or step <= 0.0:
        # The check of the values says so.
        return True
    ratio = every / step
    return round(ratio) >= 1 and abs(ratio - round(ratio)) <= 1e-6 * max(1.0, ratio)
