# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Clohessy-Wiltshire motion against matrix exponentials, numerical integration and known orbits."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from satform.dynamics.cw import (
    DisturbedStep,
    HeldInputStep,
    acceleration,
    input_matrix,
    propagate,
    system_matrices,
    transition_matrix,
)

MEAN_MOTION = 2.0 * np.pi / 6000.0
# Length and velocity scales that make every entry of the matrices of order one.
SCALE = np.repeat([1.0, MEAN_MOTION], 3)


def textbook_matrices(mean_motion):
    a, b = np.zeros((6, 6)), np.vstack((np.zeros((3, 3)), np.eye(3)))
    a[:3, 3:] = np.eye(3)
    a[3, 0], a[5, 2] = 3.0 * mean_motion**2, -(mean_motion**2)
    a[3, 4], a[4, 3] = 2.0 * mean_motion, -2.0 * mean_motion
    return a, b


def exponential(mean_motion, duration):
    """Transition and held-input matrix from the exponential of the extended system.

    By its series, scaled and squared, in decimal numbers of 60 digits: in double precision the digits that
    are lost at long durations depend on the processor.
    """
    a, b = textbook_matrices(mean_motion)
    extended = np.zeros((9, 9))
    extended[:6, :6], extended[:6, 6:] = a, b
    with localcontext(prec=60):
        exact = np.vectorize(Decimal, otypes=[object])(extended) * Decimal(duration)
        halvings = max(0, math.ceil(math.log2(abs(duration))))
        term = result = np.vectorize(Decimal, otypes=[object])(np.eye(9))
        for number in range(1, 40):
            term = term @ exact / (number * Decimal(2) ** halvings)
            result = result + term
        for _ in range(halvings):
            result = result @ result
    result = result.astype(float)
    return result[:6, :6], result[:6, 6:]


def random_motion(count=4):
    generator = np.random.default_rng(7)
    return generator.normal(0.0, 1e4, (count, 3)), generator.normal(0.0, 10.0, (count, 3))


@pytest.mark.parametrize("duration", [1e-3, 0.1, 10.0, 500.0, 1900.0, 2100.0, 6000.0, 20000.0, -300.0])
def test_transition_and_input_matrix_are_the_matrix_exponential(duration):
    transition, held = exponential(MEAN_MOTION, duration)
    unit = SCALE[None, :] / SCALE[:, None]
    error = (transition_matrix(MEAN_MOTION, duration) - transition) * unit
    largest = max(1.0, np.abs(transition * unit).max())
    assert np.abs(error).max() < 1e-12 * largest
    held_error = (input_matrix(MEAN_MOTION, duration) - held) / SCALE[:, None]
    assert np.abs(held_error).max() < 1e-12 * np.abs(held / SCALE[:, None]).max()


def test_system_matrices_and_acceleration_are_the_textbook_equations():
    a, b = textbook_matrices(MEAN_MOTION)
    assert np.array_equal(system_matrices(MEAN_MOTION)[0], a)
    assert np.array_equal(system_matrices(MEAN_MOTION)[1], b)
    position, velocity = random_motion()
    expected = (np.hstack((position, velocity)) @ a.T)[:, 3:]
    assert acceleration(position, velocity, MEAN_MOTION) == pytest.approx(expected, rel=1e-14)


def test_a_tiny_orbit_angle_loses_no_digits():
    duration = 1e-3
    lag, square = MEAN_MOTION * duration**3 / 6.0, (MEAN_MOTION * duration) ** 2
    held, transition = input_matrix(MEAN_MOTION, duration), transition_matrix(MEAN_MOTION, duration)
    assert held[0, 1] == pytest.approx(2.0 * lag * (1.0 - square / 20.0), rel=1e-15)
    assert transition[1, 0] == pytest.approx(-square * MEAN_MOTION * duration, rel=1e-12)
    assert held[3, 1] == pytest.approx(MEAN_MOTION * duration**2, rel=1e-12)


def test_without_rotation_motion_is_that_of_a_free_body():
    held = input_matrix(0.0, 8.0)
    assert np.array_equal(held, np.vstack((32.0 * np.eye(3), 8.0 * np.eye(3))))
    assert np.array_equal(transition_matrix(0.0, 8.0)[:3, 3:], 8.0 * np.eye(3))


def test_a_bounded_two_to_one_ellipse_closes_after_one_period():
    position, velocity = np.array([50e3, 0.0, 20e3]), np.array([0.0, -2.0 * MEAN_MOTION * 50e3, 3.0])
    later = propagate(position, velocity, MEAN_MOTION, 6000.0)
    assert later[0] == pytest.approx(position, abs=1e-6)
    assert later[1] == pytest.approx(velocity, abs=1e-9)


def test_coasting_back_returns_to_the_start():
    position, velocity = random_motion()
    there = propagate(position, velocity, MEAN_MOTION, 700.0)
    back = propagate(*there, MEAN_MOTION, -700.0)
    assert back[0] == pytest.approx(position, abs=1e-7)
    assert back[1] == pytest.approx(velocity, abs=1e-10)


def test_held_input_step_follows_numerical_integration():
    position, velocity = random_motion(1)
    command = np.array([0.3, -0.2, 0.1])
    a, b = textbook_matrices(MEAN_MOTION)
    start = np.hstack((position[0], velocity[0]))
    truth = solve_ivp(
        lambda _, state: a @ state + b @ command, (0.0, 40.0), start, rtol=1e-12, atol=1e-9, method="DOP853"
    ).y[:, -1]
    reached = HeldInputStep.over(MEAN_MOTION, 40.0).advance(position[0], velocity[0], command)
    assert reached[0] == pytest.approx(truth[:3], abs=1e-7)
    assert reached[1] == pytest.approx(truth[3:], abs=1e-9)


def harmonic_motion(duration, steps):
    """Two satellites under a harmonic disturbance, stepped, and the exact solution.

    The exact solution takes the disturbance as the output of an oscillator of its own.
    """
    rate, amplitude = 3.0 * MEAN_MOTION, np.array([0.01, -0.02, 0.015])
    phase = np.array([[0.0, 1.0, 2.0], [0.7, 1.7, 2.7]])
    position, velocity = random_motion(2)
    command = np.array([[0.01, 0.02, -0.01], [0.0, -0.03, 0.02]])
    step = DisturbedStep.over(MEAN_MOTION, duration / steps)
    p, v = position, velocity
    for number in range(steps):
        times = number * duration / steps + step.nodes
        p, v = step.advance(p, v, command, amplitude * np.sin(rate * times[:, None, None] + phase))
    a, b = textbook_matrices(MEAN_MOTION)
    extended = np.zeros((15, 15))
    extended[:6, :6], extended[:6, 6:9], extended[:6, 12:] = a, b, b
    extended[6:9, 9:12], extended[9:12, 6:9] = rate * np.eye(3), -rate * np.eye(3)
    exact = []
    for i in range(2):
        wave = (amplitude * np.sin(phase[i]), amplitude * np.cos(phase[i]))
        start = np.concatenate((position[i], velocity[i], *wave, command[i]))
        exact.append((expm(extended * duration) @ start)[:6])
    return np.hstack((p, v)), np.array(exact)


def test_harmonic_disturbance_is_integrated_to_rounding_in_short_steps():
    reached, exact = harmonic_motion(600.0, 120)
    assert np.abs(reached - exact)[:, :3].max() < 1e-8
    assert np.abs(reached - exact)[:, 3:].max() < 1e-11


def test_error_of_the_disturbance_falls_with_the_sixth_power_of_the_step():
    errors = []
    for steps in (8, 16):
        reached, exact = harmonic_motion(3000.0, steps)
        errors.append(np.abs(reached - exact)[:, :3].max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(6.0, abs=0.5)


def test_disturbance_agrees_with_numerical_integration():
    duration, rate = 20.0, 0.05
    position, velocity = random_motion(1)
    a, b = textbook_matrices(MEAN_MOTION)

    def disturbance(time):
        return np.array([0.01, 0.02, -0.01]) * np.sin(rate * time + np.array([0.0, 0.5, 1.0]))

    truth = solve_ivp(
        lambda time, state: a @ state + b @ disturbance(time),
        (0.0, duration),
        np.hstack((position[0], velocity[0])),
        rtol=1e-12,
        atol=1e-9,
        method="DOP853",
    ).y[:, -1]
    p, v = position, velocity
    step = DisturbedStep.over(MEAN_MOTION, 2.0)
    for number in range(10):
        nodes = np.array([[disturbance(2.0 * number + offset)] for offset in step.nodes])
        p, v = step.advance(p, v, np.zeros((1, 3)), nodes)
    assert p[0] == pytest.approx(truth[:3], abs=1e-8)
    assert v[0] == pytest.approx(truth[3:], abs=1e-10)


def test_one_satellite_and_many_get_the_same_bits():
    position, velocity = random_motion(17)
    command = np.random.default_rng(1).normal(size=(17, 3))
    disturbance = np.random.default_rng(2).normal(size=(3, 17, 3))
    step = DisturbedStep.over(MEAN_MOTION, 0.5)
    stacked = step.advance(position, velocity, command, disturbance)
    for i in range(17):
        single = step.advance(
            position[i : i + 1], velocity[i : i + 1], command[i : i + 1], disturbance[:, i : i + 1]
        )
        assert np.array_equal(single[0][0], stacked[0][i])
        assert np.array_equal(single[1][0], stacked[1][i])
