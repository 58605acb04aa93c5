# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Yaw angle about a line of sight that keeps the panel axis perpendicular to the sun, with its rates.

Two singularities are removed. For a line of sight along the sun no yaw angle is preferred, and the best
angle nearby turns once around for each turn around the sun: no function of the line of sight alone is
continuous there. Within a cone about the sun, in which yaw changes the panels' light by less than the sine
of the cone's angle, the angle is therefore taken from a fixed direction, with a smooth transition. Where
the panel axis can only just be perpendicular to the sun, the rate of the angle would be infinite; it is
bounded there.

Equations: docs/controllers/attitude.md.
"""

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from satform.numeric.elementwise import Array, cross, dot
from satform.numeric.time_derivatives import (
    Jet,
    constant,
    reciprocal,
    scalar_product,
    square_root,
    unit,
    vector_product,
)

Mask: TypeAlias = NDArray[np.bool_]

SUN_CONE = math.radians(1.0)
"""Angle between the line of sight and the sun, or the direction away from it, below which the turn about the
line of sight no longer follows the sun, rad."""

_CONE = math.sin(SUN_CONE) ** 2
_CORE = 0.01 * _CONE
"""Squared sines of the angle to the sun at which the transition begins and ends."""

_LEAST_SINE = 0.01
"""Sine of the yaw angle below which the rate of the yaw is bounded."""

_LEAST_SQUARE = 1e-4
"""Squared length below which the blend of two directions is taken for none."""


def square_direction(sun: Array) -> Array:
    """A direction square to the sun, the same whenever it is asked for.

    Args:
        sun: unit vector, shape (..., 3).

    Returns:
        The coordinate axis that is farthest from the sun, less its part along the sun; a unit vector,
        shape (..., 3).
    """
    axis = np.eye(3)[np.argmin(np.abs(sun), axis=-1)]
    square = axis - dot(axis, sun)[..., None] * sun
    direction: Array = square / np.sqrt(dot(square, square))[..., None]
    return direction


def sight_triad(line_of_sight: Jet, sun: Array) -> tuple[Jet, Jet, Jet, Jet, Jet]:
    """Triad of line of sight and sun, and the sun's components along its first and third axes.

    Args:
        line_of_sight: inertial, any length but zero, shape (..., 3).
        sun: unit vector, inertial, constant, shape (..., 3).

    Returns:
        Unit vectors along the line of sight, square to it and the sun, and square to both; and two scalars.
        Near the sun the last one is what it would be at some distance from it.
    """
    to_sun = constant(np.broadcast_to(sun, line_of_sight.value.shape))
    first = unit(line_of_sight)
    normal = vector_product(first, to_sun)
    squared = scalar_product(normal, normal)
    near = squared.value < _CONE
    if not np.any(near):
        second = normal * reciprocal(square_root(squared)).along()
        third = vector_product(first, second)
        return first, second, third, scalar_product(to_sun, first), scalar_product(to_sun, third)
    second = _chosen(near, _near_sun(first, normal, squared, sun), _regular(normal, squared, near))
    third = vector_product(first, second)
    across = _chosen(near, _away_from_zero(squared), scalar_product(to_sun, third))
    return first, second, third, scalar_product(to_sun, first), across


def _regular(normal: Jet, squared: Jet, near: Mask) -> Jet:
    """The direction square to line of sight and sun where they are apart; any finite one elsewhere."""
    safe = _chosen(near, constant(np.ones_like(squared.value)), squared)
    return normal * reciprocal(square_root(safe)).along()


def _near_sun(first: Jet, normal: Jet, squared: Jet, sun: Array) -> Jet:
    """A direction square to the line of sight that goes over from the sun's to a fixed one's."""
    aside = square_direction(sun)
    # The blend below is lost where the line of sight leaves the sun towards the fixed direction. Turned by a
    # radian, that is none of the directions along which orbits and their axes would lead it.
    aside = math.cos(1.0) * aside + math.sin(1.0) * cross(np.broadcast_to(sun, aside.shape), aside)
    fixed = constant(np.broadcast_to(aside, first.value.shape))
    steady = _steady(first, fixed, squared)
    fraction = _step_up(squared)
    outside = _regular(normal, squared, squared.value < _CORE)
    blend = outside * fraction.along() + steady * (constant(np.ones_like(fraction.value)) - fraction).along()
    length = scalar_product(blend, blend)
    lost = length.value < _LEAST_SQUARE
    safe = _chosen(lost, constant(np.ones_like(length.value)), length)
    return _chosen(lost, steady, blend * reciprocal(square_root(safe)).along())


def _steady(first: Jet, fixed: Jet, squared: Jet) -> Jet:
    """The direction square to line of sight and a fixed one, near the sun; any finite one elsewhere."""
    product = vector_product(first, fixed)
    length = scalar_product(product, product)
    # Near the sun, to which the fixed direction is square, the length is nearly one.
    safe = _chosen(squared.value < _CONE, length, constant(np.ones_like(length.value)))
    return product * reciprocal(square_root(safe)).along()


def _step_up(squared: Jet) -> Jet:
    """0 up to the core about the sun, 1 from the cone on, and a polynomial of fifth degree between them."""
    part = np.clip((squared.value - _CORE) / (_CONE - _CORE), 0.0, 1.0)
    inverse = 1.0 / (_CONE - _CORE)
    rest = part * (1.0 - part)
    slope = 30.0 * rest * rest * inverse
    bend = 60.0 * rest * (1.0 - 2.0 * part) * inverse * inverse
    value = part * part * part * (10.0 - part * (15.0 - 6.0 * part))
    return _function(squared, value, slope, bend)


def _away_from_zero(squared: Jet) -> Jet:
    """The sun's component along the third axis, kept away from zero near the sun.

    Outside it is less the root of `squared`; inside a polynomial that goes over into it with two
    derivatives stands for `squared`.
    """
    part = np.minimum(squared.value / _CONE, 1.0)
    value = _CONE * (1.0 / 3.0 + part * part * (1.0 - part / 3.0))
    raised = _function(squared, value, part * (2.0 - part), 2.0 * (1.0 - part) / _CONE)
    return square_root(raised).times(-1.0)


def _function(of: Jet, value: Array, slope: Array, bend: Array) -> Jet:
    """A function of a quantity, from its value and first two derivatives."""
    return Jet(value, slope * of.rate, slope * of.acceleration + bend * of.rate * of.rate)


def yaw(numerator: Jet, denominator: Jet) -> tuple[Jet, Jet, Mask]:
    """Cosine and sine of the yaw angle from the cosine's two parts, and where they are attainable.

    Args:
        numerator: shape (...).
        denominator: shape (...).

    Returns:
        Cosine, sine, and whether the quotient is the cosine of an angle; else the nearest angle is taken.
    """
    feasible = np.abs(numerator.value) < np.abs(denominator.value)
    divisor = np.where(feasible, denominator.value, 1.0)
    cosine = numerator * reciprocal(Jet(divisor, denominator.rate, denominator.acceleration))
    held = np.where(np.signbit(numerator.value) == np.signbit(denominator.value), 1.0, -1.0)
    cosine = _chosen(feasible, cosine, constant(held))
    return cosine, _sine(cosine, feasible), feasible


def _sine(cosine: Jet, feasible: Mask) -> Jet:
    squared = constant(np.ones_like(cosine.value)) - cosine * cosine
    # The root of a positive number: a cosine that rounds to one leaves nothing.
    positive = feasible & (squared.value > 0.0)
    safe = Jet(np.where(positive, squared.value, 1.0), squared.rate, squared.acceleration)
    root = square_root(safe)
    small = root.value < _LEAST_SINE
    if np.any(small & positive):
        # The slope of the root falls to zero with the sine instead of growing beyond all bounds.
        slope = 0.5 * root.value / (_LEAST_SINE * _LEAST_SINE)
        bend = 0.5 * slope / (_LEAST_SINE * _LEAST_SINE)
        root = _chosen(small, _function(safe, root.value, slope, bend), root)
    return _chosen(positive, root, constant(np.zeros_like(cosine.value)))


def _chosen(where: Mask, first: Jet, second: Jet) -> Jet:
    """The first quantity where a condition holds, else the second."""
    mask = where if first.value.ndim == where.ndim else where[..., None]
    return Jet(
        np.where(mask, first.value, second.value),
        np.where(mask, first.rate, second.rate),
        np.where(mask, first.acceleration, second.acceleration),
    )
