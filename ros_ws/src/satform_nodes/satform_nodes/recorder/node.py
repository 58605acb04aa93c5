# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Node of the recorder: writes every message of every step to a bag as it arrives."""

from collections.abc import Callable, Collection
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from satform_msgs.msg import FormationStatus, NodeReady, ParameterChange, RecorderProgress

from satform.bag.format import EVERY, GROUP_MEMBERS, GROUPS_METADATA
from satform.common.exit_codes import EXIT_BAD_INPUT
from satform.communication import topic_table
from satform.communication.message_validator import CONTRADICTION
from satform.communication.sim_time import NANOSECONDS, Stamps
from satform.communication.topic_table import (
    OPTIONAL,
    PLANT,
    RECORDER,
    Channel,
    array_window,
    channels,
    relative,
    satellite_channels,
    subscribed_by,
)
from satform.flight.array_exchange import recorded_every
from satform.flight.compile import FormationPlan
from satform.protocol.recorder_steps import REPORT_EVERY, RecorderSteps, SteppedTopic
from satform.scenario import Scenario
from satform_nodes.bag.metadata import offered
from satform_nodes.bag.writer import BagWriter
from satform_nodes.runtime.diagnostics import Condition, FlightProgress, Health
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.authorised_publishers import AuthorisedPublishers
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.deserialization import deserialize_or_reject
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.matched_endpoints import MatchedEndpoints
from satform_nodes.transport.message_definitions import described
from satform_nodes.transport.message_forms import array_validator_of, form_of, validator_of
from satform_nodes.transport.node_error import NodeError

_RECORDER_PROGRESS = layout(RecorderProgress, topic_table.FRAME)

_CLOCK_BYTES = 12
"""Length of a serialised clock: encapsulation, seconds, nanoseconds."""


class RecorderNode:
    """Writes the messages of the formation's topics."""

    def __init__(
        self,
        node: FormationNode,
        executor: StepExecutor,
        scenario: Scenario,
        plan: FormationPlan,
        folder: Path,
        report: SupervisorPipe,
        clocked: bool,
    ) -> None:
        self.plan = plan
        self.node = node
        self.report = report
        self.folder = folder
        self.rejections = node.rejections
        self._progress = FlightProgress(self.rejections)
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._names = list(plan.names)
        self._topics = plan.topics
        self._about = {
            channel.topic: index
            for index in range(len(self._names) if plan.groups is None else 0)
            for channel in satellite_channels(plan.topics, index)
        }
        report_every, self._write_every = REPORT_EVERY, 1
        if plan.groups is not None:
            report_every = min(REPORT_EVERY, array_window(len(self._names)) // 2)
            self._write_every = recorded_every(len(self._names), plan.timing.steps)
        followed = subscribed_by(RECORDER, channels(plan.topics))
        self.steps = RecorderSteps(plan, followed, self, clocked=clocked, report_every=report_every)
        self._authorised: list[AuthorisedPublishers] = []
        self._executor = executor
        self._subscriptions: dict[int, list[Any]] = {}
        try:
            self.bag = BagWriter(
                folder,
                scenario,
                {name: version(name) for name in ("satform", "numpy", "scipy")},
                clocked=clocked,
            )
        except FileExistsError:
            raise NodeError(f"{folder}: holds a bag already; choose another folder", EXIT_BAD_INPUT) from None
        except OSError as error:
            raise NodeError(f"{folder}: cannot be written to: {error.strerror}", EXIT_BAD_INPUT) from None
        if plan.groups is not None:
            entries = {GROUP_MEMBERS: plan.groups.to_text(), EVERY: str(self._write_every)}
            self.bag.add_metadata(GROUPS_METADATA, entries)

        self._ready_publisher = node.create_publisher(
            NodeReady, relative(topic_table.NODE_READY), qos.LATCHED
        )
        self._progress_publisher = node.create_publisher(
            RecorderProgress, relative(topic_table.RECORDER_PROGRESS), qos.LOCKSTEP
        )
        self._endpoints = MatchedEndpoints(node)
        self._endpoints.require_subscribers(self._progress_publisher, [PLANT])
        self._endpoints.require_subscribers(self._ready_publisher, [PLANT])
        # First: losses and rejoins have to be known before messages are checked for gaps.
        self._subscribe_occasional(executor, "status", topic_table.STATUS, PLANT, self._on_status)
        for channel in followed:
            if channel.kind == "parameter_changes":
                self._subscribe_occasional(
                    executor, channel.kind, channel.topic, channel.publishers[0], self._write_stepped
                )
        stepped = [channel for channel in followed if channel.rhythm != "occasional"]
        for channel, topic in zip(stepped, self.steps.topics, strict=True):
            self._subscribe_stepped(executor, channel, topic)
        self._now = (0, 0)
        (health,) = [channel for channel in followed if channel.kind == "diagnostics"]
        self._subscribe_diagnostics(executor, health)
        self._health = Health(node, "recorder: bag", "recorder", self._condition, lambda: self._now)
        executor.add_periodic(self._health.due)

    def _condition(self) -> Condition:
        """Condition of the recorder, for diagnostics."""
        return self._progress.condition(max(0, self.steps.recorded_step), {})

    def summary(self) -> str:
        """Summary of the bag, as text."""
        steps, missing = self.steps, len(self.steps.missing())
        whole = "the whole flight" if steps.complete else f"complete to step {steps.recorded_step}"
        gaps = f", {missing} gaps" if missing else ""
        return f"bag: {self.folder}, {self.bag.messages} messages, {whole}{gaps}"

    def matched(self) -> bool:
        """Whether the publishers of all topics are matched."""
        return self._endpoints.complete()

    def publish_ready(self) -> None:
        """Publish that the recorder is ready."""
        self._ready_publisher.publish(
            NodeReady(
                node=self.node.get_fully_qualified_name(),
                step=0,
                checkpoint=-1,
                interface=topic_table.INTERFACE_VERSION,
            )
        )

    def _add_topic(self, topic: str, kind: str, profile: QoSProfile) -> int:
        message_type = topic_types.TYPES[kind]
        # With the name that it really has, which a namespace or a remapping may have changed.
        name = self.node.resolve_topic_name(relative(topic))
        return self.bag.add_topic(name, described(message_type), [offered(profile)], role=topic)

    def _subscribe_stepped(self, executor: StepExecutor, followed: Channel, topic: SteppedTopic) -> None:
        """Write every message of a topic that has one at each step.

        Args:
            executor: hands out the messages.
            followed: the topic.
            topic: what is in the bag of it.
        """
        name, kind, publishers = followed.topic, followed.kind, followed.publishers
        profile = qos.arrays(followed) if followed.satellites else qos.LOCKSTEP
        number = self._add_topic(name, kind, profile)
        validate: Callable[[bytes, int, int], tuple[Any, ...] | None] = self._validated_clock
        fields: tuple[str, ...] = ()
        if followed.satellites:
            validate = array_validator_of(followed, self.rejections, self._stamps).validate
        elif kind != "clock":
            about = self._about.get(name, 0)
            validator = validator_of(kind, name, self._topics, about, self.rejections, self._stamps)
            validate, fields = validator.validate, form_of(kind, self._topics, about).fields
        version = fields.index("formation_version") if "formation_version" in fields else None

        def _on_message(data: bytes, _name: str) -> None:
            numbers = validate(data, topic.latest + 1, self.steps.last_step)
            if numbers is None:
                return
            seconds, nanoseconds, step = numbers[:3]
            if step % self._write_every == 0:
                self.bag.write(number, seconds * NANOSECONDS + nanoseconds, data, step)
            self.steps.note_message(topic, step, 0 if version is None else numbers[version])

        authorised = self._authorise(name, publishers)
        subscription = executor.subscribe(
            self.node,
            topic_types.TYPES[kind],
            name,
            _on_message,
            profile if followed.satellites else qos.LOCKSTEP_READER,
            authorised,
        )
        self._subscriptions.setdefault(topic.satellite, []).append(subscription)
        if publishers == (PLANT,) or not followed.optional:
            self._endpoints.require_publishers(subscription, authorised)

    def _authorise(self, topic: str, names: Collection[str]) -> AuthorisedPublishers:
        """The authorised publishers of a topic."""
        authorised = AuthorisedPublishers(self.node, topic, names, self.rejections)
        self._authorised.append(authorised)
        return authorised

    def _validated_clock(self, data: bytes, first: int, last: int) -> tuple[int, int, int] | None:
        """Seconds, nanoseconds and step of a valid clock message, which has no header."""
        moment = self._read_clock(data)
        if moment is None or not first <= moment[2] <= last:
            self.rejections.add(topic_table.CLOCK, "another form, or a step that is not due")
            return None
        if self._stamps.contradict(*moment, exact=True):
            self.rejections.add(topic_table.CLOCK, CONTRADICTION)
            return None
        self._now = moment[:2]
        return moment

    def _read_clock(self, data: bytes) -> tuple[int, int, int] | None:
        """Seconds, nanoseconds and step of a clock message, which has no header."""
        if len(data) != _CLOCK_BYTES:
            return None
        seconds = int.from_bytes(data[4:8], "little", signed=True)
        nanoseconds = int.from_bytes(data[8:12], "little")
        return seconds, nanoseconds, self._stamps.step(seconds, nanoseconds)

    def _subscribe_occasional(
        self,
        executor: StepExecutor,
        kind: str,
        topic: str,
        publisher: str,
        callback: Callable[[Any, int], None],
    ) -> None:
        """Write a topic with occasional messages."""
        message_type = topic_types.TYPES[kind]
        channel = self._add_topic(topic, kind, qos.LATCHED)

        def _on_message(data: bytes, _name: str) -> None:
            message = deserialize_or_reject(data, message_type, topic, self.rejections)
            if message is None:
                return
            stamp = message.header.stamp
            if self._stamps.contradict(stamp.sec, stamp.nanosec, message.step, exact=True):
                self.rejections.add(topic, CONTRADICTION)
                return
            callback(message, channel)

        authorised = self._authorise(topic, [publisher])
        subscription = executor.subscribe(
            self.node, message_type, topic, _on_message, qos.LATCHED_READER, authorised
        )
        if kind not in OPTIONAL:
            self._endpoints.require_publishers(subscription, authorised)

    def _subscribe_diagnostics(self, executor: StepExecutor, channel: Channel) -> None:
        """Write the diagnostics, which are not waited for.

        They have the simulated time at which they arrived.
        """
        topic = channel.topic
        number = self._add_topic(topic, channel.kind, qos.OBSERVER)

        def _on_message(data: bytes, _name: str) -> None:
            # An unauthorised process may have one of the names; the bag has to be readable all the same.
            if (
                deserialize_or_reject(data, topic_types.TYPES[channel.kind], topic, self.rejections)
                is not None
            ):
                seconds, nanoseconds = self._now
                self.bag.write(number, seconds * NANOSECONDS + nanoseconds, data, 0)

        authorised = self._authorise(topic, channel.publishers)
        executor.subscribe(
            self.node,
            topic_types.TYPES[channel.kind],
            topic,
            _on_message,
            qos.LOCKSTEP_READER,
            authorised,
            vital=False,
        )

    def _write_stepped(self, message: ParameterChange | FormationStatus, channel: int) -> None:
        stamp = message.header.stamp
        self.bag.write(
            channel, stamp.sec * NANOSECONDS + stamp.nanosec, serialize_message(message), message.step
        )

    def _on_status(self, status: FormationStatus, channel: int) -> None:
        if self.steps.is_repeated(status):
            return
        self._write_stepped(status, channel)
        for name in self.steps.take_status(status):
            for authorised in self._authorised:
                authorised.allow_replacement(name)

    def take_arrived(self, satellite: int) -> None:
        """Take the messages of a satellite that have arrived."""
        for subscription in self._subscriptions.get(satellite, ()):
            self._executor.finish(subscription)

    def publish_progress(self, step: int) -> None:
        """Tell the plant that all messages up to a step are in the bag."""
        self.bag.flush()
        seconds, nanoseconds = self._stamps.at(step)
        self._progress_publisher.publish(
            _RECORDER_PROGRESS.pack(seconds, nanoseconds, step, self.bag.messages)
        )
