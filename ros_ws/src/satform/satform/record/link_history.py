# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""State of the links of a flight over time, and which messages they delivered."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from satform.communication.physical_links import LinkStates
from satform.consensus.graph import Graph
from satform.numeric.elementwise import Array, Indices


@dataclass(frozen=True)
class LinkChange:
    """A step in which radio or optical links reach their required bit error rate, or no longer do.

    Attributes:
        step: number of the step.
        opened: sender and receiver of each link that reaches it from this step on.
        closed: those of each that no longer does, because of its margin.
        blocked: those of each that no longer does, because the Earth is between the two.
        connectivity: algebraic connectivity of the links that reach it and of all that are not physical.
    """

    step: int
    opened: tuple[tuple[str, str], ...]
    closed: tuple[tuple[str, str], ...]
    blocked: tuple[tuple[str, str], ...]
    connectivity: float


@dataclass(frozen=True)
class LinkHistory:
    """What the E links of a formation did in the K steps of a flight.

    Attributes:
        satellites: N names.
        edges: indices of sender and receiver of each link that the graph has at some time, shape (E, 2).
        physical: indices, among the edges, of the P radio and optical links, shape (P,).
        states: of these P links at each step, arrays of shape (K, P); None where there are none.
        linked: whether the graph has each edge at each step and both its satellites fly, shape (K, E).
        sent: whether a message was sent over each link for each step, shape (K, E).
        delivered: whether it was delivered, at once or later, shape (K, E).
    """

    satellites: tuple[str, ...]
    edges: Indices
    physical: Indices
    states: LinkStates | None
    linked: NDArray[np.bool_]
    sent: NDArray[np.bool_]
    delivered: NDArray[np.bool_]

    def connectivity(
        self, window: int, first: int = 0, end: int | None = None, satellites: Sequence[str] | None = None
    ) -> tuple[Indices, Array]:
        """Algebraic connectivity of the graph that delivered messages, in windows one after another.

        An edge counts in a window if it delivered at least one message of its steps.

        Args:
            window: steps of each.
            first: step at which the first window begins.
            end: step at which the last one ends at the latest; that after the last step when left out.
            satellites: whose graph is meant, without all others; that of all when left out.

        Returns:
            The first step of each window and its connectivity, both of shape (W,).
        """
        last = len(self.delivered) if end is None else min(end, len(self.delivered))
        begins = np.arange(first, last - window + 1, window)
        members = [self.satellites.index(name) for name in satellites or self.satellites]
        known: dict[bytes, float] = {}
        found = np.empty(len(begins))
        for place, begin in enumerate(begins.tolist()):
            used: NDArray[np.bool_] = np.asarray(self.delivered[begin : begin + window].any(axis=0))
            key = used.tobytes()
            if key not in known:
                known[key] = self._graph(used, members).algebraic_connectivity
            found[place] = known[key]
        return begins, found

    def changes(self) -> list[LinkChange]:
        """When radio and optical links opened and closed, by step; the first change is the start."""
        if self.states is None or not len(self.sent):
            return []
        reaches = (self.states.margin >= 0.0) & self.linked[:, self.physical]
        usable = self.linked.copy()
        usable[:, self.physical] = reaches
        before, everyone = np.zeros(reaches.shape[1], dtype=np.bool_), list(range(len(self.satellites)))
        found = []
        for step in np.flatnonzero(np.any(np.diff(reaches, axis=0, prepend=before[None]), axis=1)).tolist():
            now = reaches[step]
            gone = before & ~now
            earth = gone & self.states.blocked[step]
            opened, closed, blocked = map(self._named, (now & ~before, gone & ~earth, earth))
            graph = self._graph(np.asarray(usable[step]), everyone)
            found.append(LinkChange(step, opened, closed, blocked, graph.algebraic_connectivity))
            before = now
        return found

    def _named(self, links: NDArray[np.bool_]) -> tuple[tuple[str, str], ...]:
        return tuple(self.names_of(edge) for edge in self.physical[links].tolist())

    def names_of(self, edge: int) -> tuple[str, str]:
        """Sender and receiver of an edge."""
        sender, receiver = self.edges[edge].tolist()
        return self.satellites[sender], self.satellites[receiver]

    def between(self, satellites: Sequence[str] | None) -> Indices:
        """Indices of the edges whose two satellites are both among some; of all for None, shape (M,)."""
        if satellites is None:
            return np.arange(len(self.edges))
        meant = np.isin(self.edges, [self.satellites.index(name) for name in satellites]).all(axis=1)
        return np.flatnonzero(meant)

    def _graph(self, used: NDArray[np.bool_], members: Sequence[int]) -> Graph:
        adjacency = np.zeros((len(self.satellites),) * 2)
        adjacency[self.edges[used, 1], self.edges[used, 0]] = 1.0
        return Graph(adjacency[np.ix_(members, members)])
