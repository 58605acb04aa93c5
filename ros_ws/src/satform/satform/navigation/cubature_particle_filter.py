# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Cubature particle filter: many cubature Kalman filters, weighted and resampled as particles."""

from dataclasses import dataclass, field, replace

import numpy as np

from satform.dynamics.linear import multiply
from satform.navigation.conditioning import condition, factor
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.gaussian_filters import SymmetricPoints, measured_differences
from satform.navigation.protocol import MeasurementFunction
from satform.numeric.elementwise import Array, Indices
from satform.numeric.matrix_algebra import product, symmetric, transposed
from satform.numeric.positive_definite import cholesky, log_diagonal, solve_lower, solve_upper
from satform.numeric.stacking import take

NARROWEST = 0.1
"""Least factor by which a split narrows a kernel along an axis."""


@dataclass(frozen=True)
class Particles:
    """Weighted normal distributions, whose sum is the distribution of the state.

    Attributes:
        means: of each particle, shape (P, D).
        covariances: of each particle, shape (P, D, D).
        log_weights: natural logarithms of the weights up to a common summand, the largest 0, shape (P,).
        updates: number of measurements so far, which keeps apart the random numbers of two in one step.
    """

    means: Array
    covariances: Array
    log_weights: Array
    updates: int


@dataclass(frozen=True)
class CubatureParticleFilter:
    """Particle filter each of whose particles is propagated and proposed by a cubature Kalman filter.

    A particle is a normal distribution. An update has four parts:

    1. A particle along whose axes the measurement is too far from a line is split: narrowed along these axes,
       and moved at random by as much as it lost in width. The distribution stays the same.
    2. A cubature filter works the measurement into each particle. The result is the particle's proposal.
    3. A sample of the proposal gives the particle's weight: likelihood times prior over proposal. If the
       measurement is a line, that is its probability under the particle, whatever the sample is.
    4. When the effective number of particles is small, they are resampled systematically.

    With points for particles, as in the filter for large process noise, a single one would soon have all of
    the weight: the unknown accelerations of satellites are too small to separate copies after a resampling.

    Attributes:
        particles: their number P, at least 2.
        curvature: largest mean deviation of a measurement from its line along an axis of a particle, in
            standard deviations of the sensor's noise; beyond it the particle is split.
        resampling: fraction of P; with a smaller effective number of particles they are resampled.
        draws: normal numbers of a step, which seed a generator.

    Sources: Arasaratnam & Haykin 2009, IEEE Trans. Automatic Control 54(6) (cubature filter); van der Merwe,
    Doucet, de Freitas & Wan 2000, The unscented particle filter, NIPS 13 (proposals by a filter); Kotecha &
    Djuric 2003, IEEE Trans. Signal Processing 51(10) (normal distributions as particles); Tuggle & Zanetti
    2018, J. Guidance, Control, and Dynamics 41(3) (splitting along nonlinear axes of a measurement); Kitagawa
    1996, J. Computational and Graphical Statistics 5(1) (systematic resampling).
    """

    particles: int = 500
    curvature: float = 0.1
    resampling: float = 0.2
    draws: int = field(default=4, init=False)

    def start(self, prior: GaussianEstimate, draws: Array) -> Particles:
        """All particles are the prior; the first measurement splits them."""
        count, size = self.particles, len(prior.mean)
        # A component of all particles is in one piece of memory: operations are several times as fast.
        means = np.asfortranarray(np.broadcast_to(prior.mean, (count, size)))
        covariances = np.asfortranarray(np.broadcast_to(prior.covariance, (count, size, size)))
        return Particles(means, covariances, np.zeros(count), 0)

    def predict(
        self, memory: Particles, transition: Array, increment: Array, process: Array, draws: Array
    ) -> Particles:
        """The particles one control period later; arguments as of `protocol.Filter`."""
        half = product(transition, memory.covariances)
        covariances = symmetric(product(half, transposed(transition)) + process)
        return replace(memory, means=multiply(transition, memory.means) + increment, covariances=covariances)

    def update(
        self, memory: Particles, measured: Array, function: MeasurementFunction, draws: Array
    ) -> tuple[Particles, Array]:
        """The particles with a measurement worked in; arguments as of `protocol.Filter`.

        Raises:
            NotPositiveDefiniteError: the covariance of a particle is not positive definite.
        """
        generator = _generator(memory.updates, draws)
        points = SymmetricPoints()
        distance = points.distance(memory.means.shape[-1])
        means, lower = memory.means, factor(memory.covariances)
        differences = measured_differences(means, lower, function, distance)
        narrowed = self._narrowed(differences.second, distance, function.variance)
        if np.min(narrowed) < 1.0:
            moved = np.sqrt(1.0 - narrowed * narrowed) * _normals(generator, means.shape)
            means = means + multiply(lower, moved)
            lower = lower * narrowed[..., None, :]
            differences = measured_differences(means, lower, function, distance)
        line = points.regression(differences)
        updated = condition(means, lower, line, measured, function)
        squared = _innovation_squared(
            weights(memory.log_weights), updated.innovation, updated.innovation_covariance
        )

        root = factor(updated.covariance)
        normals = _normals(generator, means.shape)
        samples = updated.mean + multiply(root, normals)
        residual = function.residual(measured, function.predicted(samples))
        white = solve_lower(lower, (samples - means)[..., None])[..., 0]
        log_weights = (
            memory.log_weights
            - 0.5 * (_total(residual * residual / function.variance) + _total(white * white))
            + 0.5 * _total(normals * normals)
            + (log_diagonal(root) - log_diagonal(lower))
        )
        found = Particles(
            updated.mean, updated.covariance, log_weights - np.max(log_weights), memory.updates + 1
        )
        return self._resampled(found, float(generator.random())), squared

    def estimate(self, memory: Particles) -> GaussianEstimate:
        """Mean and covariance of the sum of all particles."""
        fractions = weights(memory.log_weights)
        mean = _sum(fractions[:, None] * memory.means)
        apart = memory.means - mean
        within = _sum(fractions[:, None, None] * memory.covariances)
        between = _sum(fractions[:, None, None] * (apart[:, :, None] * apart[:, None, :]))
        return GaussianEstimate(mean, symmetric(within + between))

    def replaced(self, memory: Particles, estimate: GaussianEstimate, draws: Array) -> Particles:
        """The particles shifted and stretched so that their sum has another mean and covariance."""
        before = self.estimate(memory)
        # T = (root after) (root before)^-1, as the transpose of the solution of L' T' = (root after)'.
        stretch = transposed(solve_upper(factor(before.covariance), transposed(factor(estimate.covariance))))
        return replace(
            memory,
            means=estimate.mean + multiply(stretch, memory.means - before.mean),
            covariances=symmetric(product(product(stretch, memory.covariances), transposed(stretch))),
        )

    def _narrowed(self, second: Array, distance: float, variance: Array) -> Array:
        """Factor of the width of each particle along each column of its Cholesky factor, shape (P, D).

        Args:
            second: second differences of the measurement, shape (P, D, m).
            distance: at which they were taken.
            variance: of the sensor, shape (m,).
        """
        deviation = np.max(np.abs(second) / np.sqrt(variance), axis=-1) / (distance * distance)
        # The deviation is quadratic in the width.
        factor_squared = self.curvature / np.maximum(deviation, self.curvature)
        narrowed: Array = np.sqrt(np.maximum(factor_squared, NARROWEST * NARROWEST))
        return narrowed

    def _resampled(self, memory: Particles, offset: float) -> Particles:
        """The same number of particles of equal weight, where few have most of the weight."""
        fractions = weights(memory.log_weights)
        if 1.0 / float(_sum(fractions * fractions)) >= self.resampling * len(fractions):
            return memory
        rows = systematic_sample(fractions, offset)
        return replace(
            memory,
            means=take(memory.means, rows),
            covariances=take(memory.covariances, rows),
            log_weights=np.zeros(len(fractions)),
        )


def weights(log_weights: Array) -> Array:
    """Weights with the sum 1, shape (P,), from their logarithms up to a common summand."""
    relative = np.exp(log_weights - np.max(log_weights))
    fractions: Array = relative / _sum(relative)
    return fractions


def systematic_sample(fractions: Array, offset: float) -> Indices:
    """Indices of as many particles as there are, each as often as its weight says, to the next whole number.

    Args:
        fractions: weights with the sum 1, shape (P,).
        offset: random number within [0, 1).

    Returns:
        Ascending, shape (P,).
    """
    count = len(fractions)
    edges = np.cumsum(fractions)
    found = np.searchsorted(edges, (np.arange(count) + offset) / count * edges[-1], side="right")
    rows: Indices = np.minimum(found, count - 1)
    return rows


def _innovation_squared(fractions: Array, innovation: Array, covariance: Array) -> Array:
    """Normalised innovation squared under the sum of all particles, shape ()."""
    mean = _sum(fractions[:, None] * innovation)
    apart = innovation - mean
    between = apart[:, :, None] * apart[:, None, :]
    root = cholesky(_sum(fractions[:, None, None] * (covariance + between)))
    white = solve_lower(root, mean[:, None])[:, 0]
    return np.asarray(_total(white * white))


def _generator(updates: int, draws: Array) -> np.random.Generator:
    """A generator seeded by the numbers of a step: an update needs more than a seeded stream retains."""
    seeds = np.ascontiguousarray(draws).view(np.uint32)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([updates, *seeds.tolist()])))


def _normals(generator: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Standard normal numbers, a component of all particles in one piece of memory."""
    return generator.standard_normal(shape[::-1]).T


def _total(values: Array) -> Array:
    """The sum over the last axis in a fixed order, shape (..., n) to (...)."""
    total: Array = values[..., 0]
    for index in range(1, values.shape[-1]):
        total = total + values[..., index]
    return total


def _sum(values: Array) -> Array:
    """The sum over the first axis one after another, whatever the order of memory."""
    total: Array = np.cumsum(values, axis=0)[-1]
    return total
