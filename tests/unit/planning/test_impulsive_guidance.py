# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Impulsive transfers, and the controllers that fly them.

Figures marked "printed" are those of the GSSAP study that gives the transfers along the belt; the
others come from an independent computation.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from satform.control.protocol import ControlStep, FlightSetting, Motion
from satform.dynamics import cw
from satform.numeric.stacking import stack
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.path_reference import Reference
from satform.planning.impulsive_guidance import ImpulsiveGuidanceSpec, TimedBurnsSpec
from satform.planning.transfer_plan import plan_tour
from satform.planning.transfers import (
    Leg,
    drift_rate,
    hohmann_delta_v,
    hohmann_transfer,
    node_crossing_rate,
    semi_major_axis_offset_for_drift,
    two_impulse_transfer,
)

MEAN_MOTION = 2.0 * math.pi / 86164.0905
BELT = 42164169.6
HOUR = 3600.0
REST = np.zeros(3)
NOWHERE = Reference(REST, REST, REST)


def at_rest(x, y, z):
    return Motion(np.array([x, y, z]) * 1e3, REST)


def behind(distance, bearing=0.0):
    """A point at a distance (km) behind the target, seen at a bearing (deg) off the track."""
    angle = math.radians(bearing)
    return np.array([distance * math.sin(angle), -distance * math.cos(angle), 0.0]) * 1e3


@pytest.mark.parametrize(
    ("axis", "hours", "expected"),
    [(1, 1, 28.0802), (1, 2, 14.4063), (0, 1, 28.5739), (0, 2, 15.6844), (2, 1, 27.6181), (2, 2, 13.5684)],
)
def test_approach_from_100_to_50_km_costs_what_the_reference_computation_found(axis, hours, expected):
    direction = np.zeros(3)
    direction[axis] = -1.0
    start, end = at_rest(*(100.0 * direction)), at_rest(*(50.0 * direction))
    transfer = two_impulse_transfer(start, end, MEAN_MOTION, hours * HOUR)
    assert float(transfer.delta_v()) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("hours", "printed"), [(1, 28.0), (2, 14.4)])
def test_approach_along_the_track_costs_what_is_printed(hours, printed):
    transfer = two_impulse_transfer(at_rest(0, -100, 0), at_rest(0, -50, 0), MEAN_MOTION, hours * HOUR)
    assert float(transfer.delta_v()) == pytest.approx(printed, abs=0.1)


def test_first_impulse_of_the_one_hour_approach():
    transfer = two_impulse_transfer(at_rest(0, -100, 0), at_rest(0, -50, 0), MEAN_MOTION, HOUR)
    assert transfer.first_impulse == pytest.approx(np.array([-3.584235, 13.574888, 0.0]), rel=1e-4)


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        ([(80, 0, 1.0, False), (50, 0, 1.0, True)], 18.5365),
        ([(80, 0, 1.0, True), (50, 0, 1.0, True)], 28.0802),
        ([(80, 0, 1.0, False), (50, 0, 0.5, True)], 34.0422),
        ([(80, 0, 1.0, False), (60, 0, 0.5, False), (50, 0, 0.5, True)], 23.4406),
        ([(80, 0, 1.0, True), (60, 0, 0.5, True), (50, 0, 0.5, True)], 44.6598),
        ([(80, 21.0454, 1.0, False), (50, 0, 1.0, True)], 34.0),
        ([(80, 21.0454, 1.0, False), (60, 18.53, 0.5, False), (50, 0, 0.5, True)], 38.3),
        ([(80, 21.0454, 1.0, False), (60, 11.41, 0.5, False), (50, 0, 0.5, True)], 38.3),
    ],
)
def test_tours_along_the_track_cost_what_the_reference_computation_found(points, expected):
    legs = [Leg(behind(d, -b), hours * HOUR, stop) for d, b, hours, stop in points]
    plan = plan_tour(Motion(behind(100.0), REST), legs, MEAN_MOTION)
    assert plan.delta_v() == pytest.approx(expected, rel=1.5e-4)


finite = st.floats(-1e5, 1e5)
points = st.tuples(finite, finite, finite).map(np.array)
velocities = st.tuples(*[st.floats(-50.0, 50.0)] * 3).map(np.array)
motions = st.builds(Motion, points, velocities)
pushes = st.tuples(*[st.floats(-1e-5, 1e-5)] * 3).map(np.array)


@settings(max_examples=25, deadline=None)
@given(motions, motions, pushes, st.floats(0.03, 0.45))
def test_two_impulses_arrive_where_and_as_fast_as_wanted(start, end, push, orbits):
    duration = orbits * 2.0 * math.pi / MEAN_MOTION
    transfer = two_impulse_transfer(start, end, MEAN_MOTION, duration, push)
    left = np.concatenate((start.position, start.velocity + transfer.first_impulse))

    def rate(_time, state):
        natural = cw.acceleration(state[:3], state[3:], MEAN_MOTION)
        return np.concatenate((state[3:], natural + push))

    flown = solve_ivp(rate, (0.0, duration), left, method="DOP853", rtol=1e-11, atol=1e-8).y[:, -1]
    assert flown[:3] == pytest.approx(end.position, abs=1e-2)
    assert flown[3:] + transfer.second_impulse == pytest.approx(end.velocity, abs=1e-5)


def test_transfers_of_many_satellites_at_once_equal_those_of_each():
    starts = np.array([[0.0, -1e5, 0.0], [5e4, 0.0, 1e4]])
    stacked = two_impulse_transfer(
        Motion(starts, np.zeros((2, 3))), Motion(0.5 * starts, np.zeros((2, 3))), MEAN_MOTION, HOUR
    )
    for index, start in enumerate(starts):
        single = two_impulse_transfer(Motion(start, REST), Motion(0.5 * start, REST), MEAN_MOTION, HOUR)
        assert stacked.first_impulse[index] == pytest.approx(single.first_impulse, rel=1e-12)


@pytest.mark.parametrize("orbits", [0.5, 1.0, 2.0])
def test_a_whole_number_of_half_orbits_is_refused_in_words(orbits):
    with pytest.raises(ValueError, match="no two-impulse solution"):
        two_impulse_transfer(
            at_rest(0, -100, 0), at_rest(0, -50, 10), MEAN_MOTION, orbits * 2.0 * math.pi / MEAN_MOTION
        )


def test_a_transfer_in_no_time_is_refused_in_words():
    with pytest.raises(ValueError, match="takes a positive time"):
        two_impulse_transfer(at_rest(0, -100, 0), at_rest(0, -50, 0), MEAN_MOTION, 0.0)


def test_rise_from_fifty_kilometres_below_the_belt_costs_less_than_two_metres_per_second():
    assert sum(hohmann_delta_v(BELT - 50e3, BELT, GRAVITATIONAL_PARAMETER)) == pytest.approx(
        1.824652, rel=1e-5
    )


def test_descent_in_two_hohmann_transfers():
    first = sum(hohmann_delta_v(42214e3, 42197e3, GRAVITATIONAL_PARAMETER))
    second = sum(hohmann_delta_v(42197e3, 42192e3, GRAVITATIONAL_PARAMETER))
    assert (first, second) == pytest.approx((0.618920, 0.182106), rel=1e-5)


def test_a_hohmann_transfer_to_the_belt_is_the_one_of_a_textbook():
    """Vallado, Fundamentals of Astrodynamics and Applications, example 6-1; his constants."""
    parameter, radius = 3.986004415e14, 6378136.3
    transfer = hohmann_transfer(radius + 191344.11, radius + 35781348.57, parameter)
    assert transfer.first == pytest.approx(2457.038, abs=2e-3)
    assert transfer.second == pytest.approx(1478.187, abs=2e-3)
    assert transfer.delta_v() == pytest.approx(3935.224, abs=3e-3)
    assert transfer.duration / 60.0 == pytest.approx(315.403, abs=1e-3)


@pytest.mark.parametrize(("start", "end"), [(6.6e6, 42.0e6), (42.0e6, 6.6e6), (7.0e6, 7.1e6)])
def test_a_target_with_the_lead_angle_is_met_at_the_end_of_a_hohmann_transfer(start, end):
    transfer = hohmann_transfer(start, end, GRAVITATIONAL_PARAMETER)
    speed = math.sqrt(GRAVITATIONAL_PARAMETER / start) + transfer.first

    def rate(_time, state):
        pull = -GRAVITATIONAL_PARAMETER * state[:2] / np.linalg.norm(state[:2]) ** 3
        return np.concatenate((state[2:], pull))

    begin = np.array([start, 0.0, 0.0, speed])
    flown = solve_ivp(rate, (0.0, transfer.duration), begin, method="DOP853", rtol=1e-12, atol=1e-6).y[:, -1]
    angle = transfer.lead_angle + math.sqrt(GRAVITATIONAL_PARAMETER / end**3) * transfer.duration
    assert flown[:2] == pytest.approx(end * np.array([math.cos(angle), math.sin(angle)]), abs=1.0)
    circular = math.sqrt(GRAVITATIONAL_PARAMETER / end)
    assert flown[2:] + np.array([0.0, -transfer.second]) == pytest.approx([0.0, -circular], abs=1e-3)


def test_the_lead_angle_of_a_hohmann_transfer_comes_again_with_the_synodic_period():
    day = hohmann_transfer(BELT, 2.0 ** (2.0 / 3.0) * BELT, GRAVITATIONAL_PARAMETER)
    period = 2.0 * math.pi * math.sqrt(BELT**3 / GRAVITATIONAL_PARAMETER)
    assert day.waiting_period == pytest.approx(2.0 * period, rel=1e-9)
    assert hohmann_transfer(BELT, BELT, GRAVITATIONAL_PARAMETER).waiting_period == math.inf


def test_orbit_fifty_kilometres_below_the_belt_drifts_east_past_four_degrees_in_a_week():
    daily = math.degrees(drift_rate(-50e3, BELT, GRAVITATIONAL_PARAMETER)) * 86400.0
    assert daily == pytest.approx(0.643060, rel=1e-5)
    assert 4.35 / daily == pytest.approx(6.765, rel=1e-3)


def test_drift_of_a_small_offset_is_the_one_of_linear_relative_motion():
    motion = math.sqrt(GRAVITATIONAL_PARAMETER / BELT**3)
    _, velocity = cw.propagate(
        np.array([-100.0, 0.0, 0.0]), np.array([0.0, 150.0 * motion, 0.0]), motion, HOUR
    )
    assert BELT * drift_rate(-100.0, BELT, GRAVITATIONAL_PARAMETER) == pytest.approx(velocity[1], rel=1e-5)


def test_a_lap_of_the_belt_in_153_days_needs_184_kilometres():
    rate = math.radians(2.36) / 86400.0
    east = semi_major_axis_offset_for_drift(rate, BELT, GRAVITATIONAL_PARAMETER)
    west = semi_major_axis_offset_for_drift(-rate, BELT, GRAVITATIONAL_PARAMETER)
    assert pytest.approx(152.54, rel=1e-3) == 360.0 / 2.36
    assert (east, west) == pytest.approx((-182.77e3, 184.78e3), rel=1e-3)
    assert drift_rate(east, BELT, GRAVITATIONAL_PARAMETER) == pytest.approx(rate, rel=1e-9)


@pytest.mark.parametrize(
    ("inclination", "distance", "expected", "printed"),
    [
        (0.5, 30.1e3, 0.05107, 0.05),
        (2.0, 30.1e3, 0.20429, 0.20),
        (4.0, 30.1e3, 0.40851, 0.41),
        (6.0, 30.1e3, 0.61261, 0.61),
        (8.0, 30.1e3, 0.81652, 0.81),
        (10.0, 30.7e3, 1.00025, 1.0),
        (12.0, 36.9e3, 0.99806, 1.0),
        (15.0, 45.7e3, 1.00631, 1.0),
    ],
)
def test_inclined_satellites_pass_the_node_at_the_tabled_rate(inclination, distance, expected, printed):
    rate = math.degrees(node_crossing_rate(3074.660, math.radians(inclination), distance))
    assert rate == pytest.approx(expected, rel=1e-4)
    assert rate == pytest.approx(printed, abs=0.01)


SETTING = FlightSetting(MEAN_MOTION, 10.0)


def fly(law, motion, steps, setting=SETTING, push=REST):
    plant = cw.HeldInputStep.over(setting.mean_motion, setting.step)
    position, velocity, memory = motion.position, motion.velocity, law.start(motion)
    track, spent = [np.concatenate((position, velocity))], 0.0
    for step in range(steps):
        moment = ControlStep(step, setting.step)
        action = law.act(Motion(position, velocity), NOWHERE, memory, moment)
        memory = action.memory
        spent += float(np.linalg.norm(action.acceleration)) * setting.step
        position, velocity = plant.advance(position, velocity, action.acceleration + push)
        track.append(np.concatenate((position, velocity)))
    return np.array(track), spent


def waypoint(distance, hours, arrival):
    return {"position": tuple(behind(distance).tolist()), "duration": hours * HOUR, "arrival": arrival}


def test_way_points_are_met_to_the_millimetre_and_the_tour_ends_at_rest():
    spec = ImpulsiveGuidanceSpec(waypoints=[waypoint(80, 1, "pass"), waypoint(50, 1, "stop")])
    track, spent = fly(spec.build(SETTING), Motion(behind(100.0), REST), 721)
    assert track[360, :3] == pytest.approx(behind(80.0), abs=1e-3)
    assert track[720, :3] == pytest.approx(behind(50.0), abs=1e-3)
    assert np.abs(track[721, 3:]).max() < 1e-6
    assert spent == pytest.approx(18.5365, rel=0.02)


def test_a_tour_that_stops_on_the_way_is_at_rest_there():
    spec = ImpulsiveGuidanceSpec(
        waypoints=[waypoint(80, 1, "stop"), waypoint(50, 1, "stop")], start_time=100.0
    )
    track, spent = fly(spec.build(SETTING), Motion(behind(100.0), REST), 740)
    assert np.abs(track[371, 3:]).max() < 1e-6
    assert track[371, :3] == pytest.approx(behind(80.0), abs=50.0)
    assert track[731, :3] == pytest.approx(behind(50.0), abs=1e-3)
    assert spent == pytest.approx(28.08, rel=0.02)


def test_a_known_acceleration_is_solved_for_and_the_flight_is_the_planned_one():
    push, start = np.array([2e-5, -1e-5, 3e-5]), Motion(behind(100.0), np.array([0.3, -0.2, 0.1]))
    points = [waypoint(80, 1, "pass"), waypoint(70, 0.5, "stop"), waypoint(50, 1, "stop")]
    spec = ImpulsiveGuidanceSpec(waypoints=points, known_acceleration=tuple(push))
    track, spent = fly(spec.build(SETTING), start, 902, push=push)
    assert track[360, :3] == pytest.approx(behind(80.0), abs=1e-3)
    assert track[540, :3] == pytest.approx(behind(70.0), abs=1e-3)
    assert np.abs(track[541, 3:]).max() < 1e-6
    assert track[901, :3] == pytest.approx(behind(50.0), abs=1e-3)
    assert np.abs(track[902, 3:]).max() < 1e-6
    legs = [
        Leg(np.array(point["position"]), point["duration"], stop=point["arrival"] == "stop")
        for point in points
    ]
    plan = plan_tour(start, legs, MEAN_MOTION, push, SETTING.step)
    assert plan.delta_v() == pytest.approx(spent, rel=1e-9)
    assert plan.end.position == pytest.approx(track[902, :3], abs=1e-3)
    unknown = ImpulsiveGuidanceSpec(waypoints=points).build(SETTING)
    missed = fly(unknown, start, 902, push=push)[0][901, :3] - behind(50.0)
    # Over the last hour alone half the acceleration times the time squared, to first order.
    assert np.linalg.norm(missed) == pytest.approx(0.5 * np.linalg.norm(push) * HOUR**2, rel=0.1)


def test_a_leg_shorter_than_three_steps_is_refused_in_words():
    with pytest.raises(ValueError, match="waypoint 0 is flown to in 20 s, but three steps of 10 s"):
        ImpulsiveGuidanceSpec(waypoints=[waypoint(50, 20.0 / HOUR, "stop")]).build(SETTING)


def test_one_tour_and_a_stack_of_them_command_the_same_bits():
    specs = [
        ImpulsiveGuidanceSpec(
            waypoints=[waypoint(80, 0.05, "pass"), waypoint(end, 0.05, "stop")], start_time=delay
        )
        for end, delay in ((50, 0.0), (60, 20.0))
    ]
    laws = [spec.build(SETTING) for spec in specs]
    fleet, plant = stack(laws), cw.HeldInputStep.over(MEAN_MOTION, 10.0)
    start = Motion(np.stack((behind(100.0), behind(90.0, 3.0))), np.ones((2, 3)))
    memory, single = fleet.start(start), []
    for index, law in enumerate(laws):
        single.append(fly(law, Motion(start.position[index], start.velocity[index]), 45)[0])
    position, velocity = start.position, start.velocity
    for step in range(45):
        action = fleet.act(Motion(position, velocity), NOWHERE, memory, ControlStep(step, 10.0))
        memory = action.memory
        position, velocity = plant.advance(position, velocity, action.acceleration)
        assert np.array_equal(position, np.stack([track[step + 1, :3] for track in single]))


def test_timed_burns_change_the_velocity_by_what_is_asked_at_the_time_that_is_asked():
    burns = [
        {"time": 105.0, "velocity_change": (0.0, 0.1, 0.0)},
        {"time": 105.0, "velocity_change": (0.0, 0.0, -0.2)},
        {"time": 500.0, "velocity_change": (0.3, 0.0, 0.0)},
    ]
    law, memory = TimedBurnsSpec(burns=burns).build(SETTING), None
    motion = Motion(REST, REST)
    memory, flown = law.start(motion), {}
    for step in range(80):
        action = law.act(motion, NOWHERE, memory, ControlStep(step, SETTING.step))
        memory = action.memory
        if np.any(action.acceleration):
            flown[step] = action.acceleration * SETTING.step
    assert list(flown) == [10, 50]
    assert flown[10] == pytest.approx(np.array([0.0, 0.1, -0.2]))
    assert flown[50] == pytest.approx(np.array([0.3, 0.0, 0.0]))
