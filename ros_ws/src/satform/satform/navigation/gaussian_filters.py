# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Filters whose estimate is one normal distribution: extended, unscented and cubature Kalman filter.

The model of the motion is linear, so that all three predict alike and exactly. They differ in the update.
"""

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from satform.dynamics.linear import multiply
from satform.navigation.conditioning import LinearMeasurement, condition, factor
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.protocol import MeasurementFunction
from satform.numeric.elementwise import Array
from satform.numeric.matrix_algebra import product, symmetric, transposed


class Linearisation(Protocol):
    """How a filter makes a measurement linear."""

    def line(self, mean: Array, lower: Array, function: MeasurementFunction) -> LinearMeasurement:
        """The measurement as a line.

        Args:
            mean: of the state, shape (..., D).
            lower: Cholesky factor of its covariance, shape (..., D, D).
            function: what is measured.
        """


@dataclass(frozen=True)
class Derivative:
    """By the derivative at the mean.

    Source: Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation, ch. 10.3.
    """

    def line(self, mean: Array, lower: Array, function: MeasurementFunction) -> LinearMeasurement:
        """The tangent at the mean, taken to be exact."""
        slope = product(transposed(lower), transposed(function.jacobian(mean)))
        width = function.width
        return LinearMeasurement(function.predicted(mean), slope, np.zeros((width, width)))


@dataclass(frozen=True)
class SymmetricPoints:
    """By pairs of points on either side of the mean, along the columns of the Cholesky factor.

    The line is the regression of the measurement at the points, and its error what they leave of it.

    Attributes:
        alpha: spread of the points.
        beta: knowledge of the distribution, 2 for a normal one.
        kappa: further scaling, above -D.

    With the values left out these are the points of the third-degree cubature rule.

    Sources: Arasaratnam & Haykin 2009, IEEE Trans. Automatic Control 54(6) (cubature); Wan & van der Merwe
    2001, in Haykin (ed.), Kalman Filtering and Neural Networks, ch. 7 (scaled points); Lefebvre, Bruyninckx &
    De Schutter 2002, IEEE Trans. Automatic Control 47(8) (points as regression).
    """

    alpha: float = 1.0
    beta: float = 0.0
    kappa: float = 0.0

    def line(self, mean: Array, lower: Array, function: MeasurementFunction) -> LinearMeasurement:
        """The regression of the measurement at the points."""
        return self.regression(measured_differences(mean, lower, function, self.distance(mean.shape[-1])))

    def distance(self, size: int) -> float:
        """Of the points from the mean, for a state of D numbers, in standard deviations."""
        return self.alpha * math.sqrt(size + self.kappa)

    def regression(self, differences: "MeasuredDifferences") -> LinearMeasurement:
        """The line through measurements at the points."""
        weight = 1.0 / (differences.distance * differences.distance)
        bends = differences.second
        offset = bends[..., 0, :]
        for index in range(1, bends.shape[-2]):
            offset = offset + bends[..., index, :]
        offset = weight * offset
        apart = bends - offset[..., None, :]
        error = weight * product(transposed(apart), apart)
        # Weight of the mean itself in the covariance; the others weigh 1 / (2 distance^2) each.
        centre = 2.0 - bends.shape[-2] * weight - self.alpha * self.alpha + self.beta
        error = error + centre * (offset[..., :, None] * offset[..., None, :])
        return LinearMeasurement(differences.at_mean + offset, differences.first, error)


@dataclass(frozen=True)
class MeasuredDifferences:
    """Measurements at pairs of points mean + s c_j and mean - s c_j, c_j the columns of the Cholesky factor.

    Attributes:
        distance: s.
        at_mean: measurement at the mean, shape (..., m).
        first: difference within each pair over 2 s, shape (..., D, m).
        second: mean of each pair less `at_mean`, shape (..., D, m).
    """

    distance: float
    at_mean: Array
    first: Array
    second: Array


def measured_differences(
    mean: Array, lower: Array, function: MeasurementFunction, distance: float
) -> MeasuredDifferences:
    """Measurements at pairs of points.

    Args:
        mean: shape (..., D).
        lower: Cholesky factor, shape (..., D, D).
        function: what is measured.
        distance: of the points from the mean, in standard deviations.
    """
    centre, columns = mean[..., None, :], distance * transposed(lower)
    at_mean = function.predicted(mean)
    reference = at_mean[..., None, :]
    above = function.residual(function.predicted(centre + columns), reference)
    below = function.residual(function.predicted(centre - columns), reference)
    return MeasuredDifferences(distance, at_mean, (above - below) / (2.0 * distance), 0.5 * (above + below))


@dataclass(frozen=True)
class GaussianFilter:
    """Kalman filter with a linear model of the motion and measurements that are made linear.

    Its memory is the estimate.

    Attributes:
        linearisation: of measurements.
        draws: it needs no random numbers.
    """

    linearisation: Linearisation
    draws: int = field(default=0, init=False)

    def start(self, prior: GaussianEstimate, draws: Array) -> GaussianEstimate:
        """The prior."""
        return prior

    def predict(
        self, memory: GaussianEstimate, transition: Array, increment: Array, process: Array, draws: Array
    ) -> GaussianEstimate:
        """The estimate one control period later; arguments as of `protocol.Filter`."""
        half = product(transition, memory.covariance)
        covariance = product(half, transposed(transition)) + process
        return GaussianEstimate(multiply(transition, memory.mean) + increment, symmetric(covariance))

    def update(
        self, memory: GaussianEstimate, measured: Array, function: MeasurementFunction, draws: Array
    ) -> tuple[GaussianEstimate, Array]:
        """The estimate with a measurement worked in; arguments as of `protocol.Filter`.

        Raises:
            NotPositiveDefiniteError: the covariance is not positive definite.
        """
        lower = factor(memory.covariance)
        line = self.linearisation.line(memory.mean, lower, function)
        updated = condition(memory.mean, lower, line, measured, function)
        return GaussianEstimate(updated.mean, updated.covariance), updated.squared

    def estimate(self, memory: GaussianEstimate) -> GaussianEstimate:
        """The memory."""
        return memory

    def replaced(
        self, memory: GaussianEstimate, estimate: GaussianEstimate, draws: Array
    ) -> GaussianEstimate:
        """The other estimate."""
        return estimate


def extended_filter() -> GaussianFilter:
    """Extended Kalman filter."""
    return GaussianFilter(Derivative())


def unscented_filter(alpha: float = 0.1, beta: float = 2.0, kappa: float = 0.0) -> GaussianFilter:
    """Unscented Kalman filter; arguments as the attributes of `SymmetricPoints`."""
    return GaussianFilter(SymmetricPoints(alpha, beta, kappa))


def cubature_filter() -> GaussianFilter:
    """Cubature Kalman filter of the third degree."""
    return GaussianFilter(SymmetricPoints())
