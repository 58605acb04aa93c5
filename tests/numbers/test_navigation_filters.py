# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Consistency of navigation filters with a large initial error and ranges only, over 200 seeds."""

import numpy as np
import pytest
from scipy.stats import chi2

from range_measurement import PROCESS, TRANSITION, Array, Ranges, flight, prior
from satform.navigation.cubature_particle_filter import CubatureParticleFilter
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.gaussian_filters import GaussianFilter, cubature_filter, extended_filter

pytestmark = pytest.mark.unmeasured

# 200 m on each axis, seen from 1500 m: the sphere of equal range bends by 13 m, and the noise is 10 m.
START = prior(200.0, 0.05, (0.0, 1500.0, 0.0, 0.0, 0.0, 0.3))
FUNCTION = Ranges(np.zeros((1, 3)), 10.0)
SEEDS, STEPS = 200, 20


def error_squared(error: Array, covariance: Array) -> Array:
    """Normalised estimation error squared, shapes (..., 6) and (..., 6, 6)."""
    return np.einsum("...i,...ij,...j->...", error, np.linalg.inv(covariance), error)


def of_gaussian_filter(own: GaussianFilter, truth: Array, measured: Array) -> Array:
    """Normalised estimation error squared of all flights, which go side by side, shape (SEEDS, STEPS)."""
    memory = GaussianEstimate(
        np.broadcast_to(START.mean, (SEEDS, 6)), np.broadcast_to(START.covariance, (SEEDS, 6, 6))
    )
    found, nothing = np.empty((SEEDS, STEPS)), np.zeros(0)
    for step in range(STEPS):
        if step:
            memory = own.predict(memory, TRANSITION, np.zeros(6), PROCESS, nothing)
        memory, _ = own.update(memory, measured[:, step], FUNCTION, nothing)
        found[:, step] = error_squared(memory.mean - truth[:, step], memory.covariance)
    return found


def of_particle_filter(truth: Array, measured: Array) -> Array:
    """The same of the cubature particle filter."""
    own, found = CubatureParticleFilter(500), np.empty((SEEDS, STEPS))
    for seed in range(SEEDS):
        generator = np.random.default_rng(1_000_000 + seed)
        memory = own.start(START, generator.normal(size=own.draws))
        for step in range(STEPS):
            draws = generator.normal(size=own.draws)
            if step:
                memory = own.predict(memory, TRANSITION, np.zeros(6), PROCESS, draws)
            memory, _ = own.update(memory, measured[seed, step], FUNCTION, draws)
            estimate = own.estimate(memory)
            found[seed, step] = error_squared(estimate.mean - truth[seed, step], estimate.covariance)
    return found


def test_the_particle_filter_stays_consistent_where_cubature_and_extended_filter_do_not() -> None:
    flights = [flight(START, FUNCTION, STEPS, seed) for seed in range(SEEDS)]
    truth, measured = (np.array(parts) for parts in zip(*flights, strict=True))
    particle = of_particle_filter(truth, measured)
    cubature = of_gaussian_filter(cubature_filter(), truth, measured)
    extended = of_gaussian_filter(extended_filter(), truth, measured)
    low, high = chi2.ppf([1e-4, 1.0 - 1e-4], 6 * SEEDS) / SEEDS
    assert np.all((low < np.mean(particle, axis=0)) & (np.mean(particle, axis=0) < high))
    # Of the others it grows: the cubature filter is consistent at first.
    assert low < np.mean(cubature[:, 0]) < high
    assert np.mean(cubature[:, -1]) > 10.0 * high
    assert np.mean(extended[:, -1]) > np.mean(cubature[:, -1])
    assert np.median(extended[:, -1]) > np.median(cubature[:, -1]) > np.median(particle[:, -1])
