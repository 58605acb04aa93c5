# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of the satellites of one process, computed together over stacked arrays with the same bits as alone.

Each satellite keeps its node, its topics and its messages. The batch is dissolved for good at the first
change of membership, graph or parameters, and each satellite continues with its own part of the state.
"""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from satform_msgs.msg import Command, Tracking

from satform.attitude.guidance import Attitude
from satform.communication import topic_table
from satform.communication.messages import AROUND_NUMBERS, WIDTH
from satform.communication.sim_time import Stamps
from satform.control.protocol import Motion
from satform.flight.compile import FormationPlan
from satform.flight.limits import Violation
from satform.flight.satellite import Satellite
from satform.flight.stacked_step import StackedResult, StackedStep
from satform.membership.formation import has_individual_events
from satform.protocol.neighbour_messages import Message
from satform_nodes.satellite.node import SatelliteNode
from satform_nodes.satellite.publishers import numbers_of, violation_command
from satform_nodes.transport import topic_types
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.fast_path import MANY_SUBSCRIPTIONS

_STATES, _ATTITUDES, _NEIGHBOURS = range(3)
"""Kinds of messages that a step needs."""

_COMMAND = layout(Command, topic_table.FRAME)
_TRACKING = layout(Tracking, topic_table.FRAME)


def batch_satellites(satellites: Sequence[SatelliteNode], plan: FormationPlan) -> bool:
    """Have the satellites of one process compute their steps together, if they can; whether they do.

    They cannot with link models or faults, on the wall clock, if the first graph lacks an edge of a later
    one, if a parameter was set at the start, or if their models differ.

    Args:
        satellites: before their first step.
        plan: of the flight's parts.
    """
    ordinary = (
        plan.links.links is None and plan.faults.empty and not has_individual_events(plan.membership.events)
    )
    alike = all(
        not (node.clocked or node.adjusted) and node.steps.neighbour_messages.receives_all()
        for node in satellites
    )
    if len(satellites) < 2 or not ordinary or not alike:
        return False
    try:
        stacked = StackedStep(
            plan,
            [node.index for node in satellites],
            [node.steps.neighbour_messages.neighbours for node in satellites],
        )
    except ValueError:
        return False
    batch = BatchedStep(satellites, plan, stacked)
    for row, node in enumerate(satellites):
        node.steps.join_batch(batch, row)
    return True


class BatchedStep:
    """Collects the messages of one step of all satellites, and computes it for all once it is complete."""

    def __init__(
        self, satellites: Sequence[SatelliteNode], plan: FormationPlan, stacked: StackedStep
    ) -> None:
        """Nothing has arrived yet.

        Args:
            satellites: the nodes, in the order in which they are stacked.
            plan: of the flight's parts.
            stacked: computes their steps.
        """
        self._nodes = list(satellites)
        self._publishers = [node.publishers for node in satellites]
        self._stacked = stacked
        self._steps = plan.timing.steps
        self._announces = plan.announces
        self._announcement = layout(topic_types.TYPES[self._announces], topic_table.FRAME)
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._number = satellites[0].steps.view.formation.number
        rows = [node.steps.neighbour_messages.neighbours for node in satellites]
        self._width = max(len(row) for row in rows)
        self._slots = [
            {neighbour: row * self._width + slot for slot, neighbour in enumerate(own)}
            for row, own in enumerate(rows)
        ]
        self._turns = satellites[0].turns
        # Received messages, and the number of missing ones, of the present step and the next one, by the
        # step's lowest bit.
        self._edges = sum(len(row) for row in rows)
        self._no_message: Message = (0.0,) * (1 + WIDTH[self._announces])
        self._received = [self._empty_slots(), self._empty_slots()]
        self._missing = [self._edges, self._edges]
        self._step = self._turn = 0
        self._begun = False
        self._begin_step()
        self._awaited_in_turn = self._expected()
        self._executor = satellites[0].executor
        if len(self._awaited_in_turn) >= MANY_SUBSCRIPTIONS:
            self._executor.await_in_turn(self._next_awaited)

    def _expected(self) -> list[tuple[int, int, Any]]:
        """The messages that a step needs, about in reverse order of their arrival.

        A wait for the last message ends once, since the others have usually arrived before it.

        Returns:
            For each message the list that it fills, its index there, and its subscription.
        """
        kinds = [(_ATTITUDES, "attitude"), (_STATES, "state")] if self._turns else [(_STATES, "state")]
        own = [
            (filled, row, node.subscriptions.subscriptions[kind])
            for filled, kind in kinds
            for row, node in reversed(list(enumerate(self._nodes)))
        ]
        received = [
            (_NEIGHBOURS, slot, node.subscriptions.subscriptions[neighbour])
            for node, own_slots in zip(self._nodes, self._slots, strict=True)
            for neighbour, slot in own_slots.items()
        ]
        return [*own, *received]

    def _next_awaited(self) -> Any:
        """The subscription of the last message that the step lacks; None when it has all or none."""
        if not self._begun:
            return None
        filled = (self._states, self._attitudes, self._received[self._step & 1])
        awaited, turn = self._awaited_in_turn, self._turn
        while turn < len(awaited):
            kind, slot, subscription = awaited[turn]
            if filled[kind][slot] is None:
                self._turn = turn
                return subscription
            turn += 1
        self._turn = turn
        return None

    def _empty_slots(self) -> list[Message | None]:
        """Slots of the messages of one step: None for an in-neighbour, zeros for a slot without one."""
        slots: list[Message | None] = [self._no_message] * (len(self._nodes) * self._width)
        for own in self._slots:
            for slot in own.values():
                slots[slot] = None
        return slots

    def _begin_step(self) -> None:
        self._states: list[tuple[Any, ...] | None] = [None] * len(self._nodes)
        self._attitudes: list[tuple[Any, ...] | None] = [None] * len(self._nodes)
        self._awaited = len(self._nodes) * (2 if self._turns else 1)
        self._turn = 0

    def add_neighbour_message(self, row: int, neighbour: int, step: int, message: Message) -> None:
        """Add what a satellite received from a neighbour for the present step or the next one."""
        slots, slot = self._received[step & 1], self._slots[row][neighbour]
        if slots[slot] is None:
            self._missing[step & 1] -= 1
        slots[slot] = message
        self._act_if_complete()

    def add_state(self, row: int, state: tuple[Any, ...]) -> None:
        """Add the state that a satellite received from the plant."""
        step, node = int(state[2]), self._nodes[row]
        if state[3] != self._number:
            self.dissolve()
            return
        if step >= self._steps:
            return
        if not node.steps.flying and not node.steps.join(step):
            self.dissolve()
            return
        self._begun = True
        self._awaited -= self._states[row] is None
        self._states[row] = state
        self._act_if_complete()

    def add_attitude(self, row: int, attitude: tuple[Any, ...]) -> None:
        """Add the attitude that a satellite received from the plant."""
        if int(attitude[2]) >= self._steps:
            return
        self._awaited -= self._attitudes[row] is None
        self._attitudes[row] = attitude
        self._act_if_complete()

    def dissolve(self) -> None:
        """Have each satellite compute its own steps, from its part of the state and of the messages."""
        self._executor.await_in_turn(None)
        nodes, begun = self._nodes, self._stacked.satellite.state.has_acted
        for row, node in enumerate(nodes):
            node.steps.leave_batch(self.single(row) if begun else None)
            for neighbour, slot in self._slots[row].items():
                for step in (self._step, self._step + 1):
                    message = self._received[step & 1][slot]
                    if message is not None:
                        node.steps.neighbour_messages.add(neighbour, step, message)
        for node in nodes:
            node.steps.act_if_complete()

    def single(self, row: int) -> Satellite:
        """The flight software of one of the satellites by itself."""
        node = self._nodes[row]
        return self._stacked.satellite.single(
            row, node.steps.satellite.plan, len(node.steps.neighbour_messages.neighbours)
        )

    def _act_if_complete(self) -> None:
        if self._awaited or self._missing[self._step & 1]:
            return
        step = self._step
        # Processor time: wall-clock time would include other threads that run meanwhile.
        begin = time.thread_time()
        result = self._compute(step)
        busy = (time.thread_time() - begin) / len(self._nodes)
        self._received[step & 1], self._missing[step & 1] = self._empty_slots(), self._edges
        self._step = step + 1
        self._begin_step()
        for node in self._nodes:
            node.steps.count_batched_step(busy)
        if isinstance(result, StackedResult):
            self._publish(step, result)
        else:
            self._report(step, result)

    def _compute(self, step: int) -> StackedResult | dict[int, Violation]:
        count = len(self._nodes)
        first = self._states[0]
        assert first is not None  # noqa: S101 - everything has arrived
        states = np.array([state[4:13] for state in self._states if state is not None])
        motion = Motion(states[:, :3], states[:, 3:6])
        messages = np.array(self._received[step & 1], dtype=np.float64).reshape(
            count, self._width, len(self._no_message)
        )
        attitude = None
        if self._turns:
            turned = np.array([own[3:12] for own in self._attitudes if own is not None])
            attitude = Attitude(turned[:, :3], turned[:, 3:6], turned[:, 6:9])
        # Satellites whose filters are updated at different times are not stacked.
        measured_step = self._stamps.step(first[0], first[1])
        return self._stacked.compute(
            step,
            motion,
            messages[..., 1:],
            messages[..., 0],
            self._nodes[0].steps.view.formation,
            measured_step=measured_step,
            attitude=attitude,
            applied=states[:, 6:],
        )

    def _report(self, step: int, violations: dict[int, Violation]) -> None:
        """Report the violations to the plant, with zero commands for all satellites of the batch."""
        within = Violation(0, 0.0)
        for row, own in enumerate(self._publishers):
            own.publish_command(violation_command(self._stamps.at(step), step, violations.get(row, within)))

    def _publish(self, step: int, result: StackedResult) -> None:
        """Publish all commands first, as the plant waits for them; then neighbour messages; then the rest."""
        nodes, publishers, now = self._nodes, self._publishers, self._stamps.at(step)
        decision, messages = result.decision, result.announced
        stamp = self._stamps.at_time(result.time)
        blank = np.zeros((len(nodes), 6 if self._announces == "arc_length" else 2))
        parts = (messages, blank) if self._announces == "arc_length" else (blank, messages)
        torque = decision.wheel_torque
        commands = np.concatenate(
            (decision.acceleration, np.zeros((len(nodes), 3)) if torque is None else torque), axis=-1
        ).tolist()
        announced = np.concatenate(parts, axis=-1).tolist()
        for own, command, message in zip(publishers, commands, announced, strict=True):
            own.publish_command(_COMMAND.pack(*now, step, *command, *stamp, *message, 0, 0.0))
        before, after = AROUND_NUMBERS[self._announces]
        for own, message in zip(publishers, messages.tolist(), strict=True):
            own.publish_announcement(self._announcement.pack(*stamp, step + 1, *before, *message, *after))
        for row, node in enumerate(nodes):
            if node.memory.due(step + 1):
                node.memory.keep(self.single(row), node.steps.neighbour_messages.neighbours)
        if decision.estimate is not None:
            for own, estimate in zip(publishers, numbers_of(decision.estimate).tolist(), strict=True):
                own.publish_estimate(*now, step, estimate)
        shown = np.concatenate(decision.tracked(), axis=-1).tolist()
        unsolved = decision.unsolved_plans
        plans = [0] * len(nodes) if unsolved is None else unsolved.astype(np.int64).tolist()
        for own, tracked, count in zip(publishers, shown, plans, strict=True):
            own.publish_tracking(_TRACKING.pack(*now, step, *tracked, count))
