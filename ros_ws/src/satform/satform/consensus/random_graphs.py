# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Random communication graphs, the same for the same seed.

They are drawn here and not by networkx's `random_regular_graph`: its graphs of degree 2 are seldom connected
(69 of 200 with 20 satellites), it needs a minute for 100 satellites of degree 90, and it would be a new
dependency for this alone.
"""

import functools
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from satform.consensus.graph import Graph, TopologySpec
from satform.numeric.elementwise import Indices

_ATTEMPTS = 200
"""Graphs drawn before giving up; with a degree of 3 and more nearly all are connected."""
_ROUNDS = 500
"""Times what is left of one graph is drawn anew before another graph is begun."""

_Adjacency = NDArray[np.bool_]


class RandomRegularSpec(TopologySpec):
    """Random regular graph: each satellite has the same number of neighbours; connected and undirected."""

    kind: Literal["random_regular"] = "random_regular"
    degree: Annotated[int, Field(ge=1, le=100)]
    """Number of neighbours of each satellite; times the number of satellites it has to be even."""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    """Chooses the graph; the scenario's own seed has no part in it."""

    def build(self, count: int) -> Graph:
        """The graph of `count` satellites.

        Raises:
            ValueError: there is no such graph of this number of satellites.
        """
        if self.degree >= count:
            raise ValueError(
                f"random_regular: degree is {self.degree}, but each of {count} satellites has only "
                f"{count - 1} others to receive from"
            )
        if count * self.degree % 2:
            raise ValueError(
                f"random_regular: {count} satellites with {self.degree} neighbours each make half a link "
                "too many; one of the two numbers has to be even"
            )
        if self.degree == 1 and count > 2:
            raise ValueError(
                f"random_regular: {count} satellites with one neighbour each are pairs that nobody connects; "
                "degree has to be at least 2"
            )
        return _drawn(count, self.degree, self.seed)


@functools.lru_cache(maxsize=8)
def _drawn(count: int, degree: int, seed: int) -> Graph:
    for attempt in range(_ATTEMPTS):
        links = _links(count, degree, np.random.default_rng([seed, attempt]))
        if links is None:
            continue
        adjacency = links.astype(np.float64)
        # Shared by all who ask for the same graph.
        adjacency.setflags(write=False)
        graph = Graph(adjacency)
        if graph.connected():
            return graph
    raise ValueError(
        f"random_regular: none of {_ATTEMPTS} graphs drawn for {count} satellites of degree {degree} is "
        "connected; try another seed"
    )


def _links(count: int, degree: int, generator: np.random.Generator) -> _Adjacency | None:
    """Adjacency, shape (count, count); None when the pairing has failed."""
    if degree == 2:
        # The only connected graph of degree 2 is a ring, and a drawn one seldom is one.
        ring = generator.permutation(count)
        return _joined(np.zeros((count, count), dtype=np.bool_), ring, np.roll(ring, -1))
    if 2 * degree < count:
        return _paired(count, degree, generator)
    # The complement is regular too, and easier to draw for a dense graph.
    apart = _paired(count, count - 1 - degree, generator)
    return None if apart is None else ~(apart | np.eye(count, dtype=np.bool_))


def _paired(count: int, degree: int, generator: np.random.Generator) -> _Adjacency | None:
    """Pairs the ends of all links at random, again and again those that could not be joined.

    Source: Steger & Wormald 1999, Generating random regular graphs quickly.
    """
    links = np.zeros((count, count), dtype=np.bool_)
    ends = np.repeat(np.arange(count), degree)
    for _ in range(_ROUNDS):
        if not len(ends):
            return links
        one, other = generator.permutation(ends).reshape(2, -1)
        pair = np.minimum(one, other) * count + np.maximum(one, other)
        first = np.zeros(len(pair), dtype=np.bool_)
        first[np.unique(pair, return_index=True)[1]] = True
        fits = first & (one != other) & ~links[one, other]
        _joined(links, one[fits], other[fits])
        ends = np.concatenate((one[~fits], other[~fits]))
        if not np.any(fits):
            left = np.unique(ends)
            if np.all(links[np.ix_(left, left)] | np.eye(len(left), dtype=np.bool_)):
                return None
    return None


def _joined(links: _Adjacency, one: Indices, other: Indices) -> _Adjacency:
    links[one, other] = links[other, one] = True
    return links
