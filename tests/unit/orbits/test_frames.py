# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import json
import math
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import brahe
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from satform.dynamics.orbital_forces import FullEarthRotation, Gravity
from satform.orbits import frames
from satform.orbits.time_scales import brahe_epoch

DATA = Path(__file__).parents[2] / "data"
MANIFEST = json.loads((DATA / "manifest.json").read_text())
ROTATION = MANIFEST["closed_rotation"]
EPOCH = datetime(2024, 1, 1, tzinfo=UTC)

unit = st.floats(-1.0, 1.0)
vectors = st.tuples(unit, unit, unit).map(np.array)
angles = st.floats(0.0, 2.0 * math.pi)


@pytest.fixture(autouse=True)
def brahes_own_earth_orientation():
    """UT1 = UTC for what brahe itself is asked for here, whatever another test has set."""
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())


def orbit(inclination, node, latitude, eccentricity=0.1, radius=7e6):
    cn, sn, ci, si = math.cos(node), math.sin(node), math.cos(inclination), math.sin(inclination)
    cu, su = math.cos(latitude), math.sin(latitude)
    out = np.array([cn * cu - sn * su * ci, sn * cu + cn * su * ci, su * si])
    ahead = np.array([-cn * su - sn * cu * ci, -sn * su + cn * cu * ci, cu * si])
    speed = math.sqrt(3.986004415e14 / radius)
    return radius * out, speed * (eccentricity * out + ahead)


@settings(max_examples=50, deadline=None)
@given(st.tuples(angles, angles, angles), vectors, vectors, vectors)
def test_lvlh_and_back_returns_the_inertial_state_to_1e_12(place, offset, rate, push):
    position, velocity = orbit(*place)
    for frame in (frames.lvlh_frame(position, velocity), frames.chief_frame(position, velocity, push)):
        there = position + 1e4 * offset, velocity + 10.0 * rate
        back = frame.to_inertial(*frame.to_lvlh(*there))
        np.testing.assert_allclose(back[0], there[0], rtol=0.0, atol=1e-12 * 7e6)
        np.testing.assert_allclose(back[1], there[1], rtol=0.0, atol=1e-12 * 7.5e3)
        relative = 1e4 * offset, 10.0 * rate
        again = frame.to_lvlh(*frame.to_inertial(*relative))
        np.testing.assert_allclose(again[0], relative[0], rtol=0.0, atol=1e-12 * 7e6)
        np.testing.assert_allclose(again[1], relative[1], rtol=0.0, atol=1e-12 * 7.5e3)


@settings(max_examples=50, deadline=None)
@given(angles, angles, angles, vectors)
def test_turning_a_vector_into_lvlh_and_back_returns_it_to_1e_12(inclination, node, latitude, vector):
    frame = frames.lvlh_frame(*orbit(inclination, node, latitude))
    back = frame.vector_to_inertial(frame.vector_to_lvlh(vector))
    np.testing.assert_allclose(back, vector, rtol=0.0, atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(st.floats(-100.0, 100.0), vectors)
def test_earth_fixed_and_back_returns_a_vector_to_1e_12(angle, vector):
    rotation = frames.ClosedEarthRotation(angle).matrix(12.5)
    back = rotation.T @ (rotation @ vector)
    np.testing.assert_allclose(back, vector, rtol=0.0, atol=1e-12)


def test_precession_and_polar_motion_and_back_return_a_vector_to_1e_12():
    rotation = FullEarthRotation(brahe_epoch(EPOCH)).matrix(4321.0)
    vector = np.array([7e6, -1e5, 3e6])
    back = rotation.T @ (rotation @ vector)
    np.testing.assert_allclose(back, vector, rtol=1e-12, atol=1e-12 * 7e6)


def test_radial_along_track_and_normal_point_where_their_names_say():
    frame = frames.lvlh_frame(np.array([7e6, 0.0, 0.0]), np.array([0.0, 0.0, 7.5e3]))
    assert frame.radial.tolist() == [1.0, 0.0, 0.0]
    assert frame.along_track.tolist() == [0.0, 0.0, 1.0]
    assert frame.normal.tolist() == [0.0, -1.0, 0.0]
    np.testing.assert_allclose(frame.rate, [0.0, 0.0, 7.5e3 / 7e6], rtol=1e-15)


@pytest.mark.parametrize("name", ["A", "B", "C"])
@pytest.mark.parametrize(("convention", "columns"), [("orbit rate", (16, 19)), ("exact", (19, 22))])
def test_orekits_inertial_states_give_orekits_hill_states_in_both_conventions(name, convention, columns):
    rows = np.loadtxt(DATA / f"{name}_ellipse_orekit.csv", delimiter=",", skiprows=1)
    chief, deputy = (rows[:, 1:4], rows[:, 4:7]), (rows[:, 7:10], rows[:, 10:13])
    frame = frames.lvlh_frame(*chief)
    if convention == "exact":
        degree = MANIFEST["setups"][name]["gravity_degree"]
        gravity = Gravity(degree, degree, frames.ClosedEarthRotation(float(ROTATION["theta0_rad"])))
        pull = [
            gravity.acceleration(time, at[None], at[None], ())[0]
            for time, at in zip(rows[:, 0], chief[0], strict=True)
        ]
        each = [frames.chief_frame(*row) for row in zip(*chief, pull, strict=True)]
        frame = replace(frame, rate=np.stack([one.rate for one in each]))
    position, velocity = frame.to_lvlh(*deputy)
    np.testing.assert_allclose(position, rows[:, 13:16], rtol=0.0, atol=5e-8)
    np.testing.assert_allclose(velocity, rows[:, slice(*columns)], rtol=0.0, atol=2e-11)


def test_velocity_at_the_exact_rate_is_the_derivative_of_position():
    # Uniform precession of a circular orbit about z: both motions are known in closed form.
    rate, drift, tilt, radius = 1.1e-3, 2e-5, 0.9, 7e6

    def chief(t):
        turned = frames.rotation_about_z(-drift * t)
        inside = radius * np.array([math.cos(rate * t), math.sin(rate * t), 0.0])
        tilted = np.array(
            [[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)], [0, math.sin(tilt), math.cos(tilt)]]
        )
        return turned @ (tilted @ inside)

    def derivative(function, t, h=1.0):
        return (8 * (function(t + h) - function(t - h)) - (function(t + 2 * h) - function(t - 2 * h))) / (
            12 * h
        )

    def velocity(t):
        return derivative(chief, t)

    def satellite(t):
        return chief(t) + np.array([300.0 + 0.2 * t, -1e3, 500.0])

    def frame(t):
        return frames.chief_frame(chief(t), velocity(t), derivative(velocity, t))

    def relative(t):
        return frame(t).vector_to_lvlh(satellite(t) - chief(t))

    instant = 700.0
    _, exact = frame(instant).to_lvlh(satellite(instant), velocity(instant) + np.array([0.2, 0.0, 0.0]))
    np.testing.assert_allclose(exact, derivative(relative, instant), rtol=0.0, atol=1e-7)
    _, orbit_rate = frames.lvlh_frame(chief(instant), velocity(instant)).to_lvlh(
        satellite(instant), velocity(instant) + np.array([0.2, 0.0, 0.0])
    )
    assert np.abs(orbit_rate - exact).max() > 1e-3


@settings(max_examples=100, deadline=None)
@given(st.tuples(angles, angles, angles))
def test_the_frame_of_a_single_chief_has_the_bits_of_the_general_one(place):
    position, velocity = orbit(*place)
    fast, general = frames.chief_frame(position, velocity), frames.lvlh_frame(position, velocity)
    for field in ("radial", "along_track", "normal", "rate"):
        assert getattr(fast, field).tobytes() == getattr(general, field).tobytes()
    axes = frames.chief_axes(position, velocity)
    assert axes[0].tobytes() == general.radial.tobytes()
    assert axes[1].tobytes() == general.along_track.tobytes()
    assert axes[2].tobytes() == general.normal.tobytes()


def test_many_satellites_have_the_bits_of_one():
    generator = np.random.default_rng(3)
    frame = frames.lvlh_frame(*orbit(0.9, 0.2, 0.3))
    position, velocity = generator.normal(size=(2, 50, 3)) * np.array([7e6, 7e3])[:, None, None]
    stacked = frame.to_lvlh(position, velocity)
    for index in range(50):
        single = frame.to_lvlh(position[index], velocity[index])
        assert single[0].tobytes() == stacked[0][index].tobytes()
        assert single[1].tobytes() == stacked[1][index].tobytes()


def test_earth_rotation_angle_is_the_one_of_the_reference_data():
    assert frames.earth_rotation_angle(8765, 43200.0) == float(ROTATION["theta0_rad"])
    assert pytest.approx(float(ROTATION["omega_rad_s"]), rel=1e-15) == frames.EARTH_ROTATION_RATE


def test_earth_rotation_angle_just_before_the_millennium_is_between_zero_and_a_turn():
    turns = 0.7790572732640 - 1.00273781191135448
    assert frames.earth_rotation_angle(-1, 0.0) == pytest.approx(2 * math.pi * (turns + 1.0), abs=1e-12)


def test_closed_rotation_is_brahes_earth_rotation_about_its_own_axis():
    epoch = brahe_epoch(EPOCH)
    closed = frames.ClosedEarthRotation(float(ROTATION["theta0_rad"]))
    for time in (0.0, 3000.0, 86400.0):
        np.testing.assert_allclose(
            closed.matrix(time), np.asarray(brahe.earth_rotation(epoch + time)), rtol=0.0, atol=1e-9
        )
