# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from satform.dynamics import integrators

MEAN_MOTION = 2.0 * math.pi / 6000.0
METHODS = [("rk4", 4), ("rk8", 8)]


def kepler(time, state):
    """Two-body motion in units in which an orbit of semi-major axis 1 lasts 2 pi."""
    position, velocity = state
    distance = np.sqrt((position**2).sum(axis=-1, keepdims=True))
    return np.stack((velocity, -position / distance**3))


def eccentric_start(eccentricity, count=1):
    speed = math.sqrt((1.0 + eccentricity) / (1.0 - eccentricity))
    return np.array([[[1.0 - eccentricity, 0.0, 0.0]] * count, [[0.0, 0.6 * speed, 0.8 * speed]] * count])


def observed_orders(errors):
    return [math.log2(coarse / fine) for coarse, fine in itertools.pairwise(errors)]


@pytest.mark.parametrize(("name", "order"), METHODS)
def test_halving_the_step_divides_the_error_by_two_to_the_order(name, order):
    start = eccentric_start(0.2)
    tableau = integrators.TABLEAUS[name]()
    assert tableau.order == order
    errors = []
    for steps in (32, 64, 128) if order == 8 else (256, 512, 1024):
        method = integrators.FixedStep(tableau, 2.0 * math.pi / steps)
        end, _ = method.advance(kepler, 0.0, start, np.zeros_like(start), 2.0 * math.pi)
        errors.append(np.abs(end - start).max())  # the orbit closes after one period
    assert observed_orders(errors) == pytest.approx([order] * 2, abs=0.45)


@pytest.mark.parametrize(("name", "order"), METHODS)
def test_time_dependent_forces_are_integrated_to_the_same_order(name, order):
    def driven(time, state):
        return np.stack((state[1], np.cos(3.0 * time) * np.ones_like(state[0])))

    start = np.zeros((2, 1, 3))
    exact = np.array([(1.0 - math.cos(6.0)) / 9.0, math.sin(6.0) / 3.0])
    errors = []
    for steps in (4, 8, 16):
        method = integrators.FixedStep(integrators.TABLEAUS[name](), 2.0 / steps)
        end, _ = method.advance(driven, 0.0, start, np.zeros_like(start), 2.0)
        errors.append(np.abs(end[:, 0, 0] - exact).max())
    assert min(observed_orders(errors)) > order - 0.45


def test_adaptive_error_follows_its_tolerance():
    start = eccentric_start(0.5)
    for tolerance in (1e-6, 1e-9, 1e-12):
        _, end = integrators.Adaptive(tolerance, tolerance).solve(kepler, 0.0, start, 2.0 * math.pi)
        assert np.abs(end - start).max() < 200.0 * tolerance


def test_adaptive_solution_can_be_asked_for_inside_the_step():
    start = eccentric_start(0.0)
    inside, _ = integrators.Adaptive(1e-12, 1e-12).solve(kepler, 0.0, start, 2.0)
    angle = 1.3
    expected = [math.cos(angle), 0.6 * math.sin(angle), 0.8 * math.sin(angle)]
    np.testing.assert_allclose(inside(angle)[:3], expected, rtol=0.0, atol=1e-10)


def test_carried_rounding_makes_many_small_additions_exact():
    state, remainder = np.array([7e6]), np.zeros(1)
    for _ in range(100_000):
        state, remainder = integrators.add_compensated(state, remainder, np.array([1e-10]))
    assert state[0] == 7e6 + 1e-5


@pytest.mark.parametrize(
    ("duration", "longest", "parts"), [(10.0, 60.0, 1), (60.0, 60.0, 1), (60.1, 60.0, 2), (0.3, 0.1, 3)]
)
def test_a_control_period_is_cut_into_the_fewest_parts_that_are_short_enough(duration, longest, parts):
    assert integrators.substeps(duration, longest) == parts


@pytest.mark.parametrize("name", ["rk4", "rk8"])
def test_a_satellite_has_the_same_bits_alone_as_among_a_thousand(name):
    generator = np.random.default_rng(1)
    many = eccentric_start(0.1, 1000) + 0.1 * generator.normal(size=(2, 1000, 3))
    method = integrators.FixedStep(integrators.TABLEAUS[name](), 0.1)
    step = integrators.exponential_step(integrators.TABLEAUS[name](), MEAN_MOTION, 30.0)
    stacked, _ = method.advance(kepler_by_components, 0.0, many, np.zeros_like(many), 0.3)
    held = generator.normal(size=(1000, 3))
    flat = generator.normal(size=(1000, 6))
    exponential = step.advance(flat, held, lambda offset, state: offset * state[:, :3])
    for row in (0, 1, 500, 999):
        one = slice(row, row + 1)
        single, _ = method.advance(kepler_by_components, 0.0, many[:, one], np.zeros((2, 1, 3)), 0.3)
        assert single.tobytes() == stacked[:, one].tobytes()
        apart = step.advance(flat[one], held[one], lambda offset, state: offset * state[:, :3])
        assert apart.tobytes() == exponential[one].tobytes()


def kepler_by_components(time, state):
    position, velocity = state
    x, y, z = position[:, 0], position[:, 1], position[:, 2]
    squared = x * x + y * y + z * z
    return np.stack((velocity, -position / (squared * np.sqrt(squared))[:, None]))


def cw_matrix():
    n = MEAN_MOTION
    matrix = np.zeros((6, 6))
    matrix[:3, 3:] = np.eye(3)
    matrix[3, 0], matrix[5, 2], matrix[3, 4], matrix[4, 3] = 3 * n * n, -n * n, 2 * n, -2 * n
    return matrix


@pytest.mark.parametrize("name", ["rk4", "rk8"])
@pytest.mark.parametrize("duration", [1.0, 600.0, 30_000.0])
def test_without_other_forces_the_exponential_step_is_exact_however_long(name, duration):
    held = np.array([[1e-5, -2e-5, 3e-5]])
    state = np.array([[500.0, 1700.0, -300.0, 0.9, -1.0, 0.4]])
    augmented = np.zeros((9, 9))
    augmented[:6, :6] = cw_matrix()
    augmented[3:6, 6:] = np.eye(3)
    expected = (expm(augmented * duration) @ np.concatenate((state[0], held[0])))[:6]
    step = integrators.exponential_step(integrators.TABLEAUS[name](), MEAN_MOTION, duration)
    found = step.advance(state, held, lambda offset, reached: np.zeros((1, 3)))
    np.testing.assert_allclose(found[0, :3], expected[:3], rtol=1e-10, atol=1e-6)
    np.testing.assert_allclose(found[0, 3:], expected[3:], rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize(("name", "order"), METHODS)
def test_the_exponential_step_takes_other_forces_to_the_order_of_its_method(name, order):
    def other(time, position):
        return 1e-7 * position * math.cos(2e-3 * time) - 1e-10 * position * position[..., :1]

    def rate(time, state):
        return cw_matrix() @ state + np.concatenate((np.zeros(3), held[0] + other(time, state[:3])))

    held = np.array([[1e-5, -2e-5, 3e-5]])
    start = np.array([[500.0, 1700.0, -300.0, 0.9, -1.0, 0.4]])
    duration = 4000.0
    expected = solve_ivp(rate, (0.0, duration), start[0], method="DOP853", rtol=1e-13, atol=1e-11).y[:, -1]
    errors = []
    for steps in (8, 16) if order == 8 else (16, 32, 64):
        length = duration / steps
        step = integrators.exponential_step(integrators.TABLEAUS[name](), MEAN_MOTION, length)
        state = start
        for index in range(steps):
            begin = index * length
            state = step.advance(state, held, lambda at, reached, b=begin: other(b + at, reached[:, :3]))
        errors.append(np.abs(state[0, :3] - expected[:3]).max())
    assert min(observed_orders(errors)) > order - 0.6, errors
