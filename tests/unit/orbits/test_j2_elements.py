# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import math

import brahe
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from satform.orbits.chief import KeplerianChief
from satform.orbits.j2_elements import as_array, drifted, element_transition, secular_rates

RADIANS = brahe.AngleFormat.RADIANS
PROBE = 1e-6

angles = st.floats(-math.pi, math.pi)


@st.composite
def chiefs(draw: st.DrawFn) -> KeplerianChief:
    """Chiefs above the Earth, clear of the equator's plane."""
    e = draw(st.floats(1e-3, 0.85))
    perigee = draw(st.floats(6.7e6, 4e7))
    inclination = draw(st.floats(0.1, math.pi - 0.1))
    return KeplerianChief(perigee / (1.0 - e), e, inclination, draw(angles), draw(angles), draw(angles))


def satellite_at(chief: KeplerianChief, elements: np.ndarray) -> KeplerianChief:
    """Orbit with relative elements to the chief, by their definition, with angles near the chief's."""
    da, dlongitude, dex, dey, dix, diy = elements.tolist()
    w = chief.argument_of_perigee
    ex, ey = chief.eccentricity * math.cos(w) + dex, chief.eccentricity * math.sin(w) + dey
    node = diy / math.sin(chief.inclination)
    perigee = w + math.remainder(math.atan2(ey, ex) - w, math.tau)
    return KeplerianChief(
        semi_major_axis=chief.semi_major_axis * (1.0 + da),
        eccentricity=math.hypot(ex, ey),
        inclination=chief.inclination + dix,
        right_ascension=chief.right_ascension + node,
        argument_of_perigee=perigee,
        mean_anomaly=w + chief.mean_anomaly + dlongitude - node * math.cos(chief.inclination) - perigee,
    )


def elements_of(chief: KeplerianChief, satellite: KeplerianChief) -> np.ndarray:
    """Relative elements by their definition: D'Amico 2010."""
    node = satellite.right_ascension - chief.right_ascension
    vectors = [
        one.eccentricity * np.array([math.cos(one.argument_of_perigee), math.sin(one.argument_of_perigee)])
        for one in (satellite, chief)
    ]
    arguments = [one.argument_of_perigee + one.mean_anomaly for one in (satellite, chief)]
    longitude = arguments[0] - arguments[1]
    return np.array(
        [
            satellite.semi_major_axis / chief.semi_major_axis - 1.0,
            longitude + node * math.cos(chief.inclination),
            *(vectors[0] - vectors[1]),
            satellite.inclination - chief.inclination,
            node * math.sin(chief.inclination),
        ]
    )


def after(chief: KeplerianChief, elements: np.ndarray, duration: float) -> np.ndarray:
    """Relative elements of a satellite whose orbit drifts as the chief's does, each by its own elements."""
    return elements_of(drifted(chief, duration), drifted(satellite_at(chief, elements), duration))


def test_the_elements_of_these_tests_are_those_of_brahe() -> None:
    chief = KeplerianChief(1.4e7, 0.4, 1.0, 0.3, 0.4, 0.5)
    elements = np.array([1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3])
    found = brahe.state_oe_to_roe(as_array(chief), as_array(satellite_at(chief, elements)), RADIANS)
    np.testing.assert_allclose(found, elements, rtol=0.0, atol=1e-14)


@settings(max_examples=60, deadline=None)
@given(chiefs(), st.floats(-20.0, 20.0))
def test_the_transition_is_the_slope_of_the_drift(chief: KeplerianChief, orbits: float) -> None:
    duration = orbits * chief.period
    slopes = [
        (after(chief, PROBE * unit, duration) - after(chief, -PROBE * unit, duration)) / (2.0 * PROBE)
        for unit in np.eye(6)
    ]
    expected = np.stack(slopes, axis=-1)
    found = element_transition(chief, duration)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.max(np.abs(found)))


@settings(max_examples=40, deadline=None)
@given(chiefs(), st.floats(0.0, 30.0), st.floats(0.0, 30.0))
def test_two_transitions_in_turn_are_one(chief: KeplerianChief, first: float, second: float) -> None:
    first, second = first * chief.period, second * chief.period
    whole = element_transition(chief, first + second)
    in_turn = element_transition(drifted(chief, first), second) @ element_transition(chief, first)
    np.testing.assert_allclose(in_turn, whole, rtol=0.0, atol=1e-11 * np.max(np.abs(whole)))


def test_a_sun_synchronous_orbit_turns_once_a_year() -> None:
    """Vallado, Fundamentals of Astrodynamics and Applications: 98.6 deg at 800 km, circular."""
    rates = secular_rates(KeplerianChief(7178137.0, 0.0, math.radians(98.603), 0.0, 0.0, 0.0))
    assert rates.right_ascension == pytest.approx(math.tau / (365.2422 * 86400.0), rel=2e-4)


def test_the_perigee_stands_still_at_the_critical_inclination() -> None:
    """Molniya: 5 cos^2 i = 1."""
    critical = KeplerianChief(26.56e6, 0.74, math.acos(math.sqrt(0.2)), 0.0, 4.7, 0.0)
    assert secular_rates(critical).argument_of_perigee == pytest.approx(0.0, abs=1e-20)


def test_without_duration_nothing_changes() -> None:
    chief = KeplerianChief(2e7, 0.6, 1.0, 0.1, 0.2, 0.3)
    np.testing.assert_array_equal(element_transition(chief, 0.0), np.eye(6))
