# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The node of one satellite: state and neighbours' phases in, command and own phase out."""

import os
import signal
import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from satform_msgs.msg import FormationStatus

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_LOST
from satform.common.name_list import listed
from satform.communication import topic_table
from satform.communication.message_validator import MessageValidator
from satform.communication.messages import encode
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import RECORDER, satellite_channels, subscribed_by
from satform.control.protocol import ReportsFailures
from satform.flight.compile import FormationPlan
from satform.flight.limits import NO_COMMAND, LimitCheck, Violation, violation_of
from satform.flight.satellite import Satellite
from satform.flight.satellite_step import Decision
from satform.membership.formation import is_lost_at, rejoins_after
from satform.membership.reconfiguration import Target
from satform.protocol.formation_view import FormationView
from satform.protocol.neighbour_messages import Message, NeighbourMessages
from satform.protocol.step_messages import StepMessages
from satform_nodes.runtime.diagnostics import Condition, FlightProgress, Health, Level, with_failures
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.realtime_loop import processor_seconds
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.satellite.checkpoint_file import CheckpointFile
from satform_nodes.satellite.duplicate_check import DuplicateCheck
from satform_nodes.satellite.parameters import SatelliteParameters, SatelliteSettings
from satform_nodes.satellite.publishers import SatellitePublishers
from satform_nodes.satellite.step_batch import StepBatch
from satform_nodes.satellite.subscriptions import MessageHandlers, SatelliteSubscriptions
from satform_nodes.transport.deserialization import deserialize_or_reject
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.node_error import NodeError

_ANY_STEP = 2**63
"""A step beyond every flight."""


class SatelliteNode:
    """Carries the flight software of one satellite; every formula is in `satform`.

    Attributes:
        view: membership and communication graph, by the status of the plant.
        neighbour_messages: received from the in-neighbours.
        subscriptions: of this satellite.
        publishers: of this satellite.
        memory: file of its checkpoints.
        step: the one that comes next.
        flying: whether it takes part.
        clocked: whether the flight goes by the wall clock.
        turns: whether the satellite has an attitude.
        pulse: number of messages of the plant.
        busy_seconds: processor time of its flight software, s.
    """

    def __init__(
        self,
        node: FormationNode,
        executor: StepExecutor,
        plan: FormationPlan,
        settings: SatelliteSettings,
        report: SupervisorPipe,
    ) -> None:
        names = list(plan.names)
        name = settings.name
        if name not in names:
            raise NodeError(
                f"there is no satellite {name!r} in the scenario; there are {listed(names)}",
                EXIT_BAD_INPUT,
            )
        self.node = node
        self.name = name
        self.executor = executor
        self.plan = plan
        self.index = names.index(name)
        self.report = report
        self.step = 0
        self.pulse = 0
        self.flying = False
        self.rejections = node.rejections
        self.busy_seconds = 0.0
        self._progress = FlightProgress(self.rejections)
        self.view = FormationView(plan)
        self._settings = settings
        self.clocked = settings.rate > 0.0
        self._skipped = 0
        self._duplicate = DuplicateCheck(name, plan.timing, settings.rate)
        self._names = names
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._planned = plan.membership.events
        self._limits = LimitCheck(plan.limits)
        self.neighbour_messages = NeighbourMessages(plan, self.index, self.view, self._stamps)
        self.memory = CheckpointFile(settings.checkpoints, name, plan.timing.checkpoint_steps)
        self._changes: list[tuple[str, list[float]]] = []
        self.turns = plan.topics.satellites[self.index].attitude
        self._messages = StepMessages(
            self.neighbour_messages,
            self._stamps,
            needed=self._needed_of_plant(),
            clocked=self.clocked,
        )
        self._batch: StepBatch | None = None
        self._target: Target | None = None
        self._row = 0
        self.satellite = self._new_software()

        self._parameters = SatelliteParameters(node, plan, self.index, self._to_change, self._changes)
        self.publishers = SatellitePublishers(node, plan, self.index, self._stamps)
        handlers = MessageHandlers(
            {
                "state": self._on_state,
                **{kind: partial(self._on_plant, kind) for kind in self._needed_of_plant()},
            },
            self._on_announcement,
            self._on_estimate,
            self._on_status,
        )
        self.subscriptions = SatelliteSubscriptions(
            node, executor, plan, self.index, self.rejections, handlers, clocked=self.clocked
        )
        self.publishers.require_subscribers(self.subscriptions.endpoints, recorded=settings.recorded)
        self._health = Health(node, f"{name}: flight software", name, self._condition, self._now)
        if settings.recorded:
            self.subscriptions.endpoints.require_subscribers(self._health.publisher, [RECORDER])
        executor.add_periodic(self._health.due)

    def _needed_of_plant(self) -> list[str]:
        """Kinds of messages of the plant that a step needs beside the state."""
        table = subscribed_by(self.name, satellite_channels(self.plan.topics, self.index))
        return [channel.kind for channel in table if channel.kind != "state"]

    # Before and after the flight, and when it does not go on

    def matched(self) -> bool:
        """Whether all required endpoints are matched."""
        return self.subscriptions.endpoints.complete(self.view.lost)

    def publish_ready(self) -> None:
        """Publish that this satellite is ready, and the checkpoint from which it would continue."""
        self._duplicate.note_ready()
        self.publishers.publish_ready(self.step, self.memory.step)

    def wait_for_acknowledgement(self) -> None:
        """Wait until the last messages are acknowledged, for a bounded time.

        In lockstep a flight is finished when the plant has every command and the recorder has every step,
        so that only parameter changes can be unacknowledged.
        """
        ended = self.view.ended
        finished = ended is not None and ended.phase == FormationStatus.FINISHED and not self.clocked
        self.publishers.wait_for_acknowledgement(only_changes=finished)

    def report_result(self) -> None:
        """Send figures of this satellite to the supervisor."""
        self.report.send(
            "satellite",
            node=self.name,
            step=self.step,
            busy=self.busy_seconds,
            refused=self.rejections.total,
            skipped=self._skipped,
            processor=processor_seconds(),
            checkpoint_failures=self.memory.failures,
            checkpoint_problem=self.memory.problem,
            **self.neighbour_messages.ages.data(),
        )

    def retransmit(self) -> None:
        """Retransmit the last messages: the step does not continue, and one of them may have been lost."""
        if self.view.ended is None and self.flying:
            self.publishers.retransmit()

    def command_zero(self) -> None:
        """Publish a command of zero: the plant is lost."""
        if self.flying:
            self.publishers.command_zero(self.step)

    def _now(self) -> tuple[int, int]:
        """Simulated time, as a stamp."""
        return self._stamps.at(self.step)

    def _condition(self) -> Condition:
        """How the flight software is."""
        formation = self.view.formation
        silent = {
            self._names[index]: self.step - formation.lost_at.get(index, self.step)
            for index in self.neighbour_messages.neighbours
            if not formation.alive[index]
        }
        condition = self._progress.condition(self.step, silent)
        if isinstance(self.satellite.plan.controller, ReportsFailures):
            software = self.satellite if self._batch is None else self._batch.single(self._row)
            condition = with_failures(condition, software.law_failures())
        if self.memory.problem and condition.level == Level.OK:
            condition = replace(condition, level=Level.WARN, message=self.memory.problem)
        return condition

    # Membership

    def _on_status(self, data: bytes, _name: str) -> None:
        status = deserialize_or_reject(data, FormationStatus, topic_table.STATUS, self.rejections)
        if status is None:
            return
        self.pulse += 1
        before = self.view.formation.number
        if not self.view.take(status):
            self.rejections.add(topic_table.STATUS, "not about this formation")
            return
        formation = self.view.formation
        if formation.number == before:
            return
        self._dissolve_batch()
        self.subscriptions.allow_replacement(np.flatnonzero(~formation.alive).tolist())
        if not formation.alive[self.index]:
            self._on_own_loss()
        self._add_new_neighbours()
        self.act_if_complete()

    def join(self, step: int) -> bool:
        """Take part from a step on: from the first state, or after a rejoin that the plant has published."""
        returned = self.view.returns.get(self.index)
        if returned is None:
            # On the wall clock the first states may have been skipped.
            may_be_late = self.clocked and bool(self.view.formation.alive[self.index])
            if step != 0 and not (may_be_late and self._duplicate.may_have_begun_here(step)):
                return False
            self.satellite.join(step, skipped=True)
        else:
            if returned[0] != step and not (self.clocked and returned[0] < step):
                return False
            if returned[1] >= 0:
                self.memory.restore(self.satellite, self.neighbour_messages.neighbours)
            self._use_target()
            self.satellite.join(step)
        self.flying = True
        self.step = step
        if returned is None or self.view.formation.lost_at.get(self.index) != step:
            # If it was lost in this step, the message that it had published before stays.
            self.publishers.publish_next(step, self.publishers.message(self.satellite.announce(), step))
            self._publish_joint_estimate(step)
        return True

    def _on_own_loss(self) -> None:
        """React to the loss of this satellite: end the process, or reset it if it shares one."""
        step = self.view.formation.step
        is_planned = is_lost_at(self._planned, self.index, step)
        if self.flying and is_planned and self._settings.single:
            self.wait_for_acknowledgement()
            self.report.send("killed", node=self.name, step=self.step)
            os.kill(os.getpid(), signal.SIGKILL)
        if self.flying and not is_planned:
            sentence = f"the plant counts {self.name} as lost since step {step}"
            raise NodeError(f"{sentence}; it ends so that it can be restarted", EXIT_LOST)
        first = not self.flying
        self.flying = False
        self.neighbour_messages.by_step.clear()
        self.publishers.forget()
        self._messages.forget_plant()
        if not first:
            # Satellites of a group share its process, which flies on.
            self.satellite = self._new_software()
            self._target = None
            self.neighbour_messages.reset()
            self._parameters.reset()
            self.memory.load()
            if rejoins_after(self._planned, self.index, step):
                self.publish_ready()

    def _use_target(self) -> None:
        """Fly by the target in force from the next step on."""
        target = self.view.formation.targets.get(self.index)
        if target is not None and target != self._target:
            self._parameters.retarget(self.satellite, target)
            self._target = target

    def _add_new_neighbours(self) -> None:
        """Subscribe to neighbours of which the graph had no edge before."""
        present = self.view.formation.graph.neighbours(self.index)
        new = [index for index in present if index not in self.neighbour_messages.neighbours]
        if not new:
            return
        previous_rows = self.neighbour_messages.add_neighbours(new)
        for neighbour in new:
            self.subscriptions.add_neighbour(neighbour)
        self.satellite.rearrange(previous_rows)
        self.satellite.find_target(self.neighbour_messages.neighbours)

    def _new_software(self) -> Satellite:
        """Flight software that is as at the start of the flight."""
        neighbours = self.neighbour_messages.neighbours
        return Satellite(self.plan.satellite(self.index, neighbours), len(neighbours))

    # A step

    def _on_announcement(self, neighbour: int, validator: MessageValidator, data: bytes, _name: str) -> None:
        if self.clocked:
            fields = validator.validate(data, 0, _ANY_STEP)
            if fields is not None:
                self.neighbour_messages.add_newest(neighbour, fields)
            return
        last = self.step + 1 if self.flying else _ANY_STEP
        fields = validator.validate(data, self.step if self.flying else 0, last)
        if fields is None:
            return
        message = self.neighbour_messages.message(fields)
        if self._batch is None:
            self.neighbour_messages.add(neighbour, fields[2], message)
            self.act_if_complete()
        else:
            self._batch.add_neighbour_message(self._row, neighbour, fields[2], message)

    def _on_state(self, validator: MessageValidator, data: bytes, _name: str) -> None:
        before = validator.repeated
        last = self.step if self.flying and not self.clocked else _ANY_STEP
        numbers = validator.validate(data, self.step, last)
        # Any message of the plant restarts its timeout.
        self.pulse += numbers is not None or validator.repeated > before
        if numbers is None:
            return
        self._messages.state = numbers
        if self._batch is None:
            self.act_if_complete()
        else:
            self._batch.add_state(self._row, numbers)

    def _on_plant(self, kind: str, validator: MessageValidator, data: bytes, _name: str) -> None:
        """Store a message of the plant beside the state."""
        last = self.step if self.flying and not self.clocked else _ANY_STEP
        numbers = validator.validate(data, self.step, last)
        if numbers is None:
            return
        self._messages.of_plant[kind] = numbers
        if self._batch is None:
            self.act_if_complete()
        elif kind == "attitude":
            self._batch.add_attitude(self._row, numbers)

    def _on_estimate(self, neighbour: int, validator: MessageValidator, data: bytes, _name: str) -> None:
        if self.clocked:
            fields = validator.validate(data, 0, _ANY_STEP)
            if fields is not None:
                self.neighbour_messages.add_newest_estimate(neighbour, fields)
            return
        last = self.step + 1 if self.flying else _ANY_STEP
        fields = validator.validate(data, self.step if self.flying else 0, last)
        if fields is None:
            return
        self.neighbour_messages.add_estimate(neighbour, fields)
        self.act_if_complete()

    def act_if_complete(self) -> None:
        """Compute the step if all its messages have been received."""
        state = self._messages.state
        if state is None or not self._knows(int(state[3])):
            return
        step = int(state[2])
        if step >= self.plan.timing.steps:
            self._messages.state = None
            return
        if not self.flying and not self.join(step):
            formation = self.view.formation
            self._duplicate.require_lost(
                step,
                int(state[3]),
                alive=bool(formation.alive[self.index]),
                known_version=formation.number,
            )
            return
        complete = self._messages.complete(step)
        if complete is None:
            return
        if self.clocked and step > self.step:
            # States that came too fast were left out.
            self._skipped += step - self.step
            self.satellite.join(step, skipped=True)
            self.step = step
        self._act(step, state, *complete)

    def _knows(self, number: int) -> bool:
        """Whether the formation that a state is meant for is known; its status is on its way if not."""
        if number > self.view.formation.number:
            self.executor.poll_soon()
            return False
        return True

    def _act(
        self, step: int, state: tuple[Any, ...], messages: dict[int, Message], senders: list[int]
    ) -> None:
        # Processor time: wall-clock time would include other threads that run meanwhile.
        begin = time.thread_time()
        self._use_target()
        given = self._messages.inputs(step, state, messages, senders)
        decision: Decision | None = None
        violation: Violation | None = None
        try:
            decision = self.satellite.act(
                given.motion,
                given.received,
                given.measured_step,
                given.attitude,
                given.applied,
                given.sensed,
            )
            violation = self._limits.of_decision(decision, encode(self.satellite.announce())).get(0)
        except ArithmeticError as error:
            violation = violation_of(error)
        self.busy_seconds += time.thread_time() - begin
        seconds, nanoseconds = self._stamps.at(step)
        self._messages.forget_plant()
        self.neighbour_messages.forget(step)
        self.step = step + 1
        publishers = self.publishers
        if violation is not None or decision is None:
            # The plant ends the flight at this step.
            publishers.report_violation(step, violation or NO_COMMAND)
            self._publish_changes(step)
            return
        message = publishers.message(self.satellite.announce(), self.step)
        publishers.command(seconds, nanoseconds, step, decision, message)
        self.memory.keep(self.satellite, self.neighbour_messages.neighbours)
        publishers.publish_next(step + 1, message)
        self._publish_joint_estimate(step + 1)
        publishers.publish_tracking_of(seconds, nanoseconds, step, decision)
        self._publish_changes(step)

    def _publish_joint_estimate(self, step: int) -> None:
        """Publish the estimate of the whole formation that goes with the neighbour message for a step."""
        if self.plan.topics.satellites[self.index].estimated:
            self.publishers.publish_joint_estimate(step, self.satellite.estimate_numbers())

    def _publish_changes(self, step: int) -> None:
        """Publish the parameters that have changed at a step."""
        if self._changes:
            self.publishers.publish_changes(step, self._changes)
            self._changes.clear()

    # In a batch with other satellites of the process

    @property
    def adjusted(self) -> bool:
        """Whether changes of parameters are unpublished, such as those of overrides at the start."""
        return bool(self._changes)

    def join_batch(self, batch: StepBatch, row: int) -> None:
        """Put messages into a batch from now on, which computes this satellite's steps."""
        self._batch, self._row = batch, row

    def leave_batch(self, satellite: Satellite | None) -> None:
        """Compute steps alone from now on.

        Args:
            satellite: flight software in the state that it has in the batch; None before the first step.
        """
        self._batch = None
        if satellite is not None:
            self.satellite = satellite

    def count_batched_step(self, busy: float) -> None:
        """Count a step that the batch has computed.

        Args:
            busy: this satellite's part of the processor time, s.
        """
        self.busy_seconds += busy
        self._messages.forget_plant()
        self.step += 1

    def _dissolve_batch(self) -> None:
        """Compute steps alone from now on, and so do all others of the batch."""
        if self._batch is not None:
            self._batch.dissolve()

    def _to_change(self) -> tuple[Satellite, int]:
        """The flight software, to be changed by itself, and its next step."""
        self._dissolve_batch()
        return self.satellite, self.step
