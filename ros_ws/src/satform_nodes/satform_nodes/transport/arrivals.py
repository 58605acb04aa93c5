# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions of an executor whose messages the compiled part counts as they arrive.

A wait set wakes its process at each message, and is built anew for each wait. Here a wait ends when all
messages are there that the step lacks, so that a step wakes a process once.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from satform_nodes.transport import compiled
from satform_nodes.transport.filtered_subscription import FilteredSubscription

if TYPE_CHECKING:
    from satform_transport.hot_path import MessageWaiter


class Arrivals:
    """Counts the messages of subscriptions and the requests to services, and takes messages."""

    def __init__(self, waiter: "MessageWaiter") -> None:
        """Nothing is counted yet.

        Args:
            waiter: compiled.
        """
        self._waiter = waiter
        self._by_index: dict[int, FilteredSubscription] = {}
        self._index_of: dict[int, int] = {}
        self._lacking: list[Callable[[], Sequence[Any] | None]] = []
        self._services: set[int] = set()
        self._last: tuple[Sequence[Any] | None, tuple[int, ...] | None] = (None, None)

    def add(self, filtered: FilteredSubscription, *, urgent: bool) -> None:
        """Count the messages of a subscription.

        Args:
            filtered: the subscription.
            urgent: whether a message of it ends any wait.

        Raises:
            RuntimeError: the middleware does not report arriving messages.
        """
        index = filtered.take_by(self._waiter, urgent=urgent)
        self._by_index[index] = filtered
        self._index_of[id(filtered.subscription)] = index

    def add_lacking(self, lacking: Callable[[], Sequence[Any] | None]) -> None:
        """Let waits be for all messages that a step lacks.

        Args:
            lacking: returns the subscriptions whose next message the step of one of several nodes needs;
                None if that is not known.
        """
        self._lacking.append(lacking)

    def take(self, timeout: float, awaited: Any) -> bool:
        """Wait for what the step lacks, and take one message of each subscription that has any.

        What was subscribed last is taken first: a state comes after the messages of the neighbours.

        Args:
            timeout: of the wait, s.
            awaited: a subscription to wait for alone; None to wait for all that the step lacks.

        Returns:
            Whether there was a message.
        """
        needed = self._needed() if awaited is None else (self._index_of[id(awaited)],)
        taken_any = False
        for index in self._waiter.wait(needed, timeout):
            taken_any |= self._by_index[index].take_one()
        return taken_any

    def arrived(self) -> list[FilteredSubscription]:
        """Subscriptions that have messages now."""
        return [self._by_index[index] for index in self._waiter.wait(None, 0.0)]

    def count_requests(self, services: Iterable[Any]) -> None:
        """Count the requests to services, too."""
        for service in services:
            if id(service) not in self._services:
                self._waiter.add_service(service.handle.pointer)
                self._services.add(id(service))

    def take_requests(self) -> int:
        """Number of requests since the last call."""
        return self._waiter.take_requests()

    def _needed(self) -> tuple[int, ...] | None:
        """Indices of the subscriptions that a wait is for; None for any."""
        found = [lacking() for lacking in self._lacking]
        if None in found:
            return None
        if len(found) == 1 and found[0] is self._last[0]:
            # The usual case: one node, whose next step lacks everything.
            return self._last[1]
        needed = tuple(self._index_of[id(subscription)] for each in found for subscription in each or ())
        self._last = (found[0] if len(found) == 1 else None, needed or None)
        return self._last[1]


def arrivals() -> Arrivals | None:
    """What counts arriving messages; None where the compiled part is not built or switched off."""
    waiter = compiled.message_waiter()
    return None if waiter is None else Arrivals(waiter)
