# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Communication graphs: topologies, Laplacian and connectivity."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from satform.common.spec import Spec
from satform.numeric.elementwise import Array

MAXIMUM_SPECTRUM = 1_500
"""Largest number of satellites for which eigenvalues are computed; the time grows with its third power."""

AdjacencyRow = tuple[Literal[0, 1], ...]


@dataclass(frozen=True, eq=False)
class Graph:
    """A directed communication graph; an undirected graph has every edge in both directions.

    Attributes:
        adjacency: 1 in row i and column j when satellite i receives from satellite j, else 0, shape (N, N),
            with a zero diagonal.
    """

    adjacency: Array

    @classmethod
    def of_edges(cls, count: int, receivers: Sequence[int], senders: Sequence[int]) -> "Graph":
        """The graph with these edges.

        Args:
            count: of satellites, N.
            receivers: of each edge the index of the satellite that receives.
            senders: of each edge the index of the satellite that sends; the same edge twice is one edge.

        Raises:
            ValueError: there are not as many senders as receivers, an index is none of a satellite, or a
                satellite would receive from itself.
        """
        rows, columns = np.array(receivers, dtype=np.int64), np.array(senders, dtype=np.int64)
        if len(rows) != len(columns):
            raise ValueError(f"{len(rows)} receivers and {len(columns)} senders; an edge has one of each")
        ends = np.concatenate((rows, columns))
        if np.any((ends < 0) | (ends >= count)):
            raise ValueError(f"an edge ends at none of the {count} satellites, which count from 0")
        if np.any(rows == columns):
            raise ValueError("a satellite cannot receive from itself")
        adjacency = np.zeros((count, count))
        adjacency[rows, columns] = 1.0
        return cls(adjacency)

    def __len__(self) -> int:
        """Number of satellites."""
        return len(self.adjacency)

    def neighbours(self, satellite: int) -> tuple[int, ...]:
        """Indices of the in-neighbours of `satellite`, ascending."""
        return tuple(np.flatnonzero(self.adjacency[satellite]).tolist())

    def receivers(self, satellite: int) -> tuple[int, ...]:
        """Indices of the out-neighbours of `satellite`, ascending."""
        return tuple(np.flatnonzero(self.adjacency[:, satellite]).tolist())

    @cached_property
    def edges(self) -> tuple[tuple[int, int], ...]:
        """Pairs (sender, receiver), ascending by receiver and then by sender."""
        receivers, senders = np.nonzero(self.adjacency)
        return tuple(zip(senders.tolist(), receivers.tolist(), strict=True))

    @cached_property
    def directed(self) -> bool:
        """Whether some edge has no edge in the opposite direction."""
        return not np.array_equal(self.adjacency, self.adjacency.T)

    def subgraph(self, satellites: NDArray[np.bool_] | list[int]) -> "Graph":
        """The graph of some of the satellites, for example of those alive.

        Args:
            satellites: a mask of shape (N,), or ascending indices.

        Returns:
            The graph of those satellites, renumbered in their order.
        """
        chosen = np.asarray(satellites)
        return Graph(self.adjacency[chosen][:, chosen])

    def laplacian(self) -> Array:
        """In-degree Laplacian L = diag(row sums of the adjacency) - adjacency, shape (N, N).

        Source: Ren & Beard, Distributed Consensus in Multi-vehicle Cooperative Control, ch. 2.
        """
        return np.diag(self.adjacency.sum(axis=1)) - self.adjacency

    @cached_property
    def eigenvalues(self) -> Array | NDArray[np.complex128]:
        """Of the Laplacian, shape (N,), by ascending real part; real for an undirected graph."""
        if not self.directed:
            return np.asarray(np.linalg.eigvalsh(self.laplacian()), dtype=np.float64)
        values = np.asarray(np.linalg.eigvals(self.laplacian()), dtype=np.complex128)
        return values[np.lexsort((values.imag, values.real))]

    @property
    def algebraic_connectivity(self) -> float:
        """Second smallest real part of the Laplacian's eigenvalues; 0 for a lone satellite.

        For an undirected graph this is Fiedler's number, positive when and only when connected. For
        a directed graph it is positive when and only when a spanning tree exists.

        Source: Fiedler 1973; Ren & Beard 2005.
        """
        return float(self.eigenvalues[1].real) if len(self) > 1 else 0.0

    def connected(self) -> bool:
        """Whether consensus is possible: every satellite can be reached from some one along the edges.

        For an undirected graph this is connectivity. For a directed one it is the existence of a
        spanning tree: a satellite from which every other one can be reached.

        Source: Ren & Beard 2005.
        """
        if len(self) == 0:
            return False
        senders, receivers = np.nonzero(self.adjacency.T)
        first = np.searchsorted(senders, np.arange(len(self) + 1)).tolist()
        receivers_of = [receivers[start:end].tolist() for start, end in pairwise(first)]
        reached: set[int] = set()
        last = 0
        for satellite in range(len(self)):
            if satellite not in reached:
                # If any satellite reaches all, the last one that no earlier one has reached does too.
                last = satellite
                _spread(satellite, receivers_of, reached)
        found: set[int] = set()
        _spread(last, receivers_of, found)
        return len(found) == len(self)


def _spread(origin: int, receivers_of: list[list[int]], reached: set[int]) -> None:
    """Add to `reached` the origin and all whom its messages reach by way of satellites that are not in it."""
    reached.add(origin)
    waiting = [origin]
    while waiting:
        for receiver in receivers_of[waiting.pop()]:
            if receiver not in reached:
                reached.add(receiver)
                waiting.append(receiver)


class TopologySpec(Spec):
    """Base of every topology's specification; subclasses set a literal `kind`."""

    def build(self, count: int) -> Graph:
        """The graph of `count` satellites.

        Raises:
            ValueError: the topology does not exist for this number of satellites.
        """
        raise NotImplementedError


class CompleteSpec(TopologySpec):
    """Complete graph: every satellite receives from every other one."""

    kind: Literal["complete"] = "complete"

    def build(self, count: int) -> Graph:
        """The graph of `count` satellites."""
        adjacency = np.ones((count, count))
        np.fill_diagonal(adjacency, 0.0)
        return Graph(adjacency)


class RingSpec(TopologySpec):
    """Ring: each satellite receives from the previous and the next one, the first from the last."""

    kind: Literal["ring"] = "ring"

    def build(self, count: int) -> Graph:
        """The graph of `count` satellites."""
        return _undirected(count, [(i, (i + 1) % count) for i in range(count) if count > 1])


class LineSpec(TopologySpec):
    """Line: each satellite receives from the previous and the next one; the first and the last are ends."""

    kind: Literal["line"] = "line"

    def build(self, count: int) -> Graph:
        """The graph of `count` satellites."""
        return _undirected(count, [(i, i + 1) for i in range(count - 1)])


class StarSpec(TopologySpec):
    """Star: the central satellite exchanges messages with all others, which have no other neighbours."""

    kind: Literal["star"] = "star"
    centre: Annotated[int, Field(ge=0)] = 0
    """Index of the satellite in the middle, counted from 0 in the order of the scenario."""

    def build(self, count: int) -> Graph:
        """The graph of `count` satellites.

        Raises:
            ValueError: the centre is not one of them.
        """
        if self.centre >= count:
            raise ValueError(
                f"star: centre is {self.centre}, but the {count} satellites are numbered 0 to {count - 1}"
            )
        return _undirected(count, [(self.centre, i) for i in range(count) if i != self.centre])


class NoneSpec(TopologySpec):
    """No edges: no satellite receives from another one."""

    kind: Literal["none"] = "none"

    def build(self, count: int) -> Graph:
        """The graph of `count` satellites."""
        return _undirected(count, [])


class MatrixSpec(TopologySpec):
    """The adjacency matrix written out; it may be directed."""

    kind: Literal["matrix"] = "matrix"
    rows: tuple[AdjacencyRow, ...]
    """Row i has a 1 in column j when satellite i receives from satellite j, else 0."""

    @field_validator("rows")
    @classmethod
    def _square_and_hollow(cls, rows: tuple[AdjacencyRow, ...]) -> tuple[AdjacencyRow, ...]:
        for index, row in enumerate(rows):
            if len(row) != len(rows):
                raise ValueError(
                    f"row {index} has {len(row)} entries, but there are {len(rows)} rows: it has to be square"
                )
            if row[index]:
                raise ValueError(
                    f"row {index} has a 1 in column {index}: a satellite cannot receive from itself"
                )
        return rows

    def build(self, count: int) -> Graph:
        """The graph of `count` satellites.

        Raises:
            ValueError: the matrix is for another number of satellites.
        """
        if len(self.rows) != count:
            raise ValueError(f"matrix: it has {len(self.rows)} rows, but there are {count} satellites")
        return Graph(np.array(self.rows, dtype=np.float64).reshape(count, count))


def _undirected(count: int, pairs: list[tuple[int, int]]) -> Graph:
    adjacency = np.zeros((count, count))
    for i, j in pairs:
        adjacency[i, j] = adjacency[j, i] = 1.0
    return Graph(adjacency)
