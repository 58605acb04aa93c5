# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reception of messages between satellites: which of those sent arrive at which receiver."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from satform.communication.channel_model import ChannelModel, LinksSpec
from satform.communication.neighbour_buffer import Received
from satform.communication.physical_links import LinkConditions
from satform.membership.faults import FaultSchedule
from satform.membership.formation import Formation
from satform.numeric.elementwise import Array, Indices


@dataclass(frozen=True)
class LinkPlan:
    """What happens to messages between satellites on their way.

    Attributes:
        links: what each link does to them; None where every message arrives at once.
        names: of all satellites.
        step: control period, s.
        seed: of the run.
        faults: whose clocks are wrong.
        width: numbers of a phase or motion; what follows in a message is an estimate.
    """

    links: LinksSpec | None
    names: tuple[str, ...]
    step: float
    seed: int
    faults: FaultSchedule
    width: int = 0


class ReceiverModel:
    """Reception by one satellite or by many that fly as one: possible in-neighbours, links, clocks.

    Attributes:
        members: index of each satellite in the formation, shape (); or (n,) for many.
        neighbours: indices of possible in-neighbours, ascending, padded with the own index, shape (..., K).
    """

    def __init__(self, plan: LinkPlan, members: Indices, neighbours: Sequence[Sequence[int]]) -> None:
        """A receiver before its first message.

        Args:
            plan: what happens to messages.
            members: indices of the satellites, shape () or (n,).
            neighbours: for each of them the indices of its possible in-neighbours, ascending.
        """
        rows = np.atleast_1d(members)
        width = max(len(row) for row in neighbours)
        senders = np.empty((len(rows), width), dtype=np.int64)
        real = np.zeros((len(rows), width))
        for index, (member, own) in enumerate(zip(rows, neighbours, strict=True)):
            senders[index] = [*own, *([member] * (width - len(own)))]
            real[index, : len(own)] = 1.0
        shape = (*members.shape, width)
        self.members = members
        self.neighbours = senders.reshape(shape)
        self._real = real.reshape(shape)
        self._faults = plan.faults
        self._width = plan.width
        self._links: ChannelModel | None = None
        if plan.links is not None:
            edges = [
                (int(sender), int(member))
                for member, row in zip(rows, senders, strict=True)
                for sender in row
            ]
            self._links = ChannelModel.of(plan.links, edges, plan.names, (plan.step, plan.seed), shape)
        self._number = -1
        self._linked = self._real

    def linked(self, formation: Formation) -> Array:
        """1 for each possible in-neighbour that is one in the present graph, shape (..., K)."""
        if formation.number != self._number:
            self._number = formation.number
            receivers = self.members if self.members.ndim == 0 else self.members[:, None]
            self._linked = formation.graph.adjacency[receivers, self.neighbours] * self._real
        return self._linked

    @property
    def channel(self) -> ChannelModel | None:
        """The incoming links; None where every message arrives at once."""
        return self._links

    def conditions(self, whole: LinkConditions | None) -> LinkConditions | None:
        """Those of the incoming links, shape (..., K), of those of all links, shape (N, N)."""
        if whole is None:
            return None
        receivers = self.members if self.members.ndim == 0 else self.members[:, None]
        return LinkConditions(
            whole.loss[receivers, self.neighbours], whole.light_time[receivers, self.neighbours]
        )

    def receive(
        self,
        step: int,
        values: Array,
        stamp: Array,
        fresh: Array | None,
        formation: Formation,
        conditions: LinkConditions | None = None,
    ) -> Received:
        """What arrives in a step.

        Args:
            step: its number.
            values: that each possible neighbour sends for this step, shape (..., K, width).
            stamp: simulated time to which they belong, s, shape (..., K).
            fresh: 1 for those that send a message for this step, else 0, shape (..., K); None when all do.
            formation: with the communication graph in this step.
            conditions: of the incoming links, shape (..., K); None where no link is physical.
        """
        linked = self.linked(formation)
        if values.shape[-1] > self._width:
            values = self._without_lost(step, values, formation)
        if fresh is None:
            received = Received(values, stamp, linked, linked, complete=True)
        else:
            arriving = fresh * linked
            received = Received(values, stamp, arriving, linked, complete=bool((arriving == linked).all()))
        if self._faults.any_clock:
            received = received.shifted(self._clocks(step))
        return received if self._links is None else self._links.transmit(step, received, conditions)

    def estimates(self, received: Received) -> Array:
        """Numbers of the estimates that have arrived in a step, each with the index of its sender in front.

        Args:
            received: by one satellite.

        Returns:
            Shape (M, 1 + width of an estimate); M is 0 where none are exchanged.
        """
        if received.values.shape[-1] <= self._width:
            return np.zeros((0, 1))
        arrived = (received.fresh * received.linked) > 0.0
        senders = self.neighbours[arrived].astype(np.float64)
        return np.concatenate((senders[:, None], received.values[arrived][:, self._width :]), axis=-1)

    def _without_lost(self, step: int, values: Array, formation: Formation) -> Array:
        """The same values without estimates of satellites that are lost in this step.

        Their phase is in the plant's status, so that all neighbours have it; an estimate may have reached
        some neighbours only.
        """
        lost = [satellite for satellite, at in formation.lost_at.items() if at == step]
        if not lost:
            return values
        values = values.copy()
        values[np.isin(self.neighbours, lost), self._width :] = 0.0
        return values

    def _clocks(self, step: int) -> Array:
        """By how much each neighbour's clock is ahead of the own one, s, shape (..., K)."""
        own = np.broadcast_to(self.members[..., None], self.neighbours.shape)
        pairs = zip(self.neighbours.ravel().tolist(), own.ravel().tolist(), strict=True)
        ahead = [self._faults.clock(other, step) - self._faults.clock(me, step) for other, me in pairs]
        return np.array(ahead).reshape(self.neighbours.shape)
