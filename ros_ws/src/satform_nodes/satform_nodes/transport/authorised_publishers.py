# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Authorised publishers of a topic: messages of all other DDS writers are rejected.

Which writers are accepted is decided by `satform.protocol.writers`. Here their names are looked up, once for
each writer.
"""

import time
from collections.abc import Collection, Iterable
from functools import cached_property
from typing import Any

from rclpy.node import Node

from satform.communication.message_validator import RejectionCounter
from satform.communication.topic_table import relative
from satform.protocol.writers import AuthorisedWriters
from satform_nodes.transport.node_names import UNKNOWN_NODE, local_name

UNDECIDED = ""
"""In place of a name: discovery has not announced the writer's node yet."""

_LOOK_UP_PERIOD = 0.02
"""Wall-clock time between two look-ups of a writer whose node is not known yet, s."""

_NAME_TIMEOUT = 10.0
"""Wall-clock time within which the name of every ROS node is discovered, s."""


class AuthorisedPublishers:
    """The authorised DDS writers of one topic."""

    def __init__(self, node: Node, topic: str, names: Collection[str], rejections: RejectionCounter) -> None:
        """No writer is known yet.

        Args:
            node: that subscribes.
            topic: its name in the root namespace.
            names: of the authorised nodes, each with one writer.
            rejections: counts the messages of all others.
        """
        self._node = node
        self._topic = topic
        self._rejections = rejections
        self._writers = AuthorisedWriters(names)
        self._next_look = 0.0
        self._first_seen: dict[bytes, float] = {}
        self._noted: dict[bytes, str] = {}

    @property
    def expected(self) -> frozenset[str]:
        """Names of the authorised nodes."""
        return self._writers.expected

    def note_endpoints(self, endpoints: Iterable[Any]) -> None:
        """Register discovered endpoints, so that their nodes need no look-up later.

        Args:
            endpoints: of the topic, as rclpy returns them for publishers.
        """
        there = {
            bytes(other.endpoint_gid): self._name(other)
            for other in endpoints
            if self._name(other) in self.expected
        }
        self._noted = {writer: name for writer, name in there.items() if not self._writers.knows(writer)}

    def allow_replacement(self, name: str) -> None:
        """Accept one more writer of a node that has been lost, since it may be restarted."""
        self._writers.allow_replacement(name)

    def reject_former(self, writer: bytes) -> None:
        """Never accept a writer whose node is not known yet: it belongs to a process whose loss is known."""
        self._writers.reject_former(writer)

    def who(self, writer: bytes) -> str | None:
        """Name of the authorised node that a message is from.

        Args:
            writer: identifier of the message's writer.

        Returns:
            The name; `UNDECIDED` if it may become known soon; None if the message is rejected, which has
            been counted then.
        """
        name = self._writers.name_of(writer)
        if name is not None:
            return name
        reason = self._writers.rejection(writer)
        if reason is None:
            name = self._look_up(writer)
            if name == UNDECIDED:
                return UNDECIDED
            reason = self._writers.decide(writer, name)
            if reason is None:
                return name
        self._rejections.add(self._topic, reason)
        return None

    def _look_up(self, writer: bytes) -> str:
        introduced = self._noted.pop(writer, None)
        if introduced is not None:
            self._first_seen.pop(writer, None)
            return introduced
        now = time.monotonic()
        if now < self._next_look:
            return UNDECIDED
        if now - self._first_seen.setdefault(writer, now) > _NAME_TIMEOUT:
            del self._first_seen[writer]
            return "a node without a name"
        endpoints = self._endpoints()
        # On a topic with many publishers the list is long, and should not be queried for each of them.
        self.note_endpoints(endpoints)
        self._noted.pop(writer, None)
        for other in endpoints:
            if bytes(other.endpoint_gid) == writer and other.node_name != UNKNOWN_NODE:
                self._first_seen.pop(writer, None)
                return self._name(other)
        self._next_look = now + _LOOK_UP_PERIOD
        return UNDECIDED

    def _endpoints(self) -> list[Any]:
        return list(self._node.get_publishers_info_by_topic(relative(self._topic)))

    @cached_property
    def _namespace(self) -> str:
        return str(self._node.get_namespace())

    def _name(self, endpoint: Any) -> str:
        return local_name(endpoint, self._namespace)
