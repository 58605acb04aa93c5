# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Membership and graph of the formation as received in `FormationStatus`, for satellites and the recorder."""

from collections.abc import Sequence

import numpy as np

from satform.communication.sim_time import Stamps
from satform.consensus.graph import Graph
from satform.flight.compile import FormationPlan
from satform.membership.formation import Formation
from satform.membership.reconfiguration import Target, targets_in_force
from satform.protocol.status import OVER, FinalCommand, FormationPhase, FormationStatus

STOPPED = "asked to stop"
"""Reason of a flight that was stopped by a signal or a service."""


class FormationView:
    """The formation by the last status of the plant.

    Attributes:
        formation: membership and communication graph.
        ended: the plant's final status; None while the flight continues.
        paused: whether the plant takes no steps at present.
        received_statuses: number of statuses that have been received.
        final_commands: what lost satellites had announced for the step in which they were lost, by index.
        returns: by index, the first step after a rejoin, and the step of its checkpoint.
    """

    def __init__(self, plan: FormationPlan) -> None:
        self.formation = Formation.of(plan.membership)
        self.ended: FormationStatus | None = None
        self.paused = False
        self.received_statuses = 0
        self.final_commands: dict[int, FinalCommand] = {}
        self.returns: dict[int, tuple[int, int]] = {}
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._names = list(plan.names)

    def take(self, status: FormationStatus) -> bool:
        """Update from a status of the plant; False if it is not about this formation."""
        if not self._fits(status):
            return False
        newer = status.version > self.formation.number
        # A known version is not built again: each of a thousand satellites receives it several times.
        graph = self._graph(status) if newer else self.formation.graph
        targets = self._targets(status) if newer else self.formation.targets
        if graph is None or targets is None:
            return False
        self.received_statuses += 1
        if status.phase in OVER:
            self.ended = status
        self.paused = status.phase == FormationPhase.PAUSED
        if not newer:
            return True
        if not np.array_equal(graph.adjacency, self.formation.graph.adjacency):
            self.formation.graph = graph
        self.formation.alive = np.array(status.alive, dtype=np.bool_)
        self.formation.number, self.formation.step = int(status.version), int(status.step)
        self.formation.reason = status.reason
        self.formation.targets = targets
        for name, command in zip(status.lost, status.final_commands, strict=False):
            self._lose(name, command, int(status.step))
        for name, checkpoint in zip(status.rejoined, status.rejoin_checkpoints, strict=True):
            if name in self._names:
                index = self._names.index(name)
                self.returns[index] = (int(status.step), int(checkpoint))
                self.formation.rejoined_at[index] = int(status.step)
        return True

    def _fits(self, status: FormationStatus) -> bool:
        """Whether a status is about this formation, and its arrays have the right lengths."""
        stamp = status.header.stamp
        if self._stamps.contradict(stamp.sec, stamp.nanosec, status.step, exact=True):
            return False
        if list(status.satellites) != self._names or len(status.alive) != len(self._names):
            return False
        if len(status.rejoined) != len(status.rejoin_checkpoints) or len(status.edge_receivers) != len(
            status.edge_senders
        ):
            return False
        return {*status.lost, *status.rejoined} <= set(self._names)

    def _graph(self, status: FormationStatus) -> Graph | None:
        """The communication graph; None if the edges are no graph of this formation."""
        try:
            return Graph.of_edges(len(self._names), status.edge_receivers, status.edge_senders)
        except ValueError:
            return None

    def _targets(self, status: FormationStatus) -> dict[int, Target] | None:
        """The targets in force; None if they are none of this formation."""
        try:
            return targets_in_force(status, self._names)
        except ValueError:
            return None

    def _lose(self, name: str, command: FinalCommand, step: int) -> None:
        if name in self._names:
            index = self._names.index(name)
            # Without a command in the step before it has published nothing for this one.
            announced = bool(command.header.frame_id) and command.step + 1 == step
            if announced:
                self.final_commands[index] = command
            self.formation.lost_at[index] = step if announced else step - 1

    def is_used_by_neighbours(self, satellite: int, step: int) -> bool:
        """Whether a satellite's neighbours use its message for a step."""
        return self.formation.is_used_by_neighbours(satellite, step)

    @property
    def lost(self) -> list[str]:
        """Names of the satellites that are lost at present."""
        return self.names(np.flatnonzero(~self.formation.alive).tolist())

    def names(self, indices: Sequence[int]) -> list[str]:
        """Names of satellites by their indices."""
        return [self._names[index] for index in indices]
