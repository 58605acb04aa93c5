# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Pointing where it is singular: along the sun, at the own position, at the end of the panels' reach."""

import math
from datetime import UTC, datetime

import numpy as np
import pytest

from flights import shipped
from satform.attitude.ground_pointing import (
    AttitudeReference,
    pointing_reference,
    sensor_axes,
    sun_safe_reference,
)
from satform.attitude.satellite_pointing import SatellitePointingSpec
from satform.attitude.yaw_steering import SUN_CONE, square_direction
from satform.common.spec import Vector
from satform.control.artificial_potential import ArtificialPotentialSpec
from satform.control.protocol import FlightSetting, RelativeNeighbour
from satform.evaluation.passes import PassLightAngle
from satform.flight.simulate import simulate
from satform.numeric.elementwise import Array
from satform.numeric.modified_rodrigues import direction_cosines
from satform.numeric.time_derivatives import Jet
from satform.orbits.curve_specs import CircleSpec, EllipseSpec
from satform.orbits.path_reference import Path as OrbitPath
from satform.orbits.path_reference import Reference
from satform.scenario import Scenario, parse_scenario
from satform_tools.check.pointing import pointing_warnings

BORESIGHT = np.array([1.0, 0.0, 0.0])
SUN = np.array([0.0, 0.0, 1.0])
RATE = 1e-3
"""Of the lines of sight that sweep past the sun, rad/s."""


def sweep(time: Array, miss: float, azimuth: float = 0.0) -> Jet:
    """A line of sight that turns evenly and passes the sun at time zero at a distance, rad."""
    angle = RATE * time
    along, ahead = np.cos(angle)[:, None], np.sin(angle)[:, None]
    cosine, sine = math.cos(azimuth), math.sin(azimuth)
    start = np.array([-math.sin(miss) * sine, math.sin(miss) * cosine, math.cos(miss)])
    side = np.array([cosine, sine, 0.0])
    value = 1e4 * (along * start + ahead * side)
    return Jet(value, RATE * 1e4 * (along * side - ahead * start), -(RATE**2) * value)


def turned(reference: AttitudeReference) -> Array:
    """Angle in rad between each attitude and the next."""
    matrix = direction_cosines(reference.mrp)
    trace = np.einsum("kij,kij->k", matrix[1:], matrix[:-1])
    angle: Array = np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0))
    return angle


@pytest.mark.parametrize("miss", [0.0, 1e-9, 1e-4, 4e-3, 1.74e-2])
@pytest.mark.parametrize("axis", [[0.0, 1.0, 0.0], [0.3, 1.0, 0.0]])
@pytest.mark.parametrize("azimuth", [0.0, 90.0, 180.0, 270.0])
def test_a_line_of_sight_that_sweeps_past_the_sun_is_followed_without_a_jump(
    miss: float, axis: list[float], azimuth: float
) -> None:
    time = np.linspace(-30.0, 30.0, 6001)
    line = sweep(time, miss, math.radians(azimuth))
    reference = pointing_reference(line, SUN, sensor_axes(BORESIGHT, np.array(axis)))
    matrix = direction_cosines(reference.mrp)
    sight = line.value / np.linalg.norm(line.value, axis=-1, keepdims=True)
    assert np.einsum("kj,kj->k", matrix[:, 0], sight) == pytest.approx(1.0, abs=1e-12)
    # The cone is crossed in 2 * SUN_CONE / RATE = 35 s; half a turn in a tenth of that is 0.9 rad/s.
    assert turned(reference).max() < 0.03
    assert np.abs(reference.angular_velocity).max() < 3.0
    assert np.all(np.isfinite(reference.angular_acceleration))


@pytest.mark.parametrize("miss", [0.0, 2e-3, 5e-3, 2e-2])
def test_the_rates_near_the_sun_are_the_derivatives_of_the_attitude(miss: float) -> None:
    time, step = np.linspace(-20.0, 20.0, 401), 1e-4
    axes = sensor_axes(BORESIGHT, np.array([0.0, 1.0, 0.0]))
    before, now, after = (
        pointing_reference(sweep(time + shift, miss), SUN, axes) for shift in (-step, 0.0, step)
    )
    matrix = direction_cosines(now.mrp)
    slope = (direction_cosines(after.mrp) - direction_cosines(before.mrp)) / (2.0 * step)
    skew = -slope @ np.swapaxes(matrix, -1, -2)
    found = np.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), axis=-1)
    assert now.angular_velocity == pytest.approx(found, abs=1e-7, rel=1e-6)
    bend = (after.angular_velocity - before.angular_velocity) / (2.0 * step)
    assert now.angular_acceleration == pytest.approx(bend, abs=2e-6, rel=1e-5)


@pytest.mark.parametrize("sun", [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.6, -0.48, 0.64]])
def test_within_the_cone_about_the_sun_panels_lose_no_more_than_the_cone_s_sine(sun: list[float]) -> None:
    random = np.random.default_rng(4)
    toward = np.array(sun)
    square = np.cross(toward, random.standard_normal((500, 3)))
    square /= np.linalg.norm(square, axis=-1, keepdims=True)
    angle = SUN_CONE * random.random((500, 1))
    line = 50.0 * (np.cos(angle) * toward + np.sin(angle) * square)
    still = np.zeros_like(line)
    axes = sensor_axes(BORESIGHT, np.array([0.0, 1.0, 0.0]))
    reference = pointing_reference(Jet(line, still, still), toward, axes)
    assert np.abs(direction_cosines(reference.mrp)[:, 1] @ toward).max() <= math.sin(SUN_CONE)


def test_the_rate_is_bounded_where_panels_can_only_just_be_kept_to_the_sun() -> None:
    # The panels' axis is 30 degrees off the boresight, which turns 30 degrees off the sun's plane and back.
    axis = np.array([math.cos(math.pi / 6.0), math.sin(math.pi / 6.0), 0.0])
    time = np.linspace(0.0, 400.0, 40_001)
    angle = math.pi / 3.0 + RATE * (time - 200.0)
    value = np.stack((np.sin(angle), np.zeros_like(angle), np.cos(angle)), axis=-1)
    rate = RATE * np.stack((np.cos(angle), np.zeros_like(angle), -np.sin(angle)), axis=-1)
    line = Jet(value, rate, -(RATE**2) * value)
    reference = pointing_reference(line, SUN, sensor_axes(BORESIGHT, axis))
    assert 0.2 < np.mean(reference.feasible) < 0.8
    at_the_edge = pointing_reference(
        Jet(*(part[20_000:20_001] for part in (line.value, line.rate, line.acceleration))),
        SUN,
        sensor_axes(BORESIGHT, axis),
    )
    for found in (reference, at_the_edge):
        # The cosine of the turn changes by about its tangent a radian of sight; 100 is 1 over the least sine.
        assert np.abs(found.angular_velocity).max() < 100.0 * 4.0 * RATE
        assert np.all(np.isfinite(found.angular_acceleration))
    assert turned(reference).max() < 0.05


def test_a_target_at_one_s_own_place_leaves_the_satellite_at_rest_with_its_panels_to_the_sun() -> None:
    here = Reference(np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.0, 0.0]), np.zeros(3))
    pointing = SatellitePointingSpec(target="b", sun=(0.3, -0.2, 1.0)).build(1e-3, 7e6)
    reference = pointing.reference(here, here, np.asarray(12.0))
    matrix = direction_cosines(reference.mrp)
    assert matrix[0] @ pointing.sun == pytest.approx(0.0, abs=1e-12)
    assert matrix[1] @ pointing.sun == pytest.approx(0.0, abs=1e-12)
    assert not np.any(reference.angular_velocity)
    assert bool(reference.feasible)


@pytest.mark.parametrize("axis", [[0.0, 1.0, 0.0], [0.9, 0.1, 0.3]])
def test_the_safe_attitude_keeps_any_panel_axis_square_to_any_sun(axis: list[float]) -> None:
    suns = np.random.default_rng(1).standard_normal((50, 3))
    suns = np.vstack((suns, np.eye(3), -np.eye(3)))
    for sun in suns / np.linalg.norm(suns, axis=-1, keepdims=True):
        axes = sensor_axes(BORESIGHT, np.array(axis))
        matrix = direction_cosines(sun_safe_reference(sun, axes).mrp)
        assert axes.panel_axis @ matrix @ sun == pytest.approx(0.0, abs=1e-12)
        assert square_direction(sun) @ sun == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("sun", [(1e-200, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 1e-30, 0.0)])
def test_a_direction_that_is_none_is_refused_in_words(sun: Vector) -> None:
    with pytest.raises(ValueError, match="sun needs a direction, got"):
        SatellitePointingSpec(target="b", sun=sun).build(1e-3, 7e6)


def pair(position: list[float]) -> Scenario:
    """Two satellites at rest, of which one points at the other, 100 m above the orbit plane by default."""
    text = f"""
name: pair
title: pair
text: pair
orbit: {{period: 6000.0}}
timing: {{step: 0.5, duration: 20.0}}
dynamics: {{kind: cw}}
graph: {{kind: complete}}
consensus: {{kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}}
nominal_motion: {{rate: 0.0}}
satellite_defaults: {{controller: {{kind: coast}}}}
satellites:
  - name: a
    curve: {{kind: fixed_point, position: [0.0, 0.0, 0.0]}}
    attitude: {{pointing: {{kind: satellite_pointing, target: b, sun: [0, 0, 1]}}}}
  - name: b
    curve: {{kind: fixed_point, position: {position}}}
"""
    return parse_scenario(text)


def test_a_flight_with_the_sun_behind_the_target_points_at_it_with_finite_numbers() -> None:
    record = simulate(pair([0.0, 0.0, 100.0]))
    assert np.all(np.isfinite(record.mrp[:, 0]))
    assert np.nanmax(record.pointing_error[:, 0]) < 1e-6


def test_a_circle_s_centre_gives_the_projected_phase_that_was_known_before() -> None:
    circle = OrbitPath(CircleSpec(radius=1000.0).build(), np.asarray(1.0))
    velocity = np.array([0.3, 0.4, 0.0])
    place, rate = circle.projected(np.zeros(3), velocity, np.asarray(123.0))
    assert float(place) == 123.0
    assert abs(float(rate)) <= 0.5 / 0.1


def test_a_flight_through_the_centre_of_a_circle_moves_its_projected_phase_without_a_jump() -> None:
    circle = OrbitPath(CircleSpec(radius=1000.0).build(), np.asarray(1.0))
    velocity, step = np.array([0.3, 0.4, 0.0]), 1.0
    place, rate = circle.projected(-800.0 * velocity, velocity, np.asarray(0.0))
    largest = 0.0
    for number in range(1, 1601):
        ahead = place + step * rate
        position = (number - 800.0) * velocity
        found, rate = circle.projected(position, velocity, ahead)
        largest = max(largest, abs(float(found - place)))
        place = found
    # Half of the circle is 3142 m, over the 200 s of the tenth of it about the centre.
    assert largest < 200.0


def test_check_says_that_a_line_of_sight_comes_near_the_sun_or_to_nothing() -> None:
    (toward,) = pointing_warnings(pair([0.0, 0.0, 100.0]))
    assert "attitude of a: at 0 s the line of sight to b is 0 deg from the sun" in toward
    (away,) = pointing_warnings(pair([0.0, 1.0, -100.0]))
    assert "0.573 deg from the direction away from the sun" in away
    (nowhere,) = pointing_warnings(pair([0.0, 0.1, 0.0]))
    assert "0.1 m from that of its target b" in nowhere
    assert not pointing_warnings(pair([0.0, 100.0, 0.0]))


@pytest.mark.parametrize(
    ("curve", "said"),
    [
        ({"semi_axes": (1e-300, 1e3), "normal": (0, 0, 1), "direction": (1, 0, 0)}, "at least 1e-06"),
        ({"semi_axes": (1e-4, 1e3), "normal": (0, 0, 1), "direction": (1, 0, 0)}, "radius 1e-11 m"),
        ({"first_axis": (1e-160, 0, 0), "second_axis": (0, 1, 0)}, "first_axis is of length"),
        ({"semi_axes": (1.0, 1.0), "normal": (0, 0, 1e-170), "direction": (1, 0, 0)}, "normal is"),
    ],
)
def test_a_curve_that_bends_without_bound_or_has_no_plane_is_refused(
    curve: dict[str, object], said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        EllipseSpec.model_validate(curve)


def test_a_law_on_the_distance_is_bounded_and_continuous_up_to_its_neighbour_s_place() -> None:
    law = ArtificialPotentialSpec().build(FlightSetting(1e-3, 0.02))
    away = np.concatenate(([0.0], np.geomspace(1e-12, 12.0, 20_000)))
    place = away[:, None] * np.array([0.6, 0.0, 0.8])
    closing = np.broadcast_to(np.array([1.0, -2.0, 0.5]), place.shape)
    found = law.field.guidance(RelativeNeighbour(place, closing))
    speed = np.linalg.norm(found.velocity, axis=-1)
    assert np.all(np.isfinite(found.acceleration))
    assert speed.max() <= 3.0
    # Held to 1e4 speed limits per safe distance, times how fast it closes.
    assert np.abs(found.acceleration).max() <= 1e4 * 3.0 / 10.0 * 2.5
    assert np.abs(np.diff(speed)).max() < 0.01


@pytest.mark.parametrize("field", ["width", "boundary", "speed_limit", "safe_distance"])
def test_a_law_on_the_distance_of_no_size_is_refused(field: str) -> None:
    with pytest.raises(ValueError, match=f"{field} is 1e-300; it has to be at least 1e-09"):
        ArtificialPotentialSpec.model_validate({field: 1e-300})


def test_two_satellites_at_one_place_have_no_light_angle() -> None:
    record = simulate(pair([0.0, 0.0, 0.0]))
    angle = PassLightAngle(
        satellites=("a", "b"), epoch=datetime(2022, 10, 20, tzinfo=UTC), chief_longitude=0.0, below=1.0
    )
    assert math.isnan(angle.measure(record))


@pytest.mark.unmeasured
def test_check_says_that_a_step_is_too_long_for_the_desired_attitude_s_own_motion() -> None:
    # The satellite passes its target at 164 s, where its boresight turns about by a radian in seconds.
    changes = ("timing.step=4.0", "timing.duration=200.0", "expect=[]")
    (found,) = pointing_warnings(shipped("attitude_cape_canaveral", *changes))
    assert "s the desired attitude turns so fast that a torque held for 4 s leaves a rate error of" in found
    record = simulate(shipped("attitude_cape_canaveral", *changes))
    said = float(found.split(" error of ")[1].split(" ")[0])
    # Settled before, and thrown off by about that there.
    assert record.attitude_rate_error[36:39, 0].max() < 0.01
    assert 0.5 * said < record.attitude_rate_error[39:44, 0].max() < 3.0 * said
    assert not pointing_warnings(shipped("attitude_cape_canaveral"))
