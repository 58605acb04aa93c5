# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Products of matrices over the last two axes, with the same bits for one matrix and for a thousand."""

import numpy as np

from satform.numeric.elementwise import Array


def product(left: Array, right: Array) -> Array:
    """Matrix product, summed in a fixed order.

    Args:
        left: shape (..., m, k), k at least 1.
        right: shape (..., k, n), leading axes broadcast against those of `left`.

    Returns:
        Shape (..., m, n), in the product of the units.
    """
    total: Array = left[..., :, 0, None] * right[..., 0, None, :]
    for index in range(1, left.shape[-1]):
        total += left[..., :, index, None] * right[..., index, None, :]
    return total


def transposed(matrix: Array) -> Array:
    """The transpose of each matrix, as a view: shape (..., m, n) to (..., n, m)."""
    swapped: Array = np.swapaxes(matrix, -1, -2)
    return swapped


def symmetric(matrix: Array) -> Array:
    """The symmetric part of each matrix, shape (..., m, m)."""
    half: Array = 0.5 * (matrix + transposed(matrix))
    return half
