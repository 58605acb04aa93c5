# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Fusion of exchanged estimates: closed forms, optimality, and consistency whatever the correlation."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from satform.consensus.graph import Graph, LineSpec, RingSpec
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.information_fusion import (
    FusionRule,
    NeighbourEstimate,
    fused,
    intersection,
    intersection_weight,
    metropolis_weights,
    propagated,
)
from satform.numeric.elementwise import Array

RULES: tuple[FusionRule, ...] = ("covariance_intersection", "information_consensus")


def random_covariance(random: np.random.Generator, size: int) -> Array:
    """Of numbers whose units differ by orders of magnitude."""
    root = random.normal(size=(size, size))
    scale = 10.0 ** random.uniform(-3.0, 3.0, size)
    return (root @ root.T + 0.1 * np.eye(size)) * np.outer(scale, scale)


def scalar(mean: float, variance: float) -> GaussianEstimate:
    return GaussianEstimate(np.array([mean]), np.array([[variance]]))


def test_of_two_scalars_the_intersection_is_the_better_one() -> None:
    # log(w b + (1 - w) a) is greatest at an end of [0, 1].
    received = [NeighbourEstimate(1, scalar(5.0, 1.0))]
    better = fused("covariance_intersection", scalar(2.0, 4.0), received, np.zeros(2))
    assert (better.mean[0], better.covariance[0, 0]) == (5.0, 1.0)


def test_consensus_on_scalars_is_the_weighted_mean_of_their_information() -> None:
    own, weights = scalar(2.0, 4.0), np.array([0.25, 0.25, 0.5])
    received = [NeighbourEstimate(1, scalar(5.0, 1.0)), NeighbourEstimate(2, scalar(-1.0, 0.5))]
    found = fused("information_consensus", own, received, weights)
    information = 0.25 / 4.0 + 0.25 / 1.0 + 0.5 / 0.5
    assert found.covariance[0, 0] == pytest.approx(1.0 / information, rel=1e-14)
    weighted = 0.25 * 2.0 / 4.0 + 0.25 * 5.0 / 1.0 + 0.5 * -1.0 / 0.5
    assert found.mean[0] == pytest.approx(weighted / information, rel=1e-14)


def test_the_weight_of_a_lost_message_goes_to_the_satellite_itself() -> None:
    third = 1.0 / 3.0
    received = [NeighbourEstimate(2, scalar(0.0, 1.0))]
    found = fused("information_consensus", scalar(3.0, 1.0), received, np.array([third, third, third]))
    assert found.mean[0] == pytest.approx(2.0, rel=1e-14)
    assert found.covariance[0, 0] == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("rule", RULES)
def test_without_messages_nothing_changes(rule: FusionRule) -> None:
    own = scalar(1.0, 2.0)
    assert fused(rule, own, [], np.array([0.5, 0.5])) is own


def test_crossed_ellipses_intersect_halfway() -> None:
    # Julier and Uhlmann's picture; by symmetry the weight is 1/2 and each variance 1 / (1/2 + 1/8).
    first = GaussianEstimate(np.array([1.0, 0.0]), np.diag([1.0, 4.0]))
    second = GaussianEstimate(np.array([0.0, 1.0]), np.diag([4.0, 1.0]))
    weight = intersection_weight(first.covariance, second.covariance)
    assert weight == 0.5
    found = intersection(first, second, weight)
    assert found.covariance == pytest.approx(np.diag([1.6, 1.6]), rel=1e-14)
    assert found.mean == pytest.approx([0.8, 0.8], rel=1e-14)


def test_equal_covariances_are_averaged() -> None:
    own = GaussianEstimate(np.zeros(6), random_covariance(np.random.default_rng(1), 6))
    assert intersection_weight(own.covariance, own.covariance) == 0.5


@pytest.mark.parametrize("seed", range(4))
def test_intersection_minimises_the_determinant(seed: int) -> None:
    random = np.random.default_rng(seed)
    first, second = random_covariance(random, 12), random_covariance(random, 12)
    inverses = np.linalg.inv(first), np.linalg.inv(second)

    def log_determinant(weight: float) -> float:
        return -float(np.linalg.slogdet(weight * inverses[0] + (1.0 - weight) * inverses[1])[1])

    best = minimize_scalar(log_determinant, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-6})
    assert intersection_weight(first, second) == pytest.approx(best.x, abs=1.0 / 128.0)
    means = random.normal(size=(2, 12))
    found = intersection(GaussianEstimate(means[0], first), GaussianEstimate(means[1], second), 0.3)
    information = 0.3 * inverses[0] + 0.7 * inverses[1]
    scale = np.sqrt(np.diag(found.covariance))
    off = found.covariance @ information - np.eye(12)
    assert np.abs(off * scale[None, :] / scale[:, None]).max() < 1e-9
    weighted = np.linalg.solve(information, 0.3 * inverses[0] @ means[0] + 0.7 * inverses[1] @ means[1])
    assert np.abs((found.mean - weighted) / scale).max() < 1e-8


def test_the_covariance_bounds_the_error_for_every_correlation() -> None:
    random = np.random.default_rng(8)
    for _ in range(40):
        first, second = random_covariance(random, 4), random_covariance(random, 4)
        correlation, _ = np.linalg.qr(random.normal(size=(4, 4)))
        crossed = np.linalg.cholesky(first) @ correlation @ np.linalg.cholesky(second).T
        weight = intersection_weight(first, second)
        gains = [
            intersection(
                GaussianEstimate(np.eye(4) * (index == 0), first),
                GaussianEstimate(np.eye(4) * (index == 1), second),
                weight,
            )
            for index in (0, 1)
        ]
        # The rows of the means were unit vectors, so that those of the results are columns of the gains.
        a, b = (gain.mean.T for gain in gains)
        true = a @ first @ a.T + b @ second @ b.T + a @ crossed @ b.T + b @ crossed.T @ a.T
        root = np.linalg.cholesky(gains[0].covariance)
        normalised = np.linalg.solve(root, np.linalg.solve(root, true).T)
        assert np.linalg.eigvalsh(normalised).max() <= 1.0 + 1e-6


@dataclass(frozen=True)
class Step:
    """Model of one control period."""

    transition: Array
    increment: Array
    process: Array


def coasting(duration: float, density: float) -> Step:
    """Position and velocity on a line, with white acceleration."""
    transition = np.array([[1.0, duration], [0.0, 1.0]])
    process = np.array([[duration**3 / 3.0, duration**2 / 2.0], [duration**2 / 2.0, duration]])
    return Step(transition, np.array([0.5 * duration**2, duration]) * 0.2, density * process)


def test_late_estimates_are_propagated_with_growing_covariance() -> None:
    start = GaussianEstimate(np.array([1.0, -2.0]), np.array([[4.0, 0.5], [0.5, 1.0]]))
    found = propagated(start, [coasting(3.0, 0.1)] * 3)
    # Closed form over the whole time at once.
    whole = coasting(9.0, 0.1)
    assert found.mean == pytest.approx(whole.transition @ start.mean + whole.increment, rel=1e-13)
    covariance = whole.transition @ start.covariance @ whole.transition.T + whole.process
    assert found.covariance == pytest.approx(covariance, rel=1e-13)


def by_product(own: GaussianEstimate, received: list[NeighbourEstimate]) -> GaussianEstimate:
    """All information added, as if the errors were independent."""
    all_of_them = [own, *(neighbour.estimate for neighbour in received)]
    inverses = [np.linalg.inv(estimate.covariance) for estimate in all_of_them]
    covariance = np.linalg.inv(sum(inverses, np.zeros_like(inverses[0])))
    weighted = [e.mean @ inverse for e, inverse in zip(all_of_them, inverses, strict=True)]
    return GaussianEstimate(sum(weighted, np.zeros_like(weighted[0])) @ covariance, covariance)


RUNS, STEPS = 300, 40


def fly(rule: FusionRule | None, graph: Graph, *, product: bool = False) -> tuple[Array, Array]:
    """Errors of satellites that each measure one combination of two bodies' positions, and exchange.

    Returns:
        Mean normalised error squared of each satellite at the end, and rms error of the first position.
    """
    random, count = np.random.default_rng(11), len(graph)
    one = coasting(1.0, 1e-3)
    transition, process = np.kron(np.eye(2), one.transition), np.kron(np.eye(2), one.process)
    step = Step(transition, np.zeros(4), process)
    outputs = [
        np.array([1.0, 0.0, 0.0, 0.0]),
        np.array([0.0, 0.0, 1.0, 0.0]),
        np.array([1.0, 0.0, -1.0, 0.0]),
    ]
    truth = random.normal(size=(RUNS, 4))
    estimates = [GaussianEstimate(np.zeros((RUNS, 4)), np.eye(4)) for _ in range(count)]
    root, weights = np.linalg.cholesky(process), metropolis_weights(graph)
    for _ in range(STEPS):
        truth = truth @ transition.T + random.normal(size=(RUNS, 4)) @ root.T
        before = [propagated(estimate, [step]) for estimate in estimates]
        for index in range(count):
            received = [NeighbourEstimate(other, before[other]) for other in graph.neighbours(index)]
            own = before[index]
            if product:
                own = by_product(own, received)
            elif rule is not None:
                own = fused(rule, own, received, weights[index])
            output = outputs[index]
            measured = truth @ output + 0.1 * random.normal(size=RUNS)
            gain = own.covariance @ output / (output @ own.covariance @ output + 0.01)
            mean = own.mean + (measured - own.mean @ output)[:, None] * gain
            estimates[index] = GaussianEstimate(
                mean, own.covariance - np.outer(gain, output @ own.covariance)
            )
    errors = np.stack([estimate.mean - truth for estimate in estimates])
    inverses = np.stack([np.linalg.inv(estimate.covariance) for estimate in estimates])
    squared = np.einsum("nri,nij,nrj->nr", errors, inverses, errors)
    return squared.mean(axis=1), np.sqrt((errors[..., 0] ** 2).mean(axis=1))


LARGEST = float(chi2.ppf(0.999, 4 * RUNS)) / RUNS


@pytest.mark.parametrize("rule", RULES)
def test_exchange_is_consistent_and_shows_each_what_only_others_measure(rule: FusionRule) -> None:
    squared, rms = fly(rule, RingSpec().build(3))
    assert np.all(squared <= LARGEST)
    # Alone the second satellite measures nothing of the first body: its error is that of the drift.
    _, alone = fly(None, RingSpec().build(3))
    assert rms[1] < 0.01 * alone[1]
    assert rms[2] < 0.01 * alone[2]


def test_adding_up_information_that_is_shared_is_overconfident() -> None:
    squared, _ = fly(None, RingSpec().build(3), product=True)
    assert np.all(squared > 2.0 * LARGEST)


def test_metropolis_weights_on_a_line() -> None:
    third = 1.0 / 3.0
    expected = [[2 * third, third, 0.0], [third, third, third], [0.0, third, 2 * third]]
    assert metropolis_weights(LineSpec().build(3)) == pytest.approx(np.array(expected), abs=1e-15)


def test_a_directed_edge_weighs_by_the_larger_in_degree() -> None:
    graph = Graph.of_edges(3, receivers=[0, 0, 1], senders=[1, 2, 0])
    expected = [[1 / 3, 1 / 3, 1 / 3], [1 / 3, 2 / 3, 0.0], [0.0, 0.0, 1.0]]
    assert metropolis_weights(graph) == pytest.approx(np.array(expected), abs=1e-15)


def test_repeated_consensus_reaches_the_mean_information_of_all() -> None:
    graph, variances = LineSpec().build(4), [1.0, 2.0, 4.0, 0.5]
    estimates = [scalar(float(index), variance) for index, variance in enumerate(variances)]
    weights = metropolis_weights(graph)
    for _ in range(200):
        estimates = [
            fused(
                "information_consensus",
                own,
                [NeighbourEstimate(other, estimates[other]) for other in graph.neighbours(index)],
                weights[index],
            )
            for index, own in enumerate(estimates)
        ]
    information = np.mean([1.0 / variance for variance in variances])
    weighted = np.mean([index / variance for index, variance in enumerate(variances)])
    for estimate in estimates:
        assert estimate.covariance[0, 0] == pytest.approx(1.0 / information, rel=1e-10)
        assert estimate.mean[0] == pytest.approx(weighted / information, rel=1e-10)


@pytest.mark.parametrize("rule", RULES)
def test_an_estimate_that_is_none_is_left_out_and_the_others_are_used(rule: FusionRule) -> None:
    own = GaussianEstimate(np.zeros(2), np.eye(2))
    bad = NeighbourEstimate(1, GaussianEstimate(np.ones(2), np.array([[1.0, 9.0], [9.0, 1.0]])))
    good = NeighbourEstimate(2, GaussianEstimate(np.ones(2), 0.25 * np.eye(2)))
    third = np.full(3, 1.0 / 3.0)
    found = fused(rule, own, [bad, good], third)
    # Of isotropic covariances the smaller one has the whole weight, and equal shares the mean information.
    least = 0.25 if rule == "covariance_intersection" else 1.0 / (0.5 + 0.5 / 0.25)
    assert found.covariance == pytest.approx(least * np.eye(2), rel=1e-12)
    assert fused(rule, own, [bad], third) is own
