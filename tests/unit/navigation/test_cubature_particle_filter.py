# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Cubature particle filter: against a posterior by brute force, resampling, random numbers, fusion."""

import dataclasses

import numpy as np
import pytest

from range_measurement import PROCESS, TRANSITION, Array, Ranges, flight, prior
from satform.navigation.cubature_particle_filter import (
    CubatureParticleFilter,
    Particles,
    systematic_sample,
    weights,
)
from satform.navigation.estimate import GaussianEstimate

START = prior(300.0, 0.1, (0.0, 1500.0, 0.0, 0.0, 0.0, 0.3))
FUNCTION = Ranges(np.zeros((1, 3)), 10.0)


def flown(own: CubatureParticleFilter, measured: Array, seed: int) -> Particles:
    """The particles after measurements of shape (count, 1)."""
    generator = np.random.default_rng(seed)
    memory = own.start(START, generator.normal(size=own.draws))
    for number, reading in enumerate(measured):
        draws = generator.normal(size=own.draws)
        if number:
            memory = own.predict(memory, TRANSITION, np.zeros(6), PROCESS, draws)
        memory, _ = own.update(memory, reading, FUNCTION, draws)
    return memory


def after(count: int, own: CubatureParticleFilter) -> Particles:
    """The particles after some measurements."""
    return flown(own, flight(START, FUNCTION, count, seed=0)[1], seed=0)


@pytest.mark.parametrize("count", [1, 4])
def test_mean_and_deviations_are_those_of_weighted_samples_of_the_prior(count: int) -> None:
    # Twenty filters with other random numbers: their mean is what is compared. A cubature filter alone has a
    # deviation of radius that is 28 % too large after one measurement.
    own = CubatureParticleFilter(500)
    _, measured = flight(START, FUNCTION, count, seed=11)
    found = [own.estimate(flown(own, measured, seed)) for seed in range(20)]
    # Process noise adds less than a metre in this time and is left out.
    samples = np.random.default_rng(1).multivariate_normal(START.mean, START.covariance, 400_000)
    log_likelihood = np.zeros(len(samples))
    for number, reading in enumerate(measured):
        if number:
            samples = samples @ TRANSITION.T
        log_likelihood -= 0.5 * ((reading - FUNCTION.predicted(samples))[:, 0] / FUNCTION.noise) ** 2
    share = np.exp(log_likelihood - log_likelihood.max())
    mean = np.average(samples, axis=0, weights=share)
    deviation = np.sqrt(np.average((samples - mean) ** 2, axis=0, weights=share))
    error = (np.mean([each.mean for each in found], axis=0) - mean) / deviation
    ratio = np.mean([np.sqrt(np.diag(each.covariance)) for each in found], axis=0) / deviation
    assert np.allclose(error, 0.0, atol=0.15)
    assert np.allclose(ratio, 1.0, atol=0.15)


def test_a_systematic_sample_has_each_particle_as_often_as_its_weight_says() -> None:
    share = np.random.default_rng(2).dirichlet(np.full(50, 0.3))
    for offset in (0.0, 0.3, 0.999999):
        rows = systematic_sample(share, offset)
        counts = np.bincount(rows, minlength=50)
        assert np.all(np.abs(counts - 50 * share) < 1.0)
        assert np.array_equal(rows, np.sort(rows))
    assert systematic_sample(np.full(4, 0.25), 0.5).tolist() == [0, 1, 2, 3]


def test_weights_far_below_the_smallest_number_are_still_a_distribution() -> None:
    assert weights(np.array([-2000.0, -2000.0 + np.log(3.0)])).tolist() == pytest.approx([0.25, 0.75])


def test_the_same_numbers_give_the_same_bits_and_others_other_particles() -> None:
    own = CubatureParticleFilter(50)
    memory = after(3, own)
    again = after(3, own)
    assert np.array_equal(memory.means, again.means)
    assert np.array_equal(memory.log_weights, again.log_weights)
    reading = np.array([1500.0])
    one, _ = own.update(memory, reading, FUNCTION, np.arange(4.0))
    other, _ = own.update(memory, reading, FUNCTION, np.arange(4.0) + 1.0)
    assert not np.array_equal(one.log_weights, other.log_weights)
    # A second measurement in the same step has random numbers of its own.
    second = dataclasses.replace(one, means=memory.means, covariances=memory.covariances)
    second, _ = own.update(
        dataclasses.replace(second, log_weights=memory.log_weights), reading, FUNCTION, np.arange(4.0)
    )
    assert not np.array_equal(one.log_weights, second.log_weights)


def test_splitting_particles_leaves_mean_and_covariance_of_their_sum() -> None:
    # A reading so inaccurate that it changes nothing, with a bound of curvature that splits all the same.
    own, function = CubatureParticleFilter(20_000, curvature=1e-9), Ranges(np.zeros((1, 3)), 1e6)
    memory, _ = own.update(own.start(START, np.arange(4.0)), np.array([1500.0]), function, np.arange(4.0))
    found, deviation = own.estimate(memory), np.sqrt(np.diag(START.covariance))
    assert not np.array_equal(memory.covariances[0], START.covariance)
    assert np.allclose((found.mean - START.mean) / deviation, 0.0, atol=0.03)
    assert np.allclose(found.covariance / deviation / deviation[:, None], np.eye(6), atol=0.04)


def test_fused_particles_have_the_fused_mean_and_covariance() -> None:
    own = CubatureParticleFilter(100)
    memory = after(3, own)
    before = own.estimate(memory)
    fused = GaussianEstimate(before.mean + 5.0, 0.5 * before.covariance)
    found = own.estimate(own.replaced(memory, fused, np.arange(4.0)))
    deviation = np.sqrt(np.diag(fused.covariance))
    assert np.allclose((found.mean - fused.mean) / deviation, 0.0, atol=1e-9)
    assert np.allclose((found.covariance - fused.covariance) / deviation / deviation[:, None], 0.0, atol=1e-9)
