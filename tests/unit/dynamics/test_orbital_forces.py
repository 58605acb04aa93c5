# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import math
from datetime import UTC, datetime
from pathlib import Path

import brahe
import numpy as np
import pytest

from satform.dynamics import orbital_forces
from satform.dynamics.atmosphere import HarrisPriester
from satform.orbits.chief import earth_angle_at
from satform.orbits.frames import ClosedEarthRotation

DATA = Path(__file__).parents[2] / "data"
FIXED = ClosedEarthRotation(0.0, 0.0)
BODY = orbital_forces.Body(
    mass=120.0, drag_area=2.0, drag_coefficient=2.3, radiation_area=3.0, reflectivity=1.4
)
EPOCH = orbital_forces.brahe_epoch(datetime(2024, 1, 1, tzinfo=UTC))


@pytest.fixture(autouse=True)
def brahes_own_earth_orientation():
    """UT1 = UTC for what brahe itself is asked for here, whatever another test has set."""
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())


@pytest.mark.parametrize(("degree", "column"), [(2, 3), (4, 6), (10, 9), (20, 12)])
def test_gravity_is_that_of_the_reference_points(degree, column):
    rows = np.loadtxt(DATA / "gravity_points.csv", delimiter=",", skiprows=2)
    assert len(rows) == 40
    found = orbital_forces.Gravity(degree, degree, FIXED).acceleration(
        0.0, np.ascontiguousarray(rows[:, :3]), rows, ()
    )
    expected = rows[:, column : column + 3]
    worst = np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert worst.max() < 1e-12


def test_degree_zero_is_a_point_mass():
    position = np.array([[7e6, 0.0, 0.0], [0.0, -4.2e7, 0.0]])
    pull = orbital_forces.Gravity(0, 0, FIXED).acceleration(0.0, position, position, ())
    expected = [[-3.986004415e14 / 49e12, 0.0, 0.0], [0.0, 3.986004415e14 / 4.2e7**2, 0.0]]
    np.testing.assert_allclose(pull, expected, rtol=1e-15)


def test_degree_two_order_zero_is_the_textbook_oblateness():
    position = np.array([[4.1e6, -3.2e6, 4.8e6]])
    x, y, z = position[0]
    r = math.sqrt(x * x + y * y + z * z)
    j2 = 0.484165143790815e-3 * math.sqrt(5.0)
    factor = -1.5 * j2 * 3.986004415e14 * 6378136.3**2 / r**5
    flattening = 5.0 * z * z / r**2
    expected = factor * np.array([x * (1 - flattening), y * (1 - flattening), z * (3 - flattening)])
    found = orbital_forces.Gravity(2, 0, FIXED).harmonics(0.0, position)[0]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=2e-15)


def test_gravity_turns_with_the_earth():
    quarter = ClosedEarthRotation(0.0, math.pi / 2.0)
    gravity = orbital_forces.Gravity(10, 10, quarter)
    start = np.array([[6.9e6, 1e6, 2e6]])
    turned = np.array([[-1e6, 6.9e6, 2e6]])
    before = gravity.acceleration(0.0, start, start, ())[0]
    after = gravity.acceleration(1.0, turned, turned, ())[0]
    np.testing.assert_allclose(after, [-before[1], before[0], before[2]], rtol=1e-12)


def test_a_gravity_field_of_more_order_than_degree_is_refused():
    with pytest.raises(ValueError, match="order"):
        orbital_forces.Gravity(4, 5, FIXED)


def test_sun_and_moon_pull_by_the_difference_to_the_earths_centre():
    position = np.array([[4.2e7, 3e6, -1e6]])
    found = orbital_forces.ThirdBodies(EPOCH, sun=True, moon=True).acceleration(
        3600.0, position, position, (BODY,)
    )[0]
    expected = np.zeros(3)
    for where, parameter in (
        (brahe.sun_position(EPOCH + 3600.0), 1.32712440041939400e20),
        (brahe.moon_position(EPOCH + 3600.0), 4.902800066e12),
    ):
        apart = where - position[0]
        expected += parameter * (apart / np.linalg.norm(apart) ** 3 - where / np.linalg.norm(where) ** 3)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-7 * np.linalg.norm(expected))


def test_drag_opposes_the_wind_of_an_atmosphere_that_turns_with_the_earth():
    position, velocity = np.array([[6.8e6, 0.0, 0.0]]), np.array([[0.0, 5e3, 5.5e3]])
    drag = orbital_forces.Drag(HarrisPriester(EPOCH, np.eye(3)), np.eye(3))
    found = drag.acceleration(0.0, position, velocity, (BODY,))[0]
    wind = velocity[0] - np.cross([0.0, 0.0, 7.292115e-5], position[0])
    density = brahe.density_harris_priester(position[0], brahe.sun_position(EPOCH))
    assert 1e-13 < density < 1e-10
    expected = -0.5 * density * 2.3 * 2.0 / 120.0 * np.linalg.norm(wind) * wind
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_sunlight_pushes_away_from_the_sun_and_not_at_all_in_the_earths_shadow():
    sun = brahe.sun_position(EPOCH)
    towards = sun / np.linalg.norm(sun)
    sunny, shaded = 7e6 * towards, -7e6 * towards
    push = orbital_forces.SolarPressure(EPOCH).acceleration(
        0.0, np.stack((sunny, shaded)), np.zeros((2, 3)), (BODY, BODY)
    )
    distance = np.linalg.norm(sun - sunny) / 1.495978707e11
    np.testing.assert_allclose(push[0], -4.56e-6 * 1.4 * 3.0 / 120.0 / distance**2 * towards, rtol=1e-6)
    assert push[1].tolist() == [0.0, 0.0, 0.0]


def test_each_satellite_has_the_same_force_alone_as_in_company():
    generator = np.random.default_rng(5)
    position = generator.normal(size=(20, 3))
    position *= 7e6 / np.linalg.norm(position, axis=1)[:, None]
    velocity = 5e3 * generator.normal(size=(20, 3))
    model = orbital_forces.ForceModel(
        (
            orbital_forces.Gravity(10, 10, ClosedEarthRotation(1.0)),
            orbital_forces.ThirdBodies(EPOCH, sun=True, moon=True),
            orbital_forces.Drag(HarrisPriester(EPOCH, np.eye(3)), np.eye(3)),
            orbital_forces.SolarPressure(EPOCH),
        )
    )
    stacked = model.acceleration(100.0, position, velocity, (BODY,) * 20)
    for row in range(20):
        one = slice(row, row + 1)
        assert (
            model.acceleration(100.0, position[one], velocity[one], (BODY,)).tobytes()
            == stacked[one].tobytes()
        )


def test_the_epochs_earth_angle_is_brahes():
    later = datetime(2026, 7, 4, 5, 6, 7, tzinfo=UTC)
    matrix = np.asarray(brahe.earth_rotation(orbital_forces.brahe_epoch(later)))
    expected = math.atan2(matrix[0, 1], matrix[0, 0]) % (2.0 * math.pi)
    assert earth_angle_at(later) == pytest.approx(expected, abs=1e-9)
