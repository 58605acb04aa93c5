# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Osculating orbits, relative elements and dates against brahe and closed forms."""

import math
from datetime import UTC, datetime, timedelta, timezone

import brahe
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from satform.dynamics.orbital_forces import gravitational_parameter
from satform.orbits.chief import KeplerianChief
from satform.orbits.earth import GRAVITATIONAL_PARAMETER_EGM2008 as GRAVITY
from satform.orbits.inertial_motion import relative_elements
from satform.orbits.j2_elements import as_array
from satform.orbits.mean_elements import mean_chief
from satform.orbits.osculating import OrbitalState, deputy_elements, osculating_relative_elements
from satform.orbits.time_scales import brahe_epoch, utc_datetime, utc_of

RADIANS = brahe.AngleFormat.RADIANS
ANGLE = st.floats(-3.1, 3.1)
ORBIT = st.tuples(
    st.floats(6.6e6, 4.3e7), st.floats(0.0, 0.9), st.floats(0.0, math.pi), ANGLE, ANGLE, ANGLE
).map(np.array)
OFFSET = st.floats(-1e-4, 1e-4)
RELATIVE = st.tuples(OFFSET, OFFSET, OFFSET, OFFSET, OFFSET, OFFSET).map(np.array)
MIDNIGHT = datetime(2024, 1, 1)  # noqa: DTZ001  a date of any time scale
FORMATION = (np.array([7.0e6, 1e-3, 1.7, 0.5, 0.4, 0.2]), np.array([0.0, 1e-5, 3e-5, 2e-5, -1e-5, 4e-5]))


def test_all_take_one_gravitational_parameter():
    assert gravitational_parameter() == GRAVITY == brahe.GM_EARTH


@given(ORBIT)
def test_a_state_is_kept_by_its_elements(elements):
    state = OrbitalState.from_elements(elements)
    again = OrbitalState.from_elements(state.elements())
    speed, radius = np.linalg.norm(state.velocity), np.linalg.norm(state.position)
    assert np.allclose(again.position, state.position, rtol=0.0, atol=1e-9 * radius)
    assert np.allclose(again.velocity, state.velocity, rtol=0.0, atol=1e-9 * speed)


@given(ORBIT)
def test_the_chiefs_orbit_starts_in_the_state_it_was_made_of(elements):
    state = OrbitalState.from_elements(elements)
    orbit, semi_major_axis = state.orbit()
    position, velocity = orbit.state(math.sqrt(GRAVITY / semi_major_axis**3), GRAVITY)
    assert np.allclose(position, state.position, rtol=0.0, atol=1e-9 * np.linalg.norm(state.position))
    assert np.allclose(velocity, state.velocity, rtol=0.0, atol=1e-9 * np.linalg.norm(state.velocity))


@pytest.mark.parametrize("eccentricity", [0.0, 1e-9, 1e-3, 0.95])
@pytest.mark.parametrize("inclination", [0.0, 1e-9, math.pi / 2.0, math.pi])
def test_circular_and_equatorial_orbits_keep_their_state(eccentricity, inclination):
    state = OrbitalState.from_elements(np.array([7e6, eccentricity, inclination, 0.4, 0.3, 0.2]))
    again = OrbitalState.from_elements(state.elements())
    assert np.allclose(again.position, state.position, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("eccentricity", [0.98, 0.9999, 1.0 - 1e-9])
@pytest.mark.parametrize("anomaly", [-3.0, -1e-12, 0.0, 1e-12, 1e-5, 0.03, 1.0, 40.0])
def test_very_eccentric_orbits_have_a_state(eccentricity, anomaly):
    state = OrbitalState.from_elements(np.array([1e9, eccentricity, 1.1, 0.4, 0.3, anomaly]))
    radius = np.linalg.norm(state.position)
    energy = 0.5 * state.velocity @ state.velocity - GRAVITY / radius
    assert energy == pytest.approx(-0.5 * GRAVITY / 1e9, abs=2e-15 * GRAVITY / radius)
    momentum = np.linalg.norm(np.cross(state.position, state.velocity))
    expected = math.sqrt(GRAVITY * 1e9 * (1.0 - eccentricity) * (1.0 + eccentricity))
    assert momentum == pytest.approx(expected, abs=2e-15 * radius * np.linalg.norm(state.velocity))


def test_elements_are_those_of_brahe_where_brahe_keeps_its_digits():
    elements = np.array([7.4e6, 0.2, 1.1, 0.5, 0.4, 0.3])
    state = OrbitalState.from_elements(elements)
    found = brahe.state_eci_to_koe(np.concatenate((state.position, state.velocity)), RADIANS)
    assert np.allclose(state.elements(), found, rtol=1e-12)
    assert np.allclose(state.elements(), elements, rtol=1e-12)


@pytest.mark.parametrize("speed", [12_000.0, 0.0])
def test_what_is_no_ellipse_is_named(speed):
    state = OrbitalState(np.array([7e6, 0.0, 0.0]), np.array([0.0, speed, 0.0]))
    with pytest.raises(ValueError, match="makes no ellipse"):
        state.orbit()


@given(ORBIT.filter(lambda chief: 1e-2 < chief[2] < 3.1 and chief[1] < 0.8), RELATIVE)
def test_relative_elements_come_back(chief, relative):
    both = (chief, deputy_elements(chief, relative))
    found = relative_elements(*(OrbitalState.from_elements(one).as_array() for one in both)) / chief[0]
    assert np.allclose(found, relative, rtol=0.0, atol=1e-9)


def test_a_satellite_at_the_chief_has_no_mean_elements_either():
    chief, _ = FORMATION
    assert np.allclose(osculating_relative_elements(chief, np.zeros(6)), 0.0, atol=1e-14)


def test_mean_and_osculating_elements_differ_by_j2():
    chief, mean = FORMATION
    apart = chief[0] * (osculating_relative_elements(chief, mean) - mean)
    # Below 1.5 J2 (R/a)^2 times a hundred metres of separation for each element, and not nothing.
    assert 0.05 < np.abs(apart).max() < 5.0


@pytest.mark.parametrize("eccentricity", [1e-3, 0.1, 0.6])
def test_mean_relative_elements_come_back_at_every_anomaly_of_the_chief(eccentricity):
    axis, mean = 7.0e6 / (1.0 - eccentricity), FORMATION[1]
    for anomaly in np.linspace(-6.0, 6.0, 25):
        chief = np.array([axis, eccentricity, 1.7, 0.5, 0.4, anomaly])
        deputy = deputy_elements(chief, osculating_relative_elements(chief, mean))
        found = [as_array(mean_chief(KeplerianChief(*elements.tolist()))) for elements in (chief, deputy)]
        states = [OrbitalState.from_elements(elements).as_array() for elements in found]
        assert np.allclose(relative_elements(*states) / axis, mean, rtol=0.0, atol=1e-7), anomaly


def test_an_equatorial_chief_has_no_relative_inclination():
    with pytest.raises(ValueError, match="lies in the equator"):
        deputy_elements(np.array([7e6, 0.0, 0.0, 0.0, 0.0, 0.0]), np.full(6, 1e-5))


def test_elements_of_no_ellipse_are_named():
    with pytest.raises(ValueError, match="no ellipse has these relative elements"):
        deputy_elements(FORMATION[0], np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize(("scale", "ahead"), [("UTC", 0.0), ("TAI", 37.0), ("TT", 69.184), ("GPS", 18.0)])
def test_time_scales_are_their_known_seconds_apart(scale, ahead):
    # 37 leap seconds from 2017, TT = TAI + 32.184 s, GPS = TAI - 19 s (IERS Bulletin C).
    found = utc_of(MIDNIGHT + timedelta(minutes=2), scale)
    assert found == (MIDNIGHT + timedelta(minutes=2)).replace(tzinfo=UTC) - timedelta(seconds=ahead)


def test_a_date_with_a_zone_is_in_utc():
    zone = timezone(timedelta(hours=2))
    assert utc_of(datetime(2024, 1, 1, 2, tzinfo=zone), "UTC") == datetime(2024, 1, 1, tzinfo=UTC)
    with pytest.raises(ValueError, match="has a time zone, and TAI knows none"):
        utc_of(datetime(2024, 1, 1, 2, tzinfo=zone), "TAI")


@given(st.datetimes(MIDNIGHT.replace(year=1975), MIDNIGHT.replace(year=2060)))
def test_a_date_comes_back_from_brahe(date):
    assert utc_datetime(brahe_epoch(date)) == date.replace(tzinfo=UTC)


def test_a_date_before_the_year_1_in_utc_is_named():
    epoch = brahe_epoch(datetime(1, 1, 1, tzinfo=UTC)) - 60.0
    with pytest.raises(ValueError, match="lies in the year 0; years go from 1 to 9999"):
        utc_datetime(epoch)


def test_a_leap_second_is_no_time_zero():
    # The leap second of 2016-12-31 began at 36 s of TAI after midnight of UTC.
    with pytest.raises(ValueError, match="leap second"):
        utc_of(MIDNIGHT.replace(year=2017) + timedelta(seconds=36.5), "TAI")
