# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How many Byzantine agents a communication graph supports: r-robustness and (r, s)-robustness.

A set of satellites is r-reachable when one of them has at least r in-neighbours outside the set. A graph
is r-robust when of any two disjoint non-empty sets at least one is r-reachable.

Source: LeBlanc, Zhang, Koutsoukos & Sundaram 2013, Resilient asymptotic consensus in robust networks.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from satform.consensus.graph import MAXIMUM_SPECTRUM, Graph

MAXIMUM_SATELLITES = 20
"""Largest number of satellites for which robustness is computed: the number of sets doubles with each."""

_ROUNDING = 1e-9
"""By which a computed eigenvalue may be too large, relative to the number of satellites."""

Counts = NDArray[np.int16]


@dataclass(frozen=True)
class Robustness:
    """Exact robustness of a graph.

    Attributes:
        r: the largest r for which the graph is r-robust.
        s: for each r from 1 on, the largest s for which the graph is (r, s)-robust; one entry for
            each r up to the largest, at least 1 and at most the number of satellites.
    """

    r: int
    s: tuple[int, ...]

    @property
    def local_byzantine(self) -> int:
        """Largest F for which the graph is (2F + 1)-robust."""
        return max(0, (self.r - 1) // 2)

    @property
    def total_byzantine(self) -> int:
        """Largest F for which the graph is (F + 1, F + 1)-robust."""
        return max((r - 1 for r, s in enumerate(self.s, 1) if s >= r), default=0)


@dataclass(frozen=True)
class AgreementGuarantee:
    """What a graph guarantees to satellites that each discard up to F neighbours on either side.

    Attributes:
        tolerated_byzantine: F.
        local: whether consensus is guaranteed with up to F Byzantine agents among the in-neighbours of each
            correct satellite; None if the graph is too large to know.
        total: whether consensus is guaranteed with up to F Byzantine agents in the whole formation, each of
            which sends the same values to all; None if the graph is too large to know.
        largest_local: the largest F for which `local` holds, or is known to hold; None when the graph is
            not connected.
        largest_total: the largest F for which `total` holds, or is known to hold; None likewise.
        exact: whether the two are exact; otherwise they are lower bounds.
        sentence: the same in words.
    """

    tolerated_byzantine: int
    local: bool | None
    total: bool | None
    largest_local: int | None
    largest_total: int | None
    exact: bool
    sentence: str


def robustness(graph: Graph) -> Robustness:
    """Robustness of a small graph, by examining every set of its satellites.

    Args:
        graph: of at most `MAXIMUM_SATELLITES`.

    Returns:
        The largest r, and the largest s for each r. A lone satellite is (1, 1)-robust by convention.

    Raises:
        ValueError: the graph is larger.
    """
    count = len(graph)
    if count > MAXIMUM_SATELLITES:
        raise ValueError(
            f"robustness: {count} satellites form {2.0**count:.2g} sets, all of which would have to be "
            f"looked at; it is exact for at most {MAXIMUM_SATELLITES}. This graph is at least "
            f"{lower_bound(graph)}-robust by its degrees and its algebraic connectivity"
        )
    if count == 1:
        return Robustness(1, (1,))
    in_edges = _in_edges_from_outside(graph)
    # A set is as reachable as its most reachable member; the empty set belongs to no pair.
    reachable = in_edges.max(axis=0)
    reachable[0] = count
    r = int(_smallest_over_pairs(np.maximum, reachable))
    return Robustness(r, tuple(_largest_s(in_edges, value) for value in range(1, r + 1)))


def lower_bound(graph: Graph) -> int:
    """An r for which a graph of any size is certainly r-robust.

    The smaller of two separate sets holds at most half of the satellites. Each of them has at most
    half less one of its neighbours inside; and of an undirected graph at least half the algebraic
    connectivity times its size leads out of it, so that one member has the average of that or more.

    Args:
        graph: of any size.

    Returns:
        r, 0 when nothing is guaranteed.

    Source: LeBlanc et al. 2013 for the degrees; Shahrivar, Pirani & Sundaram 2017 for the connectivity.
    """
    count = len(graph)
    if count < 2:
        return count
    by_degree = int(graph.adjacency.sum(axis=1).min()) - count // 2 + 1
    by_spectrum = 0
    if count <= MAXIMUM_SPECTRUM and not graph.directed:
        by_spectrum = math.ceil(0.5 * graph.algebraic_connectivity - _ROUNDING * count)
    return max(by_degree, by_spectrum, int(graph.connected()))


def agreement_guarantee(graph: Graph, tolerated_byzantine: int) -> AgreementGuarantee:
    """What a graph guarantees to satellites of which each tolerates F Byzantine in-neighbours.

    Args:
        graph: of any size; beyond `MAXIMUM_SATELLITES` by lower bounds.
        tolerated_byzantine: F, number of neighbours that each satellite discards on either side.

    Returns:
        For which Byzantine agents the correct satellites reach consensus within the interval of their values.

    Raises:
        ValueError: F is negative.

    Source: LeBlanc et al. 2013, theorems 1 and 2.
    """
    if tolerated_byzantine < 0:
        raise ValueError(f"tolerated_byzantine is {tolerated_byzantine}; it cannot be negative")
    exact = len(graph) <= MAXIMUM_SATELLITES
    if exact:
        found = robustness(graph)
        r, local, total = found.r, found.local_byzantine, found.total_byzantine
    else:
        r = lower_bound(graph)
        # A (2F + 1)-robust graph is (F + 1, F + 1)-robust.
        local = total = max(0, (r - 1) // 2)
    known = r >= 1
    keeps_local = known and tolerated_byzantine <= local
    keeps_total = known and tolerated_byzantine <= total
    return AgreementGuarantee(
        tolerated_byzantine=tolerated_byzantine,
        local=keeps_local or (False if exact else None),
        total=keeps_total or (False if exact else None),
        largest_local=local if known else None,
        largest_total=total if known else None,
        exact=exact,
        sentence=_sentence(tolerated_byzantine, keeps_local, keeps_total, exact),
    )


def _in_edges_from_outside(graph: Graph) -> Counts:
    """In-neighbours outside a set of each of its members, shape (N, 2^N); -1 for satellites not in the set.

    A set is a number whose bit i stands for satellite i.
    """
    count = len(graph)
    sets = np.arange(2**count, dtype=np.uint32)
    in_degree = np.full((count, len(sets)), -1, dtype=np.int16)
    for satellite in range(count):
        neighbours = np.uint32(sum(1 << other for other in graph.neighbours(satellite)))
        inside = (sets >> np.uint32(satellite)) & np.uint32(1) == 1
        in_degree[satellite, inside] = np.bitwise_count(neighbours & ~sets[inside])
    return in_degree


def _largest_s(in_degree: Counts, r: int) -> int:
    """The largest s for which a graph is (r, s)-robust; 0 when it is not r-robust.

    Two disjoint sets disprove it when in each of them some satellite has fewer than r in-neighbours outside
    its set, and fewer than s satellites of the two together have r of them.

    Args:
        in_degree: in-neighbours outside a set of each of its members, shape (N, 2^N); -1 outside the set.
        r: of the robustness.
    """
    count = len(in_degree)
    reached = (in_degree >= r).sum(axis=0).astype(np.int16)
    members = (in_degree >= 0).sum(axis=0)
    reached[reached == members] = count
    return min(count, int(_smallest_over_pairs(np.add, reached)))


def _smallest_over_pairs(combine: np.ufunc, value: Counts) -> int:
    """Smallest combination of the values of two disjoint sets.

    Args:
        combine: grows with both of its arguments.
        value: of each set, shape (2^N,); of sets that do not count it is so large that it is never
            smallest.

    Returns:
        The smallest, found with the smallest value of any part of each set's complement.
    """
    smallest = value.copy()
    width = 1
    while width < len(value):
        halves = smallest.reshape(-1, 2, width)
        np.minimum(halves[:, 1], halves[:, 0], out=halves[:, 1])
        width *= 2
    return int(combine(value, smallest[::-1]).min())


def _sentence(count: int, local: bool, total: bool, exact: bool) -> str:
    if local and count == 0:
        return "honest satellites agree, and no Byzantine agent is tolerated"
    some = "1 Byzantine agent" if count == 1 else f"{count} Byzantine agents"
    if local:
        return f"honest satellites agree with up to {some} among the neighbours of each, wherever they are"
    if total:
        return f"honest satellites agree with up to {some} in the whole formation that send all the same"
    if not exact:
        return (
            f"nothing is known of {some}: beyond {MAXIMUM_SATELLITES} satellites there are only lower bounds"
        )
    if count == 0:
        return "satellites need not agree: the graph is not connected enough for it"
    return f"nothing is promised with {some}, nor when all are honest: too many neighbours are ignored"
