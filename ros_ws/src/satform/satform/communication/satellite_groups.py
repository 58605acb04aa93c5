# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Groups of satellites that share a process and exchange arrays, and what each group sends the others.

The satellites of a formation are divided into groups such that few edges of the communication graph join two
groups. A group sends another one the phases of those of its satellites that have out-neighbours there (their
halo), in one message a step; so there is a topic for each pair of groups that an edge joins.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from satform.consensus.graph import Graph
from satform.numeric.elementwise import Indices


@dataclass(frozen=True, eq=False)
class SatelliteGroups:
    """Groups of satellites, and the edges between them.

    Attributes:
        members: indices of the satellites of each group, ascending; every satellite is in one group.
        graph: every edge that the communication graph has at some time of the flight.
    """

    members: tuple[tuple[int, ...], ...]
    graph: Graph

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the groups, which are those of their nodes."""
        return tuple(f"group{index}" for index in range(len(self.members)))

    @cached_property
    def rows(self) -> tuple[slice | Indices, ...]:
        """Indices of the satellites of each group, as a slice if they are consecutive."""
        return tuple(
            slice(own[0], own[-1] + 1) if own[-1] - own[0] + 1 == len(own) else np.array(own)
            for own in self.members
        )

    @cached_property
    def halos(self) -> dict[tuple[int, int], tuple[int, ...]]:
        """By sending and receiving group, the sender's satellites with out-neighbours there, ascending."""
        receivers, senders = np.nonzero(self.graph.adjacency)
        group = self._group_of()
        between = group[senders] != group[receivers]
        crossing = zip(
            group[senders][between].tolist(),
            group[receivers][between].tolist(),
            senders[between].tolist(),
            strict=True,
        )
        found: dict[tuple[int, int], set[int]] = {}
        for sending, receiving, satellite in crossing:
            found.setdefault((sending, receiving), set()).add(satellite)
        return {pair: tuple(sorted(found[pair])) for pair in sorted(found)}

    def senders_to(self, group: int) -> list[int]:
        """Groups that send their halo to a group, ascending."""
        return [sender for sender, receiver in self.halos if receiver == group]

    def receivers_of(self, group: int) -> list[int]:
        """Groups to which a group sends its halo, ascending."""
        return [receiver for sender, receiver in self.halos if sender == group]

    def _group_of(self) -> Indices:
        group = np.zeros(len(self.graph), dtype=np.int64)
        for index, members in enumerate(self.members):
            group[list(members)] = index
        return group

    def to_text(self) -> str:
        """The members of each group as JSON."""
        return json.dumps(self.members)

    @classmethod
    def of_text(cls, text: str, graph: Graph) -> "SatelliteGroups":
        """The groups whose members are given as JSON.

        Args:
            text: as `to_text` returns it.
            graph: every edge that the communication graph has at some time of the flight.

        Raises:
            ValueError: the text does not divide the satellites of this graph into groups.
        """
        try:
            members = tuple(tuple(sorted(map(int, group))) for group in json.loads(text))
        except (TypeError, ValueError) as error:
            raise ValueError(f"is no list of groups of satellites: {error}") from None
        if sorted(index for group in members for index in group) != list(range(len(graph))):
            raise ValueError(f"does not have each of the {len(graph)} satellites in one group")
        return cls(members, graph)


def divide(graph: Graph, size: int) -> SatelliteGroups:
    """Divide satellites into groups that few edges join.

    The satellites are ordered such that neighbours are near each other, and the order is cut into pieces. Two
    orders are tried: that of the scenario, and reverse Cuthill-McKee (George & Liu 1981, ch. 4); the one that
    cuts fewer edges is used.

    Args:
        graph: every edge that the communication graph has at some time of the flight.
        size: largest number of satellites in a group.

    Raises:
        ValueError: a group has no satellite.
    """
    if size < 1:
        raise ValueError(f"a group has at least one satellite, not {size}")
    receivers, senders = np.nonzero(graph.adjacency)
    count = len(graph)
    links = csr_array((np.ones(len(senders)), (receivers, senders)), shape=(count, count))
    mutual = csr_array(links + links.T)
    near = np.array(reverse_cuthill_mckee(mutual, symmetric_mode=True), dtype=np.int64)
    groups = [_group_of_each(order, size) for order in (np.arange(count), near)]
    cut = [int(np.count_nonzero(group[senders] != group[receivers])) for group in groups]
    best = groups[int(np.argmin(cut))]
    members = [tuple(np.flatnonzero(best == index).tolist()) for index in range(int(best.max()) + 1)]
    return SatelliteGroups(tuple(members), graph)


def _group_of_each(order: Indices, size: int) -> Indices:
    """Index of each satellite's group, of groups of nearly equal size along an order."""
    count = -(-len(order) // size)
    group = np.empty(len(order), dtype=np.int64)
    for index, part in enumerate(_pieces(order, count)):
        group[part] = index
    return group


def _pieces(order: Indices, count: int) -> Sequence[Indices]:
    return np.array_split(order, count)
