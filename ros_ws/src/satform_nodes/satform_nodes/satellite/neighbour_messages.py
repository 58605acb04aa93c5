# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a satellite's neighbours said: by step, or the newest on the wall clock; and what links make of it."""

from collections import deque
from typing import Any

import numpy as np
from satform_msgs.msg import Command

from satform.communication.messages import WIDTH
from satform.communication.neighbour_buffer import Received
from satform.communication.receiver import ReceiverModel
from satform.consensus.arc_length import Announces
from satform.flight.compile import FormationPlan
from satform_nodes.runtime.formation_view import FormationView
from satform_nodes.runtime.realtime_loop import Ages
from satform_nodes.satellite.publishers import AROUND_NUMBERS
from satform_nodes.transport.sim_time import Stamps

Words = tuple[float, ...]
"""What a neighbour said: its time, then the numbers of its announcement."""


class Hearsay:
    """The words of one satellite's neighbours.

    Attributes:
        neighbours: places of those whom the satellite may hear, ascending.
        by_step: in lockstep, what each neighbour said for a step.
        ages: on the wall clock, how old the words were when they were used.
    """

    def __init__(self, plan: FormationPlan, index: int, view: FormationView, stamps: Stamps) -> None:
        """Nobody has said anything.

        Args:
            plan: of the flight's parts.
            index: place of the satellite.
            view: who flies and who hears whom at present.
            stamps: of the steps.
        """
        self.neighbours = list(plan.membership.possible_graph.neighbours(index))
        self.by_step: dict[int, dict[int, Words]] = {}
        self.ages = Ages()
        self._plan = plan
        self._index = index
        self._view = view
        self._stamps = stamps
        self._step = plan.timing.step
        self._announces = plan.announces
        self._width = WIDTH[self._announces]
        self._newest: dict[int, deque[tuple[int, Words]]] = {}
        self.start_afresh()

    def start_afresh(self) -> None:
        """Have links that have carried nothing yet."""
        self._ears = ReceiverModel(self._plan.links, np.asarray(self._index), [self.neighbours])

    def meet(self, new: list[int]) -> list[int | None]:
        """Have neighbours who were none before.

        Args:
            new: their places.

        Returns:
            Of each neighbour its place among those before; None for a new one.
        """
        before = self.neighbours
        self.neighbours = sorted([*before, *new])
        self.start_afresh()
        return [before.index(place) if place in before else None for place in self.neighbours]

    def hears_all(self) -> bool:
        """Whether the graph of the moment lets the satellite hear all whom it may ever hear."""
        return bool(self._ears.linked(self._view.formation).all())

    def words(self, said: tuple[Any, ...]) -> Words:
        """Time and numbers of an announcement, from all that its message holds."""
        begin = 3 + len(AROUND_NUMBERS[self._announces][0])
        return (self._stamps.time(said[0], said[1]), *said[begin : begin + self._width])

    def hear(self, neighbour: int, step: int, words: Words) -> None:
        """Note what a neighbour said for a step."""
        self.by_step.setdefault(step, {})[neighbour] = words

    def hear_newest(self, neighbour: int, said: tuple[Any, ...]) -> None:
        """On the wall clock: keep what a neighbour said for the latest steps."""
        own = self._newest.setdefault(neighbour, deque(maxlen=3))
        own.append((said[2], self.words(said)))

    def speakers(self, step: int) -> list[int]:
        """Places of the neighbours who say something for a step and are heard at present."""
        linked, view = self._ears.linked(self._view.formation), self._view
        return [
            neighbour
            for place, neighbour in enumerate(self.neighbours)
            if linked[place] and view.is_used_by_neighbours(neighbour, step)
        ]

    def newest(self, step: int) -> dict[int, Words]:
        """The newest words of those who are heard, of this step or older."""
        heard: dict[int, Words] = {}
        for neighbour in self.speakers(step):
            # What is said for the next step already is kept for that.
            due = [said for spoken, said in self._newest.get(neighbour, ()) if spoken <= step]
            if due:
                heard[neighbour] = due[-1]
                self.ages.note(step * self._step - due[-1][0])
        return heard

    def add_last_words(self, step: int, heard: dict[int, Words]) -> None:
        """Add what lost neighbours had announced for the step in which they were lost."""
        for neighbour, command in self._view.final_commands.items():
            if self._view.formation.lost_at.get(neighbour) == step and neighbour in self.neighbours:
                heard.setdefault(neighbour, last_word(command, self._announces, self._stamps))
        self.by_step[step] = heard

    def told(self, step: int, heard: dict[int, Words], speakers: list[int]) -> Received:
        """What the links make of what the neighbours said for a step."""
        neighbours, formation = self.neighbours, self._view.formation
        count, width = len(neighbours), 1 + self._width
        if len(speakers) == count:
            said = np.array([heard[neighbour] for neighbour in neighbours]).reshape(count, width)
            return self._ears.receive(step, said[:, 1:], said[:, 0], np.ones(count), formation)
        said, fresh = np.zeros((count, width)), np.zeros(count)
        for place, neighbour in enumerate(neighbours):
            if neighbour in speakers:
                said[place], fresh[place] = heard[neighbour], 1.0
        return self._ears.receive(step, said[:, 1:], said[:, 0], fresh, formation)

    def forget(self, step: int) -> None:
        """Drop what was said for a step, which has been taken, and for the one before."""
        self.by_step.pop(step, None)
        self.by_step.pop(step - 1, None)


def last_word(command: Command, announces: Announces, stamps: Stamps) -> Words:
    """Time and numbers of the announcement that a lost satellite's last command carries."""
    time = stamps.time(command.announced_at.sec, command.announced_at.nanosec)
    if announces == "arc_length":
        return (time, command.announced_arc_length, command.announced_rate)
    position, velocity = command.announced_position, command.announced_velocity
    return (time, position.x, position.y, position.z, velocity.x, velocity.y, velocity.z)
