# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Node of the recorder: writes every message of every step to a bag as it arrives."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from satform_msgs.msg import FormationStatus, NodeReady, ParameterChange, RecorderProgress

from satform.bag.absence_log import Absences
from satform.common.exit_codes import EXIT_BAD_INPUT
from satform.communication import topic_table
from satform.communication.message_validator import CONTRADICTION, MessageValidator
from satform.communication.sim_time import NANOSECONDS, Stamps
from satform.communication.topic_table import (
    OPTIONAL,
    PLANT,
    RECORDER,
    Channel,
    channels,
    relative,
    satellite_channels,
    subscribed_by,
)
from satform.flight.compile import compile_scenario
from satform.protocol.formation_view import FormationView
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
from satform_nodes.transport.message_forms import validator_of
from satform_nodes.transport.node_error import NodeError

_RECORDER_PROGRESS = layout(RecorderProgress, topic_table.FRAME)

_CLOCK_BYTES = 12
"""Length of a serialised clock: encapsulation, seconds, nanoseconds."""

_REPORT_EVERY = 128
"""Steps between two progress messages to the plant."""


@dataclass
class _SteppedTopic:
    """A topic with a message at each step.

    Attributes:
        number: of the topic in the bag.
        topic: its name.
        kind: of topic.
        satellite: index of the publishing satellite; -1 for the plant.
        last: step of its last message.
        optional: whether its publisher may do without it.
        latest: step of the newest message in the bag; -1 before the first.
        gaps: first and last step of each stretch without messages.
        validator: of its messages; None for the clock, whose messages have no header.
    """

    number: int
    topic: str
    kind: str
    satellite: int
    last: int
    optional: bool = False
    latest: int = -1
    gaps: list[tuple[int, int]] = field(default_factory=list)
    validator: MessageValidator | None = None


class RecorderNode:
    """Writes the messages of the formation's topics, and detects missing ones."""

    def __init__(
        self,
        node: FormationNode,
        executor: StepExecutor,
        scenario: Scenario,
        folder: Path,
        report: SupervisorPipe,
        clocked: bool,
    ) -> None:
        plan = self.plan = compile_scenario(scenario)
        self.node = node
        self.report = report
        self.folder = folder
        self.missed: list[str] = []
        self.rejections = node.rejections
        self._progress = FlightProgress(self.rejections)
        self.view = FormationView(plan)
        self._absences = Absences(plan.names)
        self._clocked = clocked
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._names = list(plan.names)
        self._topics = plan.topics
        self._about = {
            channel.topic: index
            for index in range(len(self._names))
            for channel in satellite_channels(plan.topics, index)
        }
        self._last_step = plan.timing.steps
        self._reported = 0
        self._slowest: tuple[_SteppedTopic, int] | None = None
        self._channels: list[_SteppedTopic] = []
        self._authorised: list[AuthorisedPublishers] = []
        self._last_status: FormationStatus | None = None
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

        self._ready_publisher = node.create_publisher(
            NodeReady, relative(topic_table.NODE_READY), qos.LATCHED
        )
        self._progress_publisher = node.create_publisher(
            RecorderProgress, relative(topic_table.RECORDER_PROGRESS), qos.LOCKSTEP
        )
        self._endpoints = MatchedEndpoints(node)
        self._endpoints.require_subscribers(self._progress_publisher, [PLANT])
        self._endpoints.require_subscribers(self._ready_publisher, [PLANT])
        followed = subscribed_by(RECORDER, channels(plan.topics))
        # First: losses and rejoins have to be known before messages are checked for gaps.
        self._subscribe_occasional(executor, "status", topic_table.STATUS, PLANT, self._on_status)
        for channel in followed:
            if channel.kind == "parameter_changes":
                self._subscribe_occasional(
                    executor, channel.kind, channel.topic, channel.publishers[0], self._write_stepped
                )
        for channel in followed:
            if channel.rhythm != "occasional":
                self._subscribe_stepped(executor, channel)
        self._now = (0, 0)
        (health,) = [channel for channel in followed if channel.kind == "diagnostics"]
        self._subscribe_diagnostics(executor, health)
        self._health = Health(node, "recorder: bag", "recorder", self._condition, lambda: self._now)
        executor.add_periodic(self._health.due)

    @property
    def ended(self) -> FormationStatus | None:
        """The plant's final status; None while the flight continues."""
        return self.view.ended

    def _may_be_further(self) -> bool:
        """Whether the topic that was the slowest has had a message since.

        While that topic is behind, this is asked at each message of all others, of which there may be
        thousands: it does not look at every topic.
        """
        if self._slowest is not None and self._slowest[0].latest == self._slowest[1]:
            return False
        slowest = min(self._expected(), key=lambda channel: channel.latest)
        self._slowest = slowest, slowest.latest
        return True

    def _condition(self) -> Condition:
        """Condition of the recorder, for diagnostics."""
        return self._progress.condition(max(0, self.recorded_step), {})

    def _expected(self) -> list[_SteppedTopic]:
        """Topics that have a message at every step at present; on the wall clock only those of the plant."""
        alive = self.view.formation.alive & (not self._clocked)
        present = [channel for channel in self._channels if channel.satellite < 0 or alive[channel.satellite]]
        # An optional one has a message at every step from the first on, or none at all.
        return [channel for channel in present if channel.latest >= 0 or not channel.optional]

    @property
    def recorded_step(self) -> int:
        """Last step of which everything is in the bag; -1 before the first."""
        return min(channel.latest for channel in self._expected())

    def lacks_messages(self) -> bool:
        """Whether messages are missing of the steps that were complete when the flight ended."""
        ended = self.ended
        return ended is not None and any(
            channel.latest < min(channel.last, ended.step - 1) for channel in self._expected()
        )

    @property
    def complete(self) -> bool:
        """Whether every message of the whole flight is in the bag."""
        return all(channel.latest >= channel.last for channel in self._expected())

    def count_gaps(self) -> None:
        """Count as missed what is absent though its satellite was not."""
        for channel in self._channels:
            for first, last in channel.gaps:
                # On the wall clock satellites may miss steps.
                if self._clocked and channel.satellite >= 0:
                    continue
                if not self._absences.explain(channel.satellite, channel.kind, first, last):
                    self.missed.append(f"{channel.topic}: nothing from step {first} to {last}")

    def summary(self) -> str:
        """Summary of the bag, as text."""
        whole = "the whole flight" if self.complete else f"complete to step {self.recorded_step}"
        gaps = f", {len(self.missed)} gaps" if self.missed else ""
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

    def _subscribe_stepped(self, executor: StepExecutor, followed: Channel) -> None:
        """Write every message of a topic that has one at each step, and notice a gap.

        Args:
            executor: hands out the messages.
            followed: the topic.
        """
        topic, kind, (publisher,) = followed.topic, followed.kind, followed.publishers
        satellite = self._names.index(publisher) if publisher in self._names else -1
        about = self._about.get(topic, 0)
        last = self._last_step - (followed.rhythm == "steps")
        number = self._add_topic(topic, kind, qos.LOCKSTEP)
        channel = _SteppedTopic(number, topic, kind, satellite, last, followed.optional)
        if kind != "clock":
            channel.validator = validator_of(kind, topic, self._topics, about, self.rejections, self._stamps)
        self._channels.append(channel)

        def _on_message(data: bytes, _name: str) -> None:
            numbers = self._validated(channel, data)
            if numbers is None:
                return
            seconds, nanoseconds, step = numbers[:3]
            if step > channel.latest + 1:
                channel.gaps.append((channel.latest + 1, step - 1))
            channel.latest = step
            self.bag.write(channel.number, seconds * NANOSECONDS + nanoseconds, data, step)
            self._report_progress(step)

        authorised = self._authorise(topic, [publisher])
        subscription = executor.subscribe(
            self.node, topic_types.TYPES[kind], topic, _on_message, qos.LOCKSTEP_READER, authorised
        )
        if publisher == PLANT or not followed.optional:
            self._endpoints.require_publishers(subscription, authorised)

    def _authorise(self, topic: str, names: Collection[str]) -> AuthorisedPublishers:
        """The authorised publishers of a topic."""
        authorised = AuthorisedPublishers(self.node, topic, names, self.rejections)
        self._authorised.append(authorised)
        return authorised

    def _validated(self, channel: _SteppedTopic, data: bytes) -> tuple[Any, ...] | None:
        """Numbers of a valid message; None if it is rejected."""
        if channel.validator is not None:
            return channel.validator.validate(data, channel.latest + 1, self._last_step)
        moment = self._read_clock(data)
        if moment is None or not channel.latest < moment[2] <= self._last_step:
            self.rejections.add(channel.topic, "another form, or a step that is not due")
            return None
        if self._stamps.contradict(*moment, exact=True):
            self.rejections.add(channel.topic, CONTRADICTION)
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
        if status == self._last_status:
            # A retransmission while nothing changes.
            return
        self._last_status = status
        self._write_stepped(status, channel)
        number = self.view.formation.number
        if not self.view.take(status) or self.view.formation.number == number:
            return
        self._absences.take(status)
        for name in status.lost:
            for authorised in self._authorised:
                authorised.allow_replacement(name)
        # It may have been a lost satellite whose messages were missing.
        self._slowest = None
        self._report_progress(max(0, self.recorded_step))

    def _report_progress(self, step: int) -> None:
        if step < self._last_step - 1 and (
            step < self._reported + _REPORT_EVERY or not self._may_be_further()
        ):
            return
        reached = self._last_step if self.complete else self.recorded_step
        if reached <= self._reported and not self.complete:
            return
        self._reported = reached
        self.bag.flush()
        seconds, nanoseconds = self._stamps.at(reached)
        self._progress_publisher.publish(
            _RECORDER_PROGRESS.pack(seconds, nanoseconds, reached, self.bag.messages)
        )
