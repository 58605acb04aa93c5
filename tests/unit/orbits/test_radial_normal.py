# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Least distance in the radial/normal plane against its closed form and against the motion itself."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from satform.orbits.radial_normal import distance_to_ellipse, least_radial_normal_distance

numbers = st.floats(-1e3, 1e3)
vectors = st.tuples(numbers, numbers).map(np.array)
ANGLES = np.linspace(0.0, math.tau, 20001)


def elements(height, eccentricity, inclination):
    return np.array([height, 123.0, *eccentricity, *inclination])


def by_samples(height, eccentricity, inclination):
    """Least and largest distance by the near-circular map from elements to motion."""
    cosine, sine = np.cos(ANGLES), np.sin(ANGLES)
    radial = height - eccentricity[0] * cosine - eccentricity[1] * sine
    normal = inclination[0] * sine - inclination[1] * cosine
    distance = np.hypot(radial, normal)
    return distance.min(), distance.max()


@settings(deadline=None)
@given(vectors, vectors)
def test_without_offset_it_is_the_closed_form_of_the_separated_vectors(eccentricity, inclination):
    found = float(least_radial_normal_distance(elements(0.0, eccentricity, inclination)))
    summed = np.linalg.norm(eccentricity + inclination) * np.linalg.norm(eccentricity - inclination)
    squares = eccentricity @ eccentricity + inclination @ inclination
    root = math.sqrt(squares + summed)
    expected = math.sqrt(2.0) * abs(eccentricity @ inclination) / root if root > 0.0 else 0.0
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_parallel_vectors_keep_the_smaller_of_both_and_perpendicular_ones_nothing():
    parallel = elements(0.0, (0.0, 300.0), (0.0, -500.0))
    perpendicular = elements(0.0, (0.0, 300.0), (500.0, 0.0))
    assert least_radial_normal_distance(parallel) == pytest.approx(300.0)
    assert least_radial_normal_distance(perpendicular) == 0.0


@settings(deadline=None, max_examples=60)
@given(numbers, vectors, vectors)
def test_with_an_offset_it_is_the_least_of_the_motion(height, eccentricity, inclination):
    found = float(least_radial_normal_distance(elements(height, eccentricity, inclination)))
    least, largest = by_samples(height, eccentricity, inclination)
    assert found <= least + 1e-9 * largest
    # Between two samples the distance changes by less than half of the way flown.
    assert found >= least - 0.5 * largest * (ANGLES[1] - ANGLES[0]) - 1e-9 * largest


def test_a_satellite_at_rest_above_the_other_stays_there():
    assert least_radial_normal_distance(elements(-40.0, (0.0, 0.0), (0.0, 0.0))) == 40.0


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ((5.0, 0.0), 3.0),
        ((0.0, 5.0), 4.0),
        ((0.0, 0.0), 1.0),
        # From within, beyond the focus of curvature: the nearest point is beside the axis.
        ((0.6, 0.0), math.sqrt(0.2**2 + 0.84)),
        ((2.0, 0.0), 0.0),
    ],
)
def test_distance_to_an_ellipse_of_half_axes_two_and_one(point, distance):
    found = distance_to_ellipse(*(np.asarray(own) for own in (*point, 2.0, 1.0)))
    assert float(found) == pytest.approx(distance, abs=1e-12)


def test_many_at_once_have_the_bits_of_each():
    many = np.random.default_rng(3).standard_normal((5, 7, 6))
    each = [[float(least_radial_normal_distance(many[i, j])) for j in range(7)] for i in range(5)]
    assert least_radial_normal_distance(many).tolist() == each
