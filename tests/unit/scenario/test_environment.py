# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A scenario has one Sun, one Earth angle and one rotation rate: those of its truth model."""

import math
from datetime import UTC, datetime

import brahe
import numpy as np
import pytest

from satform.attitude.ground_pointing import GroundPointingSpec, ground_target
from satform.attitude.satellite_pointing import SatellitePointingSpec
from satform.dynamics.truth_models import CwDynamicsSpec, InertialDynamicsSpec
from satform.flight.compile_satellite import flight_plan
from satform.orbits import earth, frames
from satform.orbits.chief import earth_angle_at
from satform.orbits.sun import days_at, greenwich_angle, sun_direction
from satform.scenario import ScenarioError, parse_scenario
from satform.scenario.environment import environment_of, pointing_in

EPOCH = datetime(2024, 6, 3, 7, 30, tzinfo=UTC)
TEXT = """\
name: pair
title: Two satellites that point at each other
text: small
orbit: {period: 6000.0}
timing: {step: 10.0, duration: 600.0}
dynamics:
  kind: inertial
  epoch: 2024-06-03T07:30:00Z
  gravity: {degree: 2}
  chief: {inclination: 0.9, right_ascension: 0.4, argument_of_latitude: 0.3}
graph: {kind: complete}
consensus: {kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}
nominal_motion: {period: 6000.0}
satellite_defaults:
  controller: {kind: sliding_mode, proportional_gain: 0.01, switching_gain: 0.1, reaching_gain: 0.1}
  curve: {kind: circle, radius: 1000.0}
satellites:
  - {name: sat1}
  - {name: sat2, arc_length: 3000.0, attitude: {pointing: {kind: satellite_pointing, target: sat1}}}
"""


def brahes_sun(epoch):
    utc = brahe.TimeSystem.UTC
    at = brahe.Epoch.from_datetime(
        epoch.year, epoch.month, epoch.day, epoch.hour, epoch.minute, 0.0, 0.0, utc
    )
    position = brahe.sun_position(at)
    return position / np.linalg.norm(position)


def problems(*changes):
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(TEXT, "pair.yaml", changes)
    return caught.value.problems


def test_there_is_one_rotation_rate():
    assert earth.ROTATION_RATE == frames.EARTH_ROTATION_RATE
    # IERS: the nominal rate of the Earth, rounded.
    assert pytest.approx(7.2921151467e-5, rel=1e-10) == earth.ROTATION_RATE
    target = ground_target(0.3, 0.0, np.array(1000.0)).value
    angle = math.atan2(target[1], target[0])
    turned = frames.ClosedEarthRotation(0.0).matrix(1000.0)
    assert angle == pytest.approx(math.atan2(turned[0, 1], turned[0, 0]), abs=1e-15)


def test_the_sun_of_pointing_light_angles_and_forces_is_one():
    np.testing.assert_allclose(sun_direction(days_at(EPOCH)), brahes_sun(EPOCH), rtol=0.0, atol=1e-9)
    environment = environment_of(parse_scenario(TEXT).dynamics)
    np.testing.assert_allclose(environment.sun(), brahes_sun(EPOCH), rtol=0.0, atol=1e-9)


def test_the_earth_angle_of_patrols_and_of_gravity_is_one():
    assert greenwich_angle(days_at(EPOCH)) == pytest.approx(earth_angle_at(EPOCH), abs=1e-9)
    assert environment_of(InertialDynamicsSpec(epoch=EPOCH)).earth_angle == earth_angle_at(EPOCH)
    assert environment_of(InertialDynamicsSpec(gravity={"earth_angle": 1.5})).earth_angle == 1.5


def test_a_satellite_keeps_its_panels_to_the_sun_of_the_truth_models_epoch():
    scenario = parse_scenario(TEXT)
    chief = scenario.dynamics.chief
    radial, transverse, normal = chief.axes(chief.argument_of_latitude)
    expected = [float(axis @ brahes_sun(EPOCH)) for axis in (radial, transverse, normal)]
    flown = flight_plan(scenario, 1).orientation.pointing.sun
    np.testing.assert_allclose(flown, expected, rtol=0.0, atol=1e-9)


def test_another_sun_than_that_of_the_epoch_is_refused():
    (problem,) = problems("satellites.1.attitude.pointing.sun=[0.3, -0.2, 1.0]")
    assert "from where it is at the truth model's epoch" in problem.sentence
    right = flight_plan(parse_scenario(TEXT), 1).orientation.pointing.sun.tolist()
    assert parse_scenario(TEXT, "pair.yaml", [f"satellites.1.attitude.pointing.sun={right}"])


def test_a_truth_model_without_a_date_leaves_the_sun_to_the_scenario():
    free = parse_scenario(
        TEXT, "pair.yaml", ["dynamics={kind: cw}", "satellites.1.attitude.pointing.sun=[0, 2, 0]"]
    )
    np.testing.assert_allclose(flight_plan(free, 1).orientation.pointing.sun, [0.0, 1.0, 0.0])
    pointing = SatellitePointingSpec(target="sat1")
    assert pointing_in(CwDynamicsSpec(), pointing) is pointing
    assert pointing.build(1e-3, 7e6).sun.tolist() == [0.0, 0.0, 1.0]


def test_a_place_on_the_ground_is_where_the_truth_models_earth_has_turned_it():
    dynamics = InertialDynamicsSpec(epoch=EPOCH, gravity={"earth_angle": 1.0})
    spec = GroundPointingSpec(
        altitude=5e5,
        start_latitude=0.1,
        start_longitude=0.2,
        heading=0.5,
        target_latitude=0.3,
        target_longitude=0.4,
    )
    built = pointing_in(dynamics, spec).build()
    place = ground_target(built.latitude, built.longitude, np.array(500.0)).value
    # The same place through the rotation that carries the gravity field.
    fixed = earth.EQUATORIAL_RADIUS * np.array(
        [math.cos(0.3) * math.cos(0.4), math.cos(0.3) * math.sin(0.4), math.sin(0.3)]
    )
    rotation = frames.ClosedEarthRotation(1.0).matrix(500.0)
    np.testing.assert_allclose(place, rotation.T @ fixed, rtol=0.0, atol=1e-6)


def test_a_second_epoch_or_longitude_of_the_chief_is_refused():
    light = (
        "expect=[{{kind: pass_light_angle, satellites: [sat1, sat2], epoch: {}, chief_longitude: {}, "
        "below: 9.0, source: theory}}]"
    )
    axes = parse_scenario(TEXT).dynamics.chief.axes(0.3)[0]
    longitude = math.atan2(axes[1], axes[0]) - earth_angle_at(EPOCH)
    assert parse_scenario(TEXT, "pair.yaml", [light.format("2024-06-03T07:30:00Z", longitude)])
    (problem,) = problems(light.format("2024-06-04T07:30:00Z", longitude))
    assert problem.field == "expect[0].epoch"
    (problem,) = problems(light.format("2024-06-03T07:30:00Z", longitude + 0.1))
    assert problem.field == "expect[0].chief_longitude"


def test_a_ground_track_that_is_not_the_chiefs_is_refused():
    altitude = parse_scenario(TEXT).orbit.altitude
    ground = (
        f"{{kind: ground_pointing, altitude: {altitude!r}, start_latitude: 0.0, start_longitude: 0.0, "
        "heading: 0.0, target_latitude: 0.1, target_longitude: 0.1}"
    )
    (problem,) = problems(f"satellites.1.attitude.pointing={ground}")
    assert "degrees away from the truth model's chief" in problem.sentence
