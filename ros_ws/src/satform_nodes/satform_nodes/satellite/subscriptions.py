# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions of a satellite: state, attitude, links from the plant, status, messages of in-neighbours."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from satform_msgs.msg import FormationStatus

from satform.communication import topic_table
from satform.communication.message_validator import MessageValidator, RejectionCounter
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import PLANT, satellite_channels, subscribed_by, topic_name
from satform.flight.compile import FormationPlan
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.authorised_publishers import AuthorisedPublishers
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.matched_endpoints import MatchedEndpoints
from satform_nodes.transport.message_forms import validator_of


@dataclass(frozen=True)
class MessageHandlers:
    """Callbacks of a satellite's subscriptions; the executor calls them directly, since each call costs time.

    Attributes:
        of_plant: by the kind of a topic of the plant; each takes the validator, the message and its
            publisher's name.
        announcement: takes the neighbour's index, the validator, the message and its publisher's name.
        estimate: likewise, of the estimates of neighbours.
        status: takes the message and its publisher's name.
    """

    of_plant: Mapping[str, Callable[[MessageValidator, bytes, str], None]]
    announcement: Callable[[int, MessageValidator, bytes, str], None]
    estimate: Callable[[int, MessageValidator, bytes, str], None]
    status: Callable[[bytes, str], None]


class SatelliteSubscriptions:
    """A satellite's subscriptions, their authorised publishers, and the required endpoints.

    Attributes:
        endpoints: the required endpoints.
        subscriptions: by kind for topics of the plant, and by the neighbour's index for its phase or motion.
    """

    def __init__(
        self,
        node: FormationNode,
        executor: StepExecutor,
        plan: FormationPlan,
        index: int,
        rejections: RejectionCounter,
        handlers: MessageHandlers,
        *,
        clocked: bool,
    ) -> None:
        """Nothing has been received yet.

        Args:
            node: of the satellite.
            executor: hands out the messages.
            plan: of the flight's parts.
            index: of the satellite.
            rejections: counts rejected messages.
            handlers: callbacks of the messages.
            clocked: whether the flight goes by the wall clock.
        """
        self.endpoints = MatchedEndpoints(node)
        self._node = node
        self._executor = executor
        self._rejections = rejections
        self._handlers = handlers
        self._profile = qos.REALTIME if clocked else qos.LOCKSTEP_READER
        self._names = list(plan.names)
        self._announces = plan.announces
        self._topics = plan.topics
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self.subscriptions: dict[str | int, Any] = {}
        self._authorised: dict[int, list[AuthorisedPublishers]] = {}
        own = plan.topics.satellites[index]
        self._exchanges = own.exchanges
        for channel in subscribed_by(own.name, satellite_channels(plan.topics, index)):
            validator = self._validator(channel.kind, channel.topic, index)
            handle = handlers.of_plant[channel.kind]
            kind = topic_types.TYPES[channel.kind]
            self._subscribe(kind, channel.topic, partial(handle, validator), PLANT, channel.kind)
        for neighbour in plan.membership.possible_graph.neighbours(index):
            self.add_neighbour(neighbour)
        # Created last: a node that has matched this subscription has matched all others of this satellite.
        self._subscribe(
            FormationStatus, topic_table.STATUS, handlers.status, PLANT, "status", qos.LATCHED_READER
        )

    def add_neighbour(self, neighbour: int) -> None:
        """Subscribe to the messages of a neighbour."""
        self._authorised[neighbour] = [
            self._subscribe_to(neighbour, self._announces, self._handlers.announcement, neighbour)
        ]
        if self._exchanges:
            kind = "navigation_estimate"
            self._authorised[neighbour].append(
                self._subscribe_to(neighbour, kind, self._handlers.estimate, f"{kind} {neighbour}")
            )

    def finish(self, lost: Collection[str]) -> None:
        """Take what has arrived of neighbours that are lost; later messages of their processes are late."""
        for index in self._authorised if lost else ():
            if self._names[index] in lost:
                for what in (index, f"navigation_estimate {index}"):
                    if what in self.subscriptions:
                        self._executor.finish(self.subscriptions[what])

    def allow_replacement(self, lost: Collection[int]) -> None:
        """Accept restarted processes of lost neighbours as publishers."""
        for index, all_authorised in self._authorised.items():
            if index in lost:
                for authorised in all_authorised:
                    authorised.allow_replacement(self._names[index])

    def _validator(self, kind: str, topic: str, about: int) -> MessageValidator:
        """Validator of the messages of a topic about a satellite."""
        return validator_of(kind, topic, self._topics, about, self._rejections, self._stamps)

    def _subscribe_to(
        self,
        neighbour: int,
        kind: str,
        handle: Callable[[int, MessageValidator, bytes, str], None],
        what: str | int,
    ) -> AuthorisedPublishers:
        """Subscribe to a topic of a neighbour."""
        sender = self._names[neighbour]
        topic = topic_name(kind, sender)
        callback = partial(handle, neighbour, self._validator(kind, topic, neighbour))
        return self._subscribe(topic_types.TYPES[kind], topic, callback, sender, what)

    def _subscribe(
        self,
        kind: Any,
        topic: str,
        callback: Callable[[bytes, str], None],
        sender: str,
        what: str | int,
        profile: Any = None,
    ) -> AuthorisedPublishers:
        authorised = AuthorisedPublishers(self._node, topic, [sender], self._rejections)
        subscription = self._executor.subscribe(
            self._node, kind, topic, callback, profile or self._profile, authorised
        )
        self.subscriptions[what] = subscription
        self.endpoints.require_publishers(subscription, authorised)
        return authorised
