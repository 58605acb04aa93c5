# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""When a channel has a reading, and with which errors it has one."""

import math
from dataclasses import replace

import brahe
import numpy as np
import pytest
from pydantic import ValidationError

from satform.common.spec import specs
from satform.equipment.sensors.bearing_camera import BearingCameraSpec
from satform.equipment.sensors.gnss import DifferentialGnssSpec, GnssSpec
from satform.equipment.sensors.protocol import Scene
from satform.equipment.sensors.ranging import LaserRangingSpec, RadioRangingSpec
from satform.equipment.sensors.sensor_delay import SensorDelay
from satform.orbits.earth import EQUATORIAL_RADIUS

NAMES = ("a", "b")
RADIUS = 7.0e6
STEP = 2.0


def scene(other, **fields):
    """Satellite a at the chief, and b at a position relative to it."""
    position = np.array([[0.0, 0.0, 0.0], other])
    return Scene(0.0, position, np.zeros((2, 3)), np.asarray(RADIUS), **fields)


def channel(spec):
    (only,) = spec.build(NAMES, 0, STEP)
    return only


def sees(spec, scene, step=0):
    own = channel(spec)
    found = own.reading(scene, step, np.zeros(own.draws))
    assert np.isnan(found).all() or np.isfinite(found).all()
    return bool(np.isfinite(found).all())


def turned(angle):
    """Body axes of satellite a turned about the radial axis, those of b along LVLH."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]], np.eye(3)])


LASER = LaserRangingSpec(targets=("b",), maximum_range=1e7)
CAMERA = BearingCameraSpec(targets=("b",))


def test_a_reading_is_the_truth_with_bias_and_noise_of_the_size_that_was_asked_for():
    own = channel(
        LaserRangingSpec(
            targets=("b",), range_noise=0.003, range_bias=0.5, range_rate_noise=1e-4, range_rate_bias=-0.02
        )
    )
    normals = np.random.default_rng(2).standard_normal((4000, 2))
    readings = np.array([own.reading(scene([0.0, 900.0, 1200.0]), 0, draw) for draw in normals])
    np.testing.assert_allclose(
        readings.mean(axis=0), [1500.5, -0.02], atol=5 * 0.003 / math.sqrt(4000), rtol=1e-6
    )
    np.testing.assert_allclose(readings.std(axis=0), [0.003, 1e-4], rtol=0.05)
    np.testing.assert_allclose(own.model.variance, [9e-6, 1e-8])


def test_readings_are_taken_each_period_and_not_in_outages():
    spec = LaserRangingSpec(
        targets=("b",), period=4.0, outages=({"begin": 8.0, "end": 12.0}, {"begin": 19.0, "end": 21.0})
    )
    due = [step for step in range(13) if sees(spec, scene([0.0, 100.0, 0.0]), step)]
    assert due == [0, 2, 6, 8, 12]


def test_readings_arrive_after_the_latency_of_their_channel():
    channels = [
        channel(LaserRangingSpec(targets=("b",), latency=6.0, range_rate_noise=1.0)),
        channel(GnssSpec()),
        channel(RadioRangingSpec(targets=("b",), latency=2.0)),
    ]
    delay = SensorDelay(channels)
    numbers = [delay.arriving(np.arange(6.0) + 10.0 * step, step) for step in range(9)]
    for step, found in enumerate(numbers):
        for column, latency in enumerate([3, 3, 0, 0, 0, 1]):
            if step < latency:
                assert np.isnan(found[column])
            else:
                assert found[column] == column + 10.0 * (step - latency)


def test_a_target_out_of_range_has_no_reading():
    spec = LASER.model_copy(update={"maximum_range": 1000.0})
    assert sees(spec, scene([0.0, 999.0, 0.0]))
    assert not sees(spec, scene([0.0, 1001.0, 0.0]))
    assert not sees(spec, scene([0.0, 0.0, 0.0]))


@pytest.mark.parametrize("spec", [LASER, CAMERA, DifferentialGnssSpec(reference="b")])
def test_the_earth_hides_a_target_beyond_its_limb(spec):
    # The chord between two points of a circle has its middle at radius times the cosine of half the angle.
    limb = 2.0 * math.acos(EQUATORIAL_RADIUS / RADIUS)
    for angle, seen in ((limb - 1e-4, True), (limb + 1e-4, False)):
        other = [RADIUS * (math.cos(angle) - 1.0), RADIUS * math.sin(angle), 0.0]
        assert sees(spec, scene(other)) == seen


def test_a_margin_raises_the_limb():
    spec = LASER.model_copy(update={"line_of_sight_margin": 100e3})
    raised = 2.0 * math.acos((EQUATORIAL_RADIUS + 100e3) / RADIUS)
    for angle, seen in ((raised - 1e-4, True), (raised + 1e-4, False)):
        other = [RADIUS * (math.cos(angle) - 1.0), RADIUS * math.sin(angle), 0.0]
        assert sees(spec, scene(other)) == seen


@pytest.mark.parametrize("angle", [0.0, 30.0, 50.0])
def test_the_field_of_view_turns_with_the_body(angle):
    spec = LaserRangingSpec(targets=("b",), boresight=(0.0, 3.0, 0.0), field_of_view=math.radians(60.0))
    body = turned(math.radians(angle))
    # The boresight in LVLH lies in the y-z plane; targets a degree within and beyond the edge of 30 deg.
    for offset, seen in ((29.0, True), (31.0, False), (-29.0, True), (-31.0, False)):
        direction = math.radians(angle + offset)
        other = [0.0, 800.0 * math.cos(direction), 800.0 * math.sin(direction)]
        assert sees(spec, scene(other, body=body)) == seen
    # Without attitude the body axes are those of LVLH.
    assert sees(spec, scene([0.0, 1.0, 0.0]))
    assert not sees(spec, scene([0.0, 0.0, 1.0]))


def test_a_reflector_answers_in_its_own_field_of_view_alone():
    spec = LaserRangingSpec(
        targets=("b",), target_boresight=(0.0, -1.0, 0.0), target_field_of_view=math.radians(40.0)
    )
    # As seen from b, satellite a lies in the opposite direction.
    assert sees(spec, scene([0.0, 500.0, 0.0]))
    assert not sees(spec, scene([0.0, -500.0, 0.0]))
    body = turned(0.0)
    body[1] = turned(math.radians(25.0))[0]
    assert not sees(spec, scene([0.0, 500.0, 0.0], body=body))


def test_a_camera_sees_a_target_in_front_of_the_sky_alone():
    disc = math.asin(EQUATORIAL_RADIUS / RADIUS)
    for angle, seen in ((disc - 1e-3, False), (disc + 1e-3, True)):
        other = [-1000.0 * math.cos(angle), 0.0, 1000.0 * math.sin(angle)]
        assert sees(CAMERA, scene(other)) == seen
        assert sees(LASER, scene(other))
    spec = CAMERA.model_copy(update={"limb_exclusion": math.radians(10.0)})
    for angle, seen in ((9.9, False), (10.1, True)):
        direction = disc + math.radians(angle)
        assert sees(spec, scene([-math.cos(direction), math.sin(direction), 0.0])) == seen


def test_a_camera_does_not_see_near_the_sun():
    spec = BearingCameraSpec(targets=("b",), sun_exclusion=math.radians(30.0), sunlit_only=False)
    sun = np.array([0.0, 0.0, 1.0])
    for angle, seen in ((29.9, False), (30.1, True), (120.0, True)):
        direction = math.radians(angle)
        assert sees(spec, scene([0.0, math.sin(direction), math.cos(direction)], sun=sun)) == seen


def test_a_camera_sees_targets_in_sunlight_alone():
    rng = np.random.default_rng(8)
    away_from_sun = np.zeros(40, dtype=bool)
    for row in range(40):
        sun = rng.normal(size=3) + np.array([-1.5, 0.0, 0.0])
        sun /= np.linalg.norm(sun)
        other = np.array([500.0, 800.0, -300.0])
        # A conical shadow has a penumbra; brahe's gives the part of the Sun that is seen.
        lit = brahe.eclipse_conical(other + np.array([RADIUS, 0.0, 0.0]), 1.496e11 * sun)
        away_from_sun[row] = lit < 1.0
        if lit in (0.0, 1.0):
            assert sees(CAMERA, scene(other, sun=sun)) == (lit == 1.0)
            assert sees(CAMERA.model_copy(update={"sunlit_only": False}), scene(other, sun=sun))
    assert 5 < away_from_sun.sum() < 35


def test_a_camera_has_no_reading_along_the_orbit_normal():
    for angle, seen in ((0.9, False), (1.1, True)):
        direction = math.radians(angle)
        assert sees(CAMERA, scene([0.0, 700.0 * math.sin(direction), 700.0 * math.cos(direction)])) == seen


@pytest.mark.parametrize("elevation", [0.0, 60.0, 85.0])
def test_the_noise_of_a_camera_is_the_same_in_all_directions_across_the_line_of_sight(elevation):
    noise, angle = 1e-4, math.radians(elevation)
    own = channel(CAMERA.model_copy(update={"angle_noise": noise}))
    toward = np.array([0.6 * math.cos(angle), 0.8 * math.cos(angle), math.sin(angle)])
    normals = np.random.default_rng(3).standard_normal((4000, 2))
    readings = np.array([own.reading(scene(900.0 * toward), 0, draw) for draw in normals])
    azimuth, found = readings.T
    seen = np.stack(
        (np.cos(azimuth) * np.cos(found), np.sin(azimuth) * np.cos(found), np.sin(found)), axis=-1
    )
    along = np.array([-0.8, 0.6, 0.0])
    for axis in (along, np.cross(toward, along)):
        np.testing.assert_allclose((seen @ axis).std(), noise, rtol=0.05)
    np.testing.assert_allclose(readings.var(axis=0), own.model.variance_at(readings[0]), rtol=0.1)


def test_gnss_measures_the_own_motion_and_differential_gnss_the_difference():
    truth = scene([10.0, 20.0, 30.0])
    truth = replace(truth, velocity=np.array([[0.1, 0.2, 0.3], [1.0, 2.0, 4.0]]))
    (own,) = GnssSpec(velocity_noise=0.05, position_bias=(1.0, 0.0, 0.0)).build(NAMES, 1, STEP)
    np.testing.assert_array_equal(own.reading(truth, 0, np.zeros(6)), [11.0, 20.0, 30.0, 1.0, 2.0, 4.0])
    (between,) = DifferentialGnssSpec(reference="a", velocity_noise=1e-3).build(NAMES, 1, STEP)
    np.testing.assert_allclose(between.reading(truth, 0, np.zeros(6)), [10, 20, 30, 0.9, 1.8, 3.7])
    assert own.model.target is None
    assert between.model.target == 0
    assert channel(GnssSpec()).width == 3


def test_only_a_camera_that_looks_at_light_needs_a_date():
    assert CAMERA.needs_sun
    assert not BearingCameraSpec(targets=("b",), sunlit_only=False).needs_sun
    assert not LASER.needs_sun


@pytest.mark.parametrize(
    ("spec", "sentence"),
    [
        (LaserRangingSpec(targets=("c",)), "targets: there is no satellite c; there are a, b"),
        (LaserRangingSpec(targets=("a",)), "targets: a carries the sensor and cannot be its own target"),
        (LaserRangingSpec(targets=("b", "b")), "targets: b is named twice"),
        (DifferentialGnssSpec(reference="a"), "reference: a carries the sensor and cannot be its own target"),
        (GnssSpec(period=3.0), "period 3 s is 1.5 control periods of 2 s; .* for example 4 s"),
        (GnssSpec(latency=1e5), "latency 100000 s is 50000 steps; at most 1000"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(spec, sentence):
    with pytest.raises(ValueError, match=sentence):
        spec.build(NAMES, 0, STEP)


@pytest.mark.parametrize(
    "fields",
    [
        {"targets": ()},
        {"targets": ("b",), "boresight": (0.0, 0.0, 0.0)},
        {"targets": ("b",), "target_boresight": (0.0, 0.0, 0.0)},
        {"targets": ("b",), "range_noise": 0.0},
        {"targets": ("b",), "outages": ({"begin": 5.0, "end": 5.0},)},
    ],
)
def test_fields_out_of_bounds_are_refused(fields):
    with pytest.raises(ValidationError):
        LaserRangingSpec(**fields)


def test_every_sensor_is_found_by_its_kind():
    kinds = {"laser_ranging", "radio_ranging", "bearing_camera", "gnss", "differential_gnss"}
    assert kinds <= set(specs("satform.sensors"))
