# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The sliding-mode law against its reaching law, closed forms and the case study's figures."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from control_laws import STEP
from satform.control.protocol import FlightSetting, Motion
from satform.control.sliding_mode import (
    SlidingModeSpec,
    boundary_layer_bounds,
    gain_warnings,
    reaching_time,
    sampling_warnings,
    switching_ripple,
)
from satform.dynamics.cw import HeldInputStep
from satform.numeric.stacking import stack
from satform.orbits.curve_specs import EllipseSpec
from satform.orbits.path_reference import Path, Reference

MEAN_MOTION = 2.0 * np.pi / 6000.0
SETTING = FlightSetting(mean_motion=MEAN_MOTION, step=0.1)
START_ERROR = np.array([10e3, -10e3, 5e3])
PATH = Path(EllipseSpec(first_axis=(0.0, 200e3, 0.0), second_axis=(100e3, 0.0, 0.0)).build(), np.float64(1.0))
RATE = PATH.period / 6000.0
STILL = np.float64(0.0)


def random_case(seed=0):
    generator = np.random.default_rng(seed)
    return (
        Motion(generator.normal(0.0, 1e4, 3), generator.normal(0.0, 10.0, 3)),
        Reference(*(generator.normal(0.0, size, 3) for size in (1e4, 10.0, 0.1))),
    )


def start_motion():
    desired = PATH.reference(STILL, RATE, STILL)
    return Motion(desired.position + START_ERROR, desired.velocity)


def test_sliding_variable_of_the_case_study_starts_at_its_known_value():
    action = (
        SlidingModeSpec().build(SETTING).act(start_motion(), PATH.reference(STILL, RATE, STILL), None, STEP)
    )
    assert action.sliding_variable == pytest.approx([100.0, -100.0, 50.0], rel=1e-13)


def test_largest_command_of_the_case_study_is_its_first():
    action = (
        SlidingModeSpec()
        .build(SETTING)
        .act(start_motion(), PATH.at_step(STILL, RATE, STILL, 0.1), None, STEP)
    )
    assert np.linalg.norm(action.acceleration) == pytest.approx(15.066, rel=5e-3)


@pytest.mark.parametrize("boundary_layer", [0.0, 5.0])
def test_the_command_makes_the_sliding_variable_follow_the_reaching_law(boundary_layer):
    spec = SlidingModeSpec(
        proportional_gain=(0.01, 0.02, 0.03),
        switching_gain=(0.1, 0.2, 0.3),
        reaching_gain=(0.4, 0.5, 0.6),
        boundary_layer=boundary_layer,
    )
    motion, reference = random_case()
    action = spec.build(SETTING).act(motion, reference, None, STEP)
    n = MEAN_MOTION
    free = np.diag([3 * n**2, 0.0, -(n**2)]) @ motion.position
    free += np.array([[0.0, 2 * n, 0.0], [-2 * n, 0.0, 0.0], [0.0, 0.0, 0.0]]) @ motion.velocity
    error_rate = motion.velocity - reference.velocity
    s = action.sliding_variable
    surface_rate = (
        free + action.acceleration - reference.acceleration + np.array([0.01, 0.02, 0.03]) * error_rate
    )
    switch = np.clip(s / boundary_layer, -1.0, 1.0) if boundary_layer else np.sign(s)
    expected = -np.array([0.1, 0.2, 0.3]) * switch - np.array([0.4, 0.5, 0.6]) * s
    assert surface_rate == pytest.approx(expected, abs=1e-11)


def test_without_error_only_the_feed_forward_remains():
    _, reference = random_case()
    controller = SlidingModeSpec(disturbance_centre=(1e-3, 0.0, -2e-3)).build(SETTING)
    action = controller.act(Motion(reference.position, reference.velocity), reference, None, STEP)
    free = controller.natural.at(reference.position, reference.velocity)
    assert not action.sliding_variable.any()
    assert action.acceleration == pytest.approx(reference.acceleration - free - [1e-3, 0.0, -2e-3], abs=1e-15)


def test_inside_the_boundary_layer_the_sign_becomes_a_slope_on_its_own_axis_only():
    reference = Reference(np.zeros(3), np.zeros(3), np.zeros(3))
    motion = Motion(np.zeros(3), np.array([0.05, 0.05, 0.3]))
    parameters = {"proportional_gain": 1e-9, "reaching_gain": 0.0}
    layered = SlidingModeSpec(boundary_layer=(0.1, 0.0, 0.1), **parameters).build(FlightSetting(0.0, 1.0))
    assert layered.act(motion, reference, None, STEP).acceleration == pytest.approx(
        [-0.05, -0.1, -0.1], abs=1e-9
    )


def test_reaching_times_of_the_case_study_are_the_known_ones():
    times = reaching_time(np.array([100.0, -100.0, 50.0]), np.full(3, 0.1), np.full(3, 0.1))
    assert times == pytest.approx([46.1512, 46.1512, 39.3183], abs=5e-5)


def test_reaching_time_with_gains_in_kilometres_is_under_a_second():
    times = reaching_time(np.array([100.0, 100.0, 50.0]), np.full(3, 100.0), np.full(3, 0.1))
    assert times == pytest.approx([0.953, 0.953, 0.488], abs=5e-4)


@pytest.mark.parametrize(
    ("reaching_gain", "disturbance"), [(0.1, 0.03), (0.1, -0.03), (0.0, 0.03), (1e-9, 0.0)]
)
def test_reaching_time_is_that_of_the_integrated_reaching_law(reaching_gain, disturbance):
    def touches(_, s):
        return s[0]

    touches.terminal = True
    flight = solve_ivp(
        lambda _, s: [disturbance - 0.1 - reaching_gain * s[0]],
        (0.0, 1e4),
        [20.0],
        events=touches,
        rtol=1e-11,
        atol=1e-12,
    )
    time = reaching_time(np.array(20.0), np.array(0.1), np.array(reaching_gain), disturbance)
    assert time == pytest.approx(flight.t_events[0][0], rel=1e-7)


def test_a_disturbance_stronger_than_the_switching_gain_can_prevent_reaching():
    assert np.isinf(reaching_time(np.array(1.0), np.array(0.1), np.array(0.1), 0.1))


def test_sampled_flight_reaches_the_surface_when_the_theory_says():
    controller, step = SlidingModeSpec().build(SETTING), HeldInputStep.over(MEAN_MOTION, 0.1)
    motion, reached = start_motion(), np.full(3, np.nan)
    for number in range(480):
        place = RATE * (number * 0.1)
        action = controller.act(motion, PATH.at_step(place, RATE, STILL, 0.1), None, STEP)
        inside = (np.abs(action.sliding_variable) <= 0.02) & np.isnan(reached)
        reached[inside] = number * 0.1
        motion = Motion(*step.advance(motion.position, motion.velocity, action.acceleration))
    assert reached == pytest.approx([45.8, 45.8, 39.0], abs=0.5)


def test_boundary_layer_bounds_of_the_case_study_are_the_known_ones():
    sliding, error = boundary_layer_bounds(0.01, 0.1, 0.1, 0.1, 0.01)
    assert sliding == pytest.approx(0.0090909, rel=1e-5)
    assert error == pytest.approx(0.90909, rel=1e-5)


def test_a_constant_disturbance_settles_on_the_boundary_layer_bounds():
    spec = SlidingModeSpec(boundary_layer=0.5)
    sliding, error = boundary_layer_bounds(0.01, 0.1, 0.1, 0.5, 0.02)
    controller, step = spec.build(FlightSetting(MEAN_MOTION, 2.0)), HeldInputStep.over(MEAN_MOTION, 2.0)
    reference = Reference(np.zeros(3), np.zeros(3), np.zeros(3))
    motion = Motion(np.zeros(3), np.zeros(3))
    for _ in range(1500):
        action = controller.act(motion, reference, None, STEP)
        motion = Motion(*step.advance(motion.position, motion.velocity, action.acceleration + 0.02))
    assert action.sliding_variable == pytest.approx(np.full(3, sliding), rel=1e-3)
    assert motion.position == pytest.approx(np.full(3, error), rel=1e-3)


def test_sampled_chatter_is_the_switching_gain_times_the_step():
    controller, step = SlidingModeSpec().build(SETTING), HeldInputStep.over(MEAN_MOTION, 0.1)
    reference = Reference(np.zeros(3), np.zeros(3), np.zeros(3))
    motion, largest = Motion(np.zeros(3), np.full(3, 3e-3)), np.zeros(3)
    for number in range(400):
        action = controller.act(motion, reference, None, STEP)
        if number > 200:
            largest = np.maximum(largest, np.abs(action.sliding_variable))
        motion = Motion(*step.advance(motion.position, motion.velocity, action.acceleration))
    ripple = switching_ripple(np.full(3, 0.1), 0.1)
    assert np.all(largest <= 1.1 * ripple)
    assert np.all(largest >= 0.5 * ripple)


def test_a_weak_switching_gain_is_named_with_its_axis_and_both_numbers():
    spec = SlidingModeSpec(switching_gain=(0.1, 0.01, 0.1))
    warnings = gain_warnings(spec, np.array([0.05, 0.02, 0.05]))
    assert len(warnings) == 1
    assert "axis y is 0.01 m/s^2" in warnings[0]
    assert "0.02 m/s^2" in warnings[0]


def test_cancelling_the_centre_of_the_disturbance_lets_a_small_gain_suffice():
    bound, centre = np.array([0.11, 0.0, 0.0]), np.array([0.1, 0.0, 0.0])
    assert gain_warnings(SlidingModeSpec(switching_gain=0.02), bound, centre)
    aware = SlidingModeSpec(switching_gain=0.02, disturbance_centre=(0.1, 0.0, 0.0))
    assert gain_warnings(aware, bound, centre) == []


def test_a_lagging_feed_forward_is_warned_of_only_where_it_defeats_the_switching_gain():
    spec = SlidingModeSpec()
    assert "lags by up to 1.825 m/s^2" in sampling_warnings(spec, 0.01, 365.0, "start")[0]
    assert sampling_warnings(spec, 0.01, 365.0, "midpoint") == []
    assert sampling_warnings(spec, 0.1, 1.69e-3, "start") == []
    assert "from 2 on" in sampling_warnings(spec, 20.0, 0.0, "midpoint")[0]


def test_one_satellite_and_many_get_the_same_bits():
    specs = [SlidingModeSpec(switching_gain=0.1 + 0.01 * i, boundary_layer=0.01 * (i % 3)) for i in range(9)]
    controllers = [spec.build(FlightSetting(MEAN_MOTION * (1.0 + i), 0.1)) for i, spec in enumerate(specs)]
    cases = [random_case(seed) for seed in range(9)]
    stacked = stack(controllers).act(stack([c[0] for c in cases]), stack([c[1] for c in cases]), None, STEP)
    for i, controller in enumerate(controllers):
        single = controller.act(*cases[i], None, STEP)
        assert np.array_equal(single.acceleration, stacked.acceleration[i])
        assert np.array_equal(single.sliding_variable, stacked.sliding_variable[i])
