# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The node of one satellite: state and neighbours' phases in, command and own phase out."""

import os
import signal
import time
from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from satform_msgs.msg import FormationStatus

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_LOST
from satform.common.name_list import listed
from satform.communication import topic_table
from satform.communication.message_validator import MessageValidator
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import RECORDER
from satform.flight.compile import FormationPlan
from satform.flight.limits import Violation
from satform.flight.satellite import Satellite
from satform.flight.satellite_step import Decision
from satform.membership.reconfiguration import Target
from satform.numeric.elementwise import Array
from satform.protocol.satellite_output import StampedMessage
from satform.protocol.satellite_steps import SatelliteSteps
from satform.protocol.step_messages import needed_of_plant
from satform_nodes.runtime.diagnostics import Condition, FlightProgress, Health, Level, with_failures
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.realtime_loop import processor_seconds
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.satellite.checkpoint_file import CheckpointFile
from satform_nodes.satellite.duplicate_check import DuplicateCheck
from satform_nodes.satellite.parameters import SatelliteParameters, SatelliteSettings
from satform_nodes.satellite.publishers import NO_TORQUE, SatellitePublishers
from satform_nodes.satellite.subscriptions import MessageHandlers, SatelliteSubscriptions
from satform_nodes.transport.deserialization import deserialize_or_reject
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.node_error import NodeError


class SatelliteNode:
    """Carries the flight software of one satellite.

    Every formula is in `satform`, and every decision about steps in `satform.protocol`.

    Attributes:
        steps: of the flight.
        subscriptions: of this satellite.
        publishers: of this satellite.
        memory: file of its checkpoints.
        clocked: whether the flight goes by the wall clock.
        turns: whether the satellite has an attitude.
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
        self.rejections = node.rejections
        self.clocked = settings.rate > 0.0
        self.turns = plan.topics.satellites[self.index].attitude
        self._progress = FlightProgress(self.rejections)
        self._settings = settings
        self._duplicate = DuplicateCheck(name, plan.timing, settings.rate)
        self._names = names
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._changes: list[tuple[str, list[float]]] = []
        self.memory = CheckpointFile(settings.checkpoints, name, plan.timing.checkpoint_steps)
        self.steps = SatelliteSteps(
            plan, self.index, self, self.memory, clocked=self.clocked, processor_clock=time.thread_time
        )
        self._parameters = SatelliteParameters(node, plan, self.index, self._to_change, self._changes)
        self.publishers = SatellitePublishers(node, plan, self.index, self._stamps)
        handlers = MessageHandlers(
            {
                "state": self._on_state,
                **{kind: partial(self._on_plant, kind) for kind in needed_of_plant(plan, self.index)},
            },
            self._on_announcement,
            self._on_estimate,
            self._on_status,
        )
        self.subscriptions = SatelliteSubscriptions(
            node, executor, plan, self.index, self.rejections, handlers, clocked=self.clocked
        )
        self._lacking: tuple[tuple[str | int, ...], list[Any]] = ((), [])
        executor.await_together(self._lacking_subscriptions)
        self.publishers.require_subscribers(self.subscriptions.endpoints, recorded=settings.recorded)
        self._health = Health(node, f"{name}: flight software", name, self._condition, self._now)
        if settings.recorded:
            self.subscriptions.endpoints.require_subscribers(self._health.publisher, [RECORDER])
        executor.add_periodic(self._health.due)

    # Before and after the flight, and when it does not go on

    def matched(self) -> bool:
        """Whether all required endpoints are matched."""
        return self.subscriptions.endpoints.complete(self.steps.view.lost)

    def offer(self) -> None:
        """Publish that this satellite is ready, since all its endpoints are matched."""
        self.steps.offer()

    def publish_ready(self) -> None:
        """Publish that this satellite is ready, and the checkpoint from which it would continue."""
        self._duplicate.note_ready()
        self.publishers.publish_ready(self.steps.step, self.memory.step)

    def wait_for_acknowledgement(self) -> None:
        """Wait until the last messages are acknowledged, for a bounded time.

        In lockstep a flight is finished when the plant has every command and the recorder has every step,
        so that only parameter changes can be unacknowledged.
        """
        ended = self.steps.view.ended
        finished = ended is not None and ended.phase == FormationStatus.FINISHED and not self.clocked
        self.publishers.wait_for_acknowledgement(only_changes=finished)

    def report_result(self) -> None:
        """Send figures of this satellite to the supervisor."""
        self.report.send(
            "satellite",
            node=self.name,
            step=self.steps.step,
            busy=self.steps.busy_seconds,
            refused=self.rejections.total,
            skipped=self.steps.skipped,
            processor=processor_seconds(),
            checkpoint_failures=self.memory.failures,
            checkpoint_problem=self.memory.problem,
            **self.steps.neighbour_messages.ages.data(),
        )

    def retransmit(self) -> None:
        """Retransmit the last messages: the step does not continue, and one of them may have been lost."""
        if self.steps.view.ended is None and self.steps.flying:
            self.publishers.retransmit()

    def command_zero(self) -> None:
        """Publish a command of zero: the plant is lost."""
        if self.steps.flying:
            self.publishers.command_zero(self.steps.step)

    def _now(self) -> tuple[int, int]:
        """Simulated time, as a stamp."""
        return self._stamps.at(self.steps.step)

    def _condition(self) -> Condition:
        """How the flight software is."""
        steps, formation = self.steps, self.steps.view.formation
        silent = {
            self._names[index]: steps.step - formation.lost_at.get(index, steps.step)
            for index in steps.neighbour_messages.neighbours
            if not formation.alive[index]
        }
        condition = self._progress.condition(steps.step, silent)
        if steps.reports_failures:
            condition = with_failures(condition, steps.software().law_failures())
        if self.memory.problem and condition.level == Level.OK:
            condition = replace(condition, level=Level.WARN, message=self.memory.problem)
        return condition

    # What arrives

    def _lacking_subscriptions(self) -> list[Any] | None:
        """Subscriptions whose messages the next step lacks; None if that is not known."""
        keys = self.steps.lacking()
        if keys is None:
            return None
        if keys is not self._lacking[0]:
            found = self.subscriptions.subscriptions
            self._lacking = (keys, [found[key] for key in keys])
        return self._lacking[1]

    def _on_status(self, data: bytes, _name: str) -> None:
        status = deserialize_or_reject(data, FormationStatus, topic_table.STATUS, self.rejections)
        if status is None:
            return
        # One that is back already may have published by its next process.
        self.subscriptions.finish({*status.lost} - {*status.rejoined})
        if not self.steps.take_status(status):
            self.rejections.add(topic_table.STATUS, "not about this formation")

    def _on_announcement(self, neighbour: int, validator: MessageValidator, data: bytes, _name: str) -> None:
        self.steps.take_announcement(neighbour, validator, data)

    def _on_state(self, validator: MessageValidator, data: bytes, _name: str) -> None:
        self.steps.take_state(validator, data)

    def _on_plant(self, kind: str, validator: MessageValidator, data: bytes, _name: str) -> None:
        self.steps.take_of_plant(kind, validator, data)

    def _on_estimate(self, neighbour: int, validator: MessageValidator, data: bytes, _name: str) -> None:
        self.steps.take_estimate(neighbour, validator, data)

    # What the steps ask for

    def publish_command(self, step: int, decision: Decision, message: StampedMessage) -> None:
        """Publish the command of a step, with a copy of the neighbour message for the next one."""
        self.publishers.command(*self._stamps.at(step), step, decision, message)

    def publish_command_numbers(
        self, step: int, acceleration: Sequence[float], message: StampedMessage
    ) -> None:
        """Publish the command of a step from its numbers."""
        now = self._stamps.at(step)
        self.publishers.command_numbers(*now, step, acceleration, NO_TORQUE, message)

    def publish_violation(self, step: int, violation: Violation) -> None:
        """Publish a command of zero for a step, with what was beyond its limit."""
        self.publishers.report_violation(step, violation)

    def publish_next(self, step: int, message: StampedMessage) -> None:
        """Publish the neighbour message for a step."""
        self.publishers.publish_next(step, message)

    def publish_joint_estimate(self, step: int, numbers: Array) -> None:
        """Publish the estimate of the whole formation that goes with the neighbour message for a step."""
        self.publishers.publish_joint_estimate(step, numbers)

    def publish_tracking(self, step: int, decision: Decision) -> None:
        """Publish reference, tracking error and estimates of a step."""
        self.publishers.publish_tracking_of(*self._stamps.at(step), step, decision)

    def publish_tracking_numbers(self, step: int, numbers: Sequence[float]) -> None:
        """Publish reference, tracking error and sliding variable of a step from their numbers."""
        self.publishers.publish_tracking_numbers(*self._stamps.at(step), step, numbers)

    def publish_changes(self, step: int) -> None:
        """Publish the parameters that have changed at a step."""
        if self._changes:
            self.publishers.publish_changes(step, self._changes)
            self._changes.clear()

    def forget_messages(self) -> None:
        """Do not retransmit what was published last."""
        self.publishers.forget()

    def await_status(self) -> None:
        """Take a status as soon as it is there."""
        self.executor.poll_soon()

    def lost(self, step: int, *, planned: bool) -> None:
        """End the process of a lost satellite, unless it shares the process and the scenario has it lost."""
        if planned and self._settings.single:
            self.wait_for_acknowledgement()
            self.report.send("killed", node=self.name, step=self.steps.step)
            os.kill(os.getpid(), signal.SIGKILL)
        if not planned:
            sentence = f"the plant counts {self.name} as lost since step {step}"
            raise NodeError(f"{sentence}; it ends so that it can be restarted", EXIT_LOST)

    def allow_replacement(self, lost: Collection[int]) -> None:
        """Accept restarted processes of lost satellites as publishers."""
        self.subscriptions.allow_replacement(lost)

    def add_neighbour(self, neighbour: int) -> None:
        """Subscribe to the messages of a neighbour."""
        self.subscriptions.add_neighbour(neighbour)

    def retarget(self, satellite: Satellite, target: Target) -> None:
        """Have the flight software fly by a target; the parameters show it."""
        self._parameters.retarget(satellite, target)

    def reset_parameters(self) -> None:
        """Have the specifications of the scenario in force again."""
        self._parameters.reset()

    def may_have_begun_here(self, step: int) -> bool:
        """On the wall clock: whether a flight that has come to a step can have begun with this process."""
        return self._duplicate.may_have_begun_here(step)

    def require_lost(self, step: int, version: int, *, alive: bool, known_version: int) -> None:
        """End this process if another one flies this satellite."""
        self._duplicate.require_lost(step, version, alive=alive, known_version=known_version)

    # Parameters

    @property
    def adjusted(self) -> bool:
        """Whether changes of parameters are unpublished, such as those of overrides at the start."""
        return bool(self._changes)

    def _to_change(self) -> tuple[Satellite, int]:
        """The flight software, to be changed by itself, and its next step."""
        self.steps.dissolve_batch()
        return self.steps.satellite, self.steps.step
