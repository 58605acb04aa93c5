# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which writers of a topic are accepted: the first of each node, and another one after each of its losses.

Any process can give its node any name, and a restarted node must not be confused with its predecessor. A
writer is known by an identifier that no other one has, in DDS its GUID.
"""

from collections import Counter
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
        # How many new writers of each name are accepted still: one, and one more for each loss.
        self._open_slots = Counter(names)
        self._name_of: dict[bytes, str] = {}
        self._rejected: dict[bytes, str] = {}

    def knows(self, writer: bytes) -> bool:
        """Whether it has been decided if a writer is accepted."""
        return writer in self._name_of or writer in self._rejected

    def name_of(self, writer: bytes) -> str | None:
        """Name of the node of an accepted writer; None for any other."""
        return self._name_of.get(writer)

    def rejection(self, writer: bytes) -> str | None:
        """Why a writer is rejected; None for one that is not."""
        return self._rejected.get(writer)

    def allow_replacement(self, name: str) -> None:
        """Accept one more writer of a node that has been lost, since it may be restarted."""
        if name in self.expected:
            self._open_slots[name] += 1
            self._rejected.clear()

    def decide(self, writer: bytes, name: str) -> str | None:
        """Accept a new writer from now on, or remember why it is rejected.

        Args:
            writer: its identifier.
            name: of its node.

        Returns:
            Why it is rejected; None when it is accepted.
        """
        if self._open_slots[name] > 0:
            self._open_slots[name] -= 1
            for before in [known for known, own in self._name_of.items() if own == name]:
                del self._name_of[before]
                self._rejected[before] = f"{name} has been restarted"
            self._name_of[writer] = name
            return None
        reason = f"a second writer of {name}" if name in self.expected else f"{name} is not authorised"
        if len(self._rejected) >= _MAX_REJECTED:
            self._rejected.clear()
        self._rejected[writer] = reason
        return reason
