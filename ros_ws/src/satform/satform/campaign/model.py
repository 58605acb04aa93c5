# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The typed model of a campaign file: many cases of one scenario, and what is expected of them together."""

import hashlib
import json
from collections import Counter
from functools import cached_property
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, model_validator

from satform.campaign.campaign_checks import (
    change_complaints,
    correlation_complaints,
    expectation_complaints,
    figure_complaints,
    interval_complaints,
    path_complaints,
    sampling_complaints,
    series_complaints,
)
from satform.campaign.case_template import CaseTemplate
from satform.campaign.dispersion import Correlated, Dispersion
from satform.campaign.exact_arithmetic import Rows, cholesky_factor
from satform.campaign.expectations import CampaignExpectation
from satform.campaign.figure import Figure
from satform.campaign.paths import PathError, Target, targets
from satform.campaign.retained_data import Keep
from satform.campaign.sampling import MOST_CASES, Axis, MonteCarloSpec, Sampling
from satform.campaign.scenario_file import NamedScenario
from satform.common.spec import Complaint, Plugin, Positive, Spec, require_consistent
from satform.files.named_file import BY_CONTENT
from satform.scenario import Scenario, ScenarioError
from satform.scenario.expectation import Expectation
from satform.scenario.parts import Name, Sentence


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
        require_consistent(self._scenario_complaints() or self._complaints())
        return self

    def _scenario_complaints(self) -> list[Complaint]:
        try:
            _ = self.base
        except ScenarioError as error:
            return change_complaints(error, self.set)
        return []

    def _complaints(self) -> list[Complaint]:
        """What is wrong with a campaign whose scenario can fly."""
        base, dispersions, sampling = self.base, self.dispersions, self.sampling
        fields = [_fields(base, dispersion.path) for dispersion in dispersions]
        axes = None if any(isinstance(found, PathError) for found in fields) else self.axes
        return [
            *path_complaints(dispersions, fields),
            *sampling_complaints(sampling, self.runs, dispersions, axes),
            *correlation_complaints(self.correlated, dispersions, axes),
            *figure_complaints(self.figures, base),
            *expectation_complaints(self.expect, self.figure_names),
            *series_complaints(self.keep, dispersions, fields, base.timing, len(base.satellites)),
            *interval_complaints(sampling, self.expect),
        ]

    @property
    def series_bytes(self) -> int:
        """Size of the stored series of a case that flies to its end, at most."""
        return self.keep.series_bytes(self.base.timing, len(self.base.satellites))

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
    def template(self) -> CaseTemplate:
        """Data of the scenario of all cases, in which every dispersed field is present."""
        return CaseTemplate(self.base, [target for found in self.targets for target in found])

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

    def measured(self, scenario: Scenario) -> tuple[Expectation, ...]:
        """What is measured of a case, in the order of `figure_names`.

        Args:
            scenario: of the case.
        """
        return (*(figure.measure for figure in self.figures), *scenario.expect)

    @cached_property
    def figure_units(self) -> dict[str, str]:
        """Unit of each figure of a case by its name."""
        units = (measured.unit for measured in self.measured(self.base))
        return dict(zip(self.figure_names, units, strict=True))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the campaign's meaning and of its scenario's, with the content of files that it names.

        Title, text, and where the bounds of `expect` come from do not count: two campaigns with the same
        digest have the same cases, results and verdicts.
        """
        unused: Any = {"title": True, "text": True, "scenario": True}
        unused["expect"] = {"__all__": {"source", "regression"}}
        content = json.loads(self.model_dump_json(exclude=unused, context=BY_CONTENT))
        content["scenario"] = self.scenario.scenario.digest()
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def __repr__(self) -> str:
        return f"<Campaign {self.name}: {self.cases} cases of {self.base!r}>"

    __str__ = __repr__


def _fields(scenario: Scenario, path: str) -> tuple[Target, ...] | PathError:
    """The fields of a scenario that a path means, or why it means none."""
    try:
        return tuple(targets(scenario, path))
    except PathError as error:
        return error
