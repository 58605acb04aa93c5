# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Lines of sight between satellites: distance, direction in body axes, whether the Earth is in the way."""

import numpy as np
from numpy.typing import NDArray

from satform.numeric.elementwise import Array, dot, joined, norm
from satform.orbits.earth import EQUATORIAL_RADIUS


def line_of_sight(first: Array, second: Array) -> tuple[Array, Array]:
    """Distance and direction from one position to another.

    Args:
        first: m, any axes, shape (..., 3).
        second: likewise.

    Returns:
        Distance in m, shape (...); unit vector, shape (..., 3), zero where both positions are the same.
    """
    between = second - first
    distance = norm(between)
    return distance, between / np.maximum(distance, 1e-9)[..., None]


def in_body_axes(body: Array | None, direction: Array) -> Array:
    """Body components of vectors.

    Args:
        body: rows are the body axes in LVLH, shape (..., 3, 3); None where they are the axes of LVLH.
        direction: LVLH components, shape (..., 3).
    """
    if body is None:
        return direction
    return joined(*(dot(body[..., axis, :], direction) for axis in range(3)))


def from_earth_centre(position: Array, chief_radius: Array) -> Array:
    """Positions from the Earth's centre along the LVLH axes.

    Args:
        position: LVLH, m, shape (..., N, 3).
        chief_radius: distance of the chief from the Earth's centre, m, shape (...).

    Returns:
        m, shape (..., N, 3).
    """
    zero = np.zeros_like(chief_radius)
    return position + joined(chief_radius, zero, zero)[..., None, :]


def blocked_by_earth(first: Array, second: Array, margin: Array | float = 0.0) -> NDArray[np.bool_]:
    """Whether the Earth is between two satellites.

    Args:
        first: from the Earth's centre, m, shape (..., 3).
        second: likewise.
        margin: height above the Earth's equatorial radius that a free line of sight keeps, m, shape (...).
    """
    return np.asarray(line_of_sight_distance(first, second) <= EQUATORIAL_RADIUS + margin)


def line_of_sight_distance(first: Array, second: Array) -> Array:
    """Least distance of the segment between two positions from the Earth's centre.

    Args:
        first: from the Earth's centre, m, shape (..., 3).
        second: likewise.

    Returns:
        m, shape (...).
    """
    between = second - first
    squared = dot(between, between)
    along = np.clip(-dot(first, between) / np.where(squared > 0.0, squared, 1.0), 0.0, 1.0)
    return norm(first + along[..., None] * between)
