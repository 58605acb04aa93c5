# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishers of a satellite: command, phase or motion, tracking, estimate, changed parameters."""

from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
from satform_msgs.msg import AttitudeEstimate, Command, Estimate, NodeReady, ParameterChange, Tracking

from satform.communication import topic_table
from satform.communication.messages import AROUND_NUMBERS
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import (
    PLANT,
    RECORDER,
    formation_channels,
    published_by,
    relative,
    satellite_channels,
)
from satform.flight.compile import FormationPlan
from satform.flight.limits import Violation
from satform.flight.satellite_step import Decision
from satform.navigation.relative_state_filter import EstimatorMemory
from satform.navigation.satellite_navigation import NavigationMemory
from satform.numeric.elementwise import Array
from satform.protocol.satellite_output import StampedMessage
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.lifecycle import wait_for_acknowledgement
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.matched_endpoints import MatchedEndpoints
from satform_nodes.transport.message_forms import form_of
from satform_nodes.transport.node_names import local_name

_COMMAND = layout(Command, topic_table.FRAME)
_TRACKING = layout(Tracking, topic_table.FRAME)
_ESTIMATE = layout(Estimate, topic_table.FRAME)
_ATTITUDE_ESTIMATE = layout(AttitudeEstimate, topic_table.FRAME)
_KINDS = (
    "navigation_estimate",
    "command",
    "tracking",
    "estimate",
    "attitude_estimate",
    "parameter_changes",
    "node_ready",
)
"""Kinds of topics of a satellite beside its phase or motion."""

NO_TORQUE = (0.0, 0.0, 0.0)
"""Wheel torque of a satellite without attitude."""

_NOTHING = (0, 0, *[0.0] * 8)
"""Fields of a command for the next neighbour message if there is none."""

_WITHIN = (0, 0.0)
"""Fields of a command for violations of limits if there is none."""

_ACKNOWLEDGEMENT_TIMEOUT = 2.0
"""Timeout of the acknowledgements of the last messages, s."""


class SatellitePublishers:
    """A satellite's publishers, with its last messages for retransmission."""

    def __init__(self, node: FormationNode, plan: FormationPlan, index: int, stamps: Stamps) -> None:
        """Nothing has been published yet.

        Args:
            node: of the satellite.
            plan: of the flight's parts.
            index: of the satellite.
            stamps: of its steps.
        """
        self._node = node
        names = list(plan.names)
        name = self._name = names[index]
        self._index = index
        self._stamps = stamps
        estimated = plan.topics.satellites[index].estimated
        # For the present step and the next one.
        self._last_announcements: deque[tuple[Any, bytes]] = deque(maxlen=4 if estimated else 2)
        self._joint_estimate = form_of("navigation_estimate", plan.topics, index) if estimated else None
        self._estimated = estimated
        self._last_command = b""
        announces = plan.announces
        self._in_phase = announces == "arc_length"
        # Fields of a neighbour message between its step and its numbers, and after them.
        self._before_numbers, self._after_numbers = AROUND_NUMBERS[announces]
        self._announcement = layout(topic_types.TYPES[announces], topic_table.FRAME)
        table = [*satellite_channels(plan.topics, index), *formation_channels(plan.topics)]
        self._channels = {channel.kind: channel for channel in published_by(name, table)}
        self._publishers = {
            kind: node.create_publisher(
                topic_types.TYPES[kind],
                relative(self._channels[kind].topic),
                qos.PUBLISHER_BY_RHYTHM[self._channels[kind].rhythm],
            )
            for kind in (announces, *_KINDS)
            if kind in self._channels
        }
        self._announcement_publisher = self._publishers[announces]
        self._command_publisher = self._publishers["command"]
        self._tracking_publisher = self._publishers["tracking"]
        self._estimate_publisher = self._publishers.get("estimate")
        self._change_publisher = self._publishers["parameter_changes"]
        self._ready_publisher = self._publishers["node_ready"]
        self._publishers_of_last_messages = (
            self._command_publisher,
            self._announcement_publisher,
            self._tracking_publisher,
            self._change_publisher,
        )

    def require_subscribers(self, endpoints: MatchedEndpoints, *, recorded: bool) -> None:
        """Require the subscribers of this satellite's topics.

        Args:
            endpoints: gets them.
            recorded: whether a recorder subscribes, too.
        """
        for kind, publisher in self._publishers.items():
            # Changes are latched for later subscribers.
            if kind != "parameter_changes":
                endpoints.require_subscribers(
                    publisher, self._channels[kind].subscribers_in(recorded=recorded)
                )

    # At each step

    def command(
        self, seconds: int, nanoseconds: int, step: int, decision: Decision, message: StampedMessage
    ) -> None:
        """Publish the command, with a copy of the neighbour message for the next step."""
        torque = NO_TORQUE if decision.wheel_torque is None else decision.wheel_torque.tolist()
        self.command_numbers(seconds, nanoseconds, step, decision.acceleration.tolist(), torque, message)

    def command_numbers(
        self,
        seconds: int,
        nanoseconds: int,
        step: int,
        acceleration: Sequence[float],
        torque: Sequence[float],
        message: StampedMessage,
    ) -> None:
        """Publish a command from its numbers, as `command`."""
        stamp, numbers = message
        announced = (*numbers, *[0.0] * 6) if self._in_phase else (0.0, 0.0, *numbers)
        self.publish_command(
            _COMMAND.pack(
                seconds,
                nanoseconds,
                step,
                *acceleration,
                *torque,
                *stamp,
                *announced,
                *_WITHIN,
            )
        )

    def report_violation(self, step: int, violation: Violation) -> None:
        """Publish a zero command with the violation of a limit for a step."""
        self.publish_command(violation_command(self._stamps.at(step), step, violation))

    def publish_next(self, step: int, message: StampedMessage) -> None:
        """Publish the neighbour message for a step."""
        stamp, numbers = message
        self.publish_announcement(
            self._announcement.pack(*stamp, step, *self._before_numbers, *numbers, *self._after_numbers)
        )

    def publish_joint_estimate(self, step: int, numbers: Array) -> None:
        """Publish the estimate of the whole formation that goes with the neighbour message for a step.

        Args:
            step: for which it is published.
            numbers: of the estimate, as the satellite's navigation makes them.
        """
        assert self._joint_estimate is not None  # noqa: S101 - asked of satellites that estimate
        made, size = int(numbers[0]), self._estimated
        mean, covariance, last = numbers[1 : 1 + size], numbers[1 + size : -3], numbers[-3:]
        data = self._joint_estimate.pack(
            *self._stamps.at(made),
            step,
            size,
            *mean.tolist(),
            len(covariance),
            *covariance.tolist(),
            *last.tolist(),
        )
        publisher = self._publishers["navigation_estimate"]
        self._last_announcements.append((publisher, data))
        publisher.publish(data)

    def publish_tracking_of(self, seconds: int, nanoseconds: int, step: int, decision: Decision) -> None:
        """Publish reference, tracking error and estimates."""
        if decision.estimate is not None:
            self.publish_estimate(seconds, nanoseconds, step, numbers_of(decision.estimate).tolist())
        if decision.attitude is not None:
            *numbers, rejected = decision.attitude.numbers().tolist()
            self._publishers["attitude_estimate"].publish(
                _ATTITUDE_ESTIMATE.pack(seconds, nanoseconds, step, *numbers, int(rejected))
            )
        tracked = [number for part in decision.tracked() for number in part.tolist()]
        unsolved = 0 if decision.unsolved_plans is None else int(decision.unsolved_plans)
        self.publish_tracking_numbers(seconds, nanoseconds, step, tracked, unsolved)

    def publish_tracking_numbers(
        self, seconds: int, nanoseconds: int, step: int, numbers: Sequence[float], unsolved: int = 0
    ) -> None:
        """Publish reference, tracking error and sliding variable, 18 numbers, and unsolved plans."""
        self._tracking_publisher.publish(_TRACKING.pack(seconds, nanoseconds, step, *numbers, unsolved))

    def publish_estimate(self, seconds: int, nanoseconds: int, step: int, estimate: Sequence[float]) -> None:
        """Publish the estimate, as `numbers_of` has it."""
        if self._estimate_publisher is not None:
            *encode, rejected = estimate
            self._estimate_publisher.publish(
                _ESTIMATE.pack(seconds, nanoseconds, step, *encode, int(rejected))
            )

    def publish_command(self, data: bytes) -> None:
        """Publish a command, and store it for retransmission."""
        self._last_command = data
        self._command_publisher.publish(data)

    def publish_announcement(self, data: bytes) -> None:
        """Publish a neighbour message, and store it for retransmission."""
        self._last_announcements.append((self._announcement_publisher, data))
        self._announcement_publisher.publish(data)

    def publish_tracking(self, data: bytes) -> None:
        """Publish a tracking message."""
        self._tracking_publisher.publish(data)

    # Now and then

    def publish_ready(self, step: int, checkpoint: int) -> None:
        """Publish that this satellite is ready.

        Args:
            step: its present step.
            checkpoint: step of the checkpoint from which it would continue; -1 for none.
        """
        name = self._node.get_fully_qualified_name()
        ready = NodeReady(
            node=name, step=step, checkpoint=checkpoint, interface=topic_table.INTERFACE_VERSION
        )
        ready.header.stamp.sec, ready.header.stamp.nanosec = self._stamps.at(step)
        ready.header.frame_id = topic_table.FRAME
        self._ready_publisher.publish(ready)

    def publish_changes(self, step: int, changes: Sequence[tuple[str, list[float]]]) -> None:
        """Publish the parameters that have changed at a step."""
        seconds, nanoseconds = self._stamps.at(step)
        for name, value in changes:
            change = ParameterChange(step=step, name=name, value=value)
            change.header.stamp.sec, change.header.stamp.nanosec = seconds, nanoseconds
            change.header.frame_id = topic_table.FRAME
            self._change_publisher.publish(change)

    def retransmit(self) -> None:
        """Publish the last messages again."""
        if self._last_command:
            self._command_publisher.publish(self._last_command)
        for publisher, data in self._last_announcements:
            publisher.publish(data)

    def forget(self) -> None:
        """Discard the stored messages."""
        self._last_announcements.clear()
        self._last_command = b""

    def command_zero(self, step: int) -> None:
        """Publish a command of zero."""
        nothing = (*[0.0] * 6, *_NOTHING, *_WITHIN)
        self._command_publisher.publish(_COMMAND.pack(*self._stamps.at(step), step, *nothing))

    def wait_for_acknowledgement(self, *, only_changes: bool) -> None:
        """Wait until the last messages are acknowledged, for a bounded time.

        Args:
            only_changes: whether only changes can be unacknowledged.
        """
        wait_for_acknowledgement(
            (self._change_publisher,) if only_changes else self._publishers_of_last_messages,
            self._has_subscribers,
            _ACKNOWLEDGEMENT_TIMEOUT,
        )

    def _has_subscribers(self) -> bool:
        """Whether the plant or the recorder still subscribes to this satellite."""
        others = self._node.get_subscriptions_info_by_topic(self._command_publisher.topic_name)
        return bool({PLANT, RECORDER} & {local_name(other, self._node.get_namespace()) for other in others})


def violation_command(stamp: tuple[int, int], step: int, violation: Violation) -> bytes:
    """A command message of zero with a violation.

    Args:
        stamp: of the step, seconds and nanoseconds.
        step: its number.
        violation: what was not finite or beyond its limit.
    """
    return _COMMAND.pack(*stamp, step, *[0.0] * 6, *_NOTHING, violation.number, violation.value)


def numbers_of(estimate: EstimatorMemory | NavigationMemory) -> Array:
    """What an estimate's message holds after its step, in order, shape (..., 44)."""
    shape = estimate.state.shape[:-1]
    last = np.stack(np.broadcast_arrays(estimate.innovation, estimate.rejected), axis=-1)
    return np.concatenate((estimate.state, estimate.covariance.reshape(*shape, 36), last), axis=-1)
