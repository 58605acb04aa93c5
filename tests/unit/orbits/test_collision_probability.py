# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Collision probability against closed forms, published cases and a quadrature by another rule."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad
from scipy.stats import ncx2

from satform.orbits.collision_probability import (
    collision_probability,
    disc_probability,
    encounter_plane,
)

PUBLISHED = (
    # Mean and standard deviations in the encounter plane, combined radius, probability. Chan 2008, cases 1
    # to 12, conjunction summary messages 1 to 3, conjunction data messages 1 and 2, and Alfano 2009, case 3,
    # with the values of Serra et al. 2016, as the tests of their method in Orekit have them.
    ((0.0, 10.0), (25.0, 50.0), 5.0, 9.742e-3),
    ((10.0, 0.0), (25.0, 50.0), 5.0, 9.181e-3),
    ((0.0, 10.0), (25.0, 75.0), 5.0, 6.571e-3),
    ((10.0, 0.0), (25.0, 75.0), 5.0, 6.125e-3),
    ((0.0, 1000.0), (1000.0, 3000.0), 10.0, 1.577e-5),
    ((1000.0, 0.0), (1000.0, 3000.0), 10.0, 1.011e-5),
    ((0.0, 10000.0), (1000.0, 3000.0), 10.0, 6.443e-8),
    ((10000.0, 0.0), (1000.0, 3000.0), 10.0, 3.219e-27),
    ((0.0, 10000.0), (1000.0, 10000.0), 10.0, 3.033e-6),
    ((10000.0, 0.0), (1000.0, 10000.0), 10.0, 9.656e-28),
    ((0.0, 5000.0), (1000.0, 3000.0), 50.0, 1.039e-4),
    ((5000.0, 0.0), (1000.0, 3000.0), 50.0, 1.564e-9),
    ((84.875546, 60.583685), (57.918666, 152.8814468), 10.3, 1.9002e-3),
    ((-81.618369, 115.055899), (15.988242, 5756.840725), 1.3, 2.0553e-11),
    ((102.177247, 693.405893), (94.230921, 643.409272), 5.3, 7.2003e-5),
    ((-752.672701, 644.939441), (445.859950, 6095.858688), 3.5, 5.3904e-7),
    ((-692.362272, 4475.456261), (193.454603, 562.027293), 13.2, 2.2796e-20),
    ((-3.8872073, 0.1591646), (1.4101830, 114.2585190), 15.0, 1.0038e-1),
    # Alfano 2009, case 5: a hundredth of the radius wide, its coordinates are printed to too few digits.
    ((-1.2217895, 2.1230067), (0.0373279, 177.8109003), 10.0, 4.4509e-2),
)

ENCOUNTERS = (
    # The encounters that the unit tests of NASA's CARA Analysis Tools give for their circle of integration
    # (PcCircle and Pc2D_Foster): states in km and km/s, covariances in km^2, and a combined radius of 20 m.
    (
        (378.39559, 4305.721887, 5752.767554, 2.360800244, 5.580331936, -4.322349039),
        (
            (44.5757544811362, 81.6751751052616, -67.8687662707124),
            (81.6751751052616, 158.453402956163, -128.616921644857),
            (-67.8687662707124, -128.616921644858, 105.490542562701),
        ),
        (374.5180598, 4307.560983, 5751.130418, -5.388125081, -3.946827739, 3.322820358),
        (
            (2.31067077720423, 1.69905293875632, -1.4170164577661),
            (1.69905293875632, 1.24957388457206, -1.04174164279599),
            (-1.4170164577661, -1.04174164279599, 0.869260558223714),
        ),
        2.706023476569787e-05,
    ),
    (
        (
            -3239.128337196251,
            2404.575152356222,
            5703.228541709001,
            -3.745768373154199,
            5.012339015927846,
            -4.231864565717194,
        ),
        (
            (0.342072996423899e-3, -0.412677096778269e-3, 0.371500417511149e-3),
            (-0.412677096778269e-3, 0.609905946319294e-3, -0.540401385544286e-3),
            (0.371500417511149e-3, -0.540401385544286e-3, 0.521238634755377e-3),
        ),
        (
            -3239.138264917246,
            2404.568320465936,
            5703.235605231182,
            6.110192790100711,
            -1.767321407894830,
            4.140369261741708,
        ),
        (
            (0.028351300975134, -0.008204103437377, 0.019253747960155),
            (-0.008204103437377, 0.002404377774847, -0.005586512197914),
            (0.019253747960155, -0.005586512197914, 0.013289250260317),
        ),
        1.807363058494765e-01,
    ),
)

lengths = st.floats(1e-3, 1e3)
angles = st.floats(0.0, 2.0 * math.pi)


@pytest.mark.parametrize(("centre", "deviations", "radius", "printed"), PUBLISHED)
def test_published_cases_in_the_encounter_plane(centre, deviations, radius, printed):
    # Four digits are printed of most.
    assert disc_probability(centre, deviations, radius) == pytest.approx(printed, rel=3e-4)


@pytest.mark.parametrize(("one", "of_one", "other", "of_other", "expected"), ENCOUNTERS)
def test_published_encounters_in_space(one, of_one, other, of_other, expected):
    relative = np.array(one) - np.array(other)
    axes, miss = encounter_plane(relative[:3], relative[3:])
    # That program takes the distance for the distance within the plane.
    position = axes[0] * np.linalg.norm(relative[:3])
    covariance = np.array(of_one) + np.array(of_other)
    found = collision_probability(position, relative[3:], covariance, 0.02)
    assert found == pytest.approx(expected, rel=1e-11)
    assert miss <= np.linalg.norm(relative[:3])
    assert collision_probability(relative[:3], relative[3:], covariance, 0.02) >= found


@settings(deadline=None, max_examples=60)
@given(lengths, lengths)
def test_zero_mean_and_one_deviation_give_the_closed_form(deviation, radius):
    expected = -math.expm1(-0.5 * (radius / deviation) ** 2)
    found = disc_probability((0.0, 0.0), (deviation, deviation), radius)
    assert found == pytest.approx(expected, rel=1e-10)


@settings(deadline=None, max_examples=50)
@given(lengths, st.floats(1e-3, 50.0), st.floats(0.0, 50.0), angles)
def test_one_deviation_gives_the_noncentral_chi_square_distribution(deviation, radius, apart, angle):
    expected = ncx2.cdf(radius * radius, 2, apart * apart)
    centre = (deviation * apart * math.cos(angle), deviation * apart * math.sin(angle))
    found = disc_probability(centre, (deviation, deviation), deviation * radius)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-13)


def test_a_wide_disc_whose_edge_goes_through_the_mean_holds_nearly_half():
    # The edge bends away from its tangent: first order in the deviation over the radius.
    for angle in (0.0, 0.3, 0.25 * math.pi):
        centre = (math.cos(angle), math.sin(angle))
        found = disc_probability(centre, (1e-5, 1e-5), 1.0)
        assert 0.5 - found == pytest.approx(0.5e-5 / math.sqrt(math.tau), rel=1e-4)


@settings(deadline=None, max_examples=15)
@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.3, 3.0), st.floats(0.3, 3.0))
def test_quadrature_of_the_density_in_polar_coordinates(x, y, one, other):
    def density(radius: float, angle: float) -> float:
        first, second = (radius * math.cos(angle) - x) / one, (radius * math.sin(angle) - y) / other
        return radius * math.exp(-0.5 * (first * first + second * second)) / (math.tau * one * other)

    expected, _ = dblquad(density, 0.0, math.tau, 0.0, 1.5, epsabs=0.0, epsrel=1e-9)
    assert disc_probability((x, y), (one, other), 1.5) == pytest.approx(expected, rel=1e-8)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_axes_and_motion_along_the_velocity_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3, 3))
    covariance, separation, velocity = root @ root.T + 0.1 * np.eye(3), *rng.standard_normal((2, 3))
    expected = collision_probability(separation, velocity, covariance, 0.5)
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    turned = collision_probability(turn @ separation, turn @ velocity, turn @ covariance @ turn.T, 0.5)
    later = collision_probability(separation + 0.7 * velocity, velocity, covariance, 0.5)
    assert (turned, later) == pytest.approx((expected, expected), rel=1e-9)
    assert 0.0 < expected < 1.0


def test_covariance_along_the_velocity_does_not_matter():
    velocity, separation = np.array([0.0, 2.0, 0.0]), np.array([3.0, 0.0, 4.0])
    covariance = np.diag([1.0, 1e9, 4.0])
    assert collision_probability(separation, velocity, covariance, 2.0) == pytest.approx(
        disc_probability((3.0, 4.0), (1.0, 2.0), 2.0), rel=1e-12
    )


def test_without_separation_the_plane_may_have_any_axes():
    found = collision_probability(np.zeros(3), np.array([1.0, 2.0, -1.0]), 9.0 * np.eye(3), 2.0)
    assert found == pytest.approx(-math.expm1(-0.5 * (2.0 / 3.0) ** 2), rel=1e-12)


def test_without_relative_motion_there_is_no_encounter():
    assert math.isnan(collision_probability(np.ones(3), np.zeros(3), np.eye(3), 1.0))


@pytest.mark.parametrize("covariance", [np.zeros((3, 3)), np.diag([1.0, 1.0, -1.0]), np.full((3, 3), np.nan)])
def test_what_is_no_covariance_gives_no_probability(covariance):
    assert math.isnan(collision_probability(np.ones(3), np.array([0.0, 1.0, 0.0]), covariance, 1.0))


def test_bodies_without_size_do_not_collide():
    assert disc_probability((0.0, 0.0), (1.0, 1.0), 0.0) == 0.0
