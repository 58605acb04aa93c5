# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Distance of two satellites across the flight direction, by their relative orbital elements.

An error of the along-track position grows with time, so that two satellites are safe without control only if
they are apart in the plane of the radial and normal axes all the time: by the separation of relative
eccentricity and inclination vectors.
"""

import numpy as np

from satform.numeric.elementwise import Array

_NEWTON_STEPS = 80
"""Enough from the side on which the function is convex, however thin the ellipse is."""

_THINNEST = 1e-15
"""Ratio of half axes up to which an ellipse is a line."""


def least_radial_normal_distance(elements: Array) -> Array:
    """Least distance in the radial/normal plane over a revolution, near a circular orbit.

    In this plane the relative motion is an ellipse about (a da, 0). For da = 0 the result is the closed form
    sqrt(2) |de . di| / sqrt(de^2 + di^2 + |de + di| |de - di|), times a: the smaller half axis.

    Args:
        elements: quasi-nonsingular relative elements times the chief's semi-major axis (a da, a dlambda,
            a dex, a dey, a dix, a diy), m, shape (..., 6). The second does not matter.

    Returns:
        m, shape (...).

    Source: D'Amico & Montenbruck 2006 for da = 0; Eberly, Distance from a point to an ellipse, otherwise.
    """
    height, ex, ey = elements[..., 0], elements[..., 2], elements[..., 3]
    ix, iy = elements[..., 4], elements[..., 5]
    # The ellipse is the image of the unit circle under ((-ex, -ey), (-iy, ix)).
    radial, normal, mixed = ex * ex + ey * ey, ix * ix + iy * iy, ex * iy - ey * ix
    half = 0.5 * (radial - normal)
    root = np.hypot(half, mixed)
    larger = np.sqrt(0.5 * (radial + normal) + root)
    area = np.abs(ex * ix + ey * iy)
    smaller = np.minimum(area / np.where(larger > 0.0, larger, 1.0), larger)
    # Direction of the larger half axis; a circle has none, and needs none.
    along = np.where(half >= 0.0, half + root, np.abs(mixed))
    across = np.where(half >= 0.0, np.abs(mixed), root - half)
    length = np.hypot(along, across)
    round_one = length == 0.0
    scale = np.where(round_one, 1.0, length)
    cosine, sine = np.where(round_one, 1.0, along / scale), across / scale
    return distance_to_ellipse(np.abs(height) * cosine, np.abs(height) * sine, larger, smaller)


def distance_to_ellipse(along: Array, across: Array, larger: Array, smaller: Array) -> Array:
    """Distance of a point from an ellipse about the origin.

    Args:
        along: coordinate of the point along the larger half axis, m, not negative, shape (...).
        across: along the smaller one, m, likewise.
        larger: half axis, m, shape (...).
        smaller: half axis, m, at most `larger`, shape (...); 0 for a line.

    Returns:
        m, shape (...), within the ellipse as outside.

    Source: Eberly, Distance from a point to an ellipse, an ellipsoid or a hyperellipsoid, section 2.
    """
    # A line that rounding has made an ellipse is a line.
    flat = smaller <= _THINNEST * larger
    one, other = np.where(flat, 1.0, larger), np.where(flat, 1.0, smaller)
    excess = (one - other) * (one + other) / (other * other)
    ratio = excess + 1.0
    x, y = ratio * (along / one), across / other
    # The foot of the perpendicular is at x / (w + excess), y / w of the unit circle.
    w = y
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for _ in range(_NEWTON_STEPS):
            first, second = x / (w + excess), y / w
            value = first * first + second * second - 1.0
            slope = 2.0 * (first * first / (w + excess) + second * second / w)
            further = np.where(value > 0.0, w + value / slope, w)
            # What does not change any more gives the same again.
            if np.array_equal(further, w):
                break
            w = further
        foot_along, foot_across = one * (x / (w + excess)), other * (y / w)
    general = np.hypot(foot_along - along, foot_across - across)
    on_axis = np.where(across > 0.0, general, _from_larger_axis(along, larger, smaller))
    found = np.where(flat, np.hypot(np.maximum(along - larger, 0.0), across), on_axis)
    return np.asarray(found)


def _from_larger_axis(along: Array, larger: Array, smaller: Array) -> Array:
    """Distance of a point of the larger axis, whose nearest point may lie aside of it."""
    focus = larger * larger - smaller * smaller
    product = larger * along
    inside = product < focus
    cosine = np.where(inside, product / np.where(focus > 0.0, focus, 1.0), 0.0)
    aside = smaller * np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))
    return np.where(inside, np.hypot(larger * cosine - along, aside), np.abs(along - larger))
