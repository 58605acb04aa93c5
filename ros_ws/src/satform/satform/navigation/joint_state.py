# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The joint state of several satellites: its model over a control period, and measurements of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from satform.equipment.sensors.protocol import MeasurementModel, assumed_variance
from satform.navigation.kalman_filter import ProcessModel, ProcessStep
from satform.numeric.elementwise import Array

SIZE = 6
"""Numbers of the state of one satellite: position (m) and velocity (m/s), LVLH."""


@dataclass(frozen=True)
class JointStep:
    """Model of a joint state over one control period, or over several in a row.

    Attributes:
        transition: of the state, shape (D, D).
        increment: what the known accelerations add, shape (D,).
        process: covariance that unknown accelerations add, shape (D, D).
    """

    transition: Array
    increment: Array
    process: Array


@dataclass(frozen=True)
class JointModel:
    """Model of the motion of M satellites side by side, which do not act on each other.

    Attributes:
        commanded: of a satellite whose acceleration is known.
        unknown: of one whose acceleration is not.
        count: of the satellites, M.
    """

    commanded: ProcessModel
    unknown: ProcessModel
    count: int

    def over(self, number: int, acceleration: Array, known: Sequence[bool]) -> JointStep:
        """The model from the step of this number to the next one.

        Args:
            number: of the step, 0 at the start of the flight.
            acceleration: of each satellite over the period, m/s^2, shape (M, 3).
            known: whether that is the acceleration of each satellite; else it is not used.
        """
        return self._joined(self.commanded.over(number), self.unknown.over(number), acceleration, known)

    def across(self, first: int, count: int, acceleration: Array, known: Sequence[bool]) -> JointStep:
        """The model over several control periods in a row.

        Args:
            first: number of the step at which the first of them begins.
            count: how many, at least 1.
            acceleration: of each satellite, held over all of them, m/s^2, shape (M, 3).
            known: whether that is the acceleration of each satellite; else it is not used.
        """
        commanded, unknown = (model.across(first, count) for model in (self.commanded, self.unknown))
        return self._joined(commanded, unknown, acceleration, known)

    def _joined(
        self, commanded: ProcessStep, unknown: ProcessStep, acceleration: Array, known: Sequence[bool]
    ) -> JointStep:
        """The models of all satellites over the same time side by side."""
        size = SIZE * self.count
        transition, process, increment = np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
        for row, is_known in enumerate(known):
            own = commanded if is_known else unknown
            block = slice(SIZE * row, SIZE * (row + 1))
            transition[block, block], process[block, block] = own.transition, own.process
            if is_known:
                increment[block] = _response(own.response, acceleration[row])
        return JointStep(transition, increment, process)


@dataclass(frozen=True)
class JointMeasurement:
    """Readings of several channels as one function of the joint state.

    Attributes:
        models: of the channels.
        own: index of the observer among the satellites of the joint state.
        targets: index of the target of each channel; that of the observer for a channel without target.
        variance: of each number, shape (m,).
    """

    models: tuple[MeasurementModel, ...]
    own: int
    targets: tuple[int, ...]
    variance: Array

    @classmethod
    def of(
        cls,
        models: Sequence[MeasurementModel],
        own: int,
        targets: Sequence[int],
        readings: Sequence[Array],
    ) -> "JointMeasurement":
        """The function of some readings.

        Args:
            models: of their channels.
            own: index of the observer among the satellites of the joint state.
            targets: index of the target of each channel; likewise.
            readings: of each channel, on which its noise may depend.
        """
        pairs = zip(models, readings, strict=True)
        variance = np.concatenate([assumed_variance(model, reading) for model, reading in pairs])
        return cls(tuple(models), own, tuple(targets), variance)

    @property
    def width(self) -> int:
        """Numbers of all readings."""
        return sum(model.width for model in self.models)

    def predicted(self, state: Array) -> Array:
        """The readings without errors, shape (..., D) to (..., m)."""
        own = _block(state, self.own)
        found = [
            model.predicted(own, _block(state, target))
            for model, target in zip(self.models, self.targets, strict=True)
        ]
        return np.concatenate(found, axis=-1)

    def jacobian(self, state: Array) -> Array:
        """Derivative of `predicted`, shape (..., D) to (..., m, D)."""
        own = _block(state, self.own)
        found = []
        for model, target in zip(self.models, self.targets, strict=True):
            rows = np.zeros((*state.shape[:-1], model.width, state.shape[-1]))
            by_own, by_other = model.jacobian(own, _block(state, target))
            rows[..., SIZE * target : SIZE * (target + 1)] += by_other
            rows[..., SIZE * self.own : SIZE * (self.own + 1)] += by_own
            found.append(rows)
        return np.concatenate(found, axis=-2)

    def residual(self, measured: Array, predicted: Array) -> Array:
        """Measured less predicted, angles wrapped, shape (..., m)."""
        found, begin = [], 0
        for model in self.models:
            part = slice(begin, begin + model.width)
            found.append(model.residual(measured[..., part], predicted[..., part]))
            begin += model.width
        return np.concatenate(found, axis=-1)


def upper_triangle(matrix: Array) -> Array:
    """The upper triangle of a symmetric matrix, row by row, shape (D, D) to (D (D + 1) / 2,)."""
    rows, columns = np.triu_indices(matrix.shape[-1])
    return matrix[..., rows, columns]


def from_upper_triangle(numbers: Array, size: int) -> Array:
    """The symmetric matrix of a size whose upper triangle is given row by row."""
    rows, columns = np.triu_indices(size)
    matrix = np.zeros((size, size))
    matrix[rows, columns] = numbers
    matrix[columns, rows] = numbers
    return matrix


def _block(state: Array, row: int) -> Array:
    return state[..., SIZE * row : SIZE * (row + 1)]


def _response(response: Array, acceleration: Array) -> Array:
    """Response to an acceleration, shapes (6, 3) and (3,), in a fixed order."""
    product = response * acceleration
    found: Array = product[:, 0] + product[:, 1] + product[:, 2]
    return found
