# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Cholesky factor, solution, inverse and determinant against fractions, LAPACK and a closed form."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import hilbert, invhilbert

from satform.numeric.matrix_algebra import product, symmetric, transposed
from satform.numeric.positive_definite import (
    NotPositiveDefiniteError,
    cholesky,
    inverse,
    log_determinant,
    solve,
    solve_lower,
    solve_upper,
)

Array = NDArray[np.float64]


def covariances(*shape: int, size: int, seed: int = 1) -> Array:
    """Of motions in m and m/s: variances many powers of ten apart."""
    generator = np.random.default_rng(seed)
    roots = generator.normal(size=(*shape, size, size)) * 10.0 ** generator.uniform(-4.0, 3.0, (size, 1))
    return roots @ np.swapaxes(roots, -1, -2)


def test_the_factor_of_a_textbook_matrix_is_that_of_the_textbook() -> None:
    # Golub & Van Loan, example in section 4.2: all of it in whole numbers.
    matrix = np.array([[2.0, -2.0], [-2.0, 5.0]])
    root = np.sqrt(2.0)
    assert np.allclose(cholesky(matrix), [[root, 0.0], [-root, np.sqrt(3.0)]], rtol=1e-15)


def test_the_inverse_of_a_hilbert_matrix_is_its_closed_form() -> None:
    # Its condition number is 1.5e7: an error of 1e-9 is 1e-16 times that.
    assert np.allclose(inverse(hilbert(6)), invhilbert(6), rtol=2e-9)


@pytest.mark.parametrize("size", [1, 2, 6, 18])
def test_factor_solution_and_determinant_are_those_of_lapack(size: int) -> None:
    matrices = covariances(3, 4, size=size)
    right = np.random.default_rng(2).normal(size=(3, 4, size, 2))
    scale = np.sqrt(np.einsum("...ii->...i", matrices))
    expected = np.linalg.cholesky(matrices)
    assert np.all(np.abs(cholesky(matrices) - expected) <= 1e-9 * scale[..., None])
    assert np.allclose(log_determinant(matrices), np.linalg.slogdet(matrices)[1], rtol=1e-9)
    solution = np.linalg.solve(matrices, right)
    assert np.allclose(solve(matrices, right), solution, rtol=1e-6, atol=1e-9 * np.max(np.abs(solution)))
    lower = cholesky(matrices)
    assert np.allclose(lower @ solve_lower(lower, right), right, atol=1e-9)
    assert np.allclose(np.swapaxes(lower, -1, -2) @ solve_upper(lower, right), right, atol=1e-9)
    assert np.array_equal(inverse(matrices), transposed(inverse(matrices)))


def test_a_matrix_has_the_same_bits_alone_and_among_others() -> None:
    many = covariances(50, size=6)
    right = np.ones((50, 6, 1))
    for function in (cholesky, inverse, log_determinant):
        each = np.stack([function(matrix) for matrix in many])
        assert np.array_equal(function(many), each)
        assert np.array_equal(function(np.asfortranarray(many)), each)
    assert np.array_equal(
        solve(many, right),
        np.stack([solve(matrix, column) for matrix, column in zip(many, right, strict=True)]),
    )
    assert np.array_equal(product(many, many)[7], product(many[7], many[7]))


def test_the_product_and_the_symmetric_part_are_those_of_numpy() -> None:
    left, right = covariances(5, size=4)[..., :3, :], covariances(5, size=4, seed=3)
    assert np.allclose(product(left, right), left @ right, rtol=1e-12)
    assert symmetric(np.array([[1.0, 4.0], [2.0, 3.0]])).tolist() == [[1.0, 3.0], [3.0, 3.0]]


@pytest.mark.parametrize(
    ("matrix", "row", "pivot"),
    [
        ([[1.0, 2.0], [2.0, 1.0]], "row 1", "-3"),
        ([[0.0, 0.0], [0.0, 1.0]], "row 0", "0"),
        ([[1.0, 0.0], [0.0, np.nan]], "row 1", "nan"),
        ([[np.inf, 0.0], [0.0, 1.0]], "row 0", "inf"),
    ],
)
def test_a_matrix_that_is_not_positive_definite_is_refused_with_its_row(
    matrix: list[list[float]], row: str, pivot: str
) -> None:
    with pytest.raises(NotPositiveDefiniteError, match=f"^matrix is not .* in {row} .* is {pivot}, which"):
        cholesky(np.array(matrix))
    with pytest.raises(
        NotPositiveDefiniteError, match=f"^matrix 1, 0 is not .* in {row} .* is {pivot}, which"
    ):
        inverse(np.array([[np.eye(2)], [matrix]]))
