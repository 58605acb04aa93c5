# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Extended Kalman filter of a joint state."""

from dataclasses import dataclass

import numpy as np

from satform.dynamics.linear import multiply
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.protocol import MeasurementFunction
from satform.numeric.elementwise import Array
from satform.numeric.matrix_algebra import product, symmetric, transposed


@dataclass(frozen=True)
class ExtendedKalmanFilter:
    """Kalman filter about the predicted state, one number of a measurement after another.

    Source: Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation, ch. 10.3.
    """

    @property
    def draws(self) -> int:
        """It draws nothing."""
        return 0

    def start(self, prior: GaussianEstimate, draws: Array) -> GaussianEstimate:
        """As of every filter."""
        return prior

    def predict(
        self, memory: GaussianEstimate, transition: Array, increment: Array, process: Array, draws: Array
    ) -> GaussianEstimate:
        """As of every filter."""
        half = product(transition, memory.covariance)
        return GaussianEstimate(
            multiply(transition, memory.mean) + increment,
            symmetric(product(half, transposed(transition)) + process),
        )

    def update(
        self, memory: GaussianEstimate, measured: Array, function: MeasurementFunction, draws: Array
    ) -> tuple[GaussianEstimate, Array]:
        """As of every filter; the derivative is that at the predicted state for all numbers."""
        jacobian, variance = function.jacobian(memory.mean), function.variance
        residual = function.residual(measured, function.predicted(memory.mean))
        correction, covariance = np.zeros_like(memory.mean), memory.covariance
        squared = np.zeros(())
        for number in range(function.width):
            row = jacobian[number]
            column = multiply(covariance, row)
            spread = _dot(row, column) + variance[number]
            innovation = residual[number] - _dot(row, correction)
            squared = squared + innovation * innovation / spread
            gain = column / spread
            correction = correction + gain * innovation
            left = covariance - gain[:, None] * column[None, :]
            right = multiply(left, row)
            covariance = symmetric(
                left - right[:, None] * gain[None, :] + gain[:, None] * gain[None, :] * variance[number]
            )
        return GaussianEstimate(memory.mean + correction, covariance), squared

    def estimate(self, memory: GaussianEstimate) -> GaussianEstimate:
        """The memory is the estimate."""
        return memory

    def replaced(
        self, memory: GaussianEstimate, estimate: GaussianEstimate, draws: Array
    ) -> GaussianEstimate:
        """As of every filter."""
        return estimate


def _dot(first: Array, second: Array) -> Array:
    """Scalar product of two vectors, number by number."""
    product_ = first * second
    total: Array = product_[0]
    for number in range(1, len(product_)):
        total = total + product_[number]
    return total
