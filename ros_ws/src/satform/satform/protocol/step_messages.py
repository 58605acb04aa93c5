# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages that a satellite needs for a step, and what its flight software is given of them."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.attitude.guidance import Attitude
from satform.communication.neighbour_buffer import Received
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import satellite_channels, subscribed_by
from satform.control.protocol import Motion
from satform.flight.compile import FormationPlan
from satform.membership.formation import Formation
from satform.navigation.satellite_navigation import NavigationInput
from satform.numeric.elementwise import Array
from satform.protocol.neighbour_messages import Message, NeighbourMessages


@dataclass(frozen=True)
class StepInputs:
    """What the flight software of a satellite is given for a step.

    Attributes:
        motion: measured position and velocity, LVLH.
        received: messages of the neighbours, after the link models.
        measured_step: at which the motion was measured.
        attitude: measured; None without one.
        applied: acceleration that the thrusters made of the last command, m/s^2.
        sensed: what its navigation gets; None without sensors.
    """

    motion: Motion
    received: Received
    measured_step: int
    attitude: Attitude | None
    applied: Array
    sensed: NavigationInput | None


class StepMessages:
    """Collects the messages of one satellite's next step: those of the plant and of its in-neighbours.

    Attributes:
        state: fields of the newest one that is not yet used; None when there is none.
        of_plant: likewise of the other messages of the plant by kind: attitude, conditions of the incoming
            links, readings of sensors.
    """

    def __init__(
        self,
        neighbours: NeighbourMessages,
        stamps: Stamps,
        *,
        needed: Collection[str],
        clocked: bool,
    ) -> None:
        """Nothing has been received yet.

        Args:
            neighbours: messages of the in-neighbours.
            stamps: of the steps.
            needed: kinds of messages of the plant that a step needs beside the state.
            clocked: whether the flight goes by the wall clock.
        """
        self.state: tuple[Any, ...] | None = None
        self.of_plant: dict[str, tuple[Any, ...]] = {}
        self._needed = tuple(needed)
        self._neighbours = neighbours
        self._stamps = stamps
        self._clocked = clocked
        self._all: tuple[str | int, ...] = ()
        self._all_of = -1

    def lacking(self, step: int, formation: Formation) -> tuple[str | int, ...]:
        """Messages that a step of lockstep lacks, by kind or index of a neighbour.

        Args:
            step: number of the step.
            formation: membership and graph at present.

        Returns:
            The same tuple as long as nothing has been received for the step.
        """
        if formation.number != self._all_of:
            senders = self._neighbours.senders(step)
            alive = [neighbour for neighbour in senders if formation.alive[neighbour]]
            self._all, self._all_of = (*alive, *self._needed, "state"), formation.number
        stored = self._neighbours.by_step.get(step, {})
        if self.state is None and not self.of_plant and not stored:
            return self._all
        received = {*stored, *self.of_plant, *(() if self.state is None else ("state",))}
        return tuple(key for key in self._all if key not in received)

    def numbers(
        self, state: tuple[Any, ...], messages: dict[int, Message], senders: list[int]
    ) -> list[float] | None:
        """What a step of `FloatSatellite` needs of the messages for a step; None if it needs more.

        Args:
            state: fields of the state message.
            messages: of the neighbours, by their indices.
            senders: indices of the neighbours whose messages are used.
        """
        if self._clocked or self.of_plant:
            return None
        received = self._neighbours.numbers(messages, senders)
        return None if received is None else [*state[4:13], *received]

    def complete(self, step: int) -> tuple[dict[int, Message], list[int]] | None:
        """The neighbours' messages for a step: all of that step, or on the wall clock the newest ones.

        Returns:
            The messages by the neighbours' indices, and the indices of those that are used; None while a
            message is missing.
        """
        if self._clocked:
            if self._lacks_plant(step):
                return None
            messages = self._neighbours.newest(step)
            return messages, list(messages)
        messages, senders = self._neighbours.by_step.get(step, {}), self._neighbours.senders(step)
        if any(sender not in messages for sender in senders):
            self._neighbours.add_final_commands(step, messages)
            if any(sender not in messages for sender in senders):
                return None
        if self._neighbours.lacks_estimate(step, senders):
            return None
        return None if self._lacks_plant(step) else (messages, senders)

    def inputs(
        self, step: int, state: tuple[Any, ...], messages: dict[int, Message], senders: list[int]
    ) -> StepInputs:
        """What the flight software is given for a step.

        Args:
            step: number of the step.
            state: fields of its state message.
            messages: of the neighbours, by their indices.
            senders: indices of the neighbours whose messages are used.
        """
        of_plant = self.of_plant
        links = of_plant["link_conditions"][3:] if "link_conditions" in of_plant else None
        received = self._neighbours.apply_links(step, messages, senders, links)
        motion = Motion(np.array(state[4:7]), np.array(state[7:10]))
        attitude = None
        if "attitude" in of_plant:
            attitude = Attitude(*np.array(of_plant["attitude"][3:12]).reshape(3, 3))
        sensed = None
        if "measurements" in of_plant:
            readings = np.array(of_plant["measurements"][4:])
            sensed = self._neighbours.inputs_of_navigation(readings, received)
        measured_step = self._stamps.step(state[0], state[1])
        return StepInputs(motion, received, measured_step, attitude, np.array(state[10:13]), sensed)

    def forget_plant(self) -> None:
        """Discard the messages of the plant: their step has been taken, or the satellite is lost."""
        self.state = None
        self.of_plant = {}

    def _lacks_plant(self, step: int) -> bool:
        """Whether a message of the plant beside the state is missing for a step."""
        found = (self.of_plant.get(kind) for kind in self._needed)
        return any(message is None or message[2] != step for message in found)


def needed_of_plant(plan: FormationPlan, index: int) -> list[str]:
    """Kinds of messages of the plant that a step of a satellite needs beside the state."""
    table = subscribed_by(plan.names[index], satellite_channels(plan.topics, index))
    return [channel.kind for channel in table if channel.kind != "state"]
