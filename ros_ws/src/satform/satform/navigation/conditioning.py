# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Update of a normal distribution by a measurement that a filter takes to be linear in it.

All filters here share the update. They differ in how they make the measurement linear: by its derivative
(`gaussian_filters.Derivative`) or by points of the distribution (`gaussian_filters.SymmetricPoints`). With
the Cholesky factor L of the covariance and x = mean + L y, the measurement becomes

    z = predicted + B' y + errors,    y normal with unit covariance,

where the errors are the sensor's and those of the line. Leading axes are many distributions at once.
"""

from dataclasses import dataclass

import numpy as np

from satform.navigation.protocol import MeasurementFunction
from satform.numeric.elementwise import Array
from satform.numeric.matrix_algebra import product, symmetric, transposed
from satform.numeric.positive_definite import NotPositiveDefiniteError, cholesky, solve_lower, solve_upper


@dataclass(frozen=True)
class LinearMeasurement:
    """A measurement as a line in the whitened state y.

    Attributes:
        predicted: mean of the measurement, shape (..., m).
        slope: B, its derivative by y, shape (..., D, m).
        error: covariance of the measurement about the line, without the sensor's noise, shape (..., m, m).
    """

    predicted: Array
    slope: Array
    error: Array


@dataclass(frozen=True)
class Conditioned:
    """A normal distribution that has a measurement worked in.

    Attributes:
        mean: shape (..., D).
        covariance: symmetric, shape (..., D, D).
        innovation: measured less predicted, shape (..., m).
        innovation_covariance: shape (..., m, m).
        squared: normalised innovation squared, shape (...).
    """

    mean: Array
    covariance: Array
    innovation: Array
    innovation_covariance: Array
    squared: Array


def factor(covariance: Array) -> Array:
    """The Cholesky factor of a filter's covariance, shape (..., D, D).

    Raises:
        NotPositiveDefiniteError: says what a filter whose covariance it is can be helped by.
    """
    try:
        return cholesky(covariance)
    except NotPositiveDefiniteError as error:
        raise NotPositiveDefiniteError(
            f"the covariance of a navigation filter cannot be used: {error}; the filter needs a larger "
            f"acceleration density or larger assumed noise of its sensors"
        ) from None


def condition(
    mean: Array, lower: Array, line: LinearMeasurement, measured: Array, function: MeasurementFunction
) -> Conditioned:
    """Work a measurement into normal distributions.

    The covariance is a sum of squares (Joseph's form): rounding cannot make it indefinite.

    Args:
        mean: shape (..., D).
        lower: Cholesky factor of the covariance, shape (..., D, D).
        line: the measurement in the whitened state.
        measured: shape (m,).
        function: what is measured; its variance is the sensor's noise.

    Raises:
        NotPositiveDefiniteError: a number of the covariance or of the measurement is not finite.

    Source: Bucy & Joseph 1968, Filtering for Stochastic Processes, ch. 16; for points Lefebvre, Bruyninckx &
    De Schutter 2002, IEEE Trans. Automatic Control 47(8).
    """
    noise = line.error + function.variance[:, None] * np.eye(function.width)
    across = transposed(line.slope)
    innovation_covariance = product(across, line.slope) + noise
    root = cholesky(innovation_covariance)
    innovation = function.residual(measured, line.predicted)
    white = solve_lower(root, innovation[..., None])[..., 0]
    squared = white[..., 0] * white[..., 0]
    for index in range(1, function.width):
        squared = squared + white[..., index] * white[..., index]
    gain = product(lower, transposed(solve_upper(root, solve_lower(root, across))))
    shift = product(gain, innovation[..., None])[..., 0]
    left = lower - product(gain, across)
    covariance = product(left, transposed(left)) + product(product(gain, noise), transposed(gain))
    return Conditioned(
        mean + shift, symmetric(covariance), innovation, innovation_covariance, np.asarray(squared)
    )
