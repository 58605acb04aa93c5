# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Quantities carried with their first and second time derivatives, by the product and chain rules."""

from dataclasses import dataclass

import numpy as np

from satform.numeric.elementwise import Array, cross, dot


@dataclass(frozen=True)
class Jet:
    """A quantity that changes with time, to second order.

    Attributes:
        value: shape (...) for a scalar, (..., 3) for a vector.
        rate: first time derivative, same shape.
        acceleration: second time derivative, same shape.
    """

    value: Array
    rate: Array
    acceleration: Array

    def __add__(self, other: "Jet") -> "Jet":
        """Sum."""
        return Jet(self.value + other.value, self.rate + other.rate, self.acceleration + other.acceleration)

    def __sub__(self, other: "Jet") -> "Jet":
        """Difference."""
        return Jet(self.value - other.value, self.rate - other.rate, self.acceleration - other.acceleration)

    def __mul__(self, other: "Jet") -> "Jet":
        """Product of two scalars, or of each component with the component of the other."""
        return Jet(
            self.value * other.value,
            self.rate * other.value + self.value * other.rate,
            self.acceleration * other.value + 2.0 * self.rate * other.rate + self.value * other.acceleration,
        )

    def times(self, factor: float | Array) -> "Jet":
        """Product with a constant that broadcasts."""
        return Jet(self.value * factor, self.rate * factor, self.acceleration * factor)

    def along(self) -> "Jet":
        """A scalar as a factor of vectors: one axis more."""
        return Jet(self.value[..., None], self.rate[..., None], self.acceleration[..., None])


def constant(value: Array) -> Jet:
    """A quantity that does not change."""
    return Jet(value, np.zeros_like(value), np.zeros_like(value))


def scalar_product(a: Jet, b: Jet) -> Jet:
    """Scalar product of two vectors."""
    return Jet(
        dot(a.value, b.value),
        dot(a.rate, b.value) + dot(a.value, b.rate),
        dot(a.acceleration, b.value) + 2.0 * dot(a.rate, b.rate) + dot(a.value, b.acceleration),
    )


def vector_product(a: Jet, b: Jet) -> Jet:
    """Vector product of two vectors."""
    return Jet(
        cross(a.value, b.value),
        cross(a.rate, b.value) + cross(a.value, b.rate),
        cross(a.acceleration, b.value) + 2.0 * cross(a.rate, b.rate) + cross(a.value, b.acceleration),
    )


def reciprocal(divisor: Jet) -> Jet:
    """One divided by a scalar that is nowhere zero."""
    value = 1.0 / divisor.value
    slope = -value * value
    return Jet(
        value,
        slope * divisor.rate,
        slope * divisor.acceleration - 2.0 * value * slope * divisor.rate * divisor.rate,
    )


def square_root(radicand: Jet) -> Jet:
    """Square root of a positive scalar."""
    value = np.sqrt(radicand.value)
    slope = 0.5 / value
    bend = -0.5 * slope / radicand.value
    return Jet(
        value,
        slope * radicand.rate,
        slope * radicand.acceleration + bend * radicand.rate * radicand.rate,
    )


def unit(vector: Jet) -> Jet:
    """Direction of a vector that is nowhere zero."""
    return vector * reciprocal(square_root(scalar_product(vector, vector))).along()
