# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which messages the links of a flight under way lose, by its scenario and the seed of its random numbers."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from satform.communication.channel_model import LinksSpec, loss_draws
from satform.flight.compile import compile_scenario
from satform.numeric.elementwise import Array, Indices
from satform.scenario import Scenario

LOSS_WINDOW = 60.0
"""Simulated time over which the loss of a link is taken, s."""


class LinkLosses:
    """Age of the newest message and part of the messages that was lost, by link.

    The satellites draw the losses of links by these random numbers; nothing of it is published.
    """

    def __init__(self, scenario: Scenario, edges: Sequence[tuple[int, int]]) -> None:
        """Nothing has been sent yet.

        Args:
            scenario: that is flown; its links are neither radio nor optical ones.
            edges: indices of receiver and sender of each link.
        """
        plan, specs = compile_scenario(scenario), scenario.links or LinksSpec()
        names = plan.names
        self._step = scenario.timing.step
        self._links = [specs.of(names[sender], names[receiver]) for receiver, sender in edges]
        self._edges = np.array([(sender, receiver) for receiver, sender in edges], dtype=np.int64)
        self._count, self._seed = len(names), plan.links.seed
        self._every = np.array([max(1, round(link.period / self._step)) for link in self._links])
        self._loss = np.array([link.loss for link in self._links])
        self._window = max(1, round(LOSS_WINDOW / self._step))
        self._next = 0
        self._newest: Array = np.full(len(edges), np.nan)
        self._sent = np.zeros((0, len(edges)), dtype=np.bool_)
        self._delivered = self._sent

    def at(self, step: int) -> tuple[Array, Array]:
        """Age in s, and lost part of the last minute's messages, of each link; NaN where there is none.

        Args:
            step: not before that of the last call.
        """
        first = max(self._next, step + 1 - self._window)
        steps: Indices = np.arange(first, step + 1, dtype=np.int64)
        if len(steps):
            sent = steps[:, None] % self._every == 0
            draws = loss_draws(self._seed, self._edges, self._count, len(steps), first)
            delivered = sent & (draws >= self._loss) & ~self._cut(steps)
            reached = np.where(delivered, steps[:, None], -1).max(axis=0)
            self._newest = np.where(reached >= 0, reached, self._newest)
            self._sent = np.concatenate((self._sent, sent))[-self._window :]
            self._delivered = np.concatenate((self._delivered, delivered))[-self._window :]
            self._next = step + 1
        total = self._sent.sum(axis=0)
        lost = np.where(total > 0, 1.0 - self._delivered.sum(axis=0) / np.maximum(total, 1), np.nan)
        return (step - self._newest) * self._step, lost

    def _cut(self, steps: Indices) -> NDArray[np.bool_]:
        """Whether an outage of the link loses what is sent for a step, shape (K, E)."""
        cut: NDArray[np.bool_] = np.zeros((len(steps), len(self._links)), dtype=np.bool_)
        times: Array = steps.astype(np.float64) * self._step
        for column, link in enumerate(self._links):
            for window in link.outages:
                cut[:, column] |= window.covers(times)
        return cut
