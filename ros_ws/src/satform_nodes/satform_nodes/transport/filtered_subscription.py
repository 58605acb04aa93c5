# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Subscription whose messages are taken one by one and filtered by their authorised publishers."""

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from satform_nodes.transport.authorised_publishers import UNDECIDED, AuthorisedPublishers
from satform_nodes.transport.serialized_take import SerializedTaker

if TYPE_CHECKING:
    from satform_transport.hot_path import MessageWaiter

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
        self._take: Callable[[], Any] = partial(taker.take, subscription)
        self._held: dict[bytes, deque[bytes]] = {}
        self._index = -1
        self._waiter: MessageWaiter | None = None
        # Name of the node whose messages the waiter takes without their writer.
        self._known = ""

    def take_by(self, waiter: "MessageWaiter", *, urgent: bool) -> int:
        """Have a waiter count the messages from now on, and take them.

        It compares the writer with the last one that was accepted, which needs no look-up then.

        Args:
            waiter: compiled.
            urgent: whether a message ends any wait.

        Returns:
            The index of this subscription in the waiter.

        Raises:
            RuntimeError: the middleware does not report arriving messages.
        """
        self._index = waiter.add_subscription(self.subscription.handle.pointer, urgent)
        self._waiter = waiter
        self._take = partial(waiter.take, self._index)
        return self._index

    def take_one(self) -> bool:
        """Pass on the next message of an authorised publisher; whether there was one."""
        for _ in range(_MAX_AT_ONCE):
            taken = self._take()
            if taken is None:
                return False
            if taken.__class__ is bytes:
                self._callback(taken, self._known)
                return True
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

    def finish(self) -> None:
        """Pass on what has arrived of a process that is lost, and reject its writer if that is not known yet.

        Otherwise a late message of it could be taken for the first one of the process that follows.
        """
        self.take_all()
        for writer in self._held:
            if self._authorised is not None:
                self._authorised.reject_former(writer)
        self._held.clear()

    def retry_held(self) -> None:
        """Pass on messages that were held back, if their node is known by now, in order."""
        for writer, messages in list(self._held.items()):
            name = self._name_of(writer)
            if name != UNDECIDED:
                del self._held[writer]
                if name is not None:
                    self._know(writer, name)
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
        self._know(writer, name)
        self._callback(data, name)
        return True

    def _know(self, writer: bytes, name: str) -> None:
        """Have the waiter recognise an accepted writer, and no longer the one before."""
        if self._waiter is not None:
            self._waiter.know(self._index, writer)
            self._known = name

    def _name_of(self, writer: bytes) -> str | None:
        return self._authorised.who(writer) if self._authorised else None

    @property
    def holds(self) -> bool:
        """Whether messages are held back."""
        return bool(self._held)
