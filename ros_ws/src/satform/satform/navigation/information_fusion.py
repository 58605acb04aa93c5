# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Fusion of the estimates that neighbours exchange, when nobody knows what their errors have in common.

The errors of two satellites' estimates of the same state are correlated: by the unknown accelerations, and by
all that was exchanged before. A fused estimate whose information is a weighted mean of the information of
its parts is consistent for every such correlation, if each part is (covariance intersection). The two rules
here differ in the weights: those that minimise the determinant of the fused covariance, or fixed ones by the
degrees of the communication graph (consensus on information).

All functions run in flight: element-wise arithmetic in a fixed order, with a fixed number of iterations.

Source: Julier & Uhlmann 1997, A non-divergent estimation algorithm in the presence of unknown correlations;
Battistelli & Chisci 2014, Kullback-Leibler average, consensus on probability densities, and distributed state
estimation with guaranteed stability, Automatica 50, 707-718; Xiao, Boyd & Lall 2005, A scheme for robust
distributed sensor fusion based on average consensus (Metropolis weights).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from satform.consensus.graph import Graph
from satform.dynamics.linear import multiply
from satform.navigation.estimate import GaussianEstimate
from satform.numeric.elementwise import Array
from satform.numeric.matrix_algebra import product, symmetric, transposed
from satform.numeric.positive_definite import NotPositiveDefiniteError, log_determinant, solve

FusionRule = Literal["covariance_intersection", "information_consensus"]

_FRACTIONS = np.array(sorted(np.arange(-8, 9) / 8.0, key=abs))
"""Weights that a round tries, about the best one so far, as fractions of half the interval.

The middle comes first: of weights that are equally good, as for equal covariances, it is taken.
"""

_HALVES = (0.5, 0.0625)
"""Half the interval in each round; in the last one the weights are 1/128 apart."""

_EQUAL = 1e-9
"""Difference of logarithms of determinants below which two weights are equally good."""


class JointStep(Protocol):
    """Linear model of a joint state of D numbers over one control period."""

    @property
    def transition(self) -> Array:
        """Of the state, shape (D, D)."""

    @property
    def increment(self) -> Array:
        """What the known accelerations add to the state, shape (D,)."""

    @property
    def process(self) -> Array:
        """Covariance that unknown accelerations add, shape (D, D)."""


@dataclass(frozen=True)
class NeighbourEstimate:
    """An estimate that was received from a neighbour.

    Attributes:
        satellite: index of the neighbour in the formation.
        estimate: of the same state and step as the receiver's own.
    """

    satellite: int
    estimate: GaussianEstimate


def fused(
    rule: FusionRule, own: GaussianEstimate, received: Sequence[NeighbourEstimate], weights: Array
) -> GaussianEstimate:
    """A satellite's estimate with those of its neighbours.

    Args:
        rule: which weights the estimates get.
        own: estimate of the satellite itself, shapes (D,) and (D, D).
        received: those of its neighbours that have arrived, in ascending order of the neighbours. One that is
            late has to be propagated to the step of `own` before; one that is lost is left out.
        weights: of consensus on information, the satellite's row of `metropolis_weights`, shape (N,). The
            weight of a neighbour without an estimate goes to the satellite itself.

    Returns:
        `own` itself where nothing has arrived. A neighbour's estimate that cannot be combined with it in
        double precision is left out: it must not end the flight of the receiver.
    """
    if rule == "covariance_intersection":
        for neighbour in received:
            own = _with_one(own, neighbour.estimate, None) or own
        return own
    shares = [float(weights[neighbour.satellite]) for neighbour in received]
    total = 1.0
    for share in shares:
        total -= share
    # The weighted mean of all is the one of the first two with the third, and so on.
    for neighbour, share in zip(received, shares, strict=True):
        combined = _with_one(own, neighbour.estimate, total / (total + share))
        if combined is not None:
            own = combined
            total += share
    return own


def _with_one(
    own: GaussianEstimate, other: GaussianEstimate, weight: float | None
) -> GaussianEstimate | None:
    """The intersection of two estimates; None where it is not positive definite in double precision.

    Args:
        own: of the receiver.
        other: of a neighbour.
        weight: of the own information; None for the one that minimises the determinant.
    """
    try:
        if weight is None:
            weight = intersection_weight(own.covariance, other.covariance)
        return intersection(own, other, weight)
    except NotPositiveDefiniteError:
        return None


def intersection(first: GaussianEstimate, second: GaussianEstimate, weight: float) -> GaussianEstimate:
    """The estimate with the weighted mean of two estimates' information.

    With covariances A and B and weight w: inv(C) = w inv(A) + (1 - w) inv(B). It is computed as the sum of
    two congruences of A and B, which stays positive definite when A and B have very different magnitudes.

    Args:
        first: shapes (D,) and (D, D).
        second: of the same state at the same step.
        weight: of the first one's information, within [0, 1].
    """
    if weight == 1.0:
        return first
    if weight == 0.0:
        return second
    a, b = first.covariance, second.covariance
    both = solve((1.0 - weight) * a + weight * b, np.concatenate((a, b), axis=-1))
    by_a, by_b = both[:, : len(a)], both[:, len(a) :]
    moved = product(transposed(by_a), (second.mean - first.mean)[..., None])[..., 0]
    from_first = product(transposed(by_b), product(a, by_b))
    from_second = product(transposed(by_a), product(b, by_a))
    covariance = symmetric(weight * from_first + (1.0 - weight) * from_second)
    return GaussianEstimate(first.mean + (1.0 - weight) * moved, covariance)


def intersection_weight(first: Array, second: Array) -> float:
    """Weight of the first covariance that minimises the determinant of the intersection of two.

    det(C) is least where log det(w B + (1 - w) A) is greatest, a concave function of w. Seventeen weights are
    compared, evenly spread over [0, 1], then seventeen between the neighbours of the best one.

    Args:
        first: covariance A, shape (D, D).
        second: covariance B, shape (D, D).

    Returns:
        Within [0, 1], to 1/128 where the optimum lies inside.
    """
    middle = 0.5
    for half in _HALVES:
        tried = np.clip(middle + half * _FRACTIONS, 0.0, 1.0)
        mixed = tried[:, None, None] * second + (1.0 - tried)[:, None, None] * first
        values = log_determinant(mixed)
        middle = float(tried[np.argmax(values >= np.max(values) - _EQUAL)])
    return middle


def metropolis_weights(graph: Graph) -> Array:
    """Weights of consensus on information on a communication graph.

    A neighbour has 1 / (1 + the larger of both in-degrees), the satellite itself what is missing to 1. On an
    undirected graph the columns have the sum 1, too, and repeated averages converge to the mean of all.

    Args:
        graph: of N satellites; of a lost one it has no edges.

    Returns:
        Shape (N, N), row i for receiver i.
    """
    degree = graph.adjacency.sum(axis=1)
    weights: Array = graph.adjacency / (1.0 + np.maximum(degree[:, None], degree[None, :]))
    weights[np.diag_indices(len(weights))] = 1.0 - weights.sum(axis=1)
    return weights


def propagated(estimate: GaussianEstimate, steps: Iterable[JointStep]) -> GaussianEstimate:
    """An estimate that is late, at a later step.

    Args:
        estimate: shapes (D,) and (D, D).
        steps: model over each control period from its step on.
    """
    mean, covariance = estimate.mean, estimate.covariance
    for step in steps:
        mean = multiply(step.transition, mean) + step.increment
        half = product(step.transition, covariance)
        covariance = symmetric(product(half, transposed(step.transition)) + step.process)
    return GaussianEstimate(mean, covariance)
