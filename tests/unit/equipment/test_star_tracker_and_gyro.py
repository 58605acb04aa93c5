# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Readings of star trackers and gyros, against rotations of scipy and against their own statistics."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from satform.equipment.sensors.gyro import GyroSpec
from satform.equipment.sensors.protocol import Scene
from satform.equipment.sensors.star_tracker import StarTrackerSpec
from satform.numeric.elementwise import Array
from satform.orbits.earth import EQUATORIAL_RADIUS

RADIUS = 7.0e6
STEP = 2.0
ARCSEC = math.radians(1.0 / 3600.0)
TRUE = Rotation.from_rotvec([0.4, -2.0, 1.1])
"""Active: the body axes from the inertial ones."""


def scene(attitude: Rotation, body: Array | None = None, **fields: object) -> Scene:
    """One satellite at the chief; by default its body axes are those of LVLH."""
    axes = np.eye(3) if body is None else body
    mrp, rate = attitude.as_mrp(), np.array([[1e-3, 2e-3, -1e-3]])
    nowhere = np.zeros((1, 3))
    return Scene(
        0.0, nowhere, nowhere, np.asarray(RADIUS), axes[None], mrp=mrp[None], angular_velocity=rate, **fields
    )


def star_tracker(**fields: object):
    (channel,) = StarTrackerSpec.model_validate(fields).build(["one"], 0, STEP)
    return channel


def gyro(**fields: object):
    (channel,) = GyroSpec.model_validate(fields).build(["one"], 0, STEP)
    return channel.started()


def sees(channel, **fields: object) -> bool:
    return bool(np.isfinite(channel.reading(scene(TRUE, **fields), 0, np.zeros(3))).all())


def test_a_star_tracker_errs_little_across_its_boresight_and_more_about_it() -> None:
    looking = np.array([1.0, 2.0, 2.0]) / 3.0
    channel = star_tracker(
        boresight=[1.0, 2.0, 2.0],
        cross_axis_noise=10.0 * ARCSEC,
        boresight_noise=60.0 * ARCSEC,
        bias=[100.0 * ARCSEC, 0.0, -40.0 * ARCSEC],
    )
    normals = np.random.default_rng(1).standard_normal((4000, 3))
    there = scene(TRUE)
    read = Rotation.from_mrp([channel.reading(there, 0, row) for row in normals])
    errors = (TRUE.inv() * read).as_rotvec() / ARCSEC
    assert errors.mean(axis=0) == pytest.approx([100.0, 0.0, -40.0], abs=3.0)
    covariance = np.cov(errors.T)
    expected = 100.0 * (np.eye(3) - np.outer(looking, looking)) + 3600.0 * np.outer(looking, looking)
    assert covariance == pytest.approx(expected, abs=0.1 * 3600.0 / 3.0)
    assert looking @ covariance @ looking == pytest.approx(3600.0, rel=0.1)
    across = np.cross(looking, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    assert across @ covariance @ across == pytest.approx(100.0, rel=0.1)


def test_a_star_tracker_sees_nothing_with_the_earth_or_the_sun_near_its_boresight() -> None:
    disc = math.asin(EQUATORIAL_RADIUS / RADIUS)

    def off_nadir(angle: float) -> list[float]:
        # The Earth lies along minus x.
        return [-math.cos(angle), math.sin(angle), 0.0]

    margin = math.radians(20.0)
    assert not sees(star_tracker(boresight=off_nadir(disc - 0.001)))
    assert sees(star_tracker(boresight=off_nadir(disc + 0.001)))
    assert not sees(star_tracker(boresight=off_nadir(disc + margin - 0.001), earth_exclusion="20 deg"))
    assert sees(star_tracker(boresight=off_nadir(disc + margin + 0.001), earth_exclusion="20 deg"))
    # A turn of the body by a quarter about z takes its x axis to the radial axis of LVLH's y.
    turned = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert sees(star_tracker(boresight=[-1.0, 0.0, 0.0]), body=turned)
    assert not sees(star_tracker(boresight=[0.0, 1.0, 0.0]), body=turned)
    sun = np.array([0.0, math.sin(0.5), math.cos(0.5)])
    away = star_tracker(sun_exclusion=0.499)
    assert sees(away, sun=sun)
    near = star_tracker(sun_exclusion=0.501)
    assert not sees(near, sun=sun)
    assert sees(near)
    assert StarTrackerSpec(sun_exclusion=0.5).needs_sun
    assert not StarTrackerSpec().needs_sun


def test_a_gyro_integrates_the_rotation_between_its_readings() -> None:
    channel = gyro(
        period=4.0,
        angle_random_walk=0.0,
        rate_random_walk=0.0,
        bias=[0.01, 0, 0],
        scale_factor_error=[0.0, 0.1, 0],
    )
    nothing = np.zeros(channel.draws)
    bias = np.array([0.01, 0.0, 0.0])
    first = channel.reading(scene(TRUE), 0, nothing)
    assert first == pytest.approx(np.array([1e-3, 2e-3 * 1.1, -1e-3]) + bias)
    turn = np.array([0.2, -0.1, 0.3])
    assert np.isnan(channel.reading(scene(TRUE * Rotation.from_rotvec(0.3 * turn)), 1, nothing)).all()
    second = channel.reading(scene(TRUE * Rotation.from_rotvec(turn)), 2, nothing)
    assert second == pytest.approx(turn / 4.0 * [1.0, 1.1, 1.0] + bias, abs=1e-15)
    fresh = channel.started()
    assert fresh.reading(scene(TRUE), 0, nothing) == pytest.approx(first)


def test_white_noise_and_walk_of_a_gyro_have_the_variance_of_their_densities() -> None:
    """Angle error over n readings: n q T + s (n T)^3 / 3; of the bias s n T (Farrenkopf 1978)."""
    angle, walk, count, runs = 1e-3, 2e-4, 10, 700
    random = np.random.default_rng(3)
    sums, biases = np.zeros((runs, 3)), np.zeros((runs, 3))
    still = scene(TRUE)
    for run in range(runs):
        channel = gyro(angle_random_walk=angle, rate_random_walk=walk)
        channel.reading(still, 0, np.zeros(9))
        for step in range(1, count + 1):
            sums[run] += STEP * channel.reading(still, step, random.standard_normal(9))
        biases[run] = channel.walking_bias
    time = count * STEP
    assert sums.var() == pytest.approx(angle**2 * time + walk**2 * time**3 / 3.0, rel=0.1)
    assert biases.var() == pytest.approx(walk**2 * time, rel=0.1)
    together = np.mean(sums * biases)
    assert together == pytest.approx(walk**2 * time**2 / 2.0, rel=0.1)


def test_the_bias_at_the_start_is_drawn_from_what_was_asked_for() -> None:
    channel = gyro(
        turn_on_bias="0.01 deg/s", bias=["0.1 deg/s", 0, 0], angle_random_walk=0.0, rate_random_walk=0.0
    )
    normals = np.array([0.0] * 6 + [1.0, -2.0, 0.5])
    still = Scene(
        0.0,
        np.zeros((1, 3)),
        np.zeros((1, 3)),
        np.asarray(RADIUS),
        mrp=np.zeros((1, 3)),
        angular_velocity=np.zeros((1, 3)),
    )
    expected = np.radians([0.1 + 0.01, -0.02, 0.005])
    assert channel.reading(still, 0, normals) == pytest.approx(expected)
    assert channel.largest_bias == pytest.approx(math.radians(math.hypot(0.1, 0.01)))


def test_after_an_outage_a_gyro_measures_the_rotation_of_one_period_with_the_bias_that_walked_on() -> None:
    noise = {"angle_random_walk": 0.0, "rate_random_walk": 1e-3}
    whole, out = gyro(**noise), gyro(**noise, latency=2.0, outages=[{"begin": 2.0, "end": 6.0}])
    assert out.timing.latency == 1
    random = np.random.default_rng(2)
    for step, angle in enumerate((0.0, 0.1, 0.5, 0.55)):
        there = scene(TRUE * Rotation.from_rotvec([angle, 0.0, 0.0]))
        normals = random.standard_normal(9)
        usual, reading = whole.reading(there, step, normals), out.reading(there, step, normals)
        if step in (1, 2):
            assert np.isnan(reading).all()
        else:
            assert np.array_equal(reading, usual)
    assert usual[0] == pytest.approx(0.05 / STEP, abs=0.01)
