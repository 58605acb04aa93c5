# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Accuracy of the Sun's direction, against the low-accuracy series of Meeus's Astronomical Algorithms."""

import math
from datetime import UTC, datetime

import numpy as np
import pytest

from satform.orbits.sun import days_at, sun_direction

TERRESTRIAL = 66.0 / 86400.0
"""Terrestrial time less UTC, days, to 3 s for 2000 to 2035, in which the Sun moves 0.002 arc minutes."""


def true_longitude(centuries: float) -> float:
    """Of the Sun, geometric, from the mean equinox of date, deg (Meeus, 2nd ed., chapter 25)."""
    t = centuries
    mean = 280.46646 + 36000.76983 * t + 0.0003032 * t * t
    anomaly = math.radians(357.52911 + 35999.05029 * t - 0.0001537 * t * t)
    centre = (1.914602 - 0.004817 * t - 0.000014 * t * t) * math.sin(anomaly)
    centre += (0.019993 - 0.000101 * t) * math.sin(2.0 * anomaly) + 0.000289 * math.sin(3.0 * anomaly)
    return mean + centre


def turned(axis: int, angle: float) -> np.ndarray:
    """Matrix of components in axes that are turned by an angle in rad about one of them."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[first, first] = matrix[second, second] = math.cos(angle)
    matrix[first, second], matrix[second, first] = math.sin(angle), -math.sin(angle)
    return matrix


def almanac_sun(days: float) -> np.ndarray:
    """Unit vector to the Sun in the mean equator and equinox of J2000, by the precession of Lieske (1977)."""
    t = (days + TERRESTRIAL) / 36525.0
    longitude, obliquity = math.radians(true_longitude(t)), math.radians(23.4392911 - 0.0130042 * t)
    of_date = turned(0, -obliquity) @ [math.cos(longitude), math.sin(longitude), 0.0]
    zeta, z, theta = (
        math.radians(seconds / 3600.0)
        for seconds in (
            2306.2181 * t + 0.30188 * t * t,
            2306.2181 * t + 1.09468 * t * t,
            2004.3109 * t - 0.42665 * t * t,
        )
    )
    return (turned(2, -z) @ turned(1, theta) @ turned(2, -zeta)).T @ of_date


def between(first: np.ndarray, second: np.ndarray) -> float:
    """Angle between two unit vectors, arc minutes."""
    sine, cosine = float(np.linalg.norm(np.cross(first, second))), float(first @ second)
    return 60.0 * math.degrees(math.atan2(sine, cosine))


def test_the_series_of_the_almanac_has_the_longitude_of_the_books_example() -> None:
    # Example 25.a: 1992 October 13, 0 h TD.
    assert true_longitude(-0.072183436) % 360.0 == pytest.approx(199.90987, abs=1e-5)


def test_the_sun_lags_by_a_fifth_of_an_arc_minute_for_each_year_since_2000() -> None:
    for days in np.arange(0.0, 36.0 * 365.25, 97.0).tolist():
        years = days / 365.25
        lag = between(sun_direction(days), almanac_sun(days))
        assert 0.19 * years - 0.25 < lag < 0.2 * years + 0.25, days
        # The simulated Sun comes to the same place later; the Sun moves by 59.1 arc minutes a day on average.
        assert between(sun_direction(days + lag / 59.1), almanac_sun(days)) < 0.5


def test_the_line_to_the_sun_of_proba_3_is_a_fifth_of_a_metre_beside_the_true_one() -> None:
    days = days_at(datetime(2025, 3, 21, tzinfo=UTC))
    shift = 150.0 * math.radians(between(sun_direction(days), almanac_sun(days)) / 60.0)
    assert shift == pytest.approx(0.21, abs=0.005)
