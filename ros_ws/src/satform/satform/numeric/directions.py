# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Directions that are given in any length, and cones about them."""

import math

import numpy as np
from numpy.typing import NDArray

from satform.common.spec import Vector
from satform.numeric.elementwise import Array, dot


def require_direction(direction: Vector, name: str) -> None:
    """Refuse a vector that has no direction.

    Raises:
        ValueError: it has none.
    """
    if not 0.0 < math.hypot(*direction) < math.inf:
        raise ValueError(f"{name} [0, 0, 0] has no direction")


def unit(direction: Vector) -> Array:
    """The unit vector along a direction, shape (3,)."""
    found = np.asarray(direction, dtype=np.float64)
    return np.asarray(found / math.hypot(*direction))


def within(direction: Array, axis: Array, angle: float) -> NDArray[np.bool_]:
    """Whether directions lie in a cone about an axis.

    Args:
        direction: unit vectors, shape (..., 3).
        axis: unit vector, shape (3,) or (..., 3).
        angle: between the axis and the edge of the cone, rad; pi for all directions.

    Returns:
        Shape (...).
    """
    # A rounding is not to leave a direction out of a cone that has all of them.
    return np.asarray(dot(direction, axis) >= math.cos(angle) - 1e-12)
