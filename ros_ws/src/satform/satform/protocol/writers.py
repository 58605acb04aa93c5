# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which writers of a topic are accepted: the first of each node, and another one after each of its losses.

Any process can give its node any name, and a restarted node must not be confused with its predecessor. A
writer is known by an identifier that no other one has, in DDS its GUID.
"""

from collections.abc import Collection

_MAX_REJECTED = 10_000
"""Largest number of rejected writers that are remembered."""


class AuthorisedWriters:
    """The writers of one topic that are accepted, and those that are not.

    Attributes:
        expected: names of the nodes that publish the topic.
    """

    def __init__(self, names: Collection[str]) -> None:
        """No writer is known yet.

        Args:
            names: of the nodes that publish the topic, each with one writer.
        """
        self.expected = frozenset(names)
        # Names of which one new writer is accepted still.
        self._open = set(self.expected)
        self._name_of: dict[bytes, str] = {}
        self._rejected: dict[bytes, str] = {}
        # Writers that another one of their name has replaced: their late messages are never accepted again.
        self._former: dict[bytes, str] = {}

    def knows(self, writer: bytes) -> bool:
        """Whether it has been decided if a writer is accepted."""
        return writer in self._name_of or self.rejection(writer) is not None

    def name_of(self, writer: bytes) -> str | None:
        """Name of the node of an accepted writer; None for any other."""
        return self._name_of.get(writer)

    def rejection(self, writer: bytes) -> str | None:
        """Why a writer is rejected; None for one that is not."""
        return self._former.get(writer) or self._rejected.get(writer)

    def allow_replacement(self, name: str) -> None:
        """Accept another writer of a node that has been lost, since it may be restarted.

        One that was rejected because it came before the loss may be it; one that has been replaced is not.
        """
        if name in self.expected:
            self._open.add(name)
            self._rejected.clear()

    def reject_former(self, writer: bytes) -> None:
        """Never accept a writer that is not known: it belongs to a process whose loss is known."""
        if writer not in self._name_of:
            self._former[writer] = "its process has been lost"

    def decide(self, writer: bytes, name: str) -> str | None:
        """Accept a new writer from now on, or remember why it is rejected.

        Args:
            writer: its identifier.
            name: of its node.

        Returns:
            Why it is rejected; None when it is accepted.
        """
        if name in self._open:
            self._open.remove(name)
            for before in [known for known, own in self._name_of.items() if own == name]:
                del self._name_of[before]
                self._former[before] = f"{name} has been restarted"
            self._name_of[writer] = name
            return None
        reason = f"a second writer of {name}" if name in self.expected else f"{name} is not authorised"
        if len(self._rejected) >= _MAX_REJECTED:
            self._rejected.clear()
        self._rejected[writer] = reason
        return reason
