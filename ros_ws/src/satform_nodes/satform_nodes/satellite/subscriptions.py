# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions of a satellite: state, attitude, links from the plant, status, messages of in-neighbours."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial
from typing import Any

from satform_msgs.msg import Attitude, FormationStatus, LinkConditions, RelativeState

from satform.communication import topic_table
from satform.communication.topic_table import PLANT, satellite_channels, subscribed_by, topic_name
from satform.flight.compile import FormationPlan
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.authorised_publishers import AuthorisedPublishers
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.matched_endpoints import MatchedEndpoints
from satform_nodes.transport.message_validator import MessageValidator, RejectionCounter
from satform_nodes.transport.sim_time import Stamps

_STATE = layout(RelativeState, topic_table.FRAME)
_ATTITUDE = layout(Attitude, topic_table.FRAME)


@dataclass(frozen=True)
class MessageHandlers:
    """Callbacks of a satellite's subscriptions; the executor calls them directly, since each call costs time.

    Attributes:
        state: takes the validator, the message and its publisher's name.
        attitude: likewise.
        links: takes the validator, the message and its publisher's name; conditions of the incoming links.
        announcement: takes the neighbour's index, the validator, the message and its publisher's name.
        status: takes the message and its publisher's name.
    """

    state: Callable[[MessageValidator, bytes, str], None]
    attitude: Callable[[MessageValidator, bytes, str], None]
    links: Callable[[MessageValidator, bytes, str], None]
    announcement: Callable[[int, MessageValidator, bytes, str], None]
    status: Callable[[bytes, str], None]


class SatelliteSubscriptions:
    """A satellite's subscriptions, their authorised publishers, and the required endpoints.

    Attributes:
        endpoints: the required endpoints.
        subscriptions: by kind for topics of the plant, and by the neighbour's index for its messages.
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
        self._hearer = handlers
        self._profile = qos.REALTIME if clocked else qos.LOCKSTEP_READER
        self._names = list(plan.names)
        self._announces = plan.announces
        self._announcement = layout(topic_types.TYPES[self._announces], topic_table.FRAME)
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self.subscriptions: dict[str | int, Any] = {}
        self._authorised: dict[int, AuthorisedPublishers] = {}
        own = plan.topics.satellites[index]
        for channel in subscribed_by(own.name, satellite_channels(plan.topics, index)):
            if channel.kind == "state":
                validator = MessageValidator(channel.topic, _STATE, rejections, self._stamps, exact=False)
                self._subscribe(
                    RelativeState, channel.topic, partial(handlers.state, validator), PLANT, "state"
                )
            elif channel.kind == "link_conditions":
                form = layout(LinkConditions, topic_table.FRAME, len(self._names))
                validator = MessageValidator(channel.topic, form, rejections, self._stamps)
                self._subscribe(
                    LinkConditions, channel.topic, partial(handlers.links, validator), PLANT, channel.kind
                )
            else:
                validator = MessageValidator(channel.topic, _ATTITUDE, rejections, self._stamps)
                self._subscribe(
                    Attitude, channel.topic, partial(handlers.attitude, validator), PLANT, "attitude"
                )
        for neighbour in plan.membership.possible_graph.neighbours(index):
            self.add_neighbour(neighbour)
        # Created last: a node that has matched this subscription has matched all others of this satellite.
        self._subscribe(
            FormationStatus, topic_table.STATUS, handlers.status, PLANT, "status", qos.LATCHED_READER
        )

    def add_neighbour(self, neighbour: int) -> None:
        """Subscribe to the messages of a neighbour."""
        sender = self._names[neighbour]
        topic = topic_name(self._announces, sender)
        validator = MessageValidator(topic, self._announcement, self._rejections, self._stamps, exact=False)
        callback = partial(self._hearer.announcement, neighbour, validator)
        kind = topic_types.TYPES[self._announces]
        self._authorised[neighbour] = self._subscribe(kind, topic, callback, sender, neighbour)

    def allow_replacement(self, lost: Collection[int]) -> None:
        """Accept restarted processes of lost neighbours as publishers."""
        for index, authorised in self._authorised.items():
            if index in lost:
                authorised.allow_replacement(self._names[index])

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
