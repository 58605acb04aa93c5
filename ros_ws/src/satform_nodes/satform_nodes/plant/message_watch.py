# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What satellites publish for their neighbours, watched by the plant while a step does not go on.

In a step that goes on the plant receives commands alone. A step that lacks commands although all satellites
retransmit them is held up either by a satellite that does not command, or by one that does not publish what
its neighbours wait for. The plant subscribes to these messages, which are retransmitted, too, to tell which.
"""

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

from rclpy.node import Node

from satform.communication.message_validator import MessageValidator, RejectionCounter
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import TopicPlan, watched_channels
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.authorised_publishers import AuthorisedPublishers
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.message_forms import validator_of

_ANY_STEP = 2**62


class MessageWatch:
    """The messages for a step that satellites have published since it was found not to go on.

    Attributes:
        step: that is watched; None while none is.
    """

    def __init__(
        self,
        node: Node,
        executor: StepExecutor,
        plan: TopicPlan,
        rejections: RejectionCounter,
        stamps: Stamps,
    ) -> None:
        """Nothing is watched yet.

        Args:
            node: of the plant.
            executor: hands out the messages.
            plan: of the flight's topics.
            rejections: counts rejected messages.
            stamps: of the scenario's steps.
        """
        self.step: int | None = None
        self._node = node
        self._executor = executor
        self._plan = plan
        self._rejections = rejections
        self._stamps = stamps
        self._subscriptions: list[Any] = []
        self._unsent: dict[int, list[str]] = {}
        self._received_from: set[int] = set()

    def begin(self, satellites: Iterable[int], step: int) -> None:
        """Watch some satellites from now on, and no others.

        Args:
            satellites: their indices.
            step: for which they have to publish.
        """
        self.end()
        self.step = step
        for satellite in satellites:
            self._unsent[satellite] = []
            for channel in watched_channels(self._plan, satellite):
                topic, kind = channel.topic, channel.kind
                self._unsent[satellite].append(topic)
                validator = validator_of(kind, topic, self._plan, satellite, self._rejections, self._stamps)
                subscription = self._executor.subscribe(
                    self._node,
                    topic_types.TYPES[kind],
                    topic,
                    partial(self._take, satellite, topic, validator),
                    qos.LOCKSTEP_READER,
                    AuthorisedPublishers(self._node, topic, channel.publishers, self._rejections),
                    vital=False,
                )
                self._subscriptions.append(subscription)

    def end(self) -> None:
        """Watch nothing any more."""
        for subscription in self._subscriptions:
            self._executor.unsubscribe(self._node, subscription)
        self.step = None
        self._subscriptions.clear()
        self._unsent.clear()
        self._received_from.clear()

    @property
    def received_from(self) -> frozenset[int]:
        """Those of the satellites that have published a valid message, of this step or another one."""
        return frozenset(self._received_from)

    @property
    def unsent(self) -> Mapping[int, str]:
        """Of each satellite that lacks a message for the step, the topic; none where nothing was received.

        Without any message from anybody it is the plant that receives nothing.
        """
        if not self._received_from:
            return {}
        return {satellite: topics[0] for satellite, topics in self._unsent.items() if topics}

    def _take(self, satellite: int, topic: str, validator: MessageValidator, data: bytes, _name: str) -> None:
        if self.step is None:
            return
        repeated = validator.repeated
        fields = validator.validate(data, self.step, _ANY_STEP)
        if fields is not None or validator.repeated > repeated:
            self._received_from.add(satellite)
        if fields is not None and fields[2] == self.step and topic in self._unsent[satellite]:
            self._unsent[satellite].remove(topic)
