# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Gains and transitions of relative motion, applied element by element."""

import numpy as np

from satform.dynamics.cw import InPlaneCoupling
from satform.numeric.elementwise import Array


def position_matrix() -> Array:
    """Output matrix of a position measurement, shape (3, 6)."""
    return np.hstack((np.eye(3), np.zeros((3, 3))))


def multiply(matrix: Array, vector: Array) -> Array:
    """Matrix times vector, column after column, with the same bits for one satellite and for many.

    Args:
        matrix: shape (..., m, k).
        vector: shape (..., k).

    Returns:
        Shape (..., m).
    """
    products = matrix * vector[..., None, :]
    total: Array = products[..., 0] + products[..., 1]
    for column in range(2, products.shape[-1]):
        total = total + products[..., column]
    return total


def coupling(matrix: Array) -> InPlaneCoupling:
    """A gain that treats the orbit normal apart from the orbital plane, in its quick form.

    Args:
        matrix: shape (3, 3), in the order x, y, z.

    Returns:
        The same map.

    Raises:
        ValueError: the matrix couples z with x or y.
    """
    out_of_plane = np.abs([matrix[0, 2], matrix[1, 2], matrix[2, 0], matrix[2, 1]])
    if np.max(out_of_plane) > 1e-9 * np.max(np.abs(matrix)):
        raise ValueError(f"this gain couples the orbit normal with the orbital plane: {matrix.tolist()}")
    return InPlaneCoupling(own=np.diag(matrix).copy(), swapped=np.array([matrix[0, 1], matrix[1, 0]]))
