# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of a group of satellites that exchanges arrays: when a step has all its messages, what it publishes.

A step needs the state of the group, and the phases for the same step of each group that has in-neighbours of
its satellites. The node of the group hands in what arrives, and publishes what it is asked to.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from satform.communication.array_validator import ArrayMessage, ArrayValidator
from satform.communication.messages import WIDTH, encode
from satform.communication.sim_time import Stamps
from satform.control.protocol import Motion
from satform.flight.compile import FormationPlan
from satform.flight.limits import Violation
from satform.flight.satellite_step import Decision
from satform.flight.stacked_step import StackedResult, StackedStep
from satform.numeric.elementwise import Array
from satform.protocol.formation_view import FormationView
from satform.protocol.satellite_steps import ANY_STEP
from satform.protocol.status import FormationStatus


class GroupOutput(Protocol):
    """What the steps of a group ask of the node that carries them."""

    def publish_commands(self, step: int, acceleration: Array, announced: Array) -> None:
        """Publish the commands of a step, with the phases for the next one.

        Args:
            step: its number.
            acceleration: of the n satellites, m/s^2, shape (n, 3).
            announced: their phases for the next step, shape (n, 2).
        """

    def publish_violation(self, step: int, row: int, violation: Violation) -> None:
        """Publish commands of zero for a step, with what a satellite computed beyond its limit."""

    def publish_phases(self, step: int, stamp: tuple[int, int], announced: Array) -> None:
        """Publish to each group with out-neighbours the phases for a step.

        Args:
            step: for which they are.
            stamp: at which they hold, seconds and nanoseconds.
            announced: phases of all satellites of this group, shape (n, 2).
        """

    def publish_tracking(self, step: int, decision: Decision) -> None:
        """Publish what the satellites follow in a step."""

    def await_status(self) -> None:
        """Take a status as soon as it is there."""


class GroupSteps:
    """The steps of a flight, as a group takes them.

    Attributes:
        view: membership and communication graph, by the status of the plant.
        step: the one that comes next.
        flying: whether the first state has arrived.
        pulse: number of messages of the plant.
        busy_seconds: processor time of the flight software, s.
    """

    def __init__(
        self,
        plan: FormationPlan,
        group: int,
        output: GroupOutput,
        *,
        processor_clock: Callable[[], float] = lambda: 0.0,
    ) -> None:
        """Nothing has been received yet.

        Args:
            plan: of the flight's parts, with groups.
            group: index of this one.
            output: publishes what follows.
            processor_clock: processor time of this thread, s.

        Raises:
            ValueError: the satellites of the group differ in kind, so that they cannot be stacked.
        """
        groups = plan.groups
        assert groups is not None  # noqa: S101 - the node has looked
        self.view = FormationView(plan)
        self.step = 0
        self.flying = False
        self.pulse = 0
        self.busy_seconds = 0.0
        self._output = output
        self._processor_clock = processor_clock
        self._steps = plan.timing.steps
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        members = groups.members[group]
        neighbours = [plan.membership.possible_graph.neighbours(index) for index in members]
        self._software = StackedStep(plan, members, neighbours)
        self._senders = groups.senders_to(group)
        # Own satellites first, then the halo of each sender: messages of a step are gathered in this order.
        halos = [groups.halos[sender, group] for sender in self._senders]
        sources = [*members, *(satellite for halo in halos for satellite in halo)]
        row_of = {satellite: row for row, satellite in enumerate(sources)}
        width = max(map(len, neighbours))
        self._rows = np.zeros((len(members), width), dtype=np.int64)
        for row, own in enumerate(neighbours):
            self._rows[row] = row
            self._rows[row, : len(own)] = [row_of[satellite] for satellite in own]
        self._gathered = np.zeros((len(sources), WIDTH[plan.announces]))
        self._times = np.zeros(len(sources))
        self._parts: dict[int, slice] = {}
        begin = len(members)
        for sender, halo in zip(self._senders, halos, strict=True):
            self._parts[sender] = slice(begin, begin + len(halo))
            begin += len(halo)
        self._own = slice(0, len(members))
        self._state: ArrayMessage | None = None
        # Halos of the present step and of the next one, by the sender and the step's lowest bit.
        self._halos: tuple[dict[int, ArrayMessage], dict[int, ArrayMessage]] = ({}, {})

    # What arrives

    def take_status(self, status: FormationStatus) -> bool:
        """Take in a status of the plant; False if it is not about this formation."""
        self.pulse += 1
        taken = self.view.take(status)
        self.act_if_complete()
        return taken

    def take_state(self, validator: ArrayValidator, data: bytes) -> None:
        """Take in a state of the plant."""
        before = validator.repeated
        message = validator.validate(data, self.step, self.step if self.flying else ANY_STEP)
        # Any message of the plant restarts its timeout.
        self.pulse += message is not None or validator.repeated > before
        if message is not None:
            self._state = message
            self.act_if_complete()

    def take_phases(self, sender: int, validator: ArrayValidator, data: bytes) -> None:
        """Take in the phases of a group that has in-neighbours of these satellites."""
        message = validator.validate(data, self.step, self.step + 1)
        if message is not None:
            self._halos[message.step & 1][sender] = message
            self.act_if_complete()

    def lacking(self) -> tuple[bool, list[int]]:
        """What the next step lacks: whether the state, and the groups whose phases have not arrived."""
        there = self._halos[self.step & 1]
        return self._state is None, [sender for sender in self._senders if sender not in there]

    # A step

    def act_if_complete(self) -> None:
        """Compute the step if all its messages have been received."""
        state = self._state
        if state is None:
            return
        if int(state.fields["formation_version"]) > self.view.formation.number:
            # Its status is on its way.
            self._output.await_status()
            return
        if state.step >= self._steps:
            self._state = None
            return
        if not self.flying:
            self.flying = True
            self._publish_phases()
        if len(self._halos[self.step & 1]) == len(self._senders):
            self._act(state)

    def _act(self, state: ArrayMessage) -> None:
        step = self.step
        # Processor time: wall-clock time would include other threads that run meanwhile.
        begin = self._processor_clock()
        self._gather(step)
        fields: Any = state.fields
        position, velocity, applied = (
            np.array(fields[name]).reshape(-1, 3) for name in ("position", "velocity", "applied_acceleration")
        )
        result = self._software.compute(
            step,
            Motion(position, velocity),
            self._gathered.take(self._rows, axis=0),
            self._times.take(self._rows),
            self.view.formation,
            applied=applied,
        )
        self.busy_seconds += self._processor_clock() - begin
        self._halos[step & 1].clear()
        self._state = None
        self.step = step + 1
        if not isinstance(result, StackedResult):
            row = min(result)
            # The plant ends the flight at this step.
            self._output.publish_violation(step, row, result[row])
            return
        self._output.publish_commands(step, result.decision.acceleration, result.announced)
        self._output.publish_phases(self.step, self._stamps.at_time(result.time), result.announced)
        self._output.publish_tracking(step, result.decision)

    def _gather(self, step: int) -> None:
        """Put the phases for a step into one array, with the times at which they hold."""
        announcement = self._software.satellite.announce()
        self._gathered[self._own] = encode(announcement)
        self._times[self._own] = announcement.time
        for sender, message in self._halos[step & 1].items():
            rows = self._parts[sender]
            self._gathered[rows, 0] = message.fields["arc_length"]
            self._gathered[rows, 1] = message.fields["rate"]
            self._times[rows] = self._stamps.time(message.seconds, message.nanoseconds)

    def _publish_phases(self) -> None:
        """Publish the phases for the first step."""
        announcement = self._software.satellite.announce()
        stamp = self._stamps.at_time(float(announcement.time[0]))
        self._output.publish_phases(self.step, stamp, encode(announcement))
