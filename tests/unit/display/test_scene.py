# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a picture of a flight shows, against closed forms, scipy's rotations and the flight itself."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flights import shipped, shortened
from satform.attitude.ground_pointing import CircularOrbit, circular_orbit_over
from satform.display.scene import FEWEST_TRAIL_POINTS, Scene, picture_interval
from satform.display.shapes import (
    FRESH,
    GREY,
    RED,
    STALE,
    attitude_in_lvlh,
    desired_orbit,
    heading,
    link_colour,
    satellite_colour,
)
from satform.flight.compile import scene_plan
from satform.flight.simulate import simulate
from satform.orbits.curve_specs import EllipseSpec, FixedPointSpec


def equatorial(mean_motion: float) -> CircularOrbit:
    return CircularOrbit(
        np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array(7.0e6), np.array(mean_motion)
    )


def test_a_desired_orbit_is_closed_lies_on_the_ellipse_and_is_evenly_spaced() -> None:
    spec = EllipseSpec(
        centre=(10.0, 20.0, 30.0), first_axis=(0.0, 2000.0, 0.0), second_axis=(1000.0, 0.0, 0.0)
    )
    points = desired_orbit(spec.build(), 400)
    assert points.shape == (401, 3)
    np.testing.assert_array_equal(points[0], points[-1])
    x, y, z = (points - [10.0, 20.0, 30.0]).T
    np.testing.assert_allclose((x / 1000.0) ** 2 + (y / 2000.0) ** 2, 1.0, rtol=1e-9)
    np.testing.assert_array_equal(z, 0.0)
    pieces = np.linalg.norm(np.diff(points, axis=0), axis=1)
    # A chord is shorter than its arc by (arc * curvature)^2 / 24, at most 1e-4 here.
    np.testing.assert_allclose(pieces, pieces.mean(), rtol=1e-4)


def test_a_satellite_that_is_to_stay_has_an_orbit_of_one_point() -> None:
    spec = FixedPointSpec(position=(1.0, 2.0, 3.0))
    np.testing.assert_array_equal(desired_orbit(spec.build(), 96), [[1.0, 2.0, 3.0]])


@pytest.mark.parametrize(
    "direction",
    [
        (1.0, 0.0, 0.0),
        (-1.0, 0.0, 0.0),
        (0.0, 3.0, 0.0),
        (0.0, 0.0, -2.0),
        (-5.0, 1e-3, 0.0),
        (1.0, 2.0, -3.0),
    ],
)
def test_a_heading_takes_the_x_axis_to_its_direction(direction: tuple[float, float, float]) -> None:
    turned = Rotation.from_quat(heading(np.array(direction))).apply([1.0, 0.0, 0.0])
    np.testing.assert_allclose(turned, np.array(direction) / np.linalg.norm(direction), atol=1e-12)


def test_a_satellite_at_rest_keeps_the_axes() -> None:
    np.testing.assert_array_equal(heading(np.zeros(3)), [0.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize("time", [0.0, 700.0, 2900.0])
def test_a_body_that_turns_with_the_orbit_stands_still_in_lvlh(time: float) -> None:
    mean_motion = 2.0 * math.pi / 6000.0
    ahead = math.radians(30.0)
    mrp = np.array([0.0, 0.0, math.tan((mean_motion * time + ahead) / 4.0)])
    seen = attitude_in_lvlh(mrp, equatorial(mean_motion), time)
    np.testing.assert_allclose(seen, [0.0, 0.0, math.sin(ahead / 2.0), math.cos(ahead / 2.0)], atol=1e-12)


def test_an_attitude_in_lvlh_is_the_one_that_scipys_rotations_give() -> None:
    orbit = circular_orbit_over(0.3, -1.2, 0.8, 500.0e3)
    angle = float(orbit.mean_motion) * 1234.5
    radial = orbit.radial * math.cos(angle) + orbit.transverse * math.sin(angle)
    ahead = orbit.transverse * math.cos(angle) - orbit.radial * math.sin(angle)
    to_lvlh = Rotation.from_matrix(np.array([radial, ahead, np.cross(radial, ahead)]))
    for seed in range(5):
        mrp = np.random.default_rng(seed).uniform(-0.5, 0.5, 3)
        wanted = to_lvlh * Rotation.from_mrp(mrp)
        seen = Rotation.from_quat(attitude_in_lvlh(mrp, orbit, 1234.5))
        assert (wanted.inv() * seen).magnitude() < 1e-12


def test_two_hundred_pictures_a_lap_are_one_every_thirty_seconds_of_a_lap_of_six_thousand() -> None:
    assert picture_interval(scene_plan(shipped("triangle")), 200) * shipped("triangle").timing.step == 30.0


def test_a_flight_shorter_than_a_lap_has_as_many_pictures_as_a_lap() -> None:
    assert picture_interval(scene_plan(shortened("triangle", 300.0)), 200) == 3


def test_a_lap_by_rate_is_the_perimeter_over_the_speed() -> None:
    scenario = shipped("triangle", "nominal_motion={rate: 100.0}", "timing.duration=1e6")
    # Perimeter of an ellipse with semi-axes of 100 and 50 km (Ramanujan), flown at 100 m/s.
    seconds = 484_422.4 / 100.0
    assert picture_interval(scene_plan(scenario), 100) == pytest.approx(seconds / 100 / 0.5, abs=1.0)


@pytest.mark.parametrize("name", ["triangle", "ring_six"])
def test_a_picture_shows_satellites_where_the_flight_has_them(name: str) -> None:
    scenario = shortened(name, 60.0)
    record = simulate(scenario)
    scene = Scene(scene_plan(scenario), 20, 50)
    shown = []
    for step in range(record.steps + 1):
        for index in range(len(record.satellites)):
            scene.set_motion(index, step, record.position[step, index], record.velocity[step, index])
        if scene.due:
            shown.append(scene.picture())
    assert [picture.step for picture in shown] == list(range(0, record.steps + 1, scene.interval))
    assert len(shown) == 21
    for picture in shown:
        for index, view in enumerate(picture.satellites):
            assert view.name == record.satellites[index]
            np.testing.assert_array_equal(view.pose.position, record.position[picture.step, index])
            ahead = Rotation.from_quat(view.pose.orientation).apply([1.0, 0.0, 0.0])
            velocity = record.velocity[picture.step, index]
            np.testing.assert_allclose(ahead, velocity / np.linalg.norm(velocity), atol=1e-12)
    trail = shown[-1].satellites[0].trail
    assert [pose.step for pose in trail] == [picture.step for picture in shown]


def test_a_picture_shows_where_a_sensor_points() -> None:
    scenario = shortened("formation_pointing", 30.0)
    record = simulate(scenario)
    scene = Scene(scene_plan(scenario), 10, 10)
    step = record.steps
    for index in range(len(record.satellites)):
        scene.set_motion(index, step, record.position[step, index], record.velocity[step, index])
        scene.set_attitude(index, step, record.mrp[step, index])
    views = scene.picture().satellites
    names = [view.name for view in views]
    for index, view in enumerate(views):
        pointing = scenario.satellite(index).attitude.pointing
        other = views[names.index(pointing.target)].pose.position
        sight = other - view.pose.position
        boresight = Rotation.from_quat(view.pose.orientation).apply(pointing.boresight)
        # Off by what the flight itself says that the pointing was off, between its own two steps.
        off = math.acos(np.clip(boresight @ sight / np.linalg.norm(sight), -1.0, 1.0))
        assert off == pytest.approx(record.pointing_error[-1, index], abs=1e-3)


def test_a_trail_forgets_what_is_long_ago() -> None:
    scene = Scene(scene_plan(shipped("triangle")), 200, 5)
    for step in range(12):
        for index in range(3):
            scene.set_motion(index, step, (float(step), 0.0, 0.0), (1.0, 0.0, 0.0))
        scene.picture()
    assert [pose.step for pose in scene.picture().satellites[1].trail] == [7, 8, 9, 10, 11]


def test_trails_of_very_many_satellites_are_short() -> None:
    satellites = ", ".join(
        f"{{name: s{number}, curve: {{kind: circle, radius: 1000.0}}}}" for number in range(200)
    )
    scenario = shipped("ring_six", f"satellites=[{satellites}]", "expect=[]")
    scene = Scene(scene_plan(scenario), 200, 200)
    for step in range(FEWEST_TRAIL_POINTS + 5):
        for index in range(200):
            scene.set_motion(index, step, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
        picture = scene.picture()
    assert {len(view.trail) for view in picture.satellites} == {FEWEST_TRAIL_POINTS}


def seen_once(scene: Scene, step: int) -> None:
    for index in range(len(scene.names)):
        scene.set_motion(index, step, (1000.0 * index, 0.0, 0.0), (0.0, 1.0, 0.0))
        scene.note_message(index, step * 0.5)


def test_nothing_is_due_before_every_satellite_has_been_seen() -> None:
    scene = Scene(scene_plan(shipped("triangle")), 200, 10)
    scene.set_motion(0, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert not scene.due
    assert [view.name for view in scene.picture().satellites] == ["sat1"]
    assert scene.picture().links == ()


def test_each_satellite_has_half_a_line_to_everyone_whom_it_hears() -> None:
    scene = Scene(scene_plan(shipped("directed_triangle")), 200, 10)
    seen_once(scene, 0)
    links = scene.picture().links
    hears = shipped("directed_triangle").communication_graph().adjacency
    assert {(link.start[0], link.end[0]) for link in links} == {
        (1000.0 * listener, 500.0 * (listener + speaker))
        for listener, speaker in zip(*np.nonzero(hears), strict=True)
    }
    assert len(links) == 3


def test_who_is_lost_is_grey_and_whoever_hears_it_sees_red() -> None:
    scene = Scene(scene_plan(shipped("triangle")), 200, 10)
    seen_once(scene, 4)
    scene.set_formation([True, False, True], [0, 0, 1, 1, 2, 2], [1, 2, 0, 2, 0, 1])
    picture = scene.picture()
    assert [view.colour == GREY for view in picture.satellites] == [False, True, False]
    colours = {(link.start[0], link.end[0]): link.colour for link in picture.links}
    assert colours[0.0, 500.0] == RED
    assert colours[2000.0, 1500.0] == RED
    assert colours[1000.0, 500.0] == colours[1000.0, 1500.0] == GREY
    assert colours[0.0, 1000.0] == colours[2000.0, 1000.0] == FRESH


def test_a_link_that_the_plant_takes_out_of_the_graph_is_gone() -> None:
    scene = Scene(scene_plan(shipped("triangle")), 200, 10)
    seen_once(scene, 4)
    scene.set_formation([True, True, True], [0, 1, 1, 2], [1, 0, 2, 1])
    assert len(scene.picture().links) == 4


def test_a_status_of_another_formation_changes_nothing() -> None:
    scene = Scene(scene_plan(shipped("triangle")), 200, 10)
    seen_once(scene, 4)
    scene.set_formation([False, False], [], [])
    scene.set_formation([True, True, False], [0, 3], [1, 0])
    assert len(scene.picture().links) == 6
    assert GREY not in [view.colour for view in scene.picture().satellites]


def test_a_speaker_turns_from_fresh_to_stale_as_it_stays_silent() -> None:
    scene = Scene(scene_plan(shipped("triangle")), 200, 10)
    seen_once(scene, 0)
    amounts = []
    for step in (0, 2, 8, 14, 20, 500):
        for index in range(3):
            scene.set_motion(index, step, (1000.0 * index, 0.0, 0.0), (0.0, 1.0, 0.0))
        amounts.append(scene.picture().links[0].colour)
    assert amounts[0] == amounts[1] == FRESH
    assert amounts[4] == amounts[5] == pytest.approx(STALE)
    reds = [colour[0] for colour in amounts]
    assert reds[1] < reds[2] < reds[3] < reds[4]


def test_who_has_never_spoken_is_stale() -> None:
    assert link_colour(math.inf, receiver_alive=True, sender_alive=True) == pytest.approx(STALE)


def test_satellites_that_follow_each_other_in_the_list_differ_in_colour() -> None:
    colours = np.array([satellite_colour(index) for index in range(50)])
    assert np.linalg.norm(np.diff(colours, axis=0), axis=1).min() > 0.3
    assert ((colours >= 0.0) & (colours <= 1.0)).all()


@pytest.mark.parametrize(
    ("name", "extent"),
    [("triangle", 100.0e3 + 75.0e3), ("attitude_cape_canaveral", 1000.0)],
)
def test_the_extent_reaches_to_the_farthest_point_of_a_desired_orbit(name: str, extent: float) -> None:
    assert Scene(scene_plan(shipped(name)), 200, 10).extent == pytest.approx(extent, rel=1e-3)


@pytest.mark.parametrize(
    "name", ["geo_parallel", "approach_gssap", "patrol_three", "directed_triangle_close", "noisy_navigation"]
)
def test_every_kind_of_scenario_has_a_scene(name: str) -> None:
    scene = Scene(scene_plan(shipped(name)), 200, 200)
    assert scene.interval >= 1
    assert math.isfinite(scene.extent)
    assert scene.extent > 0.0
