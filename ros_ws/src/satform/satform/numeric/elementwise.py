# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Vector algebra that gives the same bits for one satellite and for a thousand.

Everything on the flight path is built from element-wise operations in a fixed order. Matrix
products go through BLAS, whose order of summation depends on the shape of its arguments; `np.arctan2`
and powers (`**`, the square too) differ in the last bit between an array and a scalar. None of them
is used in flight.
The last axis of an array holds the components x, y, z; leading axes, if any, are satellites.
"""

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.int64]
"""Indices of rows, or numbers of steps."""

FLOAT_FUNCTIONS: dict[np.ufunc, Callable[..., float]] = {}
"""The function of Python that each function made by `over_arrays` calls."""

_PLAIN = (np.ndarray, np.float64, float)


def over_arrays(function: Callable[..., float], arguments: int = 1) -> Callable[..., Array]:
    """A function of Python's library on each element, so that one satellite and many get the same bits.

    Args:
        function: of floats.
        arguments: how many it takes.

    Returns:
        The same function of arrays of one shape.
    """
    every = np.frompyfunc(function, arguments, 1)
    FLOAT_FUNCTIONS[every] = function

    def computed(*values: Array) -> Array:
        found = every(*values)
        array: Array = found.astype(np.float64) if isinstance(found, np.ndarray) else np.asarray(found)
        return array

    return computed


_ARCTAN2 = over_arrays(math.atan2, 2)


def scalar(value: float) -> Array:
    """A number of one satellite, which stacks like an array and computes faster than one of no axes.

    Args:
        value: any number.

    Returns:
        The number with the interface of an array of shape ().
    """
    number: Array = np.asarray(value, dtype=np.float64)[()]
    return number


def joined(*components: Array) -> Array:
    """Numbers side by side on a new last axis, as `np.stack` has them in a third of its time.

    Args:
        components: n of them, all of one shape (...).

    Returns:
        Shape (..., n).
    """
    whole = blank((*np.shape(components[0]), len(components)), *components)
    for column, component in enumerate(components):
        whole[..., column] = component
    return whole


def blank(shape: tuple[int, ...], *parts: Array | float) -> Array:
    """An array without values yet, of the kind of those that are to be written into it.

    Args:
        shape: of the array.
        parts: what is going to be written into it.
    """
    for part in parts:
        if type(part) not in _PLAIN and isinstance(part, np.ndarray):
            return np.empty_like(part, shape=shape)
    return np.empty(shape)


def constant(shape: tuple[int, ...], value: float | Array) -> Array:
    """An array of one number, as `numpy.full` makes it.

    Args:
        shape: of the array.
        value: the number.
    """
    whole = blank(shape, np.asarray(value) if isinstance(value, int) else value)
    whole[...] = value
    return whole


def numbers(values: Array | float) -> Array:
    """Numbers as an array, as `numpy.asarray` has them; an array of any kind as it is."""
    return values if isinstance(values, np.ndarray) else np.asarray(values, dtype=np.float64)


def column(values: Array) -> Array:
    """Numbers with a new last axis, to be multiplied with vectors; a single one needs none, and saves time.

    Args:
        values: shape (...).

    Returns:
        Shape (..., 1); of a single number the number.
    """
    return values[..., None] if values.ndim else values


def dot(a: Array, b: Array) -> Array:
    """Scalar product over the last axis.

    Args:
        a: vectors, shape (..., 3).
        b: vectors, shape (..., 3), broadcast against `a`.

    Returns:
        Shape (...), in the product of the units of `a` and `b`.
    """
    product = a * b
    total: Array = product[..., 0] + product[..., 1] + product[..., 2]
    return total


def norm(a: Array) -> Array:
    """Euclidean length over the last axis: shape (..., 3) to shape (...), in the unit of `a`."""
    length: Array = np.sqrt(dot(a, a))
    return length


def cross(a: Array, b: Array) -> Array:
    """Vector product over the last axis.

    Args:
        a: vectors, shape (..., 3).
        b: vectors, shape (..., 3), of the same shape as `a` after broadcasting.

    Returns:
        Shape (..., 3), in the product of the units of `a` and `b`.
    """
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return joined(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


def arctan2(y: Array, x: Array) -> Array:
    """Quadrant-aware arc tangent with the same bits for any shape.

    Args:
        y: ordinates, any shape.
        x: abscissae, same shape as `y`.

    Returns:
        Angles in rad within [-pi, pi], same shape.
    """
    if np.shape(y) != np.shape(x):
        raise ValueError(f"ordinates have the shape {np.shape(y)}, and abscissae {np.shape(x)}")
    return _ARCTAN2(y, x)
