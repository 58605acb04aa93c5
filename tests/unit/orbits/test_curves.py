# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Closed orbits against quadrature, published perimeters, finite differences and brute force."""

import numpy as np
import pytest
from pydantic import ValidationError

from satform.numeric.stacking import stack
from satform.orbits.curve_specs import CircleSpec, EllipseSpec, FixedPointSpec
from satform.orbits.ellipse import ellipse

AXES = [(1.0, 1.0), (1.0, 1.0 + 1e-9), (2.0, 1.0), (1.0, 2.0), (10.0, 1.0), (1.0, 100.0), (100.0, 1.0)]


def tilted(first, second, seed=3):
    """An ellipse of the given semi-axes in a random plane."""
    generator = np.random.default_rng(seed)
    directions = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    return ellipse(generator.normal(size=3), first * directions[0], second * directions[1])


def arc_by_quadrature(first, second, angle):
    """Gauss-Legendre on panels that shrink towards the ends of the longer axis."""
    nodes, weights = np.polynomial.legendre.leggauss(30)
    apex = 0.0 if first >= second else 0.5 * np.pi
    graded = np.concatenate(([0.0], np.geomspace(1e-4, 0.5 * np.pi, 40)))
    ends = np.concatenate([apex + k * np.pi + sign * graded for k in range(-3, 4) for sign in (-1, 1)])
    edges = np.unique(np.concatenate(([0.0, angle], ends[(ends > 0.0) & (ends < angle)])))
    half, middle = 0.5 * np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    theta = middle[:, None] + half[:, None] * nodes
    return float((half[:, None] * weights * np.hypot(first * np.sin(theta), second * np.cos(theta))).sum())


@pytest.mark.parametrize(
    ("semi_axes", "perimeter"),
    [((200e3, 100e3), 968844.8221), ((100e3, 50e3), 484422.4110), ((75e3, 37.5e3), 363316.8083)],
)
def test_perimeters_of_the_case_study_orbits(semi_axes, perimeter):
    curve = EllipseSpec(semi_axes=semi_axes, normal=(0, 0, -1), direction=(0, 1, 0)).build()
    assert curve.perimeter == pytest.approx(perimeter, abs=1e-4)


def test_arc_length_starts_on_the_along_track_axis_and_runs_in_the_sense_of_free_motion():
    centre, a, b = np.array([3e3, -7e3, 11e3]), 100e3, 50e3
    curve = EllipseSpec(centre=tuple(centre), first_axis=(0.0, a, 0.0), second_axis=(b, 0.0, 0.0)).build()
    theta = np.linspace(-7.0, 7.0, 23)
    point = curve.point(theta)
    zero = np.zeros_like(theta)
    speed = np.hypot(b * np.cos(theta), a * np.sin(theta))
    expected = centre + np.stack((b * np.sin(theta), a * np.cos(theta), zero), axis=-1)
    tangent = np.stack((b * np.cos(theta), -a * np.sin(theta), zero), axis=-1) / speed[:, None]
    normal = np.stack((-a * np.sin(theta), -b * np.cos(theta), zero), axis=-1) / speed[:, None]
    assert point.position == pytest.approx(expected, abs=1e-9)
    assert point.tangent == pytest.approx(tangent, abs=1e-14)
    assert point.normal == pytest.approx(normal, abs=1e-14)
    assert point.curvature == pytest.approx(a * b / speed**3, rel=1e-13)
    assert curve.arc_length_at(np.float64(0.0)) == 0.0


@pytest.mark.parametrize(("first", "second"), AXES)
def test_arc_length_is_the_integral_of_speed(first, second):
    curve = tilted(first, second)
    for angle in (1e-3, 0.02, 0.5, 1.5, 1.7, 3.0, 4.6, 6.2):
        expected = arc_by_quadrature(first, second, angle)
        assert curve.arc_length_at(np.float64(angle)) == pytest.approx(
            expected, rel=1e-12, abs=1e-14 * curve.perimeter
        )


@pytest.mark.parametrize(("first", "second"), [*AXES, (1000.0, 1.0)])
def test_angle_and_arc_length_are_inverse_to_rounding(first, second):
    curve = tilted(first, second)
    generator = np.random.default_rng(11)
    close = 10.0 ** generator.uniform(-12.0, 0.0, 4000) * generator.choice([-1.0, 1.0], 4000)
    laps = np.concatenate((generator.uniform(-3.0, 3.0, 4000), close, np.linspace(-2.0, 2.0, 65)))
    arc_length = laps * curve.perimeter
    error = np.abs(curve.arc_length_at(curve.angle_at(arc_length)) - arc_length)
    assert error.max() < 1e-14 * 3.0 * curve.perimeter


@pytest.mark.parametrize(("first", "second"), [*AXES, (1000.0, 1.0)])
@pytest.mark.parametrize("furthest", [1e-9, 1e-5, 1e-3, 0.02, 0.5])
def test_the_angle_after_a_known_point_is_found_to_rounding_however_far_it_is(first, second, furthest):
    curve = tilted(first, second)
    generator = np.random.default_rng(12)
    arc_length = generator.uniform(-3.0, 3.0, 4000) * curve.perimeter
    ahead = generator.uniform(-1.0, 1.0, 4000) * furthest * curve.perimeter
    angle = curve.angle_at(arc_length)
    found = curve.angle_after(angle, curve.point(angle), ahead, arc_length + ahead)
    error = np.abs(curve.arc_length_at(found) - (arc_length + ahead))
    assert error.max() < 1e-14 * 4.0 * curve.perimeter


def test_laps_are_counted_without_end():
    curve = tilted(2.0, 1.0)
    for laps in (-1000.0, -1.0, 1.0, 5.0, 1000.0):
        assert curve.angle_at(laps * curve.perimeter) == pytest.approx(2.0 * np.pi * laps, rel=1e-14)
        assert curve.arc_length_at(np.float64(2.0 * np.pi * laps)) == pytest.approx(
            laps * curve.perimeter, rel=1e-14
        )


def test_local_shape_agrees_with_finite_differences():
    curve = tilted(5.0, 2.0)
    theta, small = np.linspace(-3.0, 3.0, 31), 1e-5
    here, ahead, behind = (curve.point(theta + shift) for shift in (0.0, small, -small))
    velocity = (ahead.position - behind.position) / (2.0 * small)
    assert here.speed[:, None] * here.tangent == pytest.approx(velocity, abs=1e-8)
    assert here.speed_slope == pytest.approx((ahead.speed - behind.speed) / (2.0 * small), abs=1e-8)
    turning = (ahead.tangent - behind.tangent) / (2.0 * small) / here.speed[:, None]
    assert here.curvature[:, None] * here.normal == pytest.approx(turning, abs=1e-8)
    frame = np.stack((here.tangent, here.normal, np.cross(here.tangent, here.normal)), axis=-1)
    identity = np.swapaxes(frame, -1, -2) @ frame
    assert identity == pytest.approx(np.tile(np.eye(3), (31, 1, 1)), abs=1e-14)


@pytest.mark.parametrize(("first", "second"), [*AXES, (1.0, 5.0)])
def test_nearest_point_is_the_nearest_of_a_dense_sampling(first, second):
    curve = tilted(first, second)
    generator = np.random.default_rng(5)
    size = max(first, second)
    positions = curve.centre + generator.normal(size=(200, 3)) * size * generator.choice(
        [0.02, 0.3, 1, 5], (200, 1)
    )
    found = curve.point(curve.nearest(positions))
    distance = np.linalg.norm(positions - found.position, axis=-1)
    dense = curve.point(np.linspace(0.0, 2.0 * np.pi, 40001)).position
    for position, own in zip(positions, distance, strict=True):
        assert own <= np.linalg.norm(dense - position, axis=-1).min() + 1e-12 * size
    along = np.abs(((positions - found.position) * found.tangent).sum(axis=-1))
    assert along.max() < 1e-9 * size


def test_nearest_point_survives_the_cusps_of_the_evolute():
    curve = ellipse(np.zeros(3), np.array([2.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    cusp = (2.0**2 - 1.0**2) / 2.0
    for shift in (0.0, 1e-14, -1e-14, 1e-9, -1e-9):
        for side in (0.0, 1e-15, 1e-9):
            position = np.array([cusp + shift, side, 0.0])
            distance = np.linalg.norm(curve.point(curve.nearest(position)).position - position)
            # At the cusp the distance is 1/2, and it falls as fast as the position moves outwards.
            assert distance == pytest.approx(0.5 - shift, abs=1e-11)


def test_equally_near_points_go_to_the_side_of_positive_axes():
    curve = ellipse(np.zeros(3), np.array([2.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    assert curve.nearest(np.zeros(3)) == pytest.approx(0.5 * np.pi)
    inside = curve.point(curve.nearest(np.array([0.6, 0.0, 0.0]))).position
    assert inside == pytest.approx([0.8, np.sqrt(1.0 - 0.16), 0.0], abs=1e-14)


def test_nearest_point_of_a_circle_lies_on_the_ray():
    curve = CircleSpec(radius=10.0, normal=(0, 0, 1), direction=(1, 0, 0)).build()
    for angle in (-3.0, -1.0, 0.0, 0.4, 2.0):
        position = np.array([3.0 * np.cos(angle), 3.0 * np.sin(angle), 4.0])
        assert curve.nearest(position) == pytest.approx(angle, abs=1e-14)


def test_a_circle_has_constant_speed_and_curvature():
    curve = CircleSpec(centre=(1, 2, 3), radius=500.0, normal=(1, 0, 1), direction=(0, 2, 0)).build()
    point = curve.point(np.linspace(0.0, 6.0, 7))
    assert curve.perimeter == pytest.approx(1000.0 * np.pi, rel=1e-15)
    assert point.speed == pytest.approx(np.full(7, 500.0))
    assert point.curvature == pytest.approx(np.full(7, 0.002))
    assert point.position[0] == pytest.approx([1.0, 502.0, 3.0])


def test_both_forms_of_an_ellipse_give_the_same_curve():
    tilt = np.array([0.5, 0.0, np.sqrt(0.75)])
    by_vectors = EllipseSpec(first_axis=(0.0, 400.0, 0.0), second_axis=tuple(200.0 * tilt)).build()
    by_normal = EllipseSpec(
        semi_axes=(400.0, 200.0), direction=(0, 1, 0), normal=tuple(np.cross((0.0, 1.0, 0.0), tilt))
    ).build()
    theta = np.linspace(0.0, 6.0, 9)
    assert by_normal.point(theta).position == pytest.approx(by_vectors.point(theta).position, abs=1e-11)


def test_a_fixed_point_stays_where_it_is():
    curve = FixedPointSpec(position=(1.0, -2.0, 3.0)).build()
    point = curve.point(curve.angle_at(np.array([0.0, 7.0, -3.0])))
    assert np.array_equal(point.position, np.tile([1.0, -2.0, 3.0], (3, 1)))
    assert not point.tangent.any()
    assert not point.curvature.any()
    assert curve.perimeter == 0.0
    assert curve.nearest(np.zeros(3)) == 0.0


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"first_axis": (1, 0, 0), "second_axis": (1, 1, 0)}, "angle between them is 45 deg"),
        ({"first_axis": (0, 0, 0), "second_axis": (1, 1, 0)}, "first_axis is the zero vector"),
        ({"first_axis": (1, 0, 0)}, "given: first_axis"),
        ({}, "given: neither"),
        ({"semi_axes": (1, 2), "normal": (0, 0, 1)}, "given: semi_axes, normal"),
        ({"semi_axes": (1, 0), "normal": (0, 0, 1), "direction": (1, 0, 0)}, "greater than 0"),
        ({"semi_axes": (1, 2), "normal": (0, 0, 1), "direction": (0, 1, 1e-8)}, "have to be perpendicular"),
    ],
)
def test_an_impossible_ellipse_is_refused_with_the_reason(fields, words):
    with pytest.raises(ValidationError, match=words):
        EllipseSpec(**fields)


def test_one_curve_and_many_get_the_same_bits():
    generator = np.random.default_rng(0)
    curves = [tilted(*generator.uniform(1.0, 50.0, 2), seed=seed) for seed in range(25)]
    many = stack(curves)
    arc_length, positions = generator.normal(0.0, 100.0, 25), generator.normal(0.0, 30.0, (25, 3))
    angles, nearest = many.angle_at(arc_length), many.nearest(positions)
    points, arcs = many.point(angles), many.arc_length_at(angles)
    # For some a step is enough, for others it is not.
    ahead = 10.0 ** generator.uniform(-3.0, 1.5, 25)
    after = many.angle_after(angles, points, ahead, arc_length + ahead)
    for i, curve in enumerate(curves):
        assert curve.angle_at(arc_length[i]) == angles[i]
        assert curve.nearest(positions[i]) == nearest[i]
        here = curve.point(angles[i])
        assert curve.angle_after(angles[i], here, ahead[i], arc_length[i] + ahead[i]) == after[i]
        assert curve.arc_length_at(angles[i]) == arcs[i]
        for name in ("position", "tangent", "normal", "curvature", "speed", "speed_slope"):
            assert np.array_equal(getattr(curve.point(angles[i]), name), getattr(points, name)[i])
