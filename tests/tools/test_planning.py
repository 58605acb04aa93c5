# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans of approaches and patrols as the command line gives them."""

import json

import numpy as np
import pytest

from satform.control.protocol import Motion
from satform.dynamics import cw
from satform.planning.transfer_plan import plan_tour
from satform.planning.transfers import Leg
from satform_tools.cli import main as cli

BEHIND = ("--start", "0,-100e3,0")


def data(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    assert cli.main(["plan", *words, "--json"]) == 0
    found: dict[str, object] = json.loads(capsys.readouterr().out)
    return found


@pytest.mark.parametrize(
    ("points", "delta_v"),
    [
        (("0,-50e3,0,3600",), 28.0802),
        (("0,-50e3,0,7200",), 14.4063),
        (("0,-80e3,0,3600,pass", "0,-50e3,0,1800"), 34.0422),
        (("0,-80e3,0,3600", "0,-60e3,0,1800", "0,-50e3,0,1800"), 44.6598),
    ],
)
def test_an_approach_costs_what_the_reference_computation_found(
    points: tuple[str, ...], delta_v: float, capsys: pytest.CaptureFixture[str]
) -> None:
    options = [word for point in points for word in ("--point", point)]
    assert data(capsys, "approach", *BEHIND, *options)["delta_v"] == pytest.approx(delta_v, rel=1e-4)


def test_a_tour_s_impulses_lead_to_its_points_at_their_times() -> None:
    motion = 7.292e-5
    legs = [
        Leg(np.array([5e3, -80e3, 1e3]), 3600.0, stop=True),
        Leg(np.array([-3e3, -60e3, 0.0]), 1800.0, stop=False),
        Leg(np.array([0.0, -50e3, 0.0]), 2500.0, stop=True),
    ]
    plan = plan_tour(Motion(np.array([0.0, -100e3, 0.0]), np.zeros(3)), legs, motion)
    assert plan.times.tolist() == [0.0, 3600.0, 3600.0, 5400.0, 7900.0]
    state, time = np.array([0.0, -100e3, 0.0, 0.0, 0.0, 0.0]), 0.0
    places = {}
    for moment, impulse in zip(plan.times, plan.impulses, strict=True):
        state = cw.transition_matrix(motion, moment - time) @ state
        time = moment
        places[float(moment)] = state[:3].copy()
        state[3:] += impulse
    for moment, leg in ((3600.0, legs[0]), (5400.0, legs[1]), (7900.0, legs[2])):
        assert places[moment] == pytest.approx(leg.position, abs=1e-4)
    assert state[3:] == pytest.approx(np.zeros(3), abs=1e-9)


def test_the_closest_distance_of_a_tour_is_found_on_its_way() -> None:
    # About so slow an orbit the flight past the chief is straight.
    start, end = Motion(np.array([30.0, -400.0, 0.0]), np.zeros(3)), np.array([30.0, 400.0, 0.0])
    plan = plan_tour(start, [Leg(end, 8.0, stop=True)], 1e-7)
    assert plan.closest_distance == pytest.approx(30.0, rel=1e-3)
    assert plan.closest_time == pytest.approx(4.0, abs=0.01)


def test_the_patrol_of_three_satellites_is_planned_nearer_and_better_lit_than_the_drift(
    capsys: pytest.CaptureFixture[str],
) -> None:
    plan = data(capsys, "patrol")
    assert plan["delta_v"] == pytest.approx(0.337, abs=0.001)
    for seen, drifting in zip(plan["passes"], plan["drift_passes"], strict=True):
        assert seen["distance"] < drifting["distance"]
        assert seen["light_angle"] < drifting["light_angle"]
    for burn in plan["burns"]:
        assert burn["velocity_change"][1] == pytest.approx(np.linalg.norm(burn["velocity_change"]), rel=2e-3)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("approach", "--start", "0,1", "--point", "0,-5e4,0,3600"), "--start 0,1: takes 3 numbers"),
        (("approach", *BEHIND, "--point", "0,-5e4,0,3600,slowly"), "--point 0,-5e4,0,3600,slowly: takes 4"),
        (("approach", *BEHIND, "--point", "0,-5e4,0,43082.04525"), "has no two-impulse solution"),
        (("approach", *BEHIND, "--point", "0,-5e4,0,60", "--longitude", "5"), "needs both --date and"),
        (("patrol", "--target", "54,5"), "--target 54,5: takes 3 numbers"),
        (("patrol", "--days", "0"), "takes up to 60 days"),
    ],
)
def test_a_plan_that_cannot_be_made_is_refused_in_words(
    words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["plan", *words]) == 2
    assert said in capsys.readouterr().err


def test_a_patrol_that_cannot_keep_its_distance_ends_with_the_nearest_that_can(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ("plan", "patrol", "--target", "56.82,0.01,270", "--days", "7")
    assert cli.main([*words, "--keep-out", "300"]) == 1
    said = capsys.readouterr().err
    assert "stays 300 km away from every target all the time within 0.45 m/s and 7 days" in said
    feasible = said.rsplit(" is ", 1)[1].split(" km")[0]
    assert cli.main([*words, "--keep-out", feasible, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["closest_distance"] >= 1e3 * float(feasible)
