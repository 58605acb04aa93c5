# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Probability of collision of two bodies that pass each other, by Foster's integral in the encounter plane.

The two bodies are spheres, their relative velocity is constant while they pass each other, and their relative
position has a normal distribution. The probability is then the integral of a normal density of two dimensions
over a disc: the bodies collide if their relative position comes through the disc whose radius is the sum of
theirs, in the plane across the relative velocity.
"""

import math
from functools import cache

import numpy as np

from satform.numeric.elementwise import Array, cross, dot, norm

_NODES = 200
"""Nodes of the Gauss-Legendre rule."""

_DECADES = 90.0
"""Twice the exponent by which the density falls from its largest value before the rest is left out."""


@cache
def _rule() -> tuple[Array, Array]:
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return nodes, weights


def encounter_plane(separation: Array, velocity: Array) -> tuple[Array, float]:
    """The plane across the relative velocity, and how far the separation reaches in it.

    Args:
        separation: relative position, m, shape (3,).
        velocity: relative velocity, m/s, shape (3,).

    Returns:
        Two unit vectors, shape (2, 3), the first along the separation's part in the plane; and the length of
        that part, m. NaN for bodies that do not move relative to each other: then there is no such plane.
    """
    speed = float(norm(velocity))
    if not speed > 0.0:
        return np.full((2, 3), np.nan), math.nan
    normal = velocity / speed
    part = separation - normal * dot(separation, normal)
    length = float(norm(part))
    # Without separation any direction will do; the axis that is furthest from the normal gives one.
    first = part if length > 0.0 else cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first = first / norm(first)
    return np.stack((first, cross(normal, first))), length


def collision_probability(separation: Array, velocity: Array, covariance: Array, radius: float) -> float:
    """Probability that two bodies collide while they pass each other at a constant relative velocity.

    Args:
        separation: mean relative position, m, shape (3,).
        velocity: relative velocity, m/s, shape (3,).
        covariance: of the relative position, m^2, shape (3, 3), in the same axes.
        radius: sum of the radii of both bodies, m.

    Returns:
        Within [0, 1]; NaN for bodies that do not move relative to each other, and where the covariance is not
        positive definite in the encounter plane.

    Source: Foster & Estes 1992; Alfano 2005 for the integral over one variable.
    """
    axes, miss = encounter_plane(separation, velocity)
    (first, both), (_, second) = (axes @ covariance @ axes.T).tolist()
    half = 0.5 * (first - second)
    root = math.hypot(half, both)
    larger = 0.5 * (first + second) + root
    determinant = first * second - both * both
    if not (larger > 0.0 and determinant > 0.0):
        return math.nan
    # Direction of the larger variance in the plane; a round distribution has none, and needs none.
    along, across = (half + root, both) if half >= 0.0 else (both, root - half)
    length = math.hypot(along, across)
    cosine, sine = (1.0, 0.0) if length == 0.0 else (along / length, across / length)
    # The smaller variance by the determinant, which loses no digits.
    deviations = math.sqrt(larger), math.sqrt(determinant / larger)
    return disc_probability((miss * cosine, miss * sine), deviations, radius)


def disc_probability(centre: tuple[float, float], deviations: tuple[float, float], radius: float) -> float:
    """Probability that a point with a normal distribution lies in a disc about the origin.

    Args:
        centre: mean of the point along the principal axes of its distribution, m.
        deviations: standard deviations along these axes, m, both above 0.
        radius: of the disc, m.

    Returns:
        Within [0, 1].

    Source: Alfano 2005: error functions across the narrow axis of the distribution, quadrature along it. The
    error functions are complementary ones, so that small probabilities keep their digits.
    """
    from scipy.special import erfc  # noqa: PLC0415  slow to import, and not needed in flight

    if not radius > 0.0:
        return 0.0
    pairs = sorted(zip(deviations, centre, strict=True))
    (narrow, mean), (wide, offset) = pairs
    # Along the narrow axis the disc reaches from -radius to radius, of which only the part counts where the
    # density is not negligible beside its largest value in the disc.
    nearest = mean - max(-radius, min(radius, mean))
    extent = math.sqrt(nearest * nearest + _DECADES * narrow * narrow)
    begin, end = (math.asin(max(-1.0, min(1.0, (mean + sign * extent) / radius))) for sign in (-1.0, 1.0))
    nodes, weights = _rule()
    angle = 0.5 * (begin + end) + 0.5 * (end - begin) * nodes
    along, half_width = radius * np.sin(angle), radius * np.cos(angle)
    root, far = math.sqrt(2.0) * wide, abs(offset)
    within = 0.5 * (erfc((far - half_width) / root) - erfc((far + half_width) / root))
    density = np.exp(-0.5 * ((along - mean) / narrow) ** 2) / (math.sqrt(math.tau) * narrow)
    total = 0.5 * (end - begin) * float(np.sum(weights * density * within * half_width))
    return min(1.0, max(0.0, total))
