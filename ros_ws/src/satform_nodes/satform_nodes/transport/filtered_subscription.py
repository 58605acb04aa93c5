# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Subscription whose messages are taken one by one and filtered by their authorised publishers."""

from collections import deque
from collections.abc import Callable
from typing import Any

from satform_nodes.transport.authorised_publishers import UNDECIDED, AuthorisedPublishers
from satform_nodes.transport.serialized_take import SerializedTaker

_MAX_AT_ONCE = 256
"""Messages of unauthorised writers that are skipped at once on the way to an authorised one."""

_MAX_HELD = 256
"""Writers whose node is not known yet, and messages of each, that are held back at most."""


class FilteredSubscription:
    """A subscription that passes messages of authorised publishers to its callback."""

    def __init__(
        self,
        subscription: Any,
        authorised: AuthorisedPublishers | None,
        callback: Callable[[bytes, str], None],
        taker: SerializedTaker,
    ) -> None:
        self.subscription = subscription
        self._authorised = authorised
        self._callback = callback
        self._taker = taker
        self._held: dict[bytes, deque[bytes]] = {}

    def take_one(self) -> bool:
        """Pass on the next message of an authorised publisher; whether there was one."""
        for _ in range(_MAX_AT_ONCE):
            taken = self._taker.take(self.subscription)
            if taken is None:
                return False
            if self._pass_on(*taken):
                return True
        return False

    def take_all(self) -> bool:
        """Pass on all messages that have arrived; whether there were any."""
        taken = False
        # A bound: an unauthorised writer may publish faster than messages are taken.
        for _ in range(_MAX_AT_ONCE):
            if not self.take_one():
                break
            taken = True
        return taken

    def retry_held(self) -> None:
        """Pass on messages that were held back, if their node is known by now, in order."""
        for writer, messages in list(self._held.items()):
            name = self._name_of(writer)
            if name != UNDECIDED:
                del self._held[writer]
                for data in messages:
                    if name is not None:
                        self._callback(data, name)

    def _pass_on(self, data: bytes, writer: bytes) -> bool:
        if writer in self._held:
            self._held[writer].append(data)
            return False
        name = "" if self._authorised is None else self._authorised.who(writer)
        if self._authorised is not None and name == UNDECIDED:
            if len(self._held) < _MAX_HELD:
                self._held[writer] = deque([data], maxlen=_MAX_HELD)
            return False
        if name is None:
            return False
        self._callback(data, name)
        return True

    def _name_of(self, writer: bytes) -> str | None:
        return self._authorised.who(writer) if self._authorised else None

    @property
    def holds(self) -> bool:
        """Whether messages are held back."""
        return bool(self._held)
