# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Least distance of free motion against closed forms and an integration of the equations."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from satform.control.protocol import Motion
from satform.control.relative_elements import RelativeElements, elements_from_motion, motion_from_elements
from satform.dynamics.free_drift import least_free_distance, least_free_distances
from satform.orbits.chief import KeplerianChief
from satform.orbits.frames import lvlh_frame
from satform.orbits.radial_normal import least_radial_normal_distance

MEAN_MOTION = 2.0 * math.pi / 5700.0
ORBIT = 5700.0


def motion_of(elements, argument=0.0):
    return motion_from_elements(
        RelativeElements.from_array(np.array(elements)), np.asarray(MEAN_MOTION), np.asarray(argument)
    )


def test_a_satellite_on_a_larger_ellipse_about_the_other_stays_at_its_half_axis():
    # The ellipse of free motion in the orbit plane, 200 m by 100 m: nearest above and below.
    motion = motion_of([0.0, 0.0, 100.0, 0.0, 0.0, 0.0], argument=0.3)
    distance, time = least_free_distance(motion.position, motion.velocity, MEAN_MOTION, 1.0)
    assert distance == pytest.approx(100.0, rel=1e-12)
    assert math.sin(MEAN_MOTION * float(time) + 0.3) == pytest.approx(0.0, abs=1e-7)


def test_a_circle_of_the_general_circular_orbit_is_nowhere_nearer():
    # Hill's circle: radius 2 in the plane of x = -z sqrt(3).
    motion = motion_of([0.0, 0.0, 50.0, 0.0, 0.0, math.sqrt(3.0) * 50.0])
    distance, _ = least_free_distance(motion.position, motion.velocity, MEAN_MOTION, 2.0)
    assert distance == pytest.approx(100.0, rel=1e-12)


def test_a_lower_satellite_overtakes_the_other_at_its_height():
    # 200 m behind and 30 m below it drifts ahead by 3 pi times 30 m a revolution, on a line.
    motion = motion_of([-30.0, -200.0, 0.0, 0.0, 0.0, 0.0])
    near, when = least_free_distance(motion.position, motion.velocity, MEAN_MOTION, 1.0)
    assert near == pytest.approx(30.0, rel=1e-12)
    assert when == pytest.approx(200.0 / (3.0 * math.pi * 30.0) * ORBIT, rel=1e-9)
    # Before it is there, the distance at the end counts.
    early, until = least_free_distance(motion.position, motion.velocity, MEAN_MOTION, 0.5)
    assert early == pytest.approx(math.hypot(30.0, 200.0 - 1.5 * math.pi * 30.0), rel=1e-12)
    assert until == pytest.approx(0.5 * ORBIT, rel=1e-12)


def test_no_orbits_leave_the_distance_that_there_is():
    start = np.array([3.0, 4.0, 12.0])
    distance, time = least_free_distance(start, np.array([-1.0, 0.0, 0.0]), MEAN_MOTION, 0.0)
    assert (float(distance), float(time)) == (13.0, 0.0)


@settings(deadline=None, max_examples=6)
@given(st.integers(0, 2**32 - 1))
def test_least_distance_by_an_integration_of_the_equations(seed):
    rng = np.random.default_rng(seed)
    position, velocity = 100.0 * rng.standard_normal(3), 0.1 * rng.standard_normal(3)

    def rate(_: float, state: np.ndarray) -> np.ndarray:
        x, _, z, vx, vy, vz = state
        n = MEAN_MOTION
        return np.array([vx, vy, vz, 3.0 * n * n * x + 2.0 * n * vy, -2.0 * n * vx, -n * n * z])

    flown = solve_ivp(
        rate, (0.0, 1.5 * ORBIT), [*position, *velocity], rtol=1e-10, atol=1e-9, dense_output=True
    )
    times = np.linspace(0.0, 1.5 * ORBIT, 5001)
    away = np.linalg.norm(flown.sol(times)[:3], axis=0)
    found, when = least_free_distance(position, velocity, MEAN_MOTION, 1.5)
    assert found <= away.min() + 1e-6
    assert np.linalg.norm(flown.sol(float(when))[:3]) == pytest.approx(float(found), abs=1e-5)


def test_it_is_never_nearer_than_the_radial_normal_plane_says():
    rng = np.random.default_rng(5)
    position, velocity = 100.0 * rng.standard_normal((50, 3)), 0.1 * rng.standard_normal((50, 3))
    found, _ = least_free_distance(position, velocity, MEAN_MOTION, 3.0)
    argument = rng.uniform(0.0, math.tau, 50)
    elements = elements_from_motion(Motion(position, velocity), np.full(50, MEAN_MOTION), argument)
    assert (found >= least_radial_normal_distance(elements.as_array()) * (1.0 - 1e-9)).all()


def test_many_at_once_have_the_bits_of_each():
    rng = np.random.default_rng(3)
    position, velocity = 100.0 * rng.standard_normal((2, 2, 3, 3)), 0.1 * rng.standard_normal((2, 2, 3, 3))
    rates = np.array([[1.0e-3], [1.1e-3]])
    found, _ = least_free_distance(position, velocity, rates, 0.3)
    for row, run, pair in np.ndindex(found.shape):
        alone, _ = least_free_distance(position[row, run, pair], velocity[row, run, pair], rates[run, 0], 0.3)
        assert float(alone) == found[row, run, pair]


def inertial(orbit: KeplerianChief, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities by the eccentric anomaly, which Newton's method finds."""
    mean, e = orbit.mean_anomaly + orbit.mean_motion * times, orbit.eccentricity
    anomaly = mean
    for _ in range(50):
        anomaly = anomaly - (anomaly - e * np.sin(anomaly) - mean) / (1.0 - e * np.cos(anomaly))
    cosine, sine, minor = np.cos(anomaly), np.sin(anomaly), math.sqrt(1.0 - e * e)
    turn = Rotation.from_euler("ZXZ", [orbit.right_ascension, orbit.inclination, orbit.argument_of_perigee])
    position = np.stack((cosine - e, minor * sine, 0.0 * sine), axis=-1)
    rate = orbit.mean_motion / (1.0 - e * cosine)[:, None]
    velocity = rate * np.stack((-sine, minor * cosine, 0.0 * sine), axis=-1)
    return tuple(orbit.semi_major_axis * turn.apply(own) for own in (position, velocity))


def chief_of(eccentricity: float) -> KeplerianChief:
    return KeplerianChief(9.0e6 / (1.0 - eccentricity), eccentricity, 1.0, 0.3, 0.4, 2.0)


def test_an_eccentric_chief_that_is_circular_gives_the_distances_of_the_circular_one():
    rng = np.random.default_rng(5)
    position, velocity = 100.0 * rng.standard_normal((3, 2, 3)), 0.1 * rng.standard_normal((3, 2, 3))
    chief = chief_of(0.0)
    found = least_free_distances(chief, np.array([0.0, 700.0, 900.0]), position, velocity, 1.3)
    expected, _ = least_free_distance(position, velocity, chief.mean_motion, 1.3)
    assert found == pytest.approx(expected, rel=2e-6)


@pytest.mark.parametrize("eccentricity", [0.1, 0.7])
def test_distances_about_an_eccentric_chief_are_those_of_two_keplerian_orbits(eccentricity):
    chief = chief_of(eccentricity)
    times = np.array([0.0, 0.3 * chief.period])
    # One deputy has the chief's period and stays, the other one drifts.
    deputies = [
        replace(chief, eccentricity=eccentricity + 3e-6, inclination=1.0 + 4e-6, mean_anomaly=2.0 + 2e-6),
        replace(chief, semi_major_axis=chief.semi_major_axis + 5.0, mean_anomaly=2.0 - 5e-6),
    ]

    frame = lvlh_frame(*inertial(chief, times))
    motions = [frame.to_lvlh(*inertial(deputy, times)) for deputy in deputies]
    position, velocity = (np.stack(own, axis=1) for own in zip(*motions, strict=True))
    found = least_free_distances(chief, times, position, velocity, 1.4)
    for row, time in enumerate(times.tolist()):
        instants = np.linspace(time, time + 1.4 * chief.period, 6001)
        for column, deputy in enumerate(deputies):
            apart = inertial(chief, instants)[0] - inertial(deputy, instants)[0]
            # The linear motion leaves out terms of the second order in the distance.
            assert found[row, column] == pytest.approx(np.linalg.norm(apart, axis=1).min(), rel=1e-4)
