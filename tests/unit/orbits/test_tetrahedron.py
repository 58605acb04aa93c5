# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Quality factors of tetrahedra against closed forms, scipy's hull and the circumscribed sphere."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from satform.orbits import tetrahedron

REGULAR = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
LINE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.5, 0.0, 0.0], [4.0, 0.0, 0.0]])
CORNER = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def factors(positions):
    return tuple(float(quality(positions)) for quality in tetrahedron.QUALITIES.values())


def test_regular_tetrahedron_by_its_side():
    side = 2.0 * math.sqrt(2.0)
    assert tetrahedron.mean_side(REGULAR) == pytest.approx(side)
    assert tetrahedron.volume(REGULAR) == pytest.approx(side**3 / (6.0 * math.sqrt(2.0)))
    assert tetrahedron.surface(REGULAR) == pytest.approx(math.sqrt(3.0) * side**2)


def test_special_values_of_the_quality_factors():
    # Daly 1994, Table 1: 3 for a regular tetrahedron, 1 on a line; Robert and Roux's factor is 1 and 0.
    assert factors(REGULAR) == pytest.approx((3.0, 1.0, 1.0))
    assert factors(LINE) == pytest.approx((1.0, 0.0, 0.0))


def test_square_by_hand():
    mean = (4.0 + 2.0 * math.sqrt(2.0)) / 6.0
    assert factors(SQUARE) == pytest.approx((1.0 + 2.0 / (math.sqrt(3.0) * mean**2), 0.0, 0.0))


def test_corner_of_a_cube_by_hand():
    mean = (3.0 + 3.0 * math.sqrt(2.0)) / 6.0
    ratio = (1.0 / 6.0) / (mean**3 / (6.0 * math.sqrt(2.0)))
    surface = (1.5 + math.sqrt(3.0) / 2.0) / (math.sqrt(3.0) * mean**2)
    sphere = 4.0 / 3.0 * math.pi * (math.sqrt(3.0) / 2.0) ** 3
    robert = (9.0 * math.pi / (2.0 * math.sqrt(3.0)) * (1.0 / 6.0) / sphere) ** (1.0 / 3.0)
    assert factors(CORNER) == pytest.approx((ratio + surface + 1.0, robert, ratio))


def test_size_factor_by_its_polynomials():
    # Fuselier et al. 2016, for tetrahedra of 10 km: sides of 4, 6, 18 and 24 km.
    first, second, third, fourth = sides = (4e3, 6e3, 18e3, 24e3)
    regular = REGULAR / (2.0 * math.sqrt(2.0))
    expected = {
        3e3: 0.0,
        first: 0.0,
        4.7e3: (4.7e3 - first) ** 2 * (4.7e3 + first - 2.0 * second) ** 2 / (second - first) ** 4,
        second: 1.0,
        10e3: 1.0,
        third: 1.0,
        19e3: (19e3 - fourth) ** 2 * (19e3 - 2.0 * third + fourth) ** 2 / (fourth - third) ** 4,
        fourth: 0.0,
        30e3: 0.0,
    }
    found = [float(tetrahedron.size_factor(side * regular, sides)) for side in expected]
    assert found == pytest.approx(list(expected.values()), abs=1e-12)


def test_all_at_one_place_have_no_shape():
    glassmeier, robert_roux, volume = factors(np.ones((4, 3)))
    assert math.isnan(glassmeier)
    assert robert_roux == 0.0
    assert math.isnan(volume)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1), st.floats(1e-2, 1e5))
def test_factors_lie_in_their_ranges_and_do_not_depend_on_size_axes_and_names(seed, scale):
    rng = np.random.default_rng(seed)
    positions = rng.standard_normal((4, 3))
    found = factors(positions)
    assert 1.0 <= found[0] <= 3.0 + 1e-12
    assert 0.0 <= found[1] <= 1.0 + 1e-12
    assert 0.0 <= found[2] <= 1.0 + 1e-12
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    moved = scale * (positions[rng.permutation(4)] @ turn.T + rng.standard_normal(3))
    assert factors(moved) == pytest.approx(found, rel=1e-6, abs=1e-9)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_volume_surface_and_sphere_by_other_programs(seed):
    positions = np.random.default_rng(seed).standard_normal((4, 3))
    hull = ConvexHull(positions)
    assert tetrahedron.volume(positions) == pytest.approx(hull.volume, rel=1e-9)
    assert tetrahedron.surface(positions) == pytest.approx(hull.area, rel=1e-9)
    # The centre of the sphere is as far from each corner: three linear equations.
    sides = positions[1:] - positions[0]
    centre = np.linalg.solve(2.0 * sides, (sides * sides).sum(axis=1))
    sphere = 4.0 / 3.0 * math.pi * np.linalg.norm(centre) ** 3
    expected = (9.0 * math.pi / (2.0 * math.sqrt(3.0)) * hull.volume / sphere) ** (1.0 / 3.0)
    assert tetrahedron.robert_roux_quality(positions) == pytest.approx(expected, rel=1e-7)


def test_many_tetrahedra_at_once_have_the_bits_of_each():
    positions = np.random.default_rng(3).standard_normal((5, 7, 4, 3))
    for quality in tetrahedron.QUALITIES.values():
        each = [[float(quality(positions[i, j])) for j in range(7)] for i in range(5)]
        assert quality(positions).tolist() == each
