# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages of a satellite's in-neighbours, by step or the newest ones, with the link models applied."""

from collections import deque
from collections.abc import Iterable
from typing import Any

import numpy as np

from satform.communication.messages import AROUND_NUMBERS, WIDTH
from satform.communication.neighbour_buffer import Received
from satform.communication.physical_links import LinkConditions
from satform.communication.receiver import ReceiverModel
from satform.communication.sim_time import Stamps
from satform.consensus.arc_length import Announces
from satform.flight.compile import FormationPlan
from satform.navigation.satellite_navigation import NavigationInput, message_width
from satform.numeric.elementwise import Array
from satform.protocol.formation_view import FormationView
from satform.protocol.message_ages import MessageAges
from satform.protocol.status import FinalCommand

Message = tuple[float, ...]
"""Message of a neighbour: its time, then its numbers."""

_STORED_STEPS = 4
"""Steps of which estimates are stored: more arrive only while a satellite does not take part."""


class NeighbourMessages:
    """The messages of one satellite's in-neighbours.

    Attributes:
        neighbours: indices of the in-neighbours, ascending.
        by_step: in lockstep, the message of each neighbour for a step.
        ages: on the wall clock, the ages of messages when they were used.
    """

    def __init__(self, plan: FormationPlan, index: int, view: FormationView, stamps: Stamps) -> None:
        """Nothing has been received yet.

        Args:
            plan: of the flight's parts.
            index: of the satellite.
            view: membership and communication graph at present.
            stamps: of the steps.
        """
        self.neighbours = list(plan.membership.possible_graph.neighbours(index))
        self.by_step: dict[int, dict[int, Message]] = {}
        self.ages = MessageAges()
        self._plan = plan
        self._index = index
        self._view = view
        self._stamps = stamps
        self._step = plan.timing.step
        self._announces = plan.announces
        self._width = WIDTH[self._announces]
        self._no_message: Message = (0.0,) * (1 + self._width)
        self._exchanges = plan.topics.satellites[index].exchanges
        self._no_estimate: Message = (0.0,) * message_width(plan.topics.satellites[index].estimated)
        self._estimates: dict[int, dict[int, Message]] = {}
        self._newest: dict[int, deque[tuple[int, Message]]] = {}
        self._newest_estimates: dict[int, deque[tuple[int, Message]]] = {}
        self.reset()

    def reset(self) -> None:
        """Reset the link models."""
        self._receiver = ReceiverModel(self._plan.links, np.asarray(self._index), [self.neighbours])

    def add_neighbours(self, new: list[int]) -> list[int | None]:
        """Add neighbours.

        Args:
            new: their indices.

        Returns:
            Of each neighbour its row among those before; None for a new one.
        """
        before = self.neighbours
        self.neighbours = sorted([*before, *new])
        self.reset()
        return [before.index(index) if index in before else None for index in self.neighbours]

    def receives_all(self) -> bool:
        """Whether the present graph has the edges from all neighbours."""
        return bool(self._receiver.linked(self._view.formation).all())

    def message(self, fields: tuple[Any, ...]) -> Message:
        """Time and numbers of a neighbour's message, from all its fields."""
        begin = 3 + len(AROUND_NUMBERS[self._announces][0])
        return (self._stamps.time(fields[0], fields[1]), *fields[begin : begin + self._width])

    def add(self, neighbour: int, step: int, message: Message) -> None:
        """Store the message of a neighbour for a step."""
        self.by_step.setdefault(step, {})[neighbour] = message

    def add_estimate(self, neighbour: int, fields: tuple[Any, ...]) -> None:
        """Store the estimate of a neighbour that goes with its message for a step."""
        self._estimates.setdefault(fields[2], {})[neighbour] = self._estimate(fields)
        if len(self._estimates) > _STORED_STEPS:
            del self._estimates[min(self._estimates)]

    def add_newest_estimate(self, neighbour: int, fields: tuple[Any, ...]) -> None:
        """On the wall clock: store the newest estimates of a neighbour."""
        own = self._newest_estimates.setdefault(neighbour, deque(maxlen=3))
        own.append((fields[2], self._estimate(fields)))

    def _estimate(self, fields: tuple[Any, ...]) -> Message:
        """Step and numbers of an estimate, from all fields of its message."""
        made, numbers = self._stamps.step(fields[0], fields[1]), fields[3:]
        size = int(numbers[0])
        return (float(made), *numbers[1 : 1 + size], *numbers[2 + size :])

    def lacks_estimate(self, step: int, senders: list[int]) -> bool:
        """Whether the estimate of one of these senders is missing for a step."""
        if not self._exchanges:
            return False
        arrived, lost_at = self._estimates.get(step, {}), self._view.formation.lost_at
        return any(sender not in arrived and lost_at.get(sender) != step for sender in senders)

    def inputs_of_navigation(self, readings: Array, received: Received) -> NavigationInput:
        """What the satellite's navigation gets in a step.

        Args:
            readings: of its sensors, shape (W,).
            received: from the neighbours, after the link models.
        """
        return NavigationInput(readings, self._receiver.estimates(received), self._view.formation.graph)

    def add_newest(self, neighbour: int, fields: tuple[Any, ...]) -> None:
        """On the wall clock: store the newest messages of a neighbour."""
        own = self._newest.setdefault(neighbour, deque(maxlen=3))
        own.append((fields[2], self.message(fields)))

    def senders(self, step: int) -> list[int]:
        """Indices of the neighbours that publish for a step and have an edge at present."""
        linked, view = self._receiver.linked(self._view.formation), self._view
        return [
            neighbour
            for index, neighbour in enumerate(self.neighbours)
            if linked[index] and view.is_used_by_neighbours(neighbour, step)
        ]

    def newest(self, step: int) -> dict[int, Message]:
        """The newest message of each neighbour that has an edge, of this step or older."""
        received: dict[int, Message] = {}
        for neighbour in self.senders(step):
            # A message for the next step is stored until that step.
            due = [message for sent, message in self._newest.get(neighbour, ()) if sent <= step]
            if due:
                received[neighbour] = due[-1]
                self.ages.note(step * self._step - due[-1][0])
        return received

    def add_final_commands(self, step: int, received: dict[int, Message]) -> None:
        """Add the messages that lost neighbours had published for the step of their loss."""
        for neighbour, command in self._view.final_commands.items():
            if self._view.formation.lost_at.get(neighbour) == step and neighbour in self.neighbours:
                received.setdefault(neighbour, final_command(command, self._announces, self._stamps))
        self.by_step[step] = received

    def numbers(self, received: dict[int, Message], senders: list[int]) -> list[float] | None:
        """For each neighbour 1 if the graph has its edge, then for each time and numbers of its message.

        Args:
            received: messages by the indices of their senders.
            senders: indices of the neighbours whose messages are used.

        Returns:
            None where the message of a neighbour with an edge is missing, or where links delay or lose
            messages.
        """
        if self._exchanges or self._receiver.channel is not None:
            return None
        linked: list[float] = self._receiver.linked(self._view.formation).tolist()
        if sum(linked) != len(senders):
            return None
        for neighbour in self.neighbours:
            linked += received[neighbour] if neighbour in senders else self._no_message
        return linked

    def apply_links(
        self,
        step: int,
        received: dict[int, Message],
        senders: list[int],
        links: tuple[Any, ...] | None = None,
    ) -> Received:
        """Apply the link models to the messages for a step.

        Args:
            step: number of the step.
            received: messages by the indices of their senders.
            senders: indices of the neighbours whose messages are used.
            links: loss and light time of the links from all satellites, each after its length; None where no
                link is physical.
        """
        neighbours, formation = self.neighbours, self._view.formation
        conditions = None
        if links is not None:
            both = np.array(links).reshape(2, -1)[:, 1:]
            conditions = LinkConditions(both[0, neighbours], both[1, neighbours])
        whole = self._with_estimates(step, received)
        count, width = len(neighbours), 1 + self._width
        if self._exchanges:
            width += len(self._no_estimate)
        if len(senders) == count:
            messages = np.array([whole[neighbour] for neighbour in neighbours]).reshape(count, width)
            return self._receiver.receive(
                step, messages[:, 1:], messages[:, 0], np.ones(count), formation, conditions
            )
        messages, fresh = np.zeros((count, width)), np.zeros(count)
        for index, neighbour in enumerate(neighbours):
            if neighbour in senders:
                messages[index], fresh[index] = whole[neighbour], 1.0
        return self._receiver.receive(step, messages[:, 1:], messages[:, 0], fresh, formation, conditions)

    def _with_estimates(self, step: int, received: dict[int, Message]) -> dict[int, Message]:
        """The messages for a step with the estimates that go with them."""
        if not self._exchanges:
            return received
        arrived = self._estimates.get(step, {}) | self._new_estimates(step, received)
        return {
            neighbour: (*message, *arrived.get(neighbour, self._no_estimate))
            for neighbour, message in received.items()
        }

    def _new_estimates(self, step: int, senders: Iterable[int]) -> dict[int, Message]:
        """On the wall clock: of each sender the newest estimate for this step or an earlier one.

        It is used once: there is nothing new in it afterwards.
        """
        found: dict[int, Message] = {}
        for neighbour in senders:
            waiting = self._newest_estimates.get(neighbour, deque())
            while waiting and waiting[0][0] <= step:
                found[neighbour] = waiting.popleft()[1]
        return found

    def forget(self, step: int) -> None:
        """Discard the messages for a step that has been taken, and for the one before."""
        self._estimates.pop(step, None)
        self._estimates.pop(step - 1, None)
        self.by_step.pop(step, None)
        self.by_step.pop(step - 1, None)


def final_command(command: FinalCommand, announces: Announces, stamps: Stamps) -> Message:
    """Time and numbers of the neighbour message that a lost satellite's final command contains."""
    time = stamps.time(command.announced_at.sec, command.announced_at.nanosec)
    if announces == "arc_length":
        return (time, command.announced_arc_length, command.announced_rate)
    position, velocity = command.announced_position, command.announced_velocity
    return (time, position.x, position.y, position.z, velocity.x, velocity.y, velocity.z)
