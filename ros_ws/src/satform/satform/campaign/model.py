# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The typed model of a campaign file: many cases of one scenario, and what is expected of them together."""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    ModelWrapValidatorHandler,
    PrivateAttr,
    ValidationInfo,
    model_validator,
)
from pydantic_core import PydanticCustomError

from satform.campaign.distributions import ChoiceSpec, Distribution, Quantity, Value
from satform.campaign.exact_arithmetic import Rows, cholesky_factor, linear_points, logarithmic_points
from satform.campaign.expectations import CampaignExpectation, OfFigure
from satform.campaign.paths import PathError, Target, targets
from satform.campaign.sampling import MOST_CASES, Axis, MonteCarloSpec, Sampling
from satform.campaign.scenario_file import NamedScenario
from satform.common.angle_text import DEGREES, DEGREES_PER_SECOND, is_angle
from satform.common.name_list import listed
from satform.common.spec import Complaint, Plugin, Positive, Spec
from satform.files.named_file import BY_CONTENT
from satform.record.flight_record import COLUMNS, component_count
from satform.scenario import Scenario, ScenarioError
from satform.scenario.expectation import Expectation
from satform.scenario.field_errors import nearest
from satform.scenario.parts import Name, Sentence

When = Literal["never", "on_failure", "always"]

_POSITIVE_DEFINITE = 1e-10
"""Least eigenvalue of a correlation matrix; below it a Cholesky factor is mostly rounding."""

_FIGURE_SOURCE = "figure of a campaign"

_MOST_CASE_BYTES = 256_000_000
"""Size of the stored series of one case at most: it is in memory and in a message as a whole."""


class Grid(Spec):
    """Values that a sampling goes through: a list of them, or evenly spaced ones."""

    values: Annotated[tuple[Value, ...], Field(min_length=1, max_length=100_000)] | None = None
    """The values; numbers in the unit of the field, text, or true and false."""
    first: Annotated[Quantity, Field()] | None = None
    """First of evenly spaced values; needs `last` and `count`."""
    last: Annotated[Quantity, Field()] | None = None
    """Last of them."""
    count: Annotated[int, Field(ge=2, le=100_000)] | None = None
    """How many there are, both ends included."""
    spacing: Literal["linear", "logarithmic"] = "linear"
    """Whether neighbouring values have the same difference or the same ratio."""

    @model_validator(mode="after")
    def _either(self) -> "Grid":
        spaced = (self.first, self.last, self.count)
        if (self.values is None) == all(value is None for value in spaced):
            raise ValueError("give either values, or first, last and count")
        if self.values is None and any(value is None for value in spaced):
            raise ValueError("evenly spaced values need first, last and count")
        if self.values is not None and self.spacing == "logarithmic":
            raise ValueError("listed values have no spacing")
        if self.spacing == "logarithmic" and not (self.first or 0.0) * (self.last or 0.0) > 0.0:
            raise ValueError("logarithmic spacing needs a first and last of the same sign, neither zero")
        return self

    @cached_property
    def points(self) -> tuple[Value, ...]:
        """All values in order."""
        if self.values is not None:
            return self.values
        assert self.first is not None  # noqa: S101 - the validator has seen to it
        assert self.last is not None  # noqa: S101 - likewise
        assert self.count is not None  # noqa: S101 - likewise
        spaced = linear_points if self.spacing == "linear" else logarithmic_points
        return spaced(self.first, self.last, self.count)


class Dispersion(Spec):
    """A field of the scenario that differs from case to case, or this field of several entries of a list."""

    path: Annotated[str, Field(min_length=1, max_length=500)]
    """The field, as messages print it: fields with dots between them, and for an entry of a list its index,
    its name, or `*` for all entries, such as `satellites[*].position_error[0]`."""
    name: Name | None = None
    """A name of its own, by which `correlated` and reports name it; the path when left out."""
    distribution: Annotated[Distribution, Plugin("satform.distributions")] | None = None
    """From which its values are drawn. Either this or `grid` is given."""
    grid: Grid | None = None
    """Values that are gone through, for the samplings `grid` and `one_at_a_time`."""
    applied: Literal["replace", "add", "scale"] = "replace"
    """Whether a value replaces that of the scenario, is added to it, or multiplies it."""
    shared: bool = False
    """Whether all fields of a wildcard have the same draw; otherwise each has an independent one."""

    _angles: tuple[str, ...] = PrivateAttr(())

    @model_validator(mode="wrap")
    @classmethod
    def _with_angles(cls, data: Any, handler: ModelWrapValidatorHandler["Dispersion"]) -> "Dispersion":
        """Remember which numbers were written as angles, in a unit that the field has to have."""
        made = handler(data)
        if isinstance(data, dict):
            made._angles = tuple(_angle_texts([data.get("distribution"), data.get("grid")]))
        return made

    @model_validator(mode="after")
    def _one_of_two(self) -> "Dispersion":
        if (self.distribution is None) == (self.grid is None):
            raise ValueError("give exactly one of distribution and grid")
        return self

    @property
    def label(self) -> str:
        """The name, or the path without one."""
        return self.name or self.path

    def values(self) -> tuple[Value, ...]:
        """All values that are listed one by one; none of a continuous distribution."""
        if self.grid is not None:
            return self.grid.points
        return self.distribution.values if isinstance(self.distribution, ChoiceSpec) else ()

    def misplaced_angle(self, pattern: str) -> str:
        """The first text that was written for an angle or a rate and is none of a pattern; empty for none."""
        return next((text for text in self._angles if not (pattern and re.match(pattern, text))), "")


class Correlated(Spec):
    """Dispersions whose draws depend on each other, by a Gaussian copula.

    The quantiles of the group are those of normal variables with the given correlations. Normal distributions
    have these correlations themselves; others have their rank correlation, 6 / pi * asin(r / 2).
    """

    of: Annotated[tuple[str, ...], Field(min_length=2)]
    """Names or paths of dispersions. Either each has one draw, or all have equally many: then the first draw
    of each belongs to the first of the others, the second to the second, and so on."""
    matrix: Annotated[tuple[tuple[Annotated[float, Field(ge=-1.0, le=1.0)], ...], ...], Field(min_length=1)]
    """Correlations of the normal variables: symmetric, ones on the diagonal, positive definite."""

    @model_validator(mode="after")
    def _is_correlation(self) -> "Correlated":
        count = len(self.of)
        if any(len(row) != count for row in self.matrix) or len(self.matrix) != count:
            raise ValueError(f"the matrix of {count} dispersions has {count} rows of {count} numbers")
        matrix = np.array(self.matrix)
        if not np.array_equal(matrix, matrix.T):
            raise ValueError("the matrix is not symmetric")
        if not np.all(np.diag(matrix) == 1.0):
            raise ValueError("each dispersion has the correlation 1 with itself, on the matrix's diagonal")
        least = float(np.linalg.eigvalsh(matrix)[0])
        if least < _POSITIVE_DEFINITE:
            raise ValueError(
                f"the matrix is not positive definite (its least eigenvalue is {least:.3g}): no variables "
                "have these correlations"
            )
        if len(set(self.of)) != count:
            raise ValueError("a dispersion is named twice")
        return self


class RetainedSeries(Spec):
    """A quantity of the flight that is stored over time."""

    quantity: str
    """Name of the quantity, as in a flight record."""
    every: Positive | None = None
    """Time between two stored values, s; every step when left out."""

    @model_validator(mode="after")
    def _is_known(self) -> "RetainedSeries":
        if self.quantity not in COLUMNS:
            raise ValueError(
                f"there is no quantity {self.quantity!r}{nearest(self.quantity, sorted(COLUMNS))}"
            )
        return self

    def stride(self, step: float) -> int:
        """Rows of the flight record from one that is stored to the next.

        Args:
            step: control period of the flight, s.
        """
        return 1 if self.every is None else max(1, round(self.every / step))


class Keep(Spec):
    """What is stored of each case beside its figures."""

    series: tuple[RetainedSeries, ...] = ()
    """Quantities over time, of all satellites."""
    record: When = "never"
    """Of which cases the whole flight record is stored."""
    bag: When = "never"
    """Of which cases a bag is stored."""


def _without_bounds(value: Any) -> Any:
    """A measure as the model of an expectation takes it, which asks for a bound and a source."""
    if not isinstance(value, dict):
        return value
    given = sorted({"value", "relative", "absolute", "below", "above", "source", "regression"} & set(value))
    if given and value.get("source") != _FIGURE_SOURCE:
        raise ValueError(
            f"a figure has no {', '.join(given)}: bounds of each case belong to the scenario's expect, for "
            "example by set, and bounds of all cases to the campaign's expect"
        )
    return {**value, "above": -1e15, "source": _FIGURE_SOURCE}


class Figure(Spec):
    """A figure of each case that is not judged case by case."""

    name: Name
    """By which `expect`, tables and reports name it."""
    measure: Annotated[Expectation, Plugin("satform.metrics"), BeforeValidator(_without_bounds)]
    """What is measured: `kind` and fields of an expectation of a scenario, without bounds and source."""


class Campaign(Spec):
    """Many cases of one scenario, which differ in what is dispersed, and what is expected of them together.

    Case N is the scenario with changes of fields that follow from this and N alone.
    """

    name: Name = "campaign"
    """The campaign's own name: lower case letters, digits and underscores."""
    title: Sentence = "untitled"
    """One line that says what is studied."""
    text: Sentence = ""
    """What the campaign shows, and where its dispersions come from."""
    scenario: NamedScenario
    """Path of the scenario's file from the folder of the campaign's file, or name of a shipped scenario."""
    set: dict[str, Any] = Field(default_factory=dict)
    """Changes of the scenario for all cases: values by the path of a field, as `--set` takes them."""
    runs: Annotated[int, Field(ge=1, le=MOST_CASES)] | None = None
    """Number of cases; left out for the samplings `grid` and `one_at_a_time`, whose values have a number."""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    """Seed of all draws, and of the seeds of the cases."""
    same_noise: bool = False
    """Whether all cases have the scenario's own seed, and so the same noise; otherwise each has one of its
    own, unless `seed` is dispersed itself."""
    sampling: Annotated[Sampling, Plugin("satform.sampling")] = MonteCarloSpec()
    """How the cases are chosen."""
    dispersions: Annotated[tuple[Dispersion, ...], Field(max_length=1000)] = ()
    """What differs from case to case."""
    correlated: tuple[Correlated, ...] = ()
    """Groups of dispersions that depend on each other."""
    figures: tuple[Figure, ...] = ()
    """Figures of each case beside those that the scenario expects something of."""
    keep: Keep = Keep()
    """What is stored of each case beside its figures."""
    timeout: Positive | None = None
    """Wall-clock time after which a case counts as failed, s; none when left out."""
    expect: tuple[Annotated[CampaignExpectation, Plugin("satform.campaign_expectations")], ...] = ()
    """What is expected of all cases together."""

    @model_validator(mode="after")
    def _consistent(self, info: ValidationInfo) -> "Campaign":
        complaints = self._scenario_complaints()
        if not complaints:
            complaints = [
                *self._path_complaints(),
                *self._sampling_complaints(),
                *self._correlation_complaints(),
                *self._figure_complaints(),
                *self._series_complaints(),
                *self._interval_complaints(),
            ]
        if complaints:
            # The loader turns each complaint into a problem with a line of its own.
            summary = "; ".join(sentence for _, sentence in complaints)
            raise PydanticCustomError(
                "inconsistent", "{summary}", {"summary": summary, "complaints": complaints}
            )
        return self

    def _scenario_complaints(self) -> list[Complaint]:
        try:
            _ = self.base
        except ScenarioError as error:
            return change_complaints(error, self.set)
        return []

    def _path_complaints(self) -> list[Complaint]:
        complaints: list[Complaint] = []
        seen: dict[str, int] = {}
        for index, dispersion in enumerate(self.dispersions):
            field = ("dispersions", index)
            try:
                found = targets(self.base, dispersion.path)
            except PathError as error:
                complaints.append(((*field, "path"), str(error)))
                continue
            if found[0].path == ("timing", "duration"):
                sentence = "all cases of a campaign last equally long: give the duration by set"
                complaints.append(((*field, "path"), sentence))
            complaints += [(field, sentence) for sentence in _value_complaints(dispersion, found)]
            for target in found:
                if target.text in seen:
                    other = self.dispersions[seen[target.text]].path
                    sentence = f"{target.text} is dispersed by {other} already"
                    complaints.append(((*field, "path"), sentence))
                    break
                seen[target.text] = index
        labels = Counter(dispersion.label for dispersion in self.dispersions)
        for index, dispersion in enumerate(self.dispersions):
            if dispersion.name is not None and labels[dispersion.name] > 1:
                complaints.append((("dispersions", index, "name"), "another dispersion has this name too"))
        return complaints

    def _sampling_complaints(self) -> list[Complaint]:
        kind = str(getattr(self.sampling, "kind", "sampling"))
        complaints: list[Complaint] = []
        if not self.sampling.takes_grids:
            complaints += [
                (
                    ("dispersions", index, "grid"),
                    f"the sampling {kind} draws values and goes through no grid: give a distribution, such "
                    "as choice, or use the sampling grid or one_at_a_time",
                )
                for index, dispersion in enumerate(self.dispersions)
                if dispersion.grid is not None
            ]
        if not self.sampling.enumerates and self.runs is None:
            return [*complaints, (("runs",), f"is missing: the sampling {kind} needs a number of cases")]
        if complaints or not self._paths_are_right():
            return complaints
        if kind == "grid" and not any(axis.count for axis in self.axes):
            return [(("sampling",), "no dispersion has a grid, of which a combination could be flown")]
        cases = self.sampling.cases(self.axes, self.runs)
        if cases > MOST_CASES:
            return [(("sampling",), f"these values make {cases} cases; at most {MOST_CASES} are allowed")]
        if self.runs is not None and self.runs != cases:
            sentence = f"the sampling {kind} has {cases} cases, as many as its values make: leave runs out"
            return [(("runs",), sentence)]
        sentence = self.sampling.complaint(len(self.axes), cases)
        return [(("sampling",), sentence)] if sentence else []

    def _interval_complaints(self) -> list[Complaint]:
        """Expectations that ask for a confidence interval of cases that are not drawn at random."""
        if self.sampling.is_random:
            return []
        kind = str(getattr(self.sampling, "kind", "sampling"))
        sentence = f"the sampling {kind} draws no cases at random and has no interval: use estimate"
        return [
            (("expect", index, "compare"), sentence)
            for index, wanted in enumerate(self.expect)
            if "compare" in wanted.model_fields_set and wanted.compare == "interval"
        ]

    def _paths_are_right(self) -> bool:
        try:
            _ = self.axes
        except PathError:
            return False
        return True

    def _correlation_complaints(self) -> list[Complaint]:
        complaints: list[Complaint] = []
        grouped: set[str] = set()
        by_label = {dispersion.label: dispersion for dispersion in self.dispersions}
        for index, group in enumerate(self.correlated):
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
            if self._paths_are_right():
                counts = {label: len(self._axes_of(label)) for label in group.of}
                if len(set(counts.values())) > 1:
                    each = ", ".join(f"{label} has {count}" for label, count in counts.items())
                    sentence = f"dispersions of a group have equally many fields; {each}: use shared, or the"
                    complaints.append((field, f"{sentence} same wildcard in all"))
        return complaints

    def _figure_complaints(self) -> list[Complaint]:
        complaints: list[Complaint] = []
        base = self.base
        whole = {own.name: base.satellite(index) for index, own in enumerate(base.satellites)}
        names = Counter(figure.name for figure in self.figures)
        for index, figure in enumerate(self.figures):
            if names[figure.name] > 1:
                complaints.append((("figures", index, "name"), "another figure has this name too"))
            found = figure.measure.complaints(set(whole), base.timing)
            found = found or figure.measure.complaints_about_satellites(whole, base.consensus.announces)
            complaints += [(("figures", index, "measure"), sentence) for sentence in found]
        known = self.figure_names
        for index, expectation in enumerate(self.expect):
            if isinstance(expectation, OfFigure) and expectation.figure not in known:
                sentence = f"there is no figure {expectation.figure!r}"
                allowed = f"; there are {listed(known, 20)}" if known else "; the campaign has none"
                complaints.append((("expect", index, "figure"), sentence + allowed))
        return complaints

    def _series_complaints(self) -> list[Complaint]:
        timing = self.base.timing
        complaints: list[Complaint] = []
        for index, series in enumerate(self.keep.series):
            if series.every is None:
                continue
            field = ("keep", "series", index, "every")
            if not _divides(timing.step, series.every):
                sentence = f"{series.every:g} s is not a whole number of steps of {timing.step:g} s"
                complaints.append((field, sentence))
            elif series.every > timing.duration * (1.0 + 1e-9):
                complaints.append((field, f"{series.every:g} s is longer than the flight"))
        complaints = complaints or self._dispersed_step_complaints()
        names = Counter(series.quantity for series in self.keep.series)
        complaints += [
            (("keep", "series", index, "quantity"), "is kept twice")
            for index, series in enumerate(self.keep.series)
            if names[series.quantity] > 1
        ]
        if not complaints and self.series_bytes > _MOST_CASE_BYTES:
            sentence = (
                f"the series of one case take {self.series_bytes / 1e6:.0f} MB, and at most "
                f"{_MOST_CASE_BYTES / 1e6:.0f} MB are allowed: give them a longer every, or store fewer"
            )
            complaints.append((("keep", "series"), sentence))
        return complaints

    @property
    def series_bytes(self) -> int:
        """Size of the stored series of a case that flies to its end, at most."""
        timing = self.base.timing
        return sum(
            8
            * (timing.steps // series.stride(timing.step) + 1)
            * len(self.base.satellites)
            * component_count(series.quantity)
            for series in self.keep.series
        )

    def _dispersed_step_complaints(self) -> list[Complaint]:
        """Series of which the cases of a dispersed step would have values at unlike times."""
        if not self._paths_are_right():
            return []
        steps: list[Value] = []
        for dispersion, found in zip(self.dispersions, self.targets, strict=True):
            if found[0].path == ("timing", "step"):
                steps = list(dispersion.values()) if dispersion.applied == "replace" else []
                break
        else:
            return []
        return [
            (
                ("keep", "series", index),
                "timing.step is dispersed, and all cases have values at the same times only if `every` is a "
                "whole number of each step: replace the step by listed values, and give such an every",
            )
            for index, series in enumerate(self.keep.series)
            if not steps or series.every is None or not all(_divides(step, series.every) for step in steps)
        ]

    @cached_property
    def base(self) -> Scenario:
        """The scenario of all cases: that of the file with the changes of `set`, without any dispersion.

        Raises:
            ScenarioError: with these changes it cannot fly.
        """
        scenario = self.scenario.scenario
        return scenario.with_(self.set) if self.set else scenario

    @cached_property
    def targets(self) -> tuple[tuple[Target, ...], ...]:
        """Of each dispersion the fields that it means."""
        return tuple(tuple(targets(self.base, dispersion.path)) for dispersion in self.dispersions)

    @cached_property
    def axes(self) -> tuple[Axis, ...]:
        """The independent coordinates of a case, in the order of the dispersions and of their fields."""
        return tuple(
            Axis(0 if dispersion.grid is None else len(dispersion.grid.points), index)
            for index, dispersion in enumerate(self.dispersions)
            for _ in range(1 if dispersion.shared else len(self.targets[index]))
        )

    def _axes_of(self, label: str) -> list[int]:
        """Indices of the axes of the dispersion with a label."""
        return [
            index for index, axis in enumerate(self.axes) if self.dispersions[axis.dispersion].label == label
        ]

    @cached_property
    def copulas(self) -> tuple[tuple[tuple[int, ...], Rows], ...]:
        """Axes that depend on each other, and the rows of the Cholesky factor of their correlations."""
        return tuple(
            (axes, cholesky_factor(group.matrix))
            for group in self.correlated
            for axes in zip(*(self._axes_of(label) for label in group.of), strict=True)
        )

    @property
    def cases(self) -> int:
        """Number of cases."""
        return self.sampling.cases(self.axes, self.runs)

    @cached_property
    def figure_names(self) -> tuple[str, ...]:
        """Names of the figures of a case: those of `figures`, then the labels of what the scenario expects.

        A label that several expectations have is followed by the index of each among all, as `label [3]`.
        """
        labels = [expectation.describe() for expectation in self.base.expect]
        own = [figure.name for figure in self.figures]
        count = Counter([*own, *labels])
        return (
            *own,
            *(f"{label} [{i}]" if count[label] > 1 else label for i, label in enumerate(labels)),
        )

    @cached_property
    def figure_units(self) -> dict[str, str]:
        """Unit of each figure of a case by its name."""
        measures = [*(figure.measure for figure in self.figures), *self.base.expect]
        return dict(zip(self.figure_names, (measure.unit for measure in measures), strict=True))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the campaign's meaning and of its scenario's, with the content of files that it names.

        Title and text do not count: two campaigns with the same digest have the same cases and results.
        """
        content = json.loads(self.model_dump_json(exclude={"title", "text", "scenario"}, context=BY_CONTENT))
        content["scenario"] = self.scenario.scenario.digest()
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def __repr__(self) -> str:
        return f"<Campaign {self.name}: {self.cases} cases of {self.base!r}>"

    __str__ = __repr__


def change_complaints(error: ScenarioError, changes: Mapping[str, Any]) -> list[Complaint]:
    """Why a scenario with the changes of `set` cannot fly, each at the change that it is about."""
    by_source = {f"with_ {key!r}": key for key in changes}
    return [
        (("set", by_source[problem.file]) if problem.file in by_source else ("set",), sentence)
        for problem in error.problems
        for sentence in [f"{problem.field}: {problem.sentence}" if problem.field else problem.sentence]
    ]


def _divides(step: Value, every: float) -> bool:
    """Whether a time is a whole number of steps."""
    if not isinstance(step, int | float) or step <= 0.0:
        # The check of the values says so.
        return True
    ratio = every / step
    return round(ratio) >= 1 and abs(ratio - round(ratio)) <= 1e-6 * max(1.0, ratio)


def _angle_texts(data: Any) -> list[str]:
    """Texts anywhere in plain data that stand for an angle or a rate."""
    if isinstance(data, dict | list | tuple):
        parts = data.values() if isinstance(data, dict) else data
        return [text for part in parts for text in _angle_texts(part)]
    return [data] if is_angle(data) else []


def _value_complaints(dispersion: Dispersion, found: list[Target]) -> list[str]:
    """Why values of a dispersion do not fit the fields that it means; the first reason of the first field."""
    for target in found:
        sentence = (
            _type_complaint(dispersion, target)
            or _angle_complaint(dispersion, target)
            or _applied_complaint(dispersion, target)
        )
        if sentence:
            return [sentence]
    return []


def _type_complaint(dispersion: Dispersion, target: Target) -> str:
    listed_values = dispersion.values()
    if not listed_values:
        if target.is_number:
            return ""
        holds = "true or false" if bool in target.types else "text"
        return f"{target.text} holds {holds}: disperse it by a choice of these"
    for value in listed_values:
        wanted = set(target.types) | ({int} if float in target.types else set())
        if isinstance(value, str) and target.angle and re.match(target.angle, value):
            continue
        whole = isinstance(value, float) and value.is_integer() and target.is_whole
        if type(value) not in wanted and not whole:
            names = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}
            holds = " or ".join(names[kind] for kind in (float, int, bool, str) if kind in target.types)
            return f"found {json.dumps(value)} among the values; {target.text} holds {holds}"
    return ""


def _angle_complaint(dispersion: Dispersion, target: Target) -> str:
    text = dispersion.misplaced_angle(target.angle)
    if not text:
        return ""
    unit = {DEGREES: "an angle in rad", DEGREES_PER_SECOND: "a rate in rad/s"}.get(target.angle, "no angle")
    return f"found {text!r} among the values; {target.text} holds {unit}"


def _applied_complaint(dispersion: Dispersion, target: Target) -> str:
    if dispersion.applied == "replace":
        return ""
    what = "added to" if dispersion.applied == "add" else "multiplied with"
    values = dispersion.values()
    if not target.is_number or any(isinstance(value, bool | str) for value in values):
        return f"only numbers can be {what} {target.text}"
    if target.value is None:
        return f"{target.text} is not given in the scenario, so that nothing can be {what} it: give it by set"
    if dispersion.applied == "scale" and target.value == 0:
        return f"{target.text} is 0 in the scenario, and so is every multiple of it: use applied: add"
    return ""
