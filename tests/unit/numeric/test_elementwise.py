# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Vector algebra and the functions beneath it: right, and with the same bits for one, many and strided."""

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ellipeinc

from satform.numeric.elementwise import arctan2, cross, dot, norm

Array = NDArray[np.float64]

WIDTHS = (1, 2, 3, 4, 5, 7, 8, 9, 16, 17, 31, 64, 100)
"""Below, at and above every width of a vector register, so that each remainder loop is met."""

FUNCTIONS: dict[str, Callable[[Array], Array]] = {
    "exp": lambda x: np.exp(-np.abs(x)),
    "log": lambda x: np.log(np.abs(x) + 1e-3),
    "log1p": lambda x: np.log1p(np.abs(x)),
    "tanh": np.tanh,
    "sin": np.sin,
    "cos": np.cos,
    "arcsin": lambda x: np.arcsin(x / (1.0 + np.abs(x))),
    "sqrt": lambda x: np.sqrt(np.abs(x)),
    "cbrt": np.cbrt,
    "rint": np.rint,
    "floor": np.floor,
    "ellipeinc": lambda x: ellipeinc(x, -3.0),
}
"""What flight software is made of, besides the four operations.

Powers are missing, since `**` differs in the last bit between a scalar and an array.
"""


def numbers(count: int, seed: int = 0) -> Array:
    """Numbers of many magnitudes and both signs."""
    generator = np.random.default_rng(seed)
    return generator.normal(size=count) * 10.0 ** generator.uniform(-6.0, 2.0, count)


def vectors(count: int, seed: int = 0) -> Array:
    return numbers(3 * count, seed).reshape(count, 3)


def bits(values: Array) -> list[int]:
    return np.ascontiguousarray(values, dtype=np.float64).view(np.uint64).ravel().tolist()


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
@pytest.mark.parametrize("width", WIDTHS)
def test_a_function_of_many_numbers_has_the_bits_of_the_function_of_each(name: str, width: int) -> None:
    function, values = FUNCTIONS[name], numbers(width, seed=width)
    each = [bits(np.asarray(function(value)))[0] for value in values]
    no_axes = [bits(function(np.asarray(value)))[0] for value in values]
    assert bits(function(values)) == each == no_axes


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_a_function_has_the_same_bits_wherever_its_numbers_lie_in_ascending_order(name: str) -> None:
    function, table = FUNCTIONS[name], vectors(37)
    column = table[:, 1]
    expected = bits(function(column.copy()))
    assert bits(function(column)) == expected
    assert bits(function(np.asfortranarray(table))[:, 1]) == expected
    odd = np.frombuffer(b"\0" * 4 + column.tobytes(), dtype=np.uint8)[4:].view("<f8")
    assert bits(function(odd)) == expected


@pytest.mark.parametrize("count", WIDTHS)
def test_vector_algebra_has_the_same_bits_for_one_satellite_and_for_many(count: int) -> None:
    a, b = vectors(count, seed=1), vectors(count, seed=2)
    for function in (dot, cross):
        assert bits(function(a, b)) == [bit for i in range(count) for bit in bits(function(a[i], b[i]))]
    assert bits(norm(a)) == [bit for one in a for bit in bits(norm(one))]


@pytest.mark.parametrize("count", WIDTHS)
def test_vector_algebra_has_the_same_bits_wherever_its_numbers_lie_in_memory(count: int) -> None:
    a, b = vectors(count, seed=1), vectors(count, seed=2)
    strided, columns = np.repeat(a, 2, axis=0)[::2], np.asfortranarray(b)
    for function in (dot, cross):
        assert bits(function(strided, columns)) == bits(function(a, b))
    assert bits(norm(strided)) == bits(norm(a))


def test_the_scalar_product_is_exact_to_its_three_roundings() -> None:
    a, b = vectors(200, seed=1), vectors(200, seed=2)
    for one, other, got in zip(a.tolist(), b.tolist(), dot(a, b).tolist(), strict=True):
        products = [Fraction(x) * Fraction(y) for x, y in zip(one, other, strict=True)]
        slack = 3 * Fraction(2) ** -53 * sum(map(abs, products))
        assert abs(Fraction(got) - sum(products)) <= slack


def test_lengths_are_those_of_pythagorean_quadruples() -> None:
    quadruples = np.array([[1, 2, 2, 3], [2, 3, 6, 7], [4, 4, 7, 9], [6, 10, 15, 19]], dtype=np.float64)
    assert norm(quadruples[:, :3]).tolist() == quadruples[:, 3].tolist()


def test_the_vector_product_is_right_handed() -> None:
    x, y, z = np.eye(3)
    assert cross(x, y).tolist() == z.tolist()
    assert cross(y, z).tolist() == x.tolist()
    assert cross(z, x).tolist() == y.tolist()


def test_the_vector_product_is_perpendicular_and_as_long_as_the_parallelogram_is_large() -> None:
    a, b = vectors(100, seed=1), vectors(100, seed=2)
    product = cross(a, b)
    lengths = norm(a) * norm(b)
    assert np.abs(dot(product, a)).max() <= 1e-15 * (lengths * norm(a)).max()
    assert norm(product) ** 2 + dot(a, b) ** 2 == pytest.approx(lengths**2, rel=1e-13)


def test_one_vector_meets_many_by_broadcasting() -> None:
    axis, many = np.array([0.0, 1.0, 0.0]), vectors(5)
    assert dot(axis, many).tolist() == many[:, 1].tolist()
    assert cross(axis[None, :], many).shape == (5, 3)


@pytest.mark.parametrize("shape", [(), (1,), (7,), (3, 4), (0,)])
def test_the_arc_tangent_is_that_of_the_c_library_in_any_shape(shape: tuple[int, ...]) -> None:
    y, x = (numbers(math.prod(shape), seed=seed).reshape(shape) for seed in (1, 2))
    found = arctan2(y, x)
    assert found.shape == shape
    assert found.dtype == np.float64
    assert found.ravel().tolist() == [math.atan2(b, a) for b, a in zip(y.ravel(), x.ravel(), strict=True)]


def test_the_arc_tangent_knows_its_quadrant() -> None:
    y, x = np.array([1.0, 1.0, -1.0, -1.0]), np.array([1.0, -1.0, -1.0, 1.0])
    assert arctan2(y, x) == pytest.approx(np.array([0.25, 0.75, -0.75, -0.25]) * np.pi, rel=1e-15)
    assert arctan2(np.array([0.0, -0.0]), np.array([-1.0, -1.0])).tolist() == [math.pi, -math.pi]


def test_the_arc_tangent_takes_arrays_that_do_not_lie_in_one_piece() -> None:
    table = vectors(6)
    assert bits(arctan2(table[:, 0], table[:, 2])) == bits(arctan2(table[:, 0].copy(), table[:, 2].copy()))
    assert bits(arctan2(table.T, table.T)) == bits(arctan2(table, table).T)


def test_the_arc_tangent_refuses_arguments_of_different_sizes() -> None:
    with pytest.raises(ValueError, match="shape"):
        arctan2(np.zeros(2), np.zeros(3))
