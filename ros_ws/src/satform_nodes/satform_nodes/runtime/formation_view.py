# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the plant says of the formation, as a satellite, the recorder or anyone else takes it in."""

from collections.abc import Sequence

import numpy as np
from satform_msgs.msg import Command, FormationStatus

from satform.consensus.graph import Graph
from satform.flight.compile import FormationPlan
from satform.membership.state import Formation
from satform_nodes.transport.sim_time import Stamps

STOPPED = "asked to stop"
"""Reason of a flight that was aborted because it was asked to be, by a signal or a service."""

OVER = (FormationStatus.FINISHED, FormationStatus.ABORTED)
"""Phases after which nothing follows."""


class FormationView:
    """The formation as the plant's last word has it.

    Attributes:
        formation: who flies and who hears whom.
        ended: the plant's last word; None while the flight goes on.
        paused: whether the plant takes no steps at present.
        heard: how many words of the plant have come in.
        final_commands: what lost satellites had announced for the step in which they were lost, by place.
        returns: by place, from which step a satellite takes part again, and from which checkpoint.
    """

    def __init__(self, plan: FormationPlan) -> None:
        self.formation = Formation.of(plan.membership)
        self.ended: FormationStatus | None = None
        self.paused = False
        self.heard = 0
        self.final_commands: dict[int, Command] = {}
        self.returns: dict[int, tuple[int, int]] = {}
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._names = list(plan.names)

    def take(self, status: FormationStatus) -> bool:
        """Take in a word of the plant; False for one that is not about this formation."""
        if not self._fits(status):
            return False
        newer = status.version > self.formation.number
        # What holds already is not built again: each of a thousand satellites hears it a few times.
        graph = self._graph(status) if newer else self.formation.graph
        if graph is None:
            return False
        self.heard += 1
        if status.phase in OVER:
            self.ended = status
        self.paused = status.phase == FormationStatus.PAUSED
        if not newer:
            return True
        if not np.array_equal(graph.adjacency, self.formation.graph.adjacency):
            self.formation.graph = graph
        self.formation.alive = np.array(status.alive, dtype=np.bool_)
        self.formation.number, self.formation.step = int(status.version), int(status.step)
        self.formation.reason = status.reason
        for name, command in zip(status.lost, status.final_commands, strict=False):
            self._lose(name, command, int(status.step))
        for name, checkpoint in zip(status.rejoined, status.rejoin_checkpoints, strict=True):
            if name in self._names:
                place = self._names.index(name)
                self.returns[place] = (int(status.step), int(checkpoint))
                self.formation.rejoined_at[place] = int(status.step)
        return True

    def _fits(self, status: FormationStatus) -> bool:
        """Whether a word is about this formation, and as long in its parts as it has to be."""
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
        """Who hears whom; None where that is no graph of this formation."""
        try:
            return Graph.of_edges(len(self._names), status.edge_receivers, status.edge_senders)
        except ValueError:
            return None

    def _lose(self, name: str, command: Command, step: int) -> None:
        if name in self._names:
            place = self._names.index(name)
            # Without a command in the step before it has announced nothing for this one.
            announced = bool(command.header.frame_id) and command.step + 1 == step
            if announced:
                self.final_commands[place] = command
            self.formation.lost_at[place] = step if announced else step - 1

    def is_used_by_neighbours(self, satellite: int, step: int) -> bool:
        """Whether a satellite's neighbours use what it announces for a step."""
        return self.formation.is_used_by_neighbours(satellite, step)

    @property
    def lost(self) -> list[str]:
        """Names of the satellites that are lost at present."""
        return self.names(np.flatnonzero(~self.formation.alive).tolist())

    def names(self, places: Sequence[int]) -> list[str]:
        """Names of satellites by their places."""
        return [self._names[place] for place in places]
