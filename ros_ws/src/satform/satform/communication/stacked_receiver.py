# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reception of messages between the satellites of many runs: each run's satellites receive from their own."""

from collections.abc import Sequence

import numpy as np

from satform.communication.channel_model import ChannelModel
from satform.communication.neighbour_buffer import Received
from satform.communication.receiver import ReceiverModel
from satform.membership.formation import Formation
from satform.numeric.elementwise import Array, Indices


class StackedReceiver:
    """Reception by alike satellites of many runs, the same operations as `ReceiverModel` has."""

    def __init__(self, runs: Sequence[ReceiverModel], count: int) -> None:
        """Receivers before their first message.

        Args:
            runs: receivers of each run, of the same satellites with as many possible neighbours.
            count: satellites of a run, which stand one after another in what is sent.
        """
        self._runs = list(runs)
        self._count = count
        channels = [run.channel for run in runs if run.channel is not None]
        self._channel = ChannelModel.stacked(channels) if channels else None
        self._index_links()

    def _index_links(self) -> None:
        """Indices of the neighbours among all satellites, shape (K, M)."""
        own = [run.neighbours + self._count * index for index, run in enumerate(self._runs)]
        self._neighbours = np.ascontiguousarray(np.concatenate(own).T)
        self._linked: Array = np.zeros(self._neighbours.T.shape)

    def link(self, formations: Sequence[Formation]) -> None:
        """Take over the communication graph of each run, before the first message and when one changes."""
        linked = [run.linked(formation) for run, formation in zip(self._runs, formations, strict=True)]
        self._linked = np.ascontiguousarray(np.concatenate(linked).T).T

    def receive(self, step: int, sent: Array, stamp: float) -> Received:
        """What arrives in a step.

        Args:
            step: its number.
            sent: numbers that all satellites of all runs send for this step, shape (width, R N).
            stamp: simulated time to which they belong, s.
        """
        values = sent.take(self._neighbours, axis=1).T
        stamps = np.empty_like(self._linked)
        stamps.fill(stamp)
        received = Received(values, stamps, self._linked, self._linked, complete=True)
        return received if self._channel is None else self._channel.transmit(step, received)

    def keep(self, runs: Indices, rows: Indices) -> None:
        """Go on with some of the runs alone.

        Args:
            runs: their indices, ascending.
            rows: indices of their satellites among those that receive here.
        """
        self._runs = [self._runs[run] for run in runs.tolist()]
        linked = self._linked.T.take(rows, axis=1).T
        self._channel = None if self._channel is None else self._channel.keep(rows)
        self._index_links()
        self._linked = linked
