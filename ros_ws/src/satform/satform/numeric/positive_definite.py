# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Symmetric positive definite matrices: Cholesky factor, solution, inverse and determinant, element-wise.

All functions work over the last two axes, row by row in a fixed order: a matrix has the same bits alone and
among a thousand, which LAPACK does not promise.

Source: Golub & Van Loan, Matrix Computations, 4th ed., sections 3.1 and 4.2.
"""

import numpy as np

from satform.numeric.elementwise import Array


class NotPositiveDefiniteError(ArithmeticError):
    """A matrix that has to be positive definite is not, or has a number that is not finite.

    A satellite that meets one in flight has no command, and the flight ends early.
    """


def cholesky(matrix: Array) -> Array:
    """The lower triangular factor L with L L' = matrix.

    Args:
        matrix: symmetric, shape (..., n, n); only its lower triangle is read.

    Returns:
        Shape (..., n, n), zero above the diagonal, in the root of the unit.

    Raises:
        NotPositiveDefiniteError: with the first row at which a matrix is not positive definite.
    """
    size = matrix.shape[-1]
    # Rows and columns in front: a number of all matrices is in one piece of memory.
    rest = np.array(np.moveaxis(matrix, (-2, -1), (0, 1)), order="C")
    lower = np.zeros_like(rest)
    # What follows a pivot that is refused is not a number, and refused with it.
    with np.errstate(all="ignore"):
        for row in range(size):
            column = rest[row:, row] / np.sqrt(rest[row, row])
            lower[row:, row] = column
            below = column[1:]
            rest[row + 1 :, row + 1 :] -= below[:, None] * below[None, :]
    pivots = rest[np.arange(size), np.arange(size)]
    # Written so that NaN and infinity are refused too.
    refused = ~((pivots > 0.0) & (pivots < np.inf))
    if refused.any():
        row = int(np.argmax(refused.reshape(size, -1).any(axis=-1)))
        raise NotPositiveDefiniteError(_complaint(matrix, pivots[row], row))
    return np.moveaxis(lower, (0, 1), (-2, -1))


def solve_lower(lower: Array, right: Array) -> Array:
    """The solution X of L X = right, by forward substitution.

    Args:
        lower: triangular factor, shape (..., n, n), as `cholesky` gives it.
        right: shape (..., n, k); leading axes broadcast against those of `lower`.

    Returns:
        Shape (..., n, k).
    """
    rows, rest = _rows(lower, right)
    for row in range(len(rest)):
        rest[row] /= rows[row, row][..., None]
        rest[row + 1 :] -= rows[row + 1 :, row][..., None] * rest[row]
    return np.moveaxis(rest, 0, -2)


def solve_upper(lower: Array, right: Array) -> Array:
    """The solution X of L' X = right, by backward substitution; arguments and result as of `solve_lower`."""
    rows, rest = _rows(lower, right)
    for row in reversed(range(len(rest))):
        rest[row] /= rows[row, row][..., None]
        rest[:row] -= rows[row, :row][..., None] * rest[row]
    return np.moveaxis(rest, 0, -2)


def solve(matrix: Array, right: Array) -> Array:
    """The solution X of matrix X = right.

    Args:
        matrix: symmetric, positive definite, shape (..., n, n).
        right: shape (..., n, k); leading axes broadcast against those of `matrix`.

    Returns:
        Shape (..., n, k).

    Raises:
        NotPositiveDefiniteError: the matrix is not positive definite.
    """
    lower = cholesky(matrix)
    return solve_upper(lower, solve_lower(lower, right))


def inverse(matrix: Array) -> Array:
    """The inverse, symmetric to the bit.

    Args:
        matrix: symmetric, positive definite, shape (..., n, n).

    Returns:
        Shape (..., n, n), in the inverse of the unit.

    Raises:
        NotPositiveDefiniteError: the matrix is not positive definite.
    """
    half = solve_lower(cholesky(matrix), np.eye(matrix.shape[-1]))
    total: Array = half[..., 0, :, None] * half[..., 0, None, :]
    for row in range(1, matrix.shape[-1]):
        total = total + half[..., row, :, None] * half[..., row, None, :]
    return total


def log_determinant(matrix: Array) -> Array:
    """The natural logarithm of the determinant.

    Args:
        matrix: symmetric, positive definite, shape (..., n, n).

    Returns:
        Shape (...).

    Raises:
        NotPositiveDefiniteError: the matrix is not positive definite.
    """
    return 2.0 * log_diagonal(cholesky(matrix))


def log_diagonal(lower: Array) -> Array:
    """The sum of the logarithms of the diagonal, half the logarithm of the determinant of L L'.

    Args:
        lower: Cholesky factor L, shape (..., n, n).

    Returns:
        Shape (...).
    """
    total: Array = np.log(lower[..., 0, 0])
    for row in range(1, lower.shape[-1]):
        total = total + np.log(lower[..., row, row])
    return total


def _rows(lower: Array, right: Array) -> tuple[Array, Array]:
    """Rows in front, of the factor as (n, n, ...) and of a copy of the right side as (n, ..., k)."""
    shape = (*np.broadcast_shapes(lower.shape[:-2], right.shape[:-2]), *right.shape[-2:])
    rest = np.array(np.moveaxis(np.broadcast_to(right, shape), -2, 0), order="C", dtype=np.float64)
    rows: Array = np.moveaxis(lower, (-2, -1), (0, 1))
    return rows, rest


def _complaint(matrix: Array, pivot: Array, row: int) -> str:
    """Which matrix is not positive definite, and where."""
    first = np.argmin((pivot > 0.0) & (pivot < np.inf))
    which = np.unravel_index(int(first), pivot.shape)
    name = f"matrix {', '.join(map(str, which))}" if which else "matrix"
    diagonal = ", ".join(f"{value:.3g}" for value in np.diagonal(matrix[which]).tolist())
    return (
        f"{name} is not positive definite: its pivot in row {row} (from 0) is {float(pivot[which]):.3g}, "
        f"which should be above 0 and finite; its diagonal is {diagonal}"
    )
