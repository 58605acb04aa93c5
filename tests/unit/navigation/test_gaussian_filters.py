# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Extended, unscented and cubature Kalman filter against the textbook's formulas and the chi-square band."""

import numpy as np
import pytest
from scipy.stats import chi2

from range_measurement import PROCESS, TRANSITION, Array, Components, Ranges, flight, prior
from satform.navigation.cubature_particle_filter import CubatureParticleFilter
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.gaussian_filters import (
    GaussianFilter,
    cubature_filter,
    extended_filter,
    unscented_filter,
)
from satform.navigation.protocol import Filter
from satform.numeric.positive_definite import NotPositiveDefiniteError

GAUSSIAN = {"extended": extended_filter(), "unscented": unscented_filter(), "cubature": cubature_filter()}
FILTERS: dict[str, Filter] = {**GAUSSIAN, "cubature_particle": CubatureParticleFilter(20)}
START = prior(200.0, 0.2, (100.0, 1500.0, 300.0, 0.1, 0.0, 0.3))
DRAWS = np.arange(4.0)


def textbook(
    start: GaussianEstimate, measured: Array, variance: Array
) -> tuple[list[Array], list[Array], list[float]]:
    """Kalman filter for every other number of the state: means, covariances, innovations squared."""
    mean, covariance, output = start.mean, start.covariance, np.eye(6)[::2]
    means, covariances, squared = [], [], []
    for number, reading in enumerate(measured):
        if number:
            mean, covariance = TRANSITION @ mean, TRANSITION @ covariance @ TRANSITION.T + PROCESS
        spread = output @ covariance @ output.T + np.diag(variance)
        gain = covariance @ output.T @ np.linalg.inv(spread)
        innovation = reading - output @ mean
        mean, covariance = mean + gain @ innovation, (np.eye(6) - gain @ output) @ covariance
        means.append(mean)
        covariances.append(covariance)
        squared.append(float(innovation @ np.linalg.solve(spread, innovation)))
    return means, covariances, squared


@pytest.mark.parametrize("name", FILTERS)
def test_for_a_linear_measurement_each_filter_is_the_kalman_filter(name: str) -> None:
    own, function = FILTERS[name], Components(np.array([4.0, 9.0, 1e-4]))
    _, measured = flight(START, function, 15, seed=3)
    memory = own.start(START, DRAWS)
    for number, (reading, *expected) in enumerate(
        zip(measured, *textbook(START, measured, function.variance), strict=True)
    ):
        if number:
            memory = own.predict(memory, TRANSITION, np.zeros(6), PROCESS, DRAWS)
        memory, squared = own.update(memory, reading, function, DRAWS)
        found, scale = own.estimate(memory), np.sqrt(np.diag(expected[1]))
        assert np.allclose((found.mean - expected[0]) / scale, 0.0, atol=1e-6)
        assert np.allclose((found.covariance - expected[1]) / scale / scale[:, None], 0.0, atol=1e-6)
        assert float(squared) == pytest.approx(expected[2], rel=1e-6)


@pytest.mark.parametrize("name", GAUSSIAN)
def test_from_a_small_error_each_filter_is_consistent(name: str) -> None:
    # 200 flights at once, along a leading axis.
    own, runs, steps = GAUSSIAN[name], 200, 20
    start = prior(5.0, 0.01, (100.0, 1500.0, 300.0, 0.1, 0.0, 0.3))
    function = Ranges(np.array([[0.0, 0.0, 0.0], [0.0, 400.0, -900.0]]), 2.0)
    flown = [flight(start, function, steps, seed) for seed in range(runs)]
    truth, measured = (np.array(parts) for parts in zip(*flown, strict=True))
    memory = GaussianEstimate(
        np.broadcast_to(start.mean, (runs, 6)), np.broadcast_to(start.covariance, (runs, 6, 6))
    )
    for step in range(steps):
        if step:
            memory = own.predict(memory, TRANSITION, np.zeros(6), PROCESS, DRAWS)
        memory, innovation_squared = own.update(memory, measured[:, step], function, DRAWS)
        error = memory.mean - truth[:, step]
        error_squared = np.einsum("ri,rij,rj->r", error, np.linalg.inv(memory.covariance), error)
        for squared, size in ((error_squared, 6), (innovation_squared, 2)):
            low, high = chi2.ppf([1e-4, 1.0 - 1e-4], size * runs) / runs
            assert low < np.mean(squared) < high


@pytest.mark.parametrize("name", FILTERS)
def test_measurements_a_million_times_as_accurate_as_the_prior_leave_a_covariance(name: str) -> None:
    own, function = FILTERS[name], Ranges(np.array([[0.0, 0.0, 0.0], [0.0, 400.0, -900.0]]), 1e-3)
    start = prior(1000.0, 1.0, (100.0, 15_000.0, 300.0, 0.1, 0.0, 0.3))
    _, measured = flight(start, function, 30, seed=4)
    memory = own.start(start, DRAWS)
    for number, reading in enumerate(measured):
        if number:
            memory = own.predict(memory, TRANSITION, np.zeros(6), PROCESS, DRAWS)
        memory, _ = own.update(memory, reading, function, DRAWS)
        covariance = own.estimate(memory).covariance
        assert np.array_equal(covariance, covariance.T)
        deviation = np.sqrt(np.diag(covariance))
        assert np.linalg.eigvalsh(covariance / deviation / deviation[:, None])[0] > 0.0


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("variance", [-1.0, np.nan])
def test_a_covariance_that_is_lost_ends_in_a_sentence(name: str, variance: float) -> None:
    own, function = FILTERS[name], Ranges(np.zeros((1, 3)), 1.0)
    lost = GaussianEstimate(START.mean, np.diag([1.0, variance, 1.0, 1.0, 1.0, 1.0]))
    sentence = (
        r"^the covariance of a navigation filter cannot be used: matrix .* row 1 .* is (-1|nan), .* noise"
    )
    with pytest.raises(NotPositiveDefiniteError, match=sentence):
        own.update(own.start(lost, DRAWS), np.array([1500.0]), function, DRAWS)


def test_an_update_has_the_same_bits_alone_and_among_others() -> None:
    function, generator = Ranges(np.zeros((1, 3)), 1.0), np.random.default_rng(1)
    roots = generator.normal(size=(7, 6, 6)) * 10.0
    many = GaussianEstimate(START.mean + generator.normal(size=(7, 6)), roots @ np.swapaxes(roots, -1, -2))
    measured = np.array([1500.0])
    for own in (*GAUSSIAN.values(), GaussianFilter(GAUSSIAN["cubature"].linearisation)):
        together, _ = own.update(many, measured, function, DRAWS)
        alone, _ = own.update(GaussianEstimate(many.mean[3], many.covariance[3]), measured, function, DRAWS)
        assert np.array_equal(together.mean[3], alone.mean)
        assert np.array_equal(together.covariance[3], alone.covariance)
