# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The node of a group of satellites that exchanges arrays: one state in, one command out, phases of halos.

It has the place of a `SatelliteNode` for each of its satellites in the flight loop.
"""

import time
from collections import deque
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from satform_msgs.msg import FormationStatus, NodeReady

from satform.common.exit_codes import EXIT_BAD_INPUT
from satform.common.name_list import listed
from satform.communication import topic_table
from satform.communication.array_layout import ArrayLayout
from satform.communication.satellite_groups import SatelliteGroups
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import (
    PLANT,
    RECORDER,
    channels,
    phase_topic,
    published_by,
    relative,
    subscribed_by,
    topic_name,
)
from satform.flight.compile import FormationPlan
from satform.flight.limits import Violation
from satform.flight.satellite_step import Decision
from satform.numeric.elementwise import Array
from satform.protocol.group_steps import GroupSteps
from satform_nodes.runtime.diagnostics import Condition, FlightProgress, Health
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.lifecycle import wait_for_acknowledgement
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.authorised_publishers import AuthorisedPublishers
from satform_nodes.transport.deserialization import deserialize_or_reject
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.matched_endpoints import MatchedEndpoints
from satform_nodes.transport.message_forms import array_form_of, array_validator_of
from satform_nodes.transport.node_error import NodeError
from satform_nodes.transport.node_names import local_name

_ACKNOWLEDGEMENT_TIMEOUT = 2.0
"""Timeout of the acknowledgements of the last messages, s."""

_STATE = -1
"""Key of the subscription to the state, beside the senders of phases."""


class ArrayGroup:
    """Carries the flight software of a group of satellites.

    Every formula is in `satform`, and every decision about steps in `satform.protocol.group_steps`.

    Attributes:
        node: of the group.
        name: of the group.
        plan: of the flight's parts.
        report: pipe to the supervisor.
        steps: of the flight.
    """

    def __init__(
        self,
        node: FormationNode,
        executor: StepExecutor,
        plan: FormationPlan,
        groups: SatelliteGroups,
        report: SupervisorPipe,
        *,
        recorded: bool,
    ) -> None:
        """Make the endpoints; nothing has been received yet.

        Args:
            node: of the group, whose name is that of the group.
            executor: hands out the messages.
            plan: of the flight's parts, with groups.
            groups: the same.
            report: pipe to the supervisor.
            recorded: whether a recorder takes part, to be waited for.

        Raises:
            NodeError: there is no such group, or its satellites cannot be stacked.
        """
        self.name = node.get_name()
        if self.name not in groups.names:
            sentence = (
                f"there is no group {self.name!r} in the parameter groups; there are {listed(groups.names)}"
            )
            raise NodeError(sentence, EXIT_BAD_INPUT)
        index = groups.names.index(self.name)
        self.plan = plan
        self.report = report
        self.node = node
        self._executor, self._recorded = executor, recorded
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        try:
            self.steps = GroupSteps(plan, index, self, processor_clock=time.thread_time)
        except ValueError as error:
            sentence = (
                f"the satellites of {self.name} differ in kind, so that they cannot exchange arrays: {error}"
            )
            raise NodeError(sentence, EXIT_BAD_INPUT) from None
        self._endpoints = MatchedEndpoints(node)
        table = channels(plan.topics)
        own = [channel for channel in published_by(self.name, table) if channel.kind != "diagnostics"]
        self._publishers: dict[str, Any] = {}
        self._forms: dict[str, ArrayLayout] = {}
        for channel in own:
            publisher = node.create_publisher(
                topic_types.TYPES[channel.kind], relative(channel.topic), qos.publisher_profile(channel)
            )
            self._publishers[channel.topic] = publisher
            self._endpoints.require_subscribers(publisher, channel.required_subscribers(recorded=recorded))
            if channel.satellites:
                self._forms[channel.topic] = array_form_of(channel)
        self._command_topic = topic_name("group_command", self.name)
        self._tracking_topic = topic_name("group_tracking", self.name)
        # To each group with out-neighbours: the topic, and the rows of the satellites whose phases go there.
        row_of = {satellite: row for row, satellite in enumerate(groups.members[index])}
        self._halos = [
            (
                phase_topic(self.name, groups.names[receiver]),
                np.array([row_of[satellite] for satellite in groups.halos[index, receiver]]),
            )
            for receiver in groups.receivers_of(index)
        ]
        self._subscriptions: dict[int, Any] = {}
        self._subscribe(groups, subscribed_by(self.name, table))
        # For retransmission: the last command, and the phases of the present step and the next one.
        self._last_command: tuple[str, bytes] | None = None
        self._last_phases: deque[tuple[str, bytes]] = deque(maxlen=2 * len(self._halos))
        self._progress = FlightProgress(node.rejections)
        self._health = Health(
            node, f"{self.name}: flight software", self.name, self._condition, lambda: self._now
        )
        if recorded:
            self._endpoints.require_subscribers(self._health.publisher, [RECORDER])
        executor.add_periodic(self._health.due)
        executor.await_together(self._lacking)

    def _subscribe(self, groups: SatelliteGroups, own: list[topic_table.Channel]) -> None:
        """Subscribe to the state, the phases of other groups, and the status."""
        for channel in own:
            if not channel.satellites:
                continue
            validator = array_validator_of(channel, self.node.rejections, self._stamps)
            if channel.kind == "group_state":
                key, take = _STATE, partial(self.steps.take_state, validator)
            else:
                key = groups.names.index(channel.publishers[0])
                take = partial(self.steps.take_phases, key, validator)
            self._subscriptions[key] = self._subscribe_to(channel, take, qos.arrays(channel))
        # Created last: a node that has matched this subscription has matched all others of this group.
        (status,) = [channel for channel in own if channel.kind == "status"]
        self._subscribe_to(status, self._on_status, qos.LATCHED_READER)

    def _subscribe_to(self, channel: topic_table.Channel, take: Any, profile: Any) -> Any:
        authorised = AuthorisedPublishers(self.node, channel.topic, channel.publishers, self.node.rejections)
        subscription = self._executor.subscribe(
            self.node,
            topic_types.TYPES[channel.kind],
            channel.topic,
            lambda data, _name: take(data),
            profile,
            authorised,
        )
        self._endpoints.require_publishers(subscription, authorised)
        return subscription

    @property
    def _now(self) -> tuple[int, int]:
        """Simulated time, as a stamp."""
        return self._stamps.at(self.steps.step)

    def _condition(self) -> Condition:
        return self._progress.condition(self.steps.step, {})

    def _lacking(self) -> list[Any] | None:
        """Subscriptions whose messages the next step lacks; None if that is not known."""
        if not self.steps.flying:
            return None
        state, senders = self.steps.lacking()
        keys = [*senders, _STATE] if state else senders
        return [self._subscriptions[key] for key in keys] or None

    def _on_status(self, data: bytes) -> None:
        status = deserialize_or_reject(data, FormationStatus, topic_table.STATUS, self.node.rejections)
        if status is not None and not self.steps.take_status(status):
            self.node.rejections.add(topic_table.STATUS, "not about this formation")

    # Before and after the flight, and when it does not go on

    def matched(self) -> bool:
        """Whether all required endpoints are matched."""
        return self._endpoints.complete()

    def offer(self) -> None:
        """Publish that this group is ready, since all its endpoints are matched."""
        name = self.node.get_fully_qualified_name()
        ready = NodeReady(node=name, step=0, checkpoint=-1, interface=topic_table.INTERFACE_VERSION)
        ready.header.frame_id = topic_table.FRAME
        self._publishers[topic_table.NODE_READY].publish(ready)

    def retransmit(self) -> None:
        """Publish the last messages again: the step does not go on, and one of them may have been lost."""
        if self.steps.view.ended is not None or not self.steps.flying:
            return
        last = [] if self._last_command is None else [self._last_command]
        for topic, data in (*last, *self._last_phases):
            self._publishers[topic].publish(data)

    def command_zero(self) -> None:
        """Publish commands of zero: the plant is lost."""
        if self.steps.flying:
            self._publish_zero(self.steps.step, 0, Violation(0, 0.0))

    def wait_for_acknowledgement(self) -> None:
        """Wait until the last command is acknowledged, for a bounded time, unless the flight is finished."""
        ended = self.steps.view.ended
        if ended is not None and ended.phase == FormationStatus.FINISHED:
            return
        command = self._publishers[self._command_topic]

        def present() -> bool:
            others = self.node.get_subscriptions_info_by_topic(command.topic_name)
            names = {local_name(other, self.node.get_namespace()) for other in others}
            return bool({PLANT, RECORDER} & names)

        wait_for_acknowledgement((command,), present, _ACKNOWLEDGEMENT_TIMEOUT)

    def report_result(self) -> None:
        """Send figures of this group to the supervisor."""
        self.report.send("satellite", node=self.name, step=self.steps.step, busy=self.steps.busy_seconds)

    # What the steps ask for

    def publish_commands(self, step: int, acceleration: Array, announced: Array) -> None:
        """Publish the commands of a step, with the phases for the next one."""
        self._publish_command(
            step,
            {
                "acceleration": acceleration,
                "announced_arc_length": announced[:, 0],
                "announced_rate": announced[:, 1],
                "violating_satellite": 0,
                "violation": 0,
                "violating_value": 0.0,
            },
        )

    def publish_violation(self, step: int, row: int, violation: Violation) -> None:
        """Publish commands of zero for a step, with what a satellite computed beyond its limit."""
        self._publish_zero(step, row, violation)

    def publish_phases(self, step: int, stamp: tuple[int, int], announced: Array) -> None:
        """Publish to each group with out-neighbours the phases for a step."""
        for topic, rows in self._halos:
            sent = announced[rows]
            values = {"arc_length": sent[:, 0], "rate": sent[:, 1]}
            self._last_phases.append((topic, self._publish(topic, step, stamp, values)))

    def publish_tracking(self, step: int, decision: Decision) -> None:
        """Publish what the satellites follow in a step, if it is recorded."""
        if not self._recorded:
            return
        reference = decision.reference
        values = {
            "reference_position": reference.position,
            "reference_velocity": reference.velocity,
            "reference_acceleration": reference.acceleration,
            "sliding_variable": decision.sliding_variable,
        }
        self._publish(self._tracking_topic, step, self._stamps.at(step), values)

    def await_status(self) -> None:
        """Take a status as soon as it is there."""
        self._executor.poll_soon()

    def _publish_zero(self, step: int, row: int, violation: Violation) -> None:
        values = dict.fromkeys(("acceleration", "announced_arc_length", "announced_rate"), 0.0)
        self._publish_command(
            step,
            {
                **values,
                "violating_satellite": row,
                "violation": violation.number,
                "violating_value": violation.value,
            },
        )

    def _publish_command(self, step: int, values: Mapping[str, ArrayLike]) -> None:
        data = self._publish(self._command_topic, step, self._stamps.at(step), values)
        self._last_command = (self._command_topic, data)

    def _publish(
        self, topic: str, step: int, stamp: tuple[int, int], values: Mapping[str, ArrayLike]
    ) -> bytes:
        number = self.steps.view.formation.number
        data = self._forms[topic].pack(stamp, {"step": step, "formation_version": number, **values})
        self._publishers[topic].publish(data)
        return data
