# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How close to a regular tetrahedron four satellites are: quality factors of missions of four spacecraft."""

import math
from collections.abc import Callable, Mapping
from itertools import combinations

import numpy as np

from satform.numeric.elementwise import Array, cross, dot, norm

_FACES = tuple(combinations(range(4), 3))


def mean_side(positions: Array) -> Array:
    """Mean of the six sides of a tetrahedron.

    Args:
        positions: of its corners, m, shape (..., 4, 3).

    Returns:
        m, shape (...).
    """
    total = np.zeros(positions.shape[:-2])
    for one, other in combinations(range(4), 2):
        total = total + norm(positions[..., one, :] - positions[..., other, :])
    return total / 6.0


def volume(positions: Array) -> Array:
    """Volume of a tetrahedron, m^3, shape (...), from its corners in m, shape (..., 4, 3)."""
    first, second, third = _sides(positions)
    return np.asarray(np.abs(dot(first, cross(second, third))) / 6.0)


def surface(positions: Array) -> Array:
    """Sum of the four faces of a tetrahedron, m^2, shape (...), from its corners in m, shape (..., 4, 3)."""
    total = np.zeros(positions.shape[:-2])
    for corner, one, other in _FACES:
        origin = positions[..., corner, :]
        total = total + norm(cross(positions[..., one, :] - origin, positions[..., other, :] - origin))
    return total / 2.0


def glassmeier_quality(positions: Array) -> Array:
    """Glassmeier's quality factor: volume and surface beside those of a regular one of the same mean side.

    Args:
        positions: of the satellites, m, shape (..., 4, 3).

    Returns:
        Shape (...): 1 on a line, 1 to 2 in a plane, 3 for a regular tetrahedron; NaN at one place.

    Source: vom Stein, Glassmeier & Dunlop 1992; Daly 1994, The tetrahedron quality factors of CSDS, Eq. (1).
    """
    side = mean_side(positions)
    with np.errstate(divide="ignore", invalid="ignore"):
        quality: Array = volume_ratio(positions) + surface(positions) / (math.sqrt(3.0) * side * side) + 1.0
    return quality


def robert_roux_quality(positions: Array) -> Array:
    """Robert and Roux's quality factor: size of the tetrahedron beside that of its circumscribed sphere.

    Args:
        positions: of the satellites, m, shape (..., 4, 3).

    Returns:
        Shape (...): 0 in a plane, 1 for a regular tetrahedron.

    Source: Robert & Roux 1993; Daly 1994: the cube root of the ratio of volumes, times a factor that makes it
    1 for the regular tetrahedron.
    """
    first, second, third = _sides(positions)
    parts = cross(second, third), cross(third, first), cross(first, second)
    towards = sum(
        (dot(side, side)[..., None] * part for side, part in zip((first, second, third), parts, strict=True)),
        start=np.zeros_like(first),
    )
    content = volume(positions)
    flat = content == 0.0
    # Four points in a plane have a sphere of infinite radius, or one of many.
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = norm(towards) / (12.0 * content)
        quality: Array = np.cbrt(content * (9.0 * math.sqrt(3.0) / 8.0)) / radius
    return np.where(flat, 0.0, quality)


def volume_ratio(positions: Array) -> Array:
    """Volume of a tetrahedron beside that of a regular one of the same mean side.

    Args:
        positions: of the satellites, m, shape (..., 4, 3).

    Returns:
        Shape (...): 0 in a plane, 1 for a regular tetrahedron; NaN at one place.

    Source: Roscoe et al. 2011, the shape factor of the Magnetospheric Multiscale mission.
    """
    side = mean_side(positions)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio: Array = volume(positions) / (side * side * side / (6.0 * math.sqrt(2.0)))
    return ratio


def size_factor(positions: Array, sides: tuple[float, float, float, float]) -> Array:
    """How well the size of a tetrahedron fits the one that is asked for.

    Args:
        positions: of the satellites, m, shape (..., 4, 3).
        sides: mean sides, ascending, m: the factor is 1 between the second and the third, and falls to 0 at
            the first and at the fourth.

    Returns:
        Shape (...), within [0, 1], with a continuous derivative.

    Source: Roscoe et al. 2011; Fuselier et al. 2016, for the Magnetospheric Multiscale mission.
    """
    smallest, small, large, largest = sides
    side = mean_side(positions)
    up = np.clip((side - smallest) / (small - smallest), 0.0, 1.0)
    down = np.clip((largest - side) / (largest - large), 0.0, 1.0)
    rise, fall = up * (2.0 - up), down * (2.0 - down)
    factor: Array = rise * rise * fall * fall
    return factor


QUALITIES: Mapping[str, Callable[[Array], Array]] = {
    "glassmeier": glassmeier_quality,
    "robert_roux": robert_roux_quality,
    "volume": volume_ratio,
}
"""Quality factors by name."""


def _sides(positions: Array) -> tuple[Array, Array, Array]:
    """The sides from the first corner to the others, shape (..., 3) each."""
    first = positions[..., 0, :]
    return positions[..., 1, :] - first, positions[..., 2, :] - first, positions[..., 3, :] - first
