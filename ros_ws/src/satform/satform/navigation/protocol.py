# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What navigation filters implement and what measurements look like to them.

The state of a filter is the motion of one satellite or of several side by side: of each its position (m) and
velocity (m/s) in LVLH, 6 numbers.
"""

from typing import Generic, Protocol, TypeVar

from satform.navigation.estimate import GaussianEstimate
from satform.numeric.elementwise import Array

MemoryT = TypeVar("MemoryT")


class MeasurementFunction(Protocol):
    """A measurement as a function of a filter's state."""

    @property
    def width(self) -> int:
        """Numbers of a measurement, m."""

    @property
    def variance(self) -> Array:
        """Variance of each number, shape (m,); their errors are independent."""

    def predicted(self, state: Array) -> Array:
        """The measurement without errors, shape (..., D) to (..., m)."""

    def jacobian(self, state: Array) -> Array:
        """Derivative of `predicted`, shape (..., D) to (..., m, D)."""

    def residual(self, measured: Array, predicted: Array) -> Array:
        """Measured less predicted, angles wrapped into [-pi, pi], shape (..., m)."""


class Filter(Protocol, Generic[MemoryT]):
    """A filter of one satellite; its memory is a frozen dataclass of arrays, which a checkpoint can hold.

    `start` (at step 0), `predict`, `update` and `replaced` of one step get the same standard normal numbers.
    A filter uses different ones of them in each.
    """

    @property
    def draws(self) -> int:
        """Standard normal numbers of a step."""

    def start(self, prior: GaussianEstimate, draws: Array) -> MemoryT:
        """The memory before the first measurement.

        Args:
            prior: at step 0.
            draws: standard normal numbers of step 0, shape (draws,).
        """

    def predict(
        self, memory: MemoryT, transition: Array, increment: Array, process: Array, draws: Array
    ) -> MemoryT:
        """The memory one control period later.

        Args:
            memory: at the start of the period.
            transition: of the state, shape (D, D).
            increment: by known accelerations, shape (D,).
            process: covariance that unknown acceleration adds, shape (D, D).
            draws: standard normal numbers of the step at the end of the period, shape (draws,).
        """

    def update(
        self, memory: MemoryT, measured: Array, function: MeasurementFunction, draws: Array
    ) -> tuple[MemoryT, Array]:
        """The memory with a measurement of the same instant worked in.

        Args:
            memory: predicted.
            measured: finite numbers, shape (m,).
            function: what is measured.
            draws: standard normal numbers of the step, shape (draws,).

        Returns:
            The memory, and the normalised innovation squared, shape (): chi-square of m degrees of freedom
            if the filter is consistent.
        """

    def estimate(self, memory: MemoryT) -> GaussianEstimate:
        """Mean and covariance of the state."""

    def replaced(self, memory: MemoryT, estimate: GaussianEstimate, draws: Array) -> MemoryT:
        """The memory that goes on from another estimate, as after fusion with those of neighbours.

        Args:
            memory: before.
            estimate: of the same step.
            draws: standard normal numbers of the step, shape (draws,).
        """
