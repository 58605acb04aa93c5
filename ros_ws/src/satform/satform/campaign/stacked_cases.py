# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flies alike cases of a campaign as one formation and makes their figures while they fly."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from satform.campaign.cases import case_scenario
from satform.campaign.model import Campaign
from satform.evaluation.flight_figures import FlightFigures
from satform.evaluation.sampled_loops import sampled_loops
from satform.flight.compile import FormationPlan, compile_scenario
from satform.flight.stacked_plans import group_runs
from satform.flight.stacked_runs import fly_stacked
from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock
from satform.record.reducer import FlightShape
from satform.scenario import Scenario, ScenarioError
from satform.scenario.expectation import Expectation

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Case:
    """A case that can be flown.

    Attributes:
        number: of the case.
        scenario: with its changes.
        plan: compiled from it.
    """

    number: int
    scenario: Scenario
    plan: FormationPlan


@dataclass(frozen=True)
class Flown:
    """What a case gave that was flown with others to its end.

    Attributes:
        case: that was flown.
        figures: of the campaign's figures and the scenario's expectations, in order.
        series: retained quantities over time by name, shape (T, N, ...).
    """

    case: Case
    figures: tuple[float, ...]
    series: dict[str, Array]


def stacks(campaign: Campaign, numbers: Sequence[int]) -> list[list[Case]]:
    """Cases that can be flown together.

    A case that cannot be flown, or with no other, is in none of them.

    Args:
        campaign: that they belong to.
        numbers: of the cases.
    """
    cases = [case for case in (_case(campaign, number) for number in numbers) if case is not None]
    found = []
    for group in group_runs([case.plan for case in cases]):
        first = cases[group[0]].scenario
        figures = FlightFigures(campaign.measured(first), _shape([cases[index] for index in group]))
        if figures.whole_records:
            continue
        alike = [cases[index] for index in group if cases[index].scenario.expect == first.expect]
        if len(alike) > 1:
            found.append(alike)
    return found


def fly_stack(
    campaign: Campaign, cases: Sequence[Case], advanced: Callable[[float], None] | None = None
) -> list[Flown]:
    """Fly cases as one formation.

    Args:
        campaign: that they belong to.
        cases: of one of its `stacks`.
        advanced: called now and then with the part of the steps that is flown, from 0 to 1.

    Returns:
        What those gave that were flown to their end. A case that ended early is to be flown alone.
    """
    first = cases[0]
    expectations = campaign.measured(first.scenario)
    figures = FlightFigures(expectations, _shape(cases))
    series = campaign.keep.decimated(first.plan.timing.step)

    def observe(block: FlightBlock) -> None:
        figures.update(block)
        for own in series.values():
            own.update(block)
        if advanced is not None:
            advanced((block.first_step + block.steps) / first.plan.timing.steps)

    needs = figures.needs.union(*(own.needs for own in series.values()))
    ends = fly_stacked([case.plan for case in cases], observe, needs)
    if len(ends) == len(cases):
        return []
    made = figures.figures()
    retained = {name: own.series() for name, own in series.items()}
    return [
        Flown(
            case,
            tuple(_with_loops(expectations, figures.of_loops, case, made[:, run].tolist())),
            {name: values[run] for name, values in retained.items()},
        )
        for run, case in enumerate(cases)
        if run not in ends
    ]


def _with_loops(
    expectations: Sequence[Expectation], of_loops: Sequence[int], case: Case, figures: list[float]
) -> list[float]:
    for index in of_loops:
        figures[index] = expectations[index].figure_of_loops(
            case.plan.names, lambda: sampled_loops(case.scenario)
        )
    return figures


def _case(campaign: Campaign, number: int) -> Case | None:
    try:
        scenario = case_scenario(campaign, number)
        plan = compile_scenario(scenario)
        # What cannot be compiled is found here, and not when many are flown.
        plan.plant  # noqa: B018
    except ScenarioError:
        return None  # flown alone, it has this as the reason of its result
    except Exception:
        _LOG.exception("case %d cannot be flown with others", number)
        return None
    return Case(number, scenario, plan)


def _shape(cases: Sequence[Case]) -> FlightShape:
    """Of the flight of cases as one formation; each may have an orbit of its own."""
    plan = cases[0].plan
    settings = tuple(case.scenario.setting for case in cases)
    return FlightShape(plan.names, plan.timing.step, plan.timing.steps, settings)
