# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear-quadratic control of relative motion, with and without integral action.

Figures marked "printed" are those of Cadic, Xu & Lu; the others come from an independent computation
with their weights and an orbit of one turn in 86164 s.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm, solve_continuous_lyapunov

from control_laws import assert_a_stack_has_the_bits_of_each
from satform.control.lqi import LqiSpec, design_lqi, integral_model
from satform.control.lqr import LqrSpec, design_lqr, linear_quadratic_gain
from satform.control.protocol import ControlStep, FlightSetting, Motion
from satform.dynamics import cw
from satform.orbits.path_reference import Reference

FIRST = ControlStep(0, 1.0)
"""A step of which a law takes that its own command was applied before it."""

MEAN_MOTION = 2.0 * math.pi / 86164.0
STEP = 0.5
SETTING = FlightSetting(mean_motion=MEAN_MOTION, step=STEP)
PARALLEL = np.array([200e3, 0.0, 0.0])
SPHERE = np.array([200e3, 400e3j, 200e3 * math.sqrt(3.0)])
"""Complex amplitudes of the command (200 cos wt, -400 sin wt, 200 sqrt 3 cos wt) km."""
EQUAL_PUSH = np.ones(3)


def closed_loop():
    state, command = cw.system_matrices(MEAN_MOTION)
    return state - command @ design_lqr(MEAN_MOTION)


def integral_closed_loop():
    state, command = integral_model(MEAN_MOTION)
    return state - command @ design_lqi(MEAN_MOTION)


def response(system, start, times):
    """Free response of a linear system at equally spaced times, by the matrix exponential."""
    transition = expm(system * (times[1] - times[0]))
    states = [start]
    for _ in times[1:]:
        states.append(transition @ states[-1])
    return np.array(states)


def harmonic(system, push):
    """Complex amplitude of the state under a push at the orbital frequency."""
    return np.linalg.solve(1j * MEAN_MOTION * np.eye(len(system)) - system, push)


def sphere_command(times):
    turning = np.exp(1j * MEAN_MOTION * times)[:, None]
    return np.hstack(((SPHERE * turning).real, (1j * MEAN_MOTION * SPHERE * turning).real))


def settling_time(times, values, final, band):
    outside = np.nonzero(np.abs(values - final) > band * abs(final))[0]
    return times[outside[-1] + 1]


TIMES = np.arange(0.0, 1200.0, 0.2)


def sphere_from_origin():
    command = sphere_command(TIMES)
    return np.linalg.norm((command + response(closed_loop(), -command[0], TIMES))[:, :3], axis=1)


def parallel_from_origin():
    system, gain = closed_loop(), design_lqr(MEAN_MOTION)
    push = np.concatenate((np.zeros(3), gain[:, :3] @ PARALLEL))
    steady = -np.linalg.solve(system, push)
    return steady, steady + response(system, -steady, TIMES)


def test_the_source_s_weights_give_the_reference_gain():
    expected = [
        [7.29318716e-5, -8.80650408e-7, 0.0, 1.20774172e-2, 7.976e-9, 0.0],
        [8.80650e-7, 7.29159173e-5, 0.0, 7.976e-9, 1.20760963e-2, 0.0],
        [0.0, 0.0, 7.29159179e-5, 0.0, 0.0, 1.20761073e-2],
    ]
    assert design_lqr(MEAN_MOTION) == pytest.approx(np.array(expected), rel=1e-4, abs=1e-15)


def test_the_source_s_weights_give_the_reference_spectrum():
    found = np.linalg.eigvals(closed_loop())
    upper = sorted(found[found.imag > 0.0], key=lambda value: value.imag)
    expected = [-0.00603838 + 0.00596523j, -0.00603805 + 0.00603847j, -0.00603838 + 0.00611107j]
    assert np.array(upper) == pytest.approx(np.array(expected), rel=1e-4)


def test_gains_follow_the_double_integrator_approximation():
    gain = design_lqr(MEAN_MOTION)
    assert np.diag(gain[:, :3]) == pytest.approx(np.full(3, MEAN_MOTION), rel=1e-3)
    velocity_gain = math.sqrt(2.0 * MEAN_MOTION + 0.05 * MEAN_MOTION**2)
    assert np.diag(gain[:, 3:]) == pytest.approx(np.full(3, velocity_gain), rel=1e-3)
    frequency = np.abs(np.linalg.eigvals(closed_loop()))
    assert frequency == pytest.approx(np.full(6, math.sqrt(MEAN_MOTION)), rel=0.01)


def test_sphere_command_is_reached_in_about_seven_minutes_as_printed():
    radius = sphere_from_origin()
    assert TIMES[np.argmax(radius >= 400e3)] == pytest.approx(391.0, abs=2.0)
    assert settling_time(TIMES, radius, 400e3, 0.05) == pytest.approx(344.0, abs=2.0)
    assert settling_time(TIMES, radius, 400e3, 0.02) == pytest.approx(699.5, abs=2.0)
    assert TIMES[np.argmax(radius)] == pytest.approx(520.0, abs=2.0)


def test_sphere_and_parallel_commands_overshoot_by_four_percent():
    _, parallel = parallel_from_origin()
    assert 100.0 * (sphere_from_origin().max() / 400e3 - 1.0) == pytest.approx(4.321, abs=0.02)
    assert 100.0 * (parallel[:, 0].max() / 200e3 - 1.0) == pytest.approx(4.339, abs=0.02)


def test_first_command_of_the_sphere_manoeuvre_from_the_origin():
    lqr = LqrSpec().build(SETTING)
    command = sphere_command(np.zeros(1))[0]
    reference = Reference(command[:3], command[3:], np.zeros(3))
    action = lqr.act(Motion(np.zeros(3), np.zeros(3)), reference, None, FIRST)
    assert np.linalg.norm(action.acceleration) == pytest.approx(29.168, rel=1e-3)


def test_sphere_command_is_a_free_orbit_that_needs_no_steady_thrust():
    system = closed_loop()
    exact = np.concatenate((SPHERE, 1j * MEAN_MOTION * SPHERE))
    state, command = cw.system_matrices(MEAN_MOTION)
    followed = harmonic(system, command @ design_lqr(MEAN_MOTION) @ exact)
    assert np.abs(followed - exact)[:3].max() < 1e-5
    assert np.abs(design_lqr(MEAN_MOTION) @ (followed - exact)).max() < 1e-9
    assert np.abs(state @ exact - 1j * MEAN_MOTION * exact).max() < 1e-9


def test_reference_without_its_velocity_is_followed_with_the_lag_of_the_reference_computation():
    _, command = cw.system_matrices(MEAN_MOTION)
    followed = harmonic(closed_loop(), command @ design_lqr(MEAN_MOTION)[:, :3] @ SPHERE)[:3]
    turning = np.exp(1j * np.linspace(0.0, 2.0 * math.pi, 2001))[:, None]
    lag = np.linalg.norm(((followed - SPHERE) * turning).real, axis=1)
    radius = np.linalg.norm((followed * turning).real, axis=1)
    assert lag.max() == pytest.approx(4830.6, rel=5e-3)
    assert (radius.min(), radius.max()) == pytest.approx((399.9998e3, 400.0002e3), abs=0.1)


def test_parallel_orbit_is_held_with_a_steady_offset():
    steady, _ = parallel_from_origin()
    assert steady[:2] - PARALLEL[:2] == pytest.approx(np.array([43.7495, -0.5284]), rel=1e-3)
    assert 3.0 * MEAN_MOTION * PARALLEL[0] == pytest.approx(43.7495, rel=1e-3)


def test_holding_a_parallel_orbit_costs_three_millimetres_per_second_squared():
    lqr = LqrSpec(feedforward=True).build(SETTING)
    on_reference = Motion(PARALLEL, np.zeros(3))
    action = lqr.act(on_reference, Reference(PARALLEL, np.zeros(3), np.zeros(3)), None, FIRST)
    assert action.acceleration == pytest.approx(np.array([-3.190504e-3, 0.0, 0.0]), rel=1e-5)
    assert -action.acceleration[0] * 86164.0 == pytest.approx(274.9, rel=1e-3)


def test_in_plane_circle_at_orbital_rate_needs_between_one_and_two_millimetres_per_second_squared():
    lqr = LqrSpec(feedforward=True).build(SETTING)
    angle = np.linspace(0.0, 2.0 * math.pi, 2001)
    zero = np.zeros_like(angle)
    position = 200e3 * np.stack((np.cos(angle), -np.sin(angle), zero), axis=-1)
    velocity = -200e3 * MEAN_MOTION * np.stack((np.sin(angle), np.cos(angle), zero), axis=-1)
    reference = Reference(position, velocity, -(MEAN_MOTION**2) * position)
    thrust = np.linalg.norm(lqr.act(Motion(position, velocity), reference, None, FIRST).acceleration, axis=-1)
    assert (thrust.min(), thrust.max()) == pytest.approx((1.06350e-3, 2.12700e-3), rel=1e-4)


@pytest.mark.parametrize("amplitude", [1e-6, 1e-3])
def test_harmonic_disturbance_leaves_the_reference_ripple(amplitude):
    _, command = cw.system_matrices(MEAN_MOTION)
    ripple = np.abs(harmonic(closed_loop(), command @ EQUAL_PUSH * amplitude))[:3]
    assert ripple == pytest.approx(np.array([0.01388, 0.01355, 0.01371]) * amplitude / 1e-6, rel=0.01)


def test_gain_depends_on_the_unit_of_time_alone_but_not_on_mixed_units():
    state, command = cw.system_matrices(MEAN_MOTION)
    weight = np.diag([1.0, 1.0, 0.5, 0.05, 0.05, 0.05])
    effort = np.diag([1.0, 1.0, 0.5]) / MEAN_MOTION**2
    kilometres = np.diag(np.full(6, 1e-3))
    scaled = linear_quadratic_gain(
        kilometres @ state @ np.linalg.inv(kilometres), kilometres @ command * 1e3, weight, effort
    )
    assert scaled == pytest.approx(design_lqr(MEAN_MOTION), rel=1e-6, abs=1e-12)
    mixed = linear_quadratic_gain(state, command * 1e-3, weight, effort)
    frequency = np.abs(np.linalg.eigvals(state - command * 1e-3 @ mixed))
    assert np.all((frequency > 1.5e-4) & (frequency < 3.5e-4))


def test_no_other_gain_costs_less():
    state, command = cw.system_matrices(MEAN_MOTION)
    weight = np.diag([1.0, 1.0, 0.5, 0.05, 0.05, 0.05])
    effort = np.diag([1.0, 1.0, 0.5]) / MEAN_MOTION**2

    def cost(gain):
        loop = state - command @ gain
        return np.trace(solve_continuous_lyapunov(loop.T, -(weight + gain.T @ effort @ gain)))

    best = design_lqr(MEAN_MOTION)
    random = np.random.default_rng(3)
    for _ in range(20):
        other = best * (1.0 + 0.05 * random.standard_normal(best.shape))
        assert cost(other) > cost(best)


weights = st.tuples(*[st.floats(1e-3, 1e3)] * 3)


@settings(max_examples=60, deadline=None)
@given(weights, st.tuples(*[st.floats(0.0, 1e3)] * 3), weights, st.floats(6e-5, 1.2e-3))
def test_closed_loop_decays_for_any_legal_weights(position, velocity, effort, mean_motion):
    gain = design_lqr(mean_motion, position, velocity, effort)
    state, command = cw.system_matrices(mean_motion)
    assert np.linalg.eigvals(state - command @ gain).real.max() < 0.0


@settings(max_examples=40, deadline=None)
@given(weights, weights, weights, weights)
def test_closed_loop_with_integral_action_decays_for_any_legal_weights(position, velocity, integral, effort):
    gain = design_lqi(1e-3, position, velocity, integral, effort)
    state, command = integral_model(1e-3)
    assert np.linalg.eigvals(state - command @ gain).real.max() < 0.0


def test_a_step_too_long_for_the_gains_is_refused_in_words():
    with pytest.raises(ValueError, match=r"lqr: with the command held for 400 s .* does not decay"):
        LqrSpec().build(FlightSetting(mean_motion=MEAN_MOTION, step=400.0))


def fly(law, start, reference_at, duration, setting=SETTING):
    plant = cw.HeldInputStep.over(setting.mean_motion, setting.step)
    position, velocity = start
    memory = law.start(Motion(position, velocity))
    track = [position]
    for step in range(round(duration / setting.step)):
        action = law.act(Motion(position, velocity), reference_at(step * setting.step), memory, FIRST)
        memory = action.memory
        position, velocity = plant.advance(position, velocity, action.acceleration)
        track.append(position)
    return np.array(track)


def at_parallel(_time):
    return Reference(PARALLEL, np.zeros(3), np.zeros(3))


REST = (np.zeros(3), np.zeros(3))


def test_sampled_flight_overshoots_as_the_continuous_loop_does():
    track = fly(LqrSpec().build(SETTING), REST, at_parallel, 2500.0)
    assert 100.0 * (track[:, 0].max() / 200e3 - 1.0) == pytest.approx(4.339, abs=0.05)
    assert track[-1, 0] - 200e3 == pytest.approx(43.75, rel=1e-3)


def test_feedforward_removes_the_steady_offset():
    track = fly(LqrSpec(feedforward=True).build(SETTING), REST, at_parallel, 3000.0)
    assert np.abs(track[-1] - PARALLEL).max() < 1e-2


def test_zero_velocity_reference_is_flown_with_the_lag_of_the_reference_computation():
    law = LqrSpec(velocity_reference="zero").build(SETTING)
    command = sphere_command(np.arange(0.0, 3000.0 + STEP, STEP))
    track = fly(
        law,
        (command[0, :3], command[0, 3:]),
        lambda time: Reference(*np.split(command[round(time / STEP)], 2), np.zeros(3)),
        3000.0,
    )
    assert np.linalg.norm(track[-1] - command[6000, :3]) == pytest.approx(4830.5, rel=5e-3)


def test_one_regulator_and_a_stack_of_them_command_the_same_bits():
    assert_a_stack_has_the_bits_of_each(
        [LqrSpec(feedforward=True).build(FlightSetting(n, STEP)) for n in (7e-5, 1e-3, 1.1e-3)]
    )


def test_integral_action_has_the_reference_gains():
    gain = design_lqi(MEAN_MOTION)[0]
    assert (gain[0], gain[3], gain[6]) == pytest.approx((4.34988e-4, 2.949536e-2, 2.305930e-6), rel=1e-4)


def test_integral_action_reaches_the_parallel_orbit_without_overshoot_or_offset():
    system = integral_closed_loop()
    push = np.concatenate((np.zeros(6), -PARALLEL))
    steady = -np.linalg.solve(system, push)
    reached = (steady + response(system, -steady, TIMES))[:, 0]
    assert np.abs(steady[:3] - PARALLEL).max() < 1e-6
    assert 100.0 * (reached.max() / 200e3 - 1.0) < 0.01
    for band, expected in ((0.05, 356.0), (0.02, 420.0), (0.01, 505.0)):
        assert settling_time(TIMES, reached, 200e3, band) == pytest.approx(expected, abs=2.0)


def test_sampled_flight_with_integral_action_reaches_the_parallel_orbit_without_overshoot():
    setting = FlightSetting(MEAN_MOTION, 0.25)
    track = fly(LqiSpec().build(setting), REST, at_parallel, 2500.0, setting)
    assert 100.0 * (track[:, 0].max() / 200e3 - 1.0) < 0.01
    assert np.abs(track[-1] - PARALLEL).max() < 1e-3


def test_integral_action_shrinks_the_ripple_to_a_four_hundredth():
    _, command = cw.system_matrices(MEAN_MOTION)
    push = command @ EQUAL_PUSH
    plain = np.abs(harmonic(closed_loop(), push))[0]
    with_integral = np.abs(harmonic(integral_closed_loop(), np.concatenate((push, np.zeros(3)))))[0]
    assert with_integral / plain == pytest.approx(0.00229, rel=0.02)


def test_command_through_the_integral_alone_follows_the_sphere_with_a_lag():
    followed = harmonic(integral_closed_loop(), np.concatenate((np.zeros(6), -SPHERE)))[:3]
    turning = np.exp(1j * np.linspace(0.0, 2.0 * math.pi, 2001))[:, None]
    lag = np.linalg.norm(((followed - SPHERE) * turning).real, axis=1)
    radius = np.linalg.norm((followed * turning).real, axis=1)
    assert lag.max() == pytest.approx(5502.0, rel=5e-3)
    assert radius.min() == pytest.approx(399.98937e3, rel=5e-6)


def test_command_through_the_error_follows_a_free_orbit_without_lag():
    command = sphere_command(np.arange(0.0, 1000.0 + STEP, STEP))
    track = fly(
        LqiSpec(command_path="error").build(SETTING),
        (command[0, :3] + 100.0, command[0, 3:]),
        lambda time: Reference(*np.split(command[round(time / STEP)], 2), np.zeros(3)),
        1000.0,
    )
    assert np.linalg.norm(track[-1] - command[2000, :3]) < 0.5


def test_flight_with_integral_action_begins_without_a_jolt():
    law = LqiSpec().build(SETTING)
    motion = Motion(np.array([1e4, -2e4, 3e3]), np.array([1.0, -30.0, 2.0]))
    action = law.act(motion, at_parallel(0.0), law.start(motion), FIRST)
    assert np.abs(action.acceleration).max() < 1e-12
