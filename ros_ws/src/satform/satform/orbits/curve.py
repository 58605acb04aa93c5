# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What every closed relative orbit offers, and the one that is only a point."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from satform.numeric.elementwise import Array, numbers


@dataclass(frozen=True)
class CurvePoint:
    """A curve's local shape.

    Attributes:
        position: m, LVLH, shape (..., 3).
        tangent: unit vector in the sense of increasing angle, shape (..., 3).
        normal: unit vector towards the centre of curvature, shape (..., 3).
        curvature: 1/m, shape (...).
        speed: arc length per angle dl/dtheta, m/rad, shape (...).
        speed_slope: d2l/dtheta2, m/rad^2, shape (...).
    """

    position: Array
    tangent: Array
    normal: Array
    curvature: Array
    speed: Array
    speed_slope: Array


class Curve(Protocol):
    """A closed curve that a satellite may be commanded to fly along, or many stacked ones."""

    @property
    def perimeter(self) -> Array:
        """Perimeter, m, shape (...); zero for a fixed point."""

    def angle_at(self, arc_length: Array) -> Array:
        """Angle (rad, shape (...)) at an arc length (m, shape (...)), any number of revolutions."""

    def arc_length_at(self, angle: Array) -> Array:
        """Arc length (m, shape (...)) at an angle (rad, shape (...)), any number of revolutions."""

    def point(self, angle: Array) -> CurvePoint:
        """Position, Frenet frame and speed at an angle (rad, shape (...))."""

    def nearest(self, position: Array) -> Array:
        """Angle (rad, shape (...), within one revolution) of the point closest to a position (m, LVLH)."""


@runtime_checkable
class QuickCurve(Curve, Protocol):
    """A curve on which a point near a known one is found in less time than any point; it need not be one."""

    def angle_after(self, angle: Array, here: CurvePoint, ahead: Array, arc_length: Array) -> Array:
        """Angle at an arc length a little after a known point: `angle_at`, to rounding, in less time.

        Args:
            angle: of the known point, rad, shape (...).
            here: the curve's local shape there.
            ahead: arc length from there on, m, shape (...), of either sign.
            arc_length: of the point that is asked for, m, shape (...).

        Returns:
            rad, shape (...).
        """


@dataclass(frozen=True)
class FixedPoint:
    """A curve without extent: the satellite is to stay where it is.

    The angle equals the arc length, so that both have an inverse; nothing depends on either.

    Attributes:
        position: m, LVLH, shape (..., 3).
        perimeter: zero, m, shape (...).
    """

    position: Array
    perimeter: Array

    def angle_at(self, arc_length: Array) -> Array:
        """The arc length itself, shape (...)."""
        return numbers(arc_length)

    def arc_length_at(self, angle: Array) -> Array:
        """The angle itself, shape (...)."""
        return numbers(angle)

    def point(self, angle: Array) -> CurvePoint:
        """The point, with zero vectors for the frame that it does not have."""
        zero = 0.0 * (angle + self.perimeter)
        vector = zero[..., None] * self.position
        return CurvePoint(
            position=self.position + vector,
            tangent=vector,
            normal=vector,
            curvature=zero,
            speed=zero,
            speed_slope=zero,
        )

    def nearest(self, position: Array) -> Array:
        """Zero, shape (...): there is only one point."""
        return np.zeros(np.broadcast_shapes(np.shape(position), self.position.shape)[:-1])
