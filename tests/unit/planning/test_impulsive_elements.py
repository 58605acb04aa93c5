# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Pulses between relative orbital elements: reached elements, the bound, and the least delta-v there is."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from satform.control.protocol import Motion
from satform.control.relative_elements import RelativeElements, elements_from_motion, motion_from_elements
from satform.dynamics import cw
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.planning.impulsive_elements import change_to_make, delta_v_bound, plan_elements

AXIS = 7.0e6
MEAN_MOTION = math.sqrt(GRAVITATIONAL_PARAMETER / AXIS**3)
ORBIT = math.tau / MEAN_MOTION

small = st.floats(-300.0, 300.0)
elements = st.tuples(st.floats(-50.0, 50.0), st.floats(-2e3, 2e3), small, small, small, small)
arguments = st.floats(-math.pi, math.pi)
orbits = st.floats(2.0, 6.0)


def of(numbers):
    return RelativeElements.from_array(np.array(numbers, dtype=np.float64))


def flown(plan, start, argument, mean_motion=MEAN_MOTION):
    """Elements at the plan's end by the transition matrix of free motion."""
    motion = motion_from_elements(start, np.asarray(mean_motion), np.asarray(argument))
    state, time = np.concatenate((motion.position, motion.velocity)), 0.0
    for moment, impulse in zip(plan.times.tolist(), plan.impulses, strict=True):
        state = cw.transition_matrix(mean_motion, moment - time) @ state
        state, time = state + np.concatenate((np.zeros(3), impulse)), moment
    state = cw.transition_matrix(mean_motion, plan.duration - time) @ state
    end = np.asarray(argument + mean_motion * plan.duration)
    return elements_from_motion(Motion(state[:3], state[3:]), np.asarray(mean_motion), end).as_array()


def least_delta_v(change, argument, duration, radial=False):
    """Of pulses along the track, or in the orbit plane, at any of 500 places, by linear programming."""
    places = np.linspace(argument, argument + MEAN_MOTION * duration, 500)
    left = places[-1] - places
    zero, one = np.zeros_like(left), np.ones_like(left)
    columns = np.stack((2.0 * one, -3.0 * left, 2.0 * np.cos(places), 2.0 * np.sin(places)))
    if radial:
        outward = np.stack((zero, -2.0 * one, np.sin(places), -np.cos(places)))
        # Sixteen directions of each pulse; their hull is 2 % inside the circle.
        turns = math.tau * np.arange(16) / 16
        columns = np.hstack([math.cos(turn) * columns + math.sin(turn) * outward for turn in turns])
    else:
        columns = np.hstack((columns, -columns))
    wanted = change.as_array()[:4] * MEAN_MOTION
    return float(linprog(np.ones(columns.shape[1]), A_eq=columns, b_eq=wanted).fun)


@settings(max_examples=25, deadline=None)
@given(elements, elements, arguments, orbits)
def test_the_pulses_lead_to_the_wanted_elements_and_never_cost_less_than_the_bound(
    start, wanted, argument, count
):
    plan = plan_elements(of(start), of(wanted), MEAN_MOTION, argument, count * ORBIT)
    assert flown(plan, of(start), argument) == pytest.approx(np.array(wanted), abs=1e-6)
    assert plan.end.as_array() == pytest.approx(np.array(wanted), abs=1e-6)
    assert plan.tangential_delta_v() >= plan.bound.tangential * (1.0 - 1e-9) - 1e-12
    assert plan.normal_delta_v() == pytest.approx(plan.bound.normal, rel=1e-9, abs=1e-12)
    assert plan.delta_v() >= plan.bound.total() * (1.0 - 1e-9) - 1e-12
    assert np.all(np.diff(plan.times) >= 0.0)
    assert np.all((plan.times >= -1e-6) & (plan.times <= plan.duration + 1e-6))
    assert np.count_nonzero(plan.impulses) == len(plan.times) <= 4


@settings(max_examples=20, deadline=None)
@given(arguments, st.floats(10.0, 300.0), st.floats(-0.99, 0.99), arguments, orbits)
def test_what_the_eccentricity_sets_is_reached_at_the_bound(phase, size, share, argument, count):
    """Half of the pulses at one place and half at the last one of the other direction, or less of a shift."""
    reach = 0.75 * math.pi * (2.0 * math.floor(count) - 3.0) * size
    wanted = of((0.0, share * reach, size * math.cos(phase), size * math.sin(phase), 0.0, 0.0))
    plan = plan_elements(of(np.zeros(6)), wanted, MEAN_MOTION, argument, count * ORBIT)
    assert plan.delta_v() == pytest.approx(0.5 * MEAN_MOTION * size, rel=1e-8)
    assert plan.bound.total() == pytest.approx(0.5 * MEAN_MOTION * size, rel=1e-12)


@settings(max_examples=5, deadline=None)
@given(elements, elements, arguments, orbits)
def test_no_number_of_pulses_costs_less_than_the_bound_and_three_are_near_the_least(
    start, wanted, argument, count
):
    duration = count * ORBIT
    change = change_to_make(of(start), of(wanted), MEAN_MOTION, duration)
    bound = delta_v_bound(change, MEAN_MOTION, duration).tangential
    least = least_delta_v(change, argument, duration)
    assert least >= bound * (1.0 - 1e-9)
    plan = plan_elements(of(start), of(wanted), MEAN_MOTION, argument, duration)
    assert plan.tangential_delta_v() <= 1.5 * least


@settings(max_examples=5, deadline=None)
@given(elements, arguments, orbits)
def test_radial_pulses_do_not_help_axis_and_eccentricity(wanted, argument, count):
    change = of(wanted)
    x, y = wanted[2:4]
    bound = 0.5 * MEAN_MOTION * max(abs(wanted[0]), math.hypot(x, y))
    assert least_delta_v(change, argument, count * ORBIT, radial=True) >= bound * (1.0 - 1e-9)


def test_a_longitude_alone_is_moved_from_begin_to_end_at_the_bound():
    duration = 5.0 * ORBIT
    plan = plan_elements(of(np.zeros(6)), of((0, 1000.0, 0, 0, 0, 0)), MEAN_MOTION, 0.7, duration)
    assert plan.times.tolist() == pytest.approx([0.0, duration])
    drift = 1000.0 / (3.0 * duration)
    assert plan.impulses[:, 1] == pytest.approx([-drift, drift])
    assert plan.delta_v() == pytest.approx(plan.bound.total())


def test_wanted_elements_that_are_reached_without_pulses_take_none():
    start = of((10.0, 0.0, 50.0, -20.0, 5.0, 100.0))
    drifted = start.as_array() - [0, 1.5 * MEAN_MOTION * 3 * ORBIT * 10.0, 0, 0, 0, 0]
    plan = plan_elements(start, of(drifted), MEAN_MOTION, 0.2, 3 * ORBIT)
    assert plan.delta_v() < 1e-12
    assert plan.bound.total() < 1e-12


@pytest.mark.parametrize("count", [1.9, 51.0])
def test_a_time_that_is_too_short_or_too_long_is_refused_in_words(count):
    with pytest.raises(ValueError, match=r"takes 2 to 50 orbits, got .* s, which are (1\.9|51)"):
        plan_elements(of(np.zeros(6)), of(np.ones(6)), MEAN_MOTION, 0.0, count * ORBIT)


def test_two_body_motion_reaches_the_elements_within_a_ten_thousandth():
    """Chief and satellite by brahe's numerical propagator, elements by brahe.

    What is left is of second order: 500 m times the relative distance and the chief's eccentricity, 1e-4.
    """
    brahe = pytest.importorskip("brahe")
    radians = brahe.AngleFormat.RADIANS
    start, wanted = (0.0, 0.0, 300.0, 0.0, 0.0, 300.0), (0.0, 400.0, 0.0, 500.0, 100.0, 400.0)
    start, wanted = np.array(start), np.array(wanted)
    argument, duration = 0.3, 3.0 * ORBIT
    plan = plan_elements(of(start), of(wanted), MEAN_MOTION, argument, duration)
    # On an exact circle brahe's elements lose digits; this eccentricity moves the satellite by 0.1 m.
    chief = brahe.state_koe_to_eci(np.array([AXIS, 1e-4, 1.2, 0.4, 0.1, argument - 0.1]), radians)
    deputy = brahe.state_roe_to_eci(chief, start / AXIS, radians)
    states, time = [chief, deputy], 0.0
    for moment, impulse in zip((*plan.times, duration), (*plan.impulses, np.zeros(3)), strict=True):
        states = [two_body(brahe, state, float(moment) - time) for state in states]
        time = float(moment)
        turn = brahe.rotation_rtn_to_eci(states[0])
        states[1] = states[1] + np.concatenate((np.zeros(3), turn @ impulse))
    missed = brahe.state_eci_to_roe(*states, radians) - wanted / AXIS
    error = AXIS * np.array([math.remainder(part, math.tau) for part in missed.tolist()])
    assert error == pytest.approx(np.zeros(6), abs=0.05)


def two_body(brahe, state, duration):
    if duration <= 0.0:
        return state
    # brahe takes the Earth's orientation from the process, although two bodies need none.
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    epoch = brahe.Epoch.from_datetime(2024, 1, 1, 0, 0, 0.0, 0.0, brahe.TimeSystem.UTC)
    flight = brahe.NumericalOrbitPropagator(
        epoch, state, brahe.NumericalPropagationConfig.high_precision(), brahe.ForceModelConfig.two_body()
    )
    flight.propagate_to(epoch + duration)
    return np.array(flight.current_state())
