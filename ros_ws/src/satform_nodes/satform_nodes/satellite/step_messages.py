# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages that a satellite needs for a step, and what its flight software is given of them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.attitude.guidance import Attitude
from satform.communication.neighbour_buffer import Received
from satform.control.protocol import Motion
from satform.numeric.elementwise import Array
from satform_nodes.satellite.neighbour_messages import Message, NeighbourMessages
from satform_nodes.transport.sim_time import Stamps


@dataclass(frozen=True)
class StepInputs:
    """What the flight software of a satellite is given for a step.

    Attributes:
        motion: measured position and velocity, LVLH.
        received: messages of the neighbours, after the link models.
        measured_step: at which the motion was measured.
        attitude: measured; None without one.
        applied: acceleration that the thrusters made of the last command, m/s^2.
    """

    motion: Motion
    received: Received
    measured_step: int
    attitude: Attitude | None
    applied: Array


class StepMessages:
    """Collects the messages of one satellite's next step: state, attitude, links, those of its in-neighbours.

    Attributes:
        state: fields of the newest one that is not yet used; None when there is none.
        attitude: likewise.
        links: likewise, the conditions of the incoming radio and optical links.
    """

    def __init__(
        self,
        neighbours: NeighbourMessages,
        stamps: Stamps,
        *,
        needs_attitude: bool,
        needs_links: bool,
        clocked: bool,
    ) -> None:
        """Nothing has been received yet.

        Args:
            neighbours: messages of the in-neighbours.
            stamps: of the steps.
            needs_attitude: whether the satellite has an attitude.
            needs_links: whether it receives over radio or optical links.
            clocked: whether the flight goes by the wall clock.
        """
        self.state: tuple[Any, ...] | None = None
        self.attitude: tuple[Any, ...] | None = None
        self.links: tuple[Any, ...] | None = None
        self._needs_links = needs_links
        self._neighbours = neighbours
        self._stamps = stamps
        self._needs_attitude = needs_attitude
        self._clocked = clocked

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
        links = None if self.links is None else self.links[3:]
        received = self._neighbours.apply_links(step, messages, senders, links)
        motion = Motion(np.array(state[4:7]), np.array(state[7:10]))
        attitude = None
        if self.attitude is not None:
            attitude = Attitude(*np.array(self.attitude[3:12]).reshape(3, 3))
        measured_step = self._stamps.step(state[0], state[1])
        return StepInputs(motion, received, measured_step, attitude, np.array(state[10:13]))

    def forget_plant(self) -> None:
        """Discard state, attitude and links: their step has been taken, or the satellite is lost."""
        self.state = self.attitude = self.links = None

    def _lacks_plant(self, step: int) -> bool:
        """Whether a message of the plant beside the state is missing for a step."""
        attitude, links = self.attitude, self.links
        lacks_attitude = self._needs_attitude and (attitude is None or attitude[2] != step)
        return lacks_attitude or (self._needs_links and (links is None or links[2] != step))
