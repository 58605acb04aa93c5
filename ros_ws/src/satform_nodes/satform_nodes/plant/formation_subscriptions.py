# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions of the plant to what is about no satellite: readiness of nodes, progress of the recorder."""

from collections.abc import Callable, Iterable
from typing import Any

from rclpy.node import Node
from satform_msgs.msg import NodeReady, RecorderProgress

from satform.communication import topic_table
from satform.communication.message_validator import CONTRADICTION, RejectionCounter
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import RECORDER, Channel
from satform_nodes.runtime.realtime_loop import CommandMonitor
from satform_nodes.transport import qos
from satform_nodes.transport.authorised_publishers import AuthorisedPublishers
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.deserialization import deserialize_or_reject
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.matched_endpoints import MatchedEndpoints

_RECORDER_PROGRESS = layout(RecorderProgress, topic_table.FRAME)


class FormationSubscriptions:
    """The plant's subscriptions; those to commands are made by the classes that inherit this one.

    Attributes:
        command_monitor: delays and misses of commands on the wall clock.
    """

    def __init__(
        self,
        node: Node,
        executor: StepExecutor,
        channels: Iterable[Channel],
        satellites: int,
        rejections: RejectionCounter,
        on_offer: Callable[[str, int], None],
        on_other_interface: Callable[[str, int], None],
        stamps: Stamps,
    ) -> None:
        """Nothing has been received yet.

        Args:
            node: of the plant.
            executor: hands out the messages.
            channels: the topics to which the plant subscribes.
            satellites: how many there are.
            rejections: counts rejected messages.
            on_offer: called with the name of a node that is ready, and the step of its checkpoint.
            on_other_interface: called with the name of a node that was written by another version of the
                interface, and that version.
            stamps: of the scenario's steps.
        """
        self.command_monitor = CommandMonitor(satellites)
        self._node = node
        self._executor = executor
        self._rejections = rejections
        self._on_offer = on_offer
        self._on_other_interface = on_other_interface
        self._stamps = stamps
        # By the topics of commands, in the order in which they were subscribed to.
        self._commands: list[tuple[Any, AuthorisedPublishers]] = []
        publishers = {channel.topic: channel.publishers for channel in channels}
        ready = topic_table.NODE_READY
        self._authorised_ready = AuthorisedPublishers(node, ready, publishers[ready], self._rejections)
        executor.subscribe(node, NodeReady, ready, self._on_ready, qos.LATCHED_READER, self._authorised_ready)

    def require_publishers(self, endpoints: MatchedEndpoints) -> None:
        """Require the publishers of the commands."""
        for subscription, authorised in self._commands:
            endpoints.require_publishers(subscription, authorised)

    def subscribe_recorder_progress(
        self, endpoints: MatchedEndpoints, on_recorded: Callable[[int], None]
    ) -> None:
        """Subscribe to the progress of the recorder.

        Args:
            endpoints: gets the recorder as a required publisher.
            on_recorded: called with the step up to which everything is in the bag.
        """
        stamps = self._stamps

        def note(data: bytes, _name: str) -> None:
            numbers = _RECORDER_PROGRESS.unpack(data)
            if numbers is None:
                self._rejections.add(topic_table.RECORDER_PROGRESS, "another form")
                return
            if stamps.contradict(*numbers[:3], exact=True):
                self._rejections.add(topic_table.RECORDER_PROGRESS, CONTRADICTION)
                return
            on_recorded(int(numbers[2]))

        authorised = AuthorisedPublishers(
            self._node, topic_table.RECORDER_PROGRESS, [RECORDER], self._rejections
        )
        progress = self._executor.subscribe(
            self._node, RecorderProgress, topic_table.RECORDER_PROGRESS, note, qos.LOCKSTEP_READER, authorised
        )
        endpoints.require_publishers(progress, authorised)

    def _on_ready(self, data: bytes, name: str) -> None:
        ready = deserialize_or_reject(data, NodeReady, topic_table.NODE_READY, self._rejections)
        if ready is None:
            return
        if ready.node.rpartition("/")[2] != name:
            self._rejections.add(topic_table.NODE_READY, f"{name} publishes for another node")
            return
        stamp = ready.header.stamp
        if self._stamps.contradict(stamp.sec, stamp.nanosec, ready.step, exact=True):
            self._rejections.add(topic_table.NODE_READY, CONTRADICTION)
            return
        if ready.interface != topic_table.INTERFACE_VERSION:
            self._rejections.add(topic_table.NODE_READY, f"{name} has another version of the interface")
            self._on_other_interface(name, int(ready.interface))
            return
        self._on_offer(name, int(ready.checkpoint))
