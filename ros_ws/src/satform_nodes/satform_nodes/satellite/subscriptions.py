# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Whom a satellite hears: the plant, and those whom the graph lets it hear at some time."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial
from typing import Any

from satform_msgs.msg import Attitude, FormationStatus, RelativeState

from satform.communication.topic_graph import PLANT, satellite_channels, subscribed_by, topic_name
from satform.flight.compile import FormationPlan
from satform_nodes.runtime.parameters import FormationNode
from satform_nodes.transport import qos, topics
from satform_nodes.transport.authorised_publishers import Speakers
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.discovery_barrier import Company
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.message_validator import Entry, Refusals
from satform_nodes.transport.sim_time import Stamps

_STATE = layout(RelativeState, topics.FRAME)
_ATTITUDE = layout(Attitude, topics.FRAME)


@dataclass(frozen=True)
class Hearer:
    """Who takes in what arrives; called by the executor itself, since every call in between costs time.

    Attributes:
        state: takes the entry, the message and its speaker's name.
        attitude: likewise.
        announcement: takes the neighbour's place, the entry, the message and its speaker's name.
        status: takes the message and its speaker's name.
    """

    state: Callable[[Entry, bytes, str], None]
    attitude: Callable[[Entry, bytes, str], None]
    announcement: Callable[[int, Entry, bytes, str], None]
    status: Callable[[bytes, str], None]


class SatelliteEars:
    """A satellite's subscriptions, who is believed on them, and who is waited for.

    Attributes:
        company: who is waited for.
        subscriptions: by kind for what the plant says, and by the neighbour's place for what it announces.
    """

    def __init__(
        self,
        node: FormationNode,
        executor: StepExecutor,
        plan: FormationPlan,
        index: int,
        refusals: Refusals,
        hearer: Hearer,
        *,
        clocked: bool,
    ) -> None:
        """Nobody has been heard yet.

        Args:
            node: of the satellite.
            executor: hands out the messages.
            plan: of the flight's parts.
            index: place of the satellite.
            refusals: where messages that are not believed are counted.
            hearer: takes in the messages.
            clocked: whether the flight goes by the wall clock.
        """
        self.company = Company(node)
        self._node = node
        self._executor = executor
        self._refusals = refusals
        self._hearer = hearer
        self._profile = qos.REALTIME if clocked else qos.LOCKSTEP_READER
        self._names = list(plan.names)
        self._announces = plan.announces
        self._announcement = layout(topics.TYPES[self._announces], topics.FRAME)
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self.subscriptions: dict[str | int, Any] = {}
        self._speakers: dict[int, Speakers] = {}
        own = plan.topics.satellites[index]
        for channel in subscribed_by(own.name, satellite_channels(plan.topics, index)):
            if channel.kind == "state":
                entry = Entry(channel.topic, _STATE, refusals, self._stamps, exact=False)
                self._hear(RelativeState, channel.topic, partial(hearer.state, entry), PLANT, "state")
            else:
                entry = Entry(channel.topic, _ATTITUDE, refusals, self._stamps)
                self._hear(Attitude, channel.topic, partial(hearer.attitude, entry), PLANT, "attitude")
        for neighbour in plan.membership.possible_graph.neighbours(index):
            self.listen_to(neighbour)
        # Made last: whoever sees this subscription has seen all others of this satellite.
        self._hear(FormationStatus, topics.STATUS, hearer.status, PLANT, "status", qos.LATCHED_READER)

    def listen_to(self, neighbour: int) -> None:
        """Hear what a neighbour announces from now on."""
        speaker = self._names[neighbour]
        topic = topic_name(self._announces, speaker)
        entry = Entry(topic, self._announcement, self._refusals, self._stamps, exact=False)
        callback = partial(self._hearer.announcement, neighbour, entry)
        kind = topics.TYPES[self._announces]
        self._speakers[neighbour] = self._hear(kind, topic, callback, speaker, neighbour)

    def vacate(self, lost: Collection[int]) -> None:
        """Believe those who are started in place of lost neighbours."""
        for place, speakers in self._speakers.items():
            if place in lost:
                speakers.vacate(self._names[place])

    def _hear(
        self,
        kind: Any,
        topic: str,
        callback: Callable[[bytes, str], None],
        speaker: str,
        what: str | int,
        profile: Any = None,
    ) -> Speakers:
        speakers = Speakers(self._node, topic, [speaker], self._refusals)
        subscription = self._executor.subscribe(
            self._node, kind, topic, callback, profile or self._profile, speakers
        )
        self.subscriptions[what] = subscription
        self.company.is_used_by_neighbours(subscription, speakers)
        return speakers
