# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A subscription that is read message by message, and what of it is believed."""

from collections import deque
from collections.abc import Callable
from typing import Any

from satform_nodes.transport.authorised_publishers import UNDECIDED, Speakers
from satform_nodes.transport.serialized_take import Taker

_AT_ONCE = 256
"""Messages of strangers that are put aside at once on the way to one that is believed."""

_HELD = 256
"""Writers of whom it is not known yet who they are, and messages of each, that are held back at most."""


class Ear:
    """A subscription that is read here: what comes in is handed on if its writer may speak there."""

    def __init__(
        self,
        subscription: Any,
        speakers: Speakers | None,
        callback: Callable[[bytes, str], None],
        taker: Taker,
    ) -> None:
        self.subscription = subscription
        self._speakers = speakers
        self._callback = callback
        self._taker = taker
        self._held: dict[bytes, deque[bytes]] = {}

    def hear(self) -> bool:
        """Hand on the next message that is believed, if there is one; whether there was."""
        for _ in range(_AT_ONCE):
            taken = self._taker.take(self.subscription)
            if taken is None:
                return False
            if self._hand_on(*taken):
                return True
        return False

    def hear_all(self) -> bool:
        """Hand on what has arrived; whether there was anything."""
        heard = False
        # A bound: a stranger may write faster than anyone can read.
        for _ in range(_AT_ONCE):
            if not self.hear():
                break
            heard = True
        return heard

    def reconsider(self) -> None:
        """Hand on what was held back, where it is known by now whose it is; each writer's in order."""
        for writer, said in list(self._held.items()):
            name = self._name_of(writer)
            if name != UNDECIDED:
                del self._held[writer]
                for data in said:
                    if name is not None:
                        self._callback(data, name)

    def _hand_on(self, data: bytes, writer: bytes) -> bool:
        if writer in self._held:
            self._held[writer].append(data)
            return False
        name = "" if self._speakers is None else self._speakers.who(writer)
        if self._speakers is not None and name == UNDECIDED:
            if len(self._held) < _HELD:
                self._held[writer] = deque([data], maxlen=_HELD)
            return False
        if name is None:
            return False
        self._callback(data, name)
        return True

    def _name_of(self, writer: bytes) -> str | None:
        return self._speakers.who(writer) if self._speakers else None

    @property
    def holds(self) -> bool:
        """Whether something is held back."""
        return bool(self._held)
