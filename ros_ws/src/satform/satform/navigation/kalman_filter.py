# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Kalman filter on a linear model of relative motion: prediction, update, covariance, consistency (NEES).

The innovation gate and delayed measurements are in `estimator`, which calls this filter.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from satform.dynamics.cw import input_matrix, transition_matrix
from satform.dynamics.linear import multiply
from satform.dynamics.relative_motion_models import ModelName
from satform.dynamics.stepwise_model import StepwiseModel, stepwise_model
from satform.equipment.sensors.relative_motion import Measurement
from satform.numeric.elementwise import Array
from satform.numeric.matrix_algebra import product, symmetric, transposed
from satform.orbits.chief import KeplerianChief


@dataclass(frozen=True)
class Estimate:
    """A motion with its uncertainty.

    Attributes:
        state: position (m) and velocity (m/s), LVLH, shape (..., 6).
        covariance: of the state's error, shape (..., 6, 6).
    """

    state: Array
    covariance: Array


@dataclass(frozen=True)
class ProcessStep:
    """A filter's model of the motion over one control period, or over several in a row.

    Attributes:
        transition: of position (m) and velocity (m/s), LVLH, shape (..., 6, 6).
        response: to a command held over the period, shape (..., 6, 3).
        process: covariance that unknown acceleration adds in the period, shape (..., 6, 6).
    """

    transition: Array
    response: Array
    process: Array


class ProcessModel(Protocol):
    """A filter's model of the motion over each control period of a flight."""

    def over(self, number: int) -> ProcessStep:
        """The model from the step of this number, 0 at the start of the flight, to the next one."""

    def across(self, first: int, count: int) -> ProcessStep:
        """The model over several control periods in a row, with work that does not grow with their number.

        Args:
            first: number of the step at which the first of them begins.
            count: how many, at least 1.
        """


@dataclass(frozen=True)
class SteadyProcess:
    """A model that is the same in all control periods, as about a circular chief.

    Attributes:
        each: control period.
    """

    each: ProcessStep

    def over(self, number: int) -> ProcessStep:
        """The same for every step."""
        return self.each

    def across(self, first: int, count: int) -> ProcessStep:
        """As of every model: by doubling, one, two, four periods and so on."""
        found, power, rest = None, self.each, count
        while rest:
            if rest % 2:
                found = power if found is None else _in_a_row(found, power)
            rest //= 2
            if rest:
                power = _in_a_row(power, power)
        assert found is not None  # noqa: S101 - there is one period at least
        return found


@dataclass(frozen=True)
class ChangingProcess:
    """A model that follows the chief along its orbit.

    Attributes:
        motion: relative motion over each control period.
        density: power spectral density of the unknown acceleration on each axis, m^2/s^3, shape (..., 3).
    """

    motion: StepwiseModel
    density: Array

    def over(self, number: int) -> ProcessStep:
        """The model over one control period; the process covariance by three-point quadrature."""
        step = self.motion.over(number)
        process: Array = np.zeros((*self.density.shape[:-1], 6, 6))
        for weight, impulse in zip(step.weights.tolist(), step.impulses, strict=True):
            for axis in range(3):
                outer = weight * (impulse[:, axis, None] * impulse[None, :, axis])
                process = process + outer * self.density[..., axis, None, None]
        return ProcessStep(step.transition, step.response, process)

    def across(self, first: int, count: int) -> ProcessStep:
        """As of every model; the work grows with the revolutions of the chief."""
        if count == 1:
            return self.over(first)
        gap = self.motion.across(first, count)
        process: Array = np.zeros((*self.density.shape[:-1], 6, 6))
        for axis in range(3):
            column = gap.impulses[:, :, axis]
            outer = gap.weights[:, None, None] * (column[:, :, None] * column[:, None, :])
            process = process + np.add.reduce(outer, axis=0) * self.density[..., axis, None, None]
        return ProcessStep(gap.transition, gap.response, process)


def _in_a_row(first: ProcessStep, second: ProcessStep) -> ProcessStep:
    """A model over a stretch, and another one over the stretch after it, as one."""
    transition = second.transition
    half = product(transition, first.process)
    return ProcessStep(
        transition=product(transition, first.transition),
        response=product(transition, first.response) + second.response,
        process=symmetric(product(half, transposed(transition)) + second.process),
    )


@dataclass(frozen=True)
class KalmanFilter:
    """Kalman filter with known commands and measured position and velocity.

    Attributes:
        model: of the motion between measurements.
        variance: of each measured component, shape (..., 6).

    Source: Kalman 1960; Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and
    Navigation, ch. 5.
    """

    model: ProcessModel
    variance: Array

    def start(self, measurement: Measurement) -> Estimate:
        """The estimate from a first measurement alone."""
        state = np.concatenate((measurement.position, measurement.velocity), axis=-1)
        variance = np.broadcast_to(self.variance, state.shape)
        return Estimate(state, variance[..., None] * np.eye(6))

    def predict(self, estimate: Estimate, acceleration: Array, number: int) -> Estimate:
        """The estimate one control period later.

        Args:
            estimate: at the start of the period.
            acceleration: command held over it, m/s^2, shape (..., 3).
            number: of the step at which the period starts.
        """
        return self._predicted(estimate, acceleration, self.model.over(number))

    def predict_across(self, estimate: Estimate, acceleration: Array, first: int, count: int) -> Estimate:
        """The estimate several control periods later, with work that does not grow with their number.

        Args:
            estimate: at the start of the first period.
            acceleration: held over all of them, m/s^2, shape (..., 3).
            first: number of the step at which the first period starts.
            count: how many, at least 1; with 1 the same bits as `predict`.
        """
        return self._predicted(estimate, acceleration, self.model.across(first, count))

    def _predicted(self, estimate: Estimate, acceleration: Array, own: ProcessStep) -> Estimate:
        """The estimate at the end of what a model covers."""
        half = product(own.transition, estimate.covariance)
        covariance = product(half, transposed(own.transition)) + own.process
        state = multiply(own.transition, estimate.state) + multiply(own.response, acceleration)
        return Estimate(state, symmetric(covariance))

    def update(self, estimate: Estimate, measurement: Measurement) -> tuple[Estimate, Array]:
        """The estimate with a measurement of the same instant worked in.

        The six components are independent, so they are worked in one after another and nothing has
        to be inverted. The covariance is updated in Joseph's form and made symmetric, so that rounding
        cannot make it indefinite.

        Args:
            estimate: predicted.
            measurement: of the same step.

        Returns:
            The estimate, and the measurement's normalised innovation squared, shape (...): chi-square of
            6 degrees of freedom if the filter is consistent.

        Source: Bucy & Joseph 1968, Filtering for Stochastic Processes, ch. 16; Bar-Shalom, Li & Kirubarajan,
        ch. 5.2.3 (Joseph form), ch. 5.4 (normalised innovation squared).
        """
        measured = np.concatenate((measurement.position, measurement.velocity), axis=-1)
        state, covariance = estimate.state, estimate.covariance
        squared = np.zeros(state.shape[:-1])
        for index in range(6):
            column = covariance[..., :, index]
            variance = self.variance[..., index]
            innovation_variance = column[..., index] + variance
            innovation = measured[..., index] - state[..., index]
            squared = squared + innovation * innovation / innovation_variance
            gain = column / innovation_variance[..., None]
            state = state + gain * innovation[..., None]
            # (I - k h) P (I - k h)' + k r k', with h picking one component.
            left = covariance - gain[..., :, None] * covariance[..., index, None, :]
            both = left - left[..., :, index, None] * gain[..., None, :]
            covariance = (
                both + (gain[..., :, None] * gain[..., None, :]) * np.asarray(variance)[..., None, None]
            )
        return Estimate(state, symmetric(covariance)), squared


def process_model(
    model: ModelName,
    mean_motion: float,
    step: float,
    acceleration_density: Array,
    chief: KeplerianChief | None = None,
) -> ProcessModel:
    """The model of a name, for one chief and one control period.

    Args:
        model: of the relative motion.
        mean_motion: of the chief, rad/s.
        step: control period, s.
        acceleration_density: power spectral density of the unknown acceleration on each axis, taken to
            be white, m^2/s^3, shape (3,).
        chief: its orbit; None for a circular one in an unknown plane.

    Raises:
        ValueError: the model does not know such an orbit.
    """
    motion = stepwise_model(model, chief, step)
    if motion is not None:
        return ChangingProcess(motion, acceleration_density)
    return SteadyProcess(
        ProcessStep(
            transition=transition_matrix(mean_motion, step),
            response=input_matrix(mean_motion, step),
            process=process_covariance(mean_motion, step, acceleration_density),
        )
    )


def process_covariance(mean_motion: float, step: float, acceleration_density: Array) -> Array:
    """Covariance that white acceleration adds to a free CW motion over a time span.

    Args:
        mean_motion: of the chief, rad/s.
        step: s.
        acceleration_density: power spectral density on each axis, m^2/s^3, shape (3,).

    Returns:
        Shape (6, 6), in m and m/s. The integral is taken by twelve-point Gauss-Legendre quadrature.

    Source: Bar-Shalom, Li & Kirubarajan, ch. 4.3 (discretised continuous white noise).
    """
    abscissae, weights = np.polynomial.legendre.leggauss(12)
    total = np.zeros((6, 6))
    for abscissa, weight in zip(abscissae, weights, strict=True):
        response = transition_matrix(mean_motion, 0.5 * step * (1.0 + abscissa))[:, 3:]
        total += 0.5 * step * weight * (response * acceleration_density) @ response.T
    return total


def normalised_error_squared(error: Array, covariance: Array) -> Array:
    """Normalised estimation error squared (NEES): chi-square of 6 degrees if a filter is consistent.

    Args:
        error: estimate less truth, shape (..., 6).
        covariance: of the filter's estimate, shape (..., 6, 6).

    Returns:
        Dimensionless, shape (...). For analysis, not for flight.

    Source: Bar-Shalom, Li & Kirubarajan, ch. 5.4.
    """
    squared: Array = np.sum(error * np.linalg.solve(covariance, error[..., None])[..., 0], axis=-1)
    return squared
