# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Points at rest in axes that do not turn with LVLH: inertial ones, or ones that point at the Sun.

Equations: docs/controllers/eccentric.md.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.numeric.elementwise import Array, cross, dot, norm
from satform.orbits.frames import LvlhFrame
from satform.orbits.inertial_motion import ChiefMotion
from satform.orbits.path_reference import Path, Reference
from satform.orbits.sun import days_at, sun_position

AxesName = Literal["inertial", "sun"]

_APART = 30.0
"""Half the time over which the turning of axes is taken as a difference, s."""

_SECONDS_OF_DAY = 86400.0


@dataclass(frozen=True)
class AxesByStep:
    """Where axes point in LVLH at each step of a flight.

    Attributes:
        matrix: components along these axes to LVLH components, at each of K + 1 states, shape
            (..., K + 1, 3, 3).
        rate: its derivative with respect to time, in LVLH, 1/s, shape (..., K + 1, 3, 3).
        rate_change: mean derivative of the rate over each step, 1/s^2, shape (..., K, 3, 3).
    """

    matrix: Array
    rate: Array
    rate_change: Array


@dataclass(frozen=True, kw_only=True)
class TurningPointPath(Path):
    """A fixed point of other axes than LVLH, in which it therefore moves; its curve is a `FixedPoint`.

    Attributes:
        axes: in which the curve's position is given.
    """

    axes: AxesByStep

    def reference(self, generalised_arc_length: Array, rate: Array, rate_change: Array) -> Reference:
        """Desired motion at time zero; it does not depend on the arc length, and later `at_step` has it.

        Args:
            generalised_arc_length: of no effect but for its shape (...).
            rate: likewise.
            rate_change: likewise.

        Returns:
            Desired motion, shape (..., 3).
        """
        return self._at(self._position(generalised_arc_length), 0)

    def at_step(
        self,
        generalised_arc_length: Array,
        rate: Array,
        rate_change: Array,
        duration: float,
        number: int = 0,
    ) -> Reference:
        """Desired motion for one control period.

        Args:
            generalised_arc_length: of no effect but for its shape (...).
            rate: likewise.
            rate_change: likewise.
            duration: of no effect; the axes are those of the flight's own control period.
            number: of the step; beyond the last one of the flight the last one's motion is returned.

        Returns:
            Position and velocity at the start of the step, mean acceleration over it, shape (..., 3).
        """
        return self._at(self._position(generalised_arc_length), number)

    def _position(self, generalised_arc_length: Array) -> Array:
        """Place in its own axes, m, shape (..., 3)."""
        return self.curve.point(np.asarray(generalised_arc_length, dtype=np.float64)).position

    def _at(self, position: Array, number: int) -> Reference:
        step = min(number, self.axes.rate_change.shape[-3] - 1)
        tables = (self.axes.matrix, self.axes.rate, self.axes.rate_change)
        return Reference(*(_times(table[..., step, :, :], position) for table in tables))


def axes_by_step(name: AxesName, chief: ChiefMotion, step: float) -> AxesByStep:
    """Inertial axes, or axes that point at the Sun, as LVLH has them during a flight.

    Args:
        name: `inertial` for those of GCRF. `sun` for x from the chief to the Sun, z in the plane of x and the
            inertial z axis and square to x, and y completing them.
        chief: its motion at each state of the flight.
        step: control period, s.

    Returns:
        The axes at each state; a velocity in them is one in LVLH as the chief's frame turns.

    Source: transport theorem; the Sun by brahe's analytic ephemeris, seen from the chief and without
    aberration.
    """
    frame = chief.frames
    axes, turning = _inertial(frame) if name == "inertial" else _towards_sun(chief, step)
    matrix = np.stack([frame.vector_to_lvlh(axis) for axis in axes], axis=-1)
    columns = [
        frame.vector_to_lvlh(turn) - cross(frame.rate, matrix[..., column])
        for column, turn in enumerate(turning)
    ]
    rate = np.stack(columns, axis=-1)
    return AxesByStep(matrix, rate, (rate[1:] - rate[:-1]) / step)


def _inertial(frame: LvlhFrame) -> tuple[list[Array], list[Array]]:
    """The axes of GCRF and their derivatives, inertial components, three of shape (K + 1, 3) each."""
    shape = frame.radial.shape
    axes = [np.broadcast_to(axis, shape) for axis in np.eye(3)]
    return axes, [np.zeros(shape)] * 3


def _towards_sun(chief: ChiefMotion, step: float) -> tuple[list[Array], list[Array]]:
    """Axes whose x points at the Sun and their derivatives, likewise."""
    days = days_at(chief.epoch) + step * np.arange(len(chief.position)) / _SECONDS_OF_DAY
    apart = _APART / _SECONDS_OF_DAY

    def at(offset: float) -> list[Array]:
        sun = np.array([sun_position(day) for day in (days + offset * apart).tolist()])
        return _axes_along(sun - (chief.position + offset * _APART * chief.velocity))

    here, before, after = at(0.0), at(-1.0), at(1.0)
    return here, [(late - early) / (2.0 * _APART) for early, late in zip(before, after, strict=True)]


def _axes_along(direction: Array) -> list[Array]:
    """Three unit vectors of which the first has a direction, shape (K, 3) each."""
    first = direction / norm(direction)[..., None]
    pole = np.broadcast_to(np.array([0.0, 0.0, 1.0]), first.shape)
    third = pole - dot(pole, first)[..., None] * first
    third = third / norm(third)[..., None]
    return [first, cross(third, first), third]


def _times(matrix: Array, vector: Array) -> Array:
    """Matrices of shape (..., 3, 3) times vectors of shape (..., 3), without BLAS, whose bits vary."""
    x, y, z = vector[..., 0:1], vector[..., 1:2], vector[..., 2:3]
    product: Array = matrix[..., 0] * x + matrix[..., 1] * y + matrix[..., 2] * z
    return product
