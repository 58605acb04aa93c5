# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The expected error of CW against two-body motion that is integrated numerically."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from satform.dynamics.cw import propagate
from satform.dynamics.cw_error import cw_error, free_motion, two_body
from satform.orbits.chief import KeplerianChief

MU = 3.986004418e14
AXIS = 7.0e6
RATE = math.sqrt(MU / AXIS**3)
PERIOD = math.tau / RATE
CIRCLE, TENTH = KeplerianChief.from_mean_motion(RATE), KeplerianChief.from_mean_motion(RATE, 0.1)


def ellipse(size, phase):
    """Start on the 2:1 ellipse with the long half-axis `size` m."""
    x, y = 0.5 * size * math.sin(phase), size * math.cos(phase)
    return np.array([x, y, 0.0]), np.array([0.5 * RATE * y, -2.0 * RATE * x, 0.0])


def kepler(_, state):
    return np.concatenate((state[3:], -MU * state[:3] / np.linalg.norm(state[:3]) ** 3))


def integrated_error(position, velocity, chief, duration):
    """Largest distance from CW, two-body motion by scipy and the frame by its definition."""
    chief_position, chief_velocity = chief.state_in_own_axes()
    momentum = chief_position[0] * chief_velocity[1]
    turn = np.array([0.0, 0.0, momentum / chief_position[0] ** 2])
    satellite = (chief_position + position, chief_velocity + velocity + np.cross(turn, position))
    times = np.linspace(0.0, duration, 97)[1:]
    both = [
        solve_ivp(
            kepler,
            (0.0, duration),
            np.concatenate(start),
            method="DOP853",
            rtol=1e-13,
            atol=1e-7,
            t_eval=times,
        ).y.T
        for start in ((chief_position, chief_velocity), satellite)
    ]
    errors = []
    for time, one, other in zip(times, *both, strict=True):
        radial = one[:3] / np.linalg.norm(one[:3])
        normal = np.cross(one[:3], one[3:])
        normal /= np.linalg.norm(normal)
        axes = np.array([radial, np.cross(normal, radial), normal])
        expected = propagate(position, velocity, chief.mean_motion, time)[0]
        errors.append(np.linalg.norm(axes @ (other[:3] - one[:3]) - expected))
    return max(errors)


@pytest.mark.parametrize(
    ("size", "error"), [(100.0, 0.0168), (1e3, 1.68), (1e4, 168.0), (1e5, 16.8e3), (2e5, 67.7e3)]
)
def test_one_orbit_of_the_ellipse_errs_by_the_square_of_its_size(size, error):
    found = cw_error(*ellipse(size, 0.0), CIRCLE, PERIOD)
    assert found == pytest.approx(error, rel=0.01)
    assert found == pytest.approx(integrated_error(*ellipse(size, 0.0), CIRCLE, PERIOD), rel=1e-3)
    # The closed form of the second order, along-track at the end of the revolution.
    assert found == pytest.approx(3.75 * math.pi * size**2 / AXIS, rel=0.01)


@pytest.mark.parametrize("eccentricity", [0.01, 0.05, 0.1, 0.7])
@pytest.mark.parametrize("phase", [0.0, 1.0, 3.0])
def test_an_eccentric_chief_costs_what_integrated_motion_says(eccentricity, phase):
    rate = math.sqrt(MU / 3.0e7**3)
    chief = KeplerianChief.from_mean_motion(rate, eccentricity, 0.4)
    position, velocity = ellipse(2000.0, phase)
    velocity *= rate / RATE
    found = cw_error(position, velocity, chief, math.tau / rate)
    # Sampled at other times; the largest error lies between them.
    assert found == pytest.approx(
        integrated_error(position, velocity, chief, math.tau / rate), rel=0.03 if eccentricity < 0.5 else 0.15
    )


def test_a_chief_of_a_tenth_moves_an_ellipse_of_two_by_one_kilometre_by_822_metres():
    # Computed by an independent program.
    assert cw_error(*ellipse(2000.0, 0.0), TENTH, PERIOD) == pytest.approx(822.0, rel=0.01)


@pytest.mark.parametrize("eccentricity", [0.0, 0.3, 0.9])
def test_two_body_motion_is_that_of_an_integration(eccentricity):
    chief = KeplerianChief.from_mean_motion(math.sqrt(MU / 7.0e7**3), eccentricity, 0.7)
    position, velocity = chief.state_in_own_axes()
    velocity = velocity + np.array([0.0, 0.0, 100.0])
    times = np.array([100.0, 5e4, 3e5])
    flown = solve_ivp(
        kepler,
        (0.0, 3e5),
        np.concatenate((position, velocity)),
        method="DOP853",
        rtol=1e-13,
        atol=1e-6,
        t_eval=times,
    ).y.T
    found = two_body(position, velocity, times)
    assert found is not None
    np.testing.assert_allclose(found[0], flown[:, :3], rtol=0.0, atol=0.2)
    np.testing.assert_allclose(found[1], flown[:, 3:], rtol=0.0, atol=1e-3)


def test_a_satellite_on_no_ellipse_has_no_bound():
    assert math.isinf(cw_error(np.zeros(3), np.array([0.0, 2e4, 0.0]), CIRCLE, PERIOD))


def test_planned_motion_that_needs_no_control_is_kept_and_other_motion_replaced():
    position, velocity = ellipse(1000.0, 0.7)
    assert free_motion(position, velocity, RATE) is velocity
    np.testing.assert_allclose(free_motion(position, 50.0 * velocity, RATE), velocity, rtol=1e-12)
    still = np.zeros(3)
    assert free_motion(np.array([0.0, 500.0, 0.0]), still, RATE) is still
