# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Cases of a campaign flown as one formation: the results are those of each case flown alone."""

import math
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from campaigns import FLOWN_ALONE, SHIPPED, campaign, of, shortened_campaign
from satform.campaign.chunk import fly_case, fly_chunk
from satform.campaign.loader import load_campaign
from satform.campaign.model import Campaign
from satform.campaign.results import CaseResult
from satform.campaign.stacked_cases import stacks
from satform.evaluation.tracking import TrackingError
from satform.flight.compile import FormationPlan, compile_scenario
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario

pytestmark = pytest.mark.unmeasured

NOT_REACHED = {("triangle_dispersed", "agreement")}
"""Names and figures of shipped campaigns that no flight of a short duration has."""

STARTS = of("satellites[*].position_error[*]", {"kind": "normal", "standard_deviation": 50.0}, applied="add")


def content(result: CaseResult) -> tuple[Any, ...]:
    """All that a result says of its flight, bit for bit."""
    figures = {name: struct.pack("<d", figure) for name, figure in result.figures.items()}
    series = {name: (values.shape, values.tobytes()) for name, values in result.series.items()}
    return result.number, result.changes, figures, result.met, result.success, result.reason, series


def alone(dispersed: Campaign, numbers: Sequence[int]) -> list[tuple[Any, ...]]:
    return [content(fly_case(dispersed, number)) for number in numbers]


@pytest.mark.parametrize(
    ("scenario", "changes", "dispersions"),
    [
        (
            "triangle",
            {"timing.duration": 60.0},
            [of("satellites[*].controller.reaching_gain[*]", {"kind": "uniform", "low": 0.08, "high": 0.12})],
        ),
        (
            "noisy_navigation",
            {"timing.duration": 120.0},
            [of("satellites[*].sensor.position_noise[*]", {"kind": "uniform", "low": 0.5, "high": 2.0})],
        ),
        (
            "lossy_links",
            {"timing.duration": 300.0},
            [of("links.default.loss", {"kind": "uniform", "low": 0.0, "high": 0.9})],
        ),
    ],
)
def test_cases_flown_as_one_have_the_results_of_each_flown_alone(
    scenario: str, changes: dict[str, Any], dispersions: list[Any]
) -> None:
    expect = [{"kind": "tracking_error", "below": 40.0, "source": "a test"}]
    every = 10 * campaign(scenario, runs=1).base.timing.step
    keep = {"series": [{"quantity": "position", "every": every}, {"quantity": "tracking_error"}]}
    dispersed = campaign(
        scenario,
        runs=5,
        set={**changes, "expect": expect},
        dispersions=[STARTS, *dispersions],
        figures=[{"name": "effort", "measure": {"kind": "delta_v"}}],
        keep=keep,
    )
    results = fly_chunk(dispersed, range(5))
    assert all(result.stacked for result in results)
    assert [content(result) for result in results] == alone(dispersed, range(5))
    assert len({result.figures["effort"] for result in results}) == 5


@pytest.mark.parametrize("name", [name for name in SHIPPED if name not in FLOWN_ALONE])
def test_ten_cases_of_a_shipped_campaign_flown_as_one_have_the_results_of_each_flown_alone(
    name: str, tmp_path: Path
) -> None:
    shipped = load_campaign(shortened_campaign(name, tmp_path, ("position", "velocity", "acceleration")))
    # From all parts of the campaign: a grid begins with cases that are much alike.
    numbers = [index * (shipped.cases // 10 + 1) for index in range(10)]
    flown = fly_chunk(shipped, numbers)
    assert [content(result) for result in flown] == alone(shipped, numbers)
    assert all(result.stacked for result in flown)
    # At the two smallest rates of loss, no message may be lost in a short flight.
    assert len({result.series["position"].tobytes() for result in flown}) >= 9
    for figure in shipped.figure_names:
        reached = any(math.isfinite(result.figures[figure]) for result in flown)
        assert reached == ((name, figure) not in NOT_REACHED)


def test_figures_of_orbits_are_those_of_each_case_s_own_chief() -> None:
    pairs = ("radial_normal_distance", "passive_safety", "collision_probability")
    fields = {
        "passive_safety": {"orbits": 0.5},
        "collision_probability": {"combined_radius": 10.0, "standard_deviation": 100.0},
    }
    measures = [{"kind": kind, **fields.get(kind, {})} for kind in (*pairs, "delta_v_per_orbit")]
    dispersed = campaign(
        "ei_separation",
        runs=4,
        set={"timing.step": 20.0, "timing.duration": 6000.0, "expect": [], "satellite_defaults": PUSHED},
        dispersions=[of("orbit.period", {"kind": "uniform", "low": 5500.0, "high": 6000.0})],
        figures=[{"name": measure["kind"], "measure": measure} for measure in measures],
    )
    results = fly_chunk(dispersed, range(4))
    assert all(result.stacked for result in results)
    assert [content(result) for result in results] == alone(dispersed, range(4))
    for name in dispersed.figure_names:
        assert len({result.figures[name] for result in results}) == 4
        assert all(math.isfinite(result.figures[name]) for result in results)


PUSHED = {"controller": {"kind": "lqr", "feedforward": True}, "path_parameter": "angle"}


def test_a_case_that_ends_early_is_flown_alone_and_says_why() -> None:
    gains = of(
        "satellites[*].controller.reaching_gain[*]", {"kind": "choice", "values": [0.05, 1.6]}, shared=True
    )
    limits = {"timing.duration": 80.0, "limits.speed": 500.0, "expect": []}
    dispersed = campaign("noisy_navigation", runs=14, set=limits, dispersions=[gains])
    results = fly_chunk(dispersed, range(6, 14))
    assert {result.stacked for result in results} == {True, False}
    assert [content(result) for result in results] == alone(dispersed, range(6, 14))
    for result in results:
        assert result.stacked == result.success
        assert result.stacked != ("beyond the limit" in result.reason)


def test_cases_of_different_kinds_are_flown_in_different_stacks_or_alone() -> None:
    sources = of(
        "satellites[*].feedforward_sample", {"kind": "choice", "values": ["start", "midpoint"]}, shared=True
    )
    taken = of("consensus.neighbour_values", {"kind": "choice", "values": ["hold", "extrapolate"]})
    short = {"timing.duration": 4.0, "expect": []}
    dispersed = campaign(runs=9, set=short, dispersions=[sources, taken], figures=[EFFORT])
    plans = [[case.plan.satellite(0) for case in stack] for stack in stacks(dispersed, range(9))]
    kinds = [
        {(plan.path.feedforward_sample, plan.consensus.neighbour_values) for plan in stack} for stack in plans
    ]
    assert len(kinds) > 1
    assert all(len(kind) == 1 for kind in kinds)
    results = fly_chunk(dispersed, range(9))
    assert [content(result) for result in results] == alone(dispersed, range(9))


EFFORT = {"name": "effort", "measure": {"kind": "delta_v"}}


def test_the_record_of_a_failed_case_is_that_of_its_flight_alone(tmp_path: Path) -> None:
    expect = [{"kind": "tracking_error", "below": 7380.0, "source": "a test"}]
    dispersed = campaign(
        runs=6,
        set={"timing.duration": 4.0, "expect": expect},
        dispersions=[
            of(
                "satellites[*].position_error[*]",
                {"kind": "normal", "standard_deviation": 500.0},
                applied="add",
            )
        ],
        keep={"record": "on_failure"},
    )
    results = fly_chunk(dispersed, range(6), records=str(tmp_path))
    assert {result.success for result in results} == {True, False}
    for result in results:
        assert result.stacked == result.success == (result.record_path is None)


class OwnError(TrackingError):
    """A kind of its own that measures whole records only."""

    def measure(self, record: FlightRecord) -> float:
        return float(record.tracking_error.max())


def test_a_figure_that_measures_whole_records_has_its_cases_flown_one_by_one() -> None:
    dispersed = campaign(
        runs=3, set={"timing.duration": 4.0, "expect": []}, dispersions=[STARTS], figures=[EFFORT]
    )
    assert [len(stack) for stack in stacks(dispersed, range(3))] == [3]
    own = dispersed.figures[0].model_copy(update={"measure": OwnError(below=1e9)})
    changed = dispersed.model_copy(update={"figures": (own,)})
    assert stacks(changed, range(3)) == []


@pytest.mark.parametrize("kind", ["delivered_connectivity", "delivered_fraction"])
def test_cases_with_a_figure_of_links_are_flown_one_by_one_and_have_it(kind: str) -> None:
    rates = of("links.default.loss", {"kind": "uniform", "low": 0.2, "high": 0.9})
    figure = {"name": "links", "measure": {"kind": kind}}
    if kind == "delivered_connectivity":
        figure["measure"] = {"kind": kind, "statistic": "mean"}
    dispersed = campaign(
        "lossy_links",
        runs=3,
        set={"timing.duration": 40.0, "expect": []},
        dispersions=[rates],
        figures=[EFFORT, figure],
    )
    results = fly_chunk(dispersed, range(3))
    assert not any(result.stacked for result in results)
    figures = [result.figures["links"] for result in results]
    assert all(map(math.isfinite, figures))
    assert len(set(figures)) == 3


@pytest.mark.parametrize("where", ["fly_stack", "stacks"])
def test_a_part_that_fails_among_many_has_each_case_flown_alone(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, where: str
) -> None:
    def fail(*_: Any) -> None:
        raise RuntimeError("this law flies one satellite")

    monkeypatch.setattr(f"satform.campaign.chunk.{where}", fail)
    dispersed = campaign(
        runs=3, set={"timing.duration": 4.0, "expect": []}, dispersions=[STARTS], figures=[EFFORT]
    )
    results = fly_chunk(dispersed, range(3))
    assert not any(result.stacked for result in results)
    assert all(result.success for result in results)
    assert "cases 0, 1, 2 are flown one by one" in caplog.text
    assert "RuntimeError: this law flies one satellite" in caplog.text


def test_a_case_whose_plan_cannot_be_made_is_flown_alone_and_one_that_cannot_fly_is_not_logged(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def compiled(scenario: Scenario) -> FormationPlan:
        if scenario.seed == 1:
            raise RuntimeError("this law takes no such gain")
        return compile_scenario(scenario)

    monkeypatch.setattr("satform.campaign.stacked_cases.compile_scenario", compiled)
    seeds = of("seed", grid={"values": [0, 1, 2, -1]})
    dispersed = campaign(
        sampling={"kind": "grid"}, set={"timing.duration": 4.0, "expect": []}, dispersions=[seeds]
    )
    [cases] = stacks(dispersed, range(4))
    assert [case.number for case in cases] == [0, 2]
    assert [record.getMessage() for record in caplog.records] == ["case 1 cannot be flown with others"]
    assert "RuntimeError: this law takes no such gain" in caplog.text
