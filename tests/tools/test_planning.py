# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans of approaches and patrols as the command line gives them."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from plan_output import planned
from satform.control.protocol import ControlStep, FlightSetting, Motion
from satform.dynamics import cw
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.path_reference import Reference
from satform.planning.impulsive_guidance import ImpulsiveGuidanceSpec, TimedBurnsSpec
from satform.planning.transfer_plan import plan_tour
from satform.planning.transfers import Leg
from satform_tools.cli import main as cli

BEHIND = ("--start", "0,-100e3,0")


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
    assert planned(capsys, "approach", *BEHIND, *options)["delta_v"] == pytest.approx(delta_v, rel=1e-4)


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


def integrated(start, burns, until, motion, push, duration):
    """Position and velocity at a time, with held burns by solve_ivp, or impulses where they last no time."""
    state, time = np.concatenate((start.position, start.velocity)), 0.0

    def flow(state, seconds, command):
        def rate(_time, now):
            natural = cw.acceleration(now[:3], now[3:], motion)
            return np.concatenate((now[3:], natural + command))

        if seconds <= 0.0:
            return state
        return solve_ivp(rate, (0.0, seconds), state, method="DOP853", rtol=1e-11, atol=1e-9).y[:, -1]

    for begin, change in burns:
        if begin + duration > until:
            break
        state = flow(state, begin - time, push)
        if duration:
            state = flow(state, duration, push + change / duration)
        else:
            state = state + np.concatenate((np.zeros(3), change))
        time = begin + duration
    return flow(state, until - time, push)


places = st.tuples(*[st.floats(-3000.0, 3000.0)] * 3).map(np.array)
speeds = st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array)
pushes = st.tuples(*[st.floats(-1e-5, 1e-5)] * 3).map(np.array)


@settings(max_examples=10, deadline=None)
@given(places, speeds, pushes, places, places, st.booleans(), st.sampled_from([0.0, 10.0, 60.0]))
def test_a_tour_from_any_motion_under_a_known_acceleration_meets_its_points_and_ends_at_rest(
    position, velocity, push, middle, end, stop, step
):
    motion, start = 1.1e-3, Motion(position, velocity)
    legs = [Leg(middle, 900.0, stop=stop), Leg(end, 1200.0, stop=True)]
    plan = plan_tour(start, legs, motion, push, step)
    burns = list(zip(plan.times.tolist(), plan.impulses, strict=True))
    second = 900.0 + (step if stop else 0.0)
    assert plan.times.tolist() == [0.0, *([900.0] if stop else []), second, second + 1200.0]
    for time, place in ((900.0, middle), (second + 1200.0, end)):
        # What is flown up to this time: the burns that are over by then.
        before = [(begin, change) for begin, change in burns if begin < time]
        assert integrated(start, before, time, motion, push, step)[:3] == pytest.approx(place, abs=1e-4)
    last = integrated(start, burns, plan.duration, motion, push, step)
    assert last[3:] == pytest.approx(np.zeros(3), abs=1e-6)
    assert last[:3] == pytest.approx(plan.end.position, abs=1e-4)


def test_burns_of_a_step_far_from_any_orbit_are_those_of_straight_motion(
    capsys: pytest.CaptureFixture[str],
) -> None:
    # About so slow an orbit there is no gravity: d = v0 T + a T^2 / 2 + dv1 (T - h / 2).
    distance, speed, push, time, step = 1000.0, 0.5, 1e-4, 800.0, 20.0
    plan = planned(
        capsys,
        *("approach", "--start", f"-1000,0,0,{speed},0,0", "--point", f"0,0,0,{time}"),
        *("--acceleration", f"{push},0,0", "--step", f"{step}", "--period", "1e12"),
    )
    first = (distance - speed * time - 0.5 * push * time**2) / (time - 0.5 * step)
    second = -(speed + first + push * (time + step))
    assert [burn["time"] for burn in plan["impulses"]] == [10.0, 810.0]
    assert [burn["velocity_change"][0] for burn in plan["impulses"]] == pytest.approx(
        [first, second], rel=1e-6
    )
    assert plan["delta_v"] == pytest.approx(abs(first) + abs(second), rel=1e-6)
    assert plan["duration"] == 820.0
    # The last burn stops it evenly, within its step.
    passed = 0.5 * (speed + first + push * time) * step
    assert plan["end_position"] == pytest.approx([passed, 0.0, 0.0], abs=1e-3)


def test_burns_of_a_step_are_those_that_the_controllers_fly(capsys: pytest.CaptureFixture[str]) -> None:
    period, step = 5700.0, 10.0
    setting = FlightSetting(2.0 * math.pi / period, step)
    points = [((200.0, -500.0, 30.0), 900.0, "pass"), ((0.0, -100.0, 0.0), 1200.0, "stop")]
    words = [
        word
        for place, time, arrival in points
        for word in ("--point", ",".join(map(str, (*place, time))) + (",pass" if arrival == "pass" else ""))
    ]
    start = Motion(np.array([100.0, -2000.0, 50.0]), np.array([0.3, -0.1, 0.2]))
    state = ",".join(map(str, [*start.position, *start.velocity]))
    plan = planned(capsys, "approach", "--start", state, *words, "--period", f"{period}", "--step", f"{step}")
    guided = ImpulsiveGuidanceSpec(
        waypoints=[
            {"position": place, "duration": time, "arrival": arrival} for place, time, arrival in points
        ]
    )
    for law in (guided.build(setting), TimedBurnsSpec(burns=plan["impulses"]).build(setting)):
        commands, end = flown(law, start, setting, round(plan["duration"] / step))
        changes = np.array([change for change in commands if np.any(change)]) * step
        expected = np.array([burn["velocity_change"] for burn in plan["impulses"]])
        assert changes == pytest.approx(expected, abs=1e-9)
        assert end[:3] == pytest.approx(plan["end_position"], abs=1e-5)
        assert end[3:] == pytest.approx(np.zeros(3), abs=1e-8)


def flown(law, start, setting, steps):
    """Commands of a law on CW, and the motion at the end."""
    plant, nowhere = cw.HeldInputStep.over(setting.mean_motion, setting.step), Reference(*[np.zeros(3)] * 3)
    position, velocity, memory, commands = start.position, start.velocity, law.start(start), []
    for number in range(steps):
        action = law.act(Motion(position, velocity), nowhere, memory, ControlStep(number, setting.step))
        memory = action.memory
        commands.append(action.acceleration)
        position, velocity = plant.advance(position, velocity, action.acceleration)
    return commands, np.concatenate((position, velocity))


def test_hohmann_pairs_drift_rates_and_passing_rates_are_those_of_closed_forms(
    capsys: pytest.CaptureFixture[str],
) -> None:
    # Vallado, example 6-1.
    transfer = planned(capsys, "hohmann", "--start", "191344.11", "--end", "35781348.57", "--altitudes")
    assert transfer["delta_v"] == pytest.approx(3935.224, abs=0.01)
    assert transfer["duration"] == pytest.approx(315.403 * 60.0, abs=0.1)
    back = planned(capsys, "hohmann", "--start", "35781348.57", "--end", "191344.11", "--altitudes")
    assert (back["first"], back["second"]) == pytest.approx((-transfer["second"], -transfer["first"]))
    # 4.35 deg in about a week, printed by the study of the belt.
    drift = planned(capsys, "drift", "--offset", "-50e3", "--angle", "4.35")
    assert math.degrees(drift["rate"]) * 86400.0 == pytest.approx(0.643060, rel=1e-5)
    assert drift["duration"] / 86400.0 == pytest.approx(6.765, rel=1e-3)
    assert drift["along_track_per_orbit"] == pytest.approx(3.0 * math.pi * 50e3, rel=3e-3)
    daily = math.degrees(drift["rate"]) * 86400.0
    assert planned(capsys, "drift", "--rate", f"{daily:.15g}")["offset"] == pytest.approx(-50e3, rel=1e-9)
    # Printed table of passes at the node.
    radius = GRAVITATIONAL_PARAMETER / 3074.660**2
    passing = ("passing", "--inclination", "2", "--radius", f"{radius:.15g}")
    assert math.degrees(planned(capsys, *passing, "--distance", "30.1e3")["rate"]) == pytest.approx(
        0.20429, rel=1e-4
    )
    assert planned(capsys, *passing, "--rate", "0.20429")["distance"] == pytest.approx(30.1e3, rel=1e-4)


CHANGE = ("elements", "--start", "0,0,300,0,100,300", "--wanted", "0,400,0,500,0,400")


def test_impulses_between_elements_cost_the_bound_of_closed_form(capsys: pytest.CaptureFixture[str]) -> None:
    plan = planned(capsys, *CHANGE, "--argument", "20", "--orbits", "2")
    motion = math.tau / 6000.0
    along, normal = 0.5 * motion * math.hypot(300.0, 500.0), motion * math.hypot(100.0, 100.0)
    assert plan["delta_v_bound"] == pytest.approx(along + normal, rel=1e-12)
    assert plan["delta_v"] == pytest.approx(along + normal, rel=1e-9)
    assert plan["end_elements"] == pytest.approx([0.0, 400.0, 0.0, 500.0, 0.0, 400.0], abs=1e-6)
    times = [impulse["time"] for impulse in plan["impulses"] if impulse["velocity_change"][1]]
    first = (math.degrees(math.atan2(500.0, -300.0)) - 20.0) / 360.0 * 6000.0
    assert times == pytest.approx([first, first + 3000.0, first + 6000.0])


@pytest.mark.parametrize("argument", ["3620", "1e17", "-1e17", "1e300"])
def test_whole_turns_of_the_argument_do_not_change_a_plan(
    argument: str, capsys: pytest.CaptureFixture[str]
) -> None:
    within = f"{math.fmod(float(argument), 360.0)}"
    plans = [planned(capsys, *CHANGE, "--argument", angle, "--orbits", "2") for angle in (argument, within)]
    assert plans[0] == plans[1]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--start", "0,0,300"), "--start 0,0,300: takes six numbers"),
        (("--wanted", "0,0,x,0,0,0"), "--wanted 0,0,x,0,0,0: takes six numbers"),
        (("--orbits", "1"), "--orbits 1: a plan of elements takes 2 to 50 orbits"),
        (("--period", "0"), "--period 0: an orbit takes a positive time"),
        (("--argument", "inf"), "--argument inf: takes a finite angle"),
    ],
)
def test_bad_elements_are_refused_in_a_sentence(
    words: tuple[str, str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["plan", *CHANGE, *words]) == 2
    assert sentence in capsys.readouterr().err


def test_the_plans_are_printed_as_tables(capsys: pytest.CaptureFixture[str]) -> None:
    said = {}
    for words in (
        ("approach", "--start", "0,-1000,0,0.1,0,0", "--point", "0,-100,0,1200", "--step", "10"),
        ("hohmann", "--start", "42114169.6", "--end", "42164169.6"),
        ("drift", "--rate", "2.36"),
        ("passing", "--inclination", "10", "--rate", "1"),
        CHANGE,
    ):
        assert cli.main(["plan", *words]) == 0
        said[words[0]] = capsys.readouterr().out
    assert "middle [s]" in said["approach"]
    assert "each burn is held over 10 s" in said["approach"]
    assert "1.824652 m/s" in said["hohmann"]
    assert "-182774" in said["drift"]
    assert "30707." in said["passing"]
    assert "delta-v together: 0.453404 m/s, lower bound 0.453404 m/s" in said["elements"]


def test_the_closest_distance_of_a_tour_is_found_on_its_way() -> None:
    # About so slow an orbit the flight past the chief is straight.
    start, end = Motion(np.array([30.0, -400.0, 0.0]), np.zeros(3)), np.array([30.0, 400.0, 0.0])
    plan = plan_tour(start, [Leg(end, 8.0, stop=True)], 1e-7)
    assert plan.closest_distance == pytest.approx(30.0, rel=1e-3)
    assert plan.closest_time == pytest.approx(4.0, abs=0.01)


def test_the_patrol_of_three_satellites_is_planned_nearer_and_better_lit_than_the_drift(
    capsys: pytest.CaptureFixture[str],
) -> None:
    plan = planned(capsys, "patrol")
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
        (("approach", "--start", "0,1,2,3", "--point", "0,0,0,9"), "or 6 with the velocity"),
        (
            ("approach", *BEHIND, "--point", "0,-5e4,0,3600", "--acceleration", "1"),
            "--acceleration 1: takes 3",
        ),
        (("approach", *BEHIND, "--point", "0,-5e4,0,3600", "--step", "0"), "--step 0: a control step takes"),
        (("approach", *BEHIND, "--point", "0,0,0,25", "--step", "10"), "leg 0 of 25 s is 2.5 steps of 10 s"),
        (("approach", *BEHIND, "--point", "0,0,0,20", "--step", "10"), "at least 3"),
        (("hohmann", "--start", "1", "--end", "7e6"), "--start: the orbit has a radius of 1 m"),
        (("drift",), "give exactly one of --offset [m] and --rate [deg/day]"),
        (("drift", "--offset", "1", "--rate", "1"), "give exactly one of --offset"),
        (("drift", "--rate", "-400"), "takes more than -360.9"),
        (("drift", "--offset", "-4e7"), "--offset: the drifting orbit has a radius"),
        (("drift", "--offset", "0", "--angle", "4"), "does not lead there"),
        (("drift", "--offset", "9e3", "--angle", "4"), "does not lead there"),
        (("passing", "--inclination", "0", "--rate", "1"), "takes more than 0 and at most 180 deg"),
        (("passing", "--inclination", "5"), "give exactly one of --distance"),
        (("passing", "--inclination", "5", "--rate", "-1"), "--rate -1: takes a positive number"),
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
