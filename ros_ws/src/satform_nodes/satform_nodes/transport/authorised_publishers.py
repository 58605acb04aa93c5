# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who is believed on a topic: the one writer of the node that has to speak there, and nobody else.

A node's name is what it says of itself, so the first writer with the right name is the one, and another
one with the same name is believed only after the satellite has been lost, when it may have been started
again. Names are looked up once for each writer.
"""

import time
from collections import Counter
from collections.abc import Collection, Iterable
from functools import cached_property
from typing import Any

from rclpy.node import Node
from rclpy.serialization import deserialize_message

from satform.communication.topic_graph import relative
from satform_nodes.transport.message_validator import Refusals
from satform_nodes.transport.node_names import UNKNOWN_NODE, local_name

UNDECIDED = ""
"""In place of a name: discovery has not yet told whose writer it is."""

_LOOK = 0.02
"""Wall-clock time between two look-ups of a writer whose node is not known yet, s."""

_ANONYMOUS = 10.0
"""Wall-clock time within which every ROS node has told its name, s."""

_MOST_STRANGERS = 10_000
"""Writers that are remembered as not believed."""


class Speakers:
    """The writers of one topic that are believed."""

    def __init__(self, node: Node, topic: str, names: Collection[str], refusals: Refusals) -> None:
        """Nobody has spoken yet.

        Args:
            node: that listens.
            topic: its name in the root namespace.
            names: of the nodes that have to speak there, each with one writer.
            refusals: where messages of others are counted.
        """
        self._node = node
        self._topic = topic
        self._refusals = refusals
        self._expected = frozenset(names)
        # How many new writers of each name are believed still: one, and one more for each loss.
        self._vacancies = Counter(names)
        self._name_of: dict[bytes, str] = {}
        self._strangers: dict[bytes, str] = {}
        self._next_look = 0.0
        self._met: dict[bytes, float] = {}
        self._introduced: dict[bytes, str] = {}

    @property
    def expected(self) -> frozenset[str]:
        """Names of the nodes that have to speak there."""
        return self._expected

    def introduce(self, endpoints: Iterable[Any]) -> None:
        """Take note of whose writers these are, which need not be looked up any more.

        Args:
            endpoints: of the topic, as rclpy tells of publishers.
        """
        there = {
            bytes(other.endpoint_gid): self._name(other)
            for other in endpoints
            if self._name(other) in self._expected
        }
        known = self._name_of.keys() | self._strangers.keys()
        self._introduced = {writer: name for writer, name in there.items() if writer not in known}

    def vacate(self, name: str) -> None:
        """A node has been lost: one that is started in its place is believed, too."""
        if name in self._expected:
            self._vacancies[name] += 1
            self._strangers.clear()

    def who(self, writer: bytes) -> str | None:
        """Name of the node that a message is believed to be from.

        Args:
            writer: identifier of the message's writer.

        Returns:
            The name; `UNDECIDED` when it may become known soon; None when the message is refused, which
            has been counted then.
        """
        name = self._name_of.get(writer)
        if name is not None:
            return name
        reason = self._strangers.get(writer)
        if reason is None:
            name = self._look_up(writer)
            if name == UNDECIDED:
                return UNDECIDED
            reason = self._meet(writer, name)
            if reason is None:
                return name
        self._refusals.note(self._topic, reason)
        return None

    def writers(self, name: str) -> set[bytes]:
        """Identifiers of all writers that a node of this name has here at present, believed or not."""
        return {bytes(other.endpoint_gid) for other in self._endpoints() if self._name(other) == name}

    def _meet(self, writer: bytes, name: str) -> str | None:
        """Believe a new writer from now on, or remember why not."""
        if self._vacancies[name] > 0:
            self._vacancies[name] -= 1
            for before in [known for known, own in self._name_of.items() if own == name]:
                del self._name_of[before]
                self._strangers[before] = f"{name} has been started anew"
            self._name_of[writer] = name
            return None
        reason = f"a second writer of {name}" if name in self._expected else f"not for {name} to say"
        if len(self._strangers) >= _MOST_STRANGERS:
            self._strangers.clear()
        self._strangers[writer] = reason
        return reason

    def _look_up(self, writer: bytes) -> str:
        introduced = self._introduced.pop(writer, None)
        if introduced is not None:
            self._met.pop(writer, None)
            return introduced
        now = time.monotonic()
        if now < self._next_look:
            return UNDECIDED
        if now - self._met.setdefault(writer, now) > _ANONYMOUS:
            del self._met[writer]
            return "a nameless node"
        endpoints = self._endpoints()
        # On a topic where everyone speaks the list is long, and is not to be asked for by each.
        self.introduce(endpoints)
        self._introduced.pop(writer, None)
        for other in endpoints:
            if bytes(other.endpoint_gid) == writer and other.node_name != UNKNOWN_NODE:
                self._met.pop(writer, None)
                return self._name(other)
        self._next_look = now + _LOOK
        return UNDECIDED

    def _endpoints(self) -> list[Any]:
        return list(self._node.get_publishers_info_by_topic(relative(self._topic)))

    @cached_property
    def _namespace(self) -> str:
        return str(self._node.get_namespace())

    def _name(self, endpoint: Any) -> str:
        return local_name(endpoint, self._namespace)


def decoded(data: bytes, kind: Any, topic: str, refusals: Refusals) -> Any:
    """A message of varying size from its bytes; None, and counted, when they are no such message."""
    try:
        return deserialize_message(data, kind)
    except (RuntimeError, ValueError, MemoryError):
        refusals.note(topic, "another form")
        return None
