# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Arithmetic with the same bits on every processor: values of grids, and the products of correlations.

numpy and LAPACK choose their code by the processor, and its results may differ in the last bit. Here sums are
made in a fixed order by operations that IEEE 754 rounds alike everywhere or that are made in integers, and
logarithms and exponentials by `decimal`, which computes them in integers.

Draws of `uniform` and `choice` need sums and products only, and are exact, too. Those of `normal`,
`truncated_normal` and `log_uniform`, and of all correlated dispersions, go through logarithms and
exponentials of the C library (`distributions`, `cases`): they may differ in the last bits between processors.
"""

import math
from collections.abc import Sequence
from decimal import Context, Decimal
from fractions import Fraction
from typing import TypeAlias

Rows: TypeAlias = tuple[tuple[float, ...], ...]
"""A matrix by its rows."""

_DIGITS = Context(prec=34)
"""Twice the digits of a float64, so that the rounding to it is the only one that matters."""


def linear_points(first: float, last: float, count: int) -> tuple[float, ...]:
    """Evenly spaced values with both ends.

    Args:
        first: value.
        last: value.
        count: of all values, 2 or more.
    """
    first, last = float(first), float(last)
    step = (last - first) / (count - 1)
    return (*(first + index * step for index in range(count - 1)), last)


def logarithmic_points(first: float, last: float, count: int) -> tuple[float, ...]:
    """Values of which neighbours have the same ratio, with both ends.

    Args:
        first: value; not zero.
        last: value, of the same sign.
        count: of all values, 2 or more.
    """
    first, last = float(first), float(last)
    start = Decimal(first)
    step = _DIGITS.divide(_DIGITS.ln(_DIGITS.divide(Decimal(last), start)), Decimal(count - 1))
    inner = (
        float(_DIGITS.multiply(start, _DIGITS.exp(_DIGITS.multiply(step, Decimal(index)))))
        for index in range(1, count - 1)
    )
    return (first, *inner, last)


def cholesky_factor(matrix: Sequence[Sequence[float]]) -> Rows:
    """Lower triangular factor of a symmetric matrix: its product with its transpose is the matrix.

    Args:
        matrix: rows, positive definite.

    Raises:
        ValueError: it is not positive definite.
    """
    rows: list[list[float]] = []
    for index, given in enumerate(matrix):
        row: list[float] = []
        for column in range(index):
            row.append((given[column] - _dot(row, rows[column])) / rows[column][column])
        row.append(math.sqrt(given[index] - _dot(row, row)))
        rows.append(row)
    return tuple((*row, *(0.0,) * (len(rows) - len(row))) for row in rows)


def factor_times(factor: Rows, values: Sequence[float]) -> list[float]:
    """Product of a lower triangular matrix and a vector.

    Its terms are added from the diagonal to the first column, with one rounding for each, as by a fused
    multiply-add. This is done in rational numbers: not every processor has that instruction.

    Args:
        factor: rows.
        values: finite, as many as rows.
    """
    found = []
    for index, row in enumerate(factor):
        total = 0.0
        for column in range(index, -1, -1):
            total = float(Fraction(row[column]) * Fraction(values[column]) + Fraction(total))
        found.append(total)
    return found


def _dot(one: Sequence[float], other: Sequence[float]) -> float:
    """Sum of products, from the first to the last; of the shorter one's length."""
    total = 0.0
    for left, right in zip(one, other, strict=False):
        total += left * right
    return total
