# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Ranges to fixed points as a measurement of navigation filters, and flights whose ranges are measured."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from satform.dynamics.cw import transition_matrix
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.kalman_filter import process_covariance

Array = NDArray[np.float64]

MEAN_MOTION = 0.0011
STEP = 45.0
TRANSITION = transition_matrix(MEAN_MOTION, STEP)
PROCESS = process_covariance(MEAN_MOTION, STEP, np.full(3, 1e-10))


@dataclass(frozen=True)
class Ranges:
    """Distances from points at rest, m."""

    points: Array
    noise: float

    @property
    def width(self) -> int:
        return len(self.points)

    @property
    def variance(self) -> Array:
        return np.full(self.width, self.noise**2)

    def predicted(self, state: Array) -> Array:
        return np.linalg.norm(state[..., None, :3] - self.points, axis=-1)

    def jacobian(self, state: Array) -> Array:
        away = state[..., None, :3] - self.points
        rows = np.zeros((*state.shape[:-1], self.width, 6))
        rows[..., :3] = away / np.linalg.norm(away, axis=-1, keepdims=True)
        return rows

    def residual(self, measured: Array, predicted: Array) -> Array:
        return measured - predicted


@dataclass(frozen=True)
class Components:
    """Position and velocity themselves, of which a filter knows every other number."""

    variance: Array
    width: int = 3

    def predicted(self, state: Array) -> Array:
        return state[..., ::2]

    def jacobian(self, state: Array) -> Array:
        return np.broadcast_to(np.eye(6)[::2], (*state.shape[:-1], 3, 6))

    def residual(self, measured: Array, predicted: Array) -> Array:
        return measured - predicted


def prior(position: float, velocity: float, mean: tuple[float, ...]) -> GaussianEstimate:
    """With the same standard deviation on each axis, m and m/s."""
    return GaussianEstimate(np.array(mean), np.diag(np.repeat([position, velocity], 3) ** 2))


def flight(
    start: GaussianEstimate, function: Ranges | Components, steps: int, seed: int
) -> tuple[Array, Array]:
    """True states, drawn from the prior, and what is measured of them: shapes (steps, 6) and (steps, m)."""
    generator = np.random.default_rng(seed)
    states = [generator.multivariate_normal(start.mean, start.covariance, method="cholesky")]
    for _ in range(steps - 1):
        noise = generator.multivariate_normal(np.zeros(6), PROCESS, method="cholesky")
        states.append(TRANSITION @ states[-1] + noise)
    truth = np.array(states)
    errors = generator.normal(size=(steps, function.width)) * np.sqrt(function.variance)
    return truth, function.predicted(truth) + errors
