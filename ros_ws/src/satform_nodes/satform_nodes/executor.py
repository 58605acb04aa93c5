"""An executor for nodes that live from a few small messages at every step.

The stock executor gathers all entities, builds a wait set and makes a task for every message, which
costs several times what DDS itself does. Here the hot subscriptions stand in a wait set that is built
once, and their messages go straight to their callbacks, in the thread that waits. A second wait set,
looked at now and then, holds all else (parameter services, latched topics); what is ready there is handed
to the parent class.
"""

import os
import time
from collections.abc import Callable
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node

from satform_nodes.trace import AnyTrace, trace_from_environment

HOUSEKEEPING_PERIOD = 1.0
"""Wall-clock time between two looks at what no wait set holds: timers, events, new entities; s."""

LONGEST_WAIT = 0.02
"""Wall-clock time after which a wait is broken off to look at the condition and at all else, s."""

COLD_LOOK = 0.001
"""Wall-clock time that a look at what is not hot is granted where a moment has to be met, s."""

LEISURE = 0.005
"""Wall-clock time that a node which nobody waits for lets messages gather, s."""

PATIENCE_OF_A_STEP = 0.1
"""Wall-clock time without progress after which a node says once more what it said last, s."""

LONGEST_IDLE = 1.0
"""Longest wall-clock time between two such repetitions, s."""

STOCK = "SATFORM_STOCK_EXECUTOR"
"""Environment variable: when set, all is left to the parent class, to measure what this one gains."""

_SEQUENCE = "publication_sequence_number"
"""Where rclpy tells the number that a message has as its writer counts."""

_NANOSECONDS = 1_000_000_000


class _Hot:
    """A subscription on the fast path.

    Attributes:
        handle: rclpy's, by which messages are taken.
        message_type: rosidl's class.
        callback: called with the serialised message and its number.
        name: of its callback's spans in a trace.
    """

    __slots__ = ("callback", "handle", "message_type", "name")

    def __init__(self, message_type: Any, callback: Callable[[bytes, int], None], name: int) -> None:
        self.handle: Any = None
        self.message_type = message_type
        self.callback = callback
        self.name = name


class StepExecutor(SingleThreadedExecutor):
    """A single-threaded executor with a fast path for chosen raw subscriptions."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.trace: AnyTrace = trace_from_environment()
        self._stock = STOCK in os.environ
        self._handed_out = 0
        self._names: list[str] = []
        self._hot: list[_Hot] = []
        self._hot_subscriptions: set[int] = set()
        self._chores: list[Callable[[], None]] = []
        self._cold: list[Any] = []
        self._services: list[Any] = []
        self._hot_wait_set: Any = None
        self._cold_wait_set: Any = None
        self._next_housekeeping = 0.0
        self._next_cold_look = 0.0

    def add_node(self, node: Node) -> bool:
        """Have a node's work done here; its name is kept, since the node may go before this does."""
        self._names.append(node.get_name())
        return bool(super().add_node(node))

    def add_chore(self, chore: Callable[[], None]) -> None:
        """Have something done at every look at what is not hot, some fifty times a second."""
        self._chores.append(chore)

    def look_soon(self) -> None:
        """Look at what is not hot as soon as the present callback has ended."""
        self._next_cold_look = 0.0

    def subscribe(
        self, node: Node, message_type: Any, topic: str, callback: Callable[[bytes, int], None], qos: Any
    ) -> Any:
        """Subscribe to a topic on the fast path.

        Args:
            node: the node that subscribes, already added to this executor.
            message_type: rosidl's class of the message.
            topic: name of the topic.
            callback: called with the serialised message and its number as its writer counts.
            qos: quality of service.

        Returns:
            rclpy's subscription.
        """
        hot = _Hot(message_type, callback, self.trace.name(topic))

        # When the parent is asked to look at all else it may come upon a hot message, too.
        def _handed_out_by_the_parent(data: bytes, information: dict[str, int]) -> None:
            self._hand_out(hot, data, information[_SEQUENCE])

        subscription = node.create_subscription(message_type, topic, _handed_out_by_the_parent, qos, raw=True)
        hot.handle = subscription.handle
        if self._stock:
            return subscription
        self._hot.append(hot)
        self._hot_subscriptions.add(id(subscription))
        self._hot_wait_set = None
        return subscription

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """End, and leave what was traced where it was asked for."""
        self.trace.write(self._names)
        return bool(super().shutdown(timeout_sec))

    def spin_while(
        self,
        condition: Callable[[], bool],
        timeout: float,
        idle: Callable[[], None] | None = None,
        progress: Callable[[], object] | None = None,
    ) -> bool:
        """Work until the condition no longer holds, or nothing has come of it for too long.

        Args:
            condition: asked after every round.
            timeout: wall-clock time without progress after which to give up, s.
            idle: called when there was no progress for `PATIENCE_OF_A_STEP`, then twice that, and so on
                up to `LONGEST_IDLE` between two calls.
            progress: what is to change; when left out, the arrival of any hot message is progress.

        Returns:
            True when the condition has ended; False when the time was up.
        """
        last = time.monotonic()
        before = progress() if progress else None
        wait, due = PATIENCE_OF_A_STEP, last + PATIENCE_OF_A_STEP
        while condition():
            now = time.monotonic()
            if now >= self._next_cold_look:
                self._look_at_cold(now)
            moved = self._take_hot(LONGEST_WAIT)
            if progress:
                here = progress()
                moved = here != before
                before = here
            if moved:
                last = now
                wait, due = PATIENCE_OF_A_STEP, now + PATIENCE_OF_A_STEP
            elif now - last > timeout:
                return False
            elif idle and now > due:
                wait = min(2.0 * wait, LONGEST_IDLE)
                due = now + wait
                idle()
        return True

    def spin_till(self, moment: float, condition: Callable[[], bool]) -> None:
        """Work until a moment of the monotonic clock in s, or until the condition no longer holds."""
        while condition():
            now = time.monotonic()
            if now >= moment:
                return
            # What is not hot may take a while, and the moment is not to be missed for it.
            if now >= self._next_cold_look and moment - now > COLD_LOOK:
                self._look_at_cold(now)
            self._take_hot(min(LONGEST_WAIT, max(0.0, moment - time.monotonic())))

    def spin_at_leisure(
        self, condition: Callable[[], bool], timeout: float, pause: Callable[[float], Any]
    ) -> bool:
        """As `spin_while`, for a node that nobody waits for: it takes what has gathered, then pauses.

        Args:
            condition: asked after every round.
            timeout: wall-clock time without any hot message after which to give up, s.
            pause: waits for the given time in s, or less when there is reason to.

        Returns:
            True when the condition has ended; False when the time was up.
        """
        last = time.monotonic()
        while condition():
            now = time.monotonic()
            if now >= self._next_cold_look:
                self._look_at_cold(now)
            if self._drain_hot():
                last = now
            elif now - last > timeout:
                return False
            pause(LEISURE)
        return True

    def spin_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Work in the stock way until a condition holds; for what is not hot, such as readiness.

        Args:
            condition: asked after every callback.
            timeout: wall-clock time after which to give up, s.

        Returns:
            Whether the condition holds.
        """
        end = time.monotonic() + timeout
        while not condition():
            left = end - time.monotonic()
            if left <= 0.0:
                return False
            super().spin_once(timeout_sec=min(left, LONGEST_WAIT))
        return True

    def _take_hot(self, timeout: float) -> bool:
        """Wait for hot messages and hand them out; whether there were any."""
        if self._stock:
            before = self._handed_out
            super().spin_once(timeout_sec=timeout)
            return self._handed_out != before
        wait_set = self._hot_wait_set
        if wait_set is None:
            wait_set = _rclpy.WaitSet(len(self._hot), 0, 0, 0, 0, 0, self.context.handle)
            self._hot_wait_set = wait_set
        wait_set.clear_entities()
        add = wait_set.add_subscription
        for entry in self._hot:
            add(entry.handle)
        wait_set.wait(int(timeout * _NANOSECONDS))
        taken_any = False
        for index, entry in enumerate(self._hot):
            if wait_set.is_ready("subscription", index):
                taken_any = self._take(entry) or taken_any
        return taken_any

    def _take(self, hot: _Hot) -> bool:
        """Hand out one message without waiting; whether there was one."""
        taken = hot.handle.take_message(hot.message_type, True)
        if taken is None:
            return False
        self._hand_out(hot, taken[0], taken[1][_SEQUENCE])
        return True

    def _hand_out(self, hot: _Hot, data: bytes, sequence: int) -> None:
        self._handed_out += 1
        trace = self.trace
        if trace.on:
            trace.begin(hot.name)
            hot.callback(data, sequence)
            trace.end(hot.name)
        else:
            hot.callback(data, sequence)

    def _drain_hot(self) -> bool:
        """Hand out all hot messages that have arrived, without waiting; whether there were any."""
        if self._stock:
            return self._take_hot(0.0)
        taken_any = False
        for entry in self._hot:
            while self._take(entry):
                taken_any = True
        return taken_any

    def _look_at_cold(self, now: float) -> None:
        """Hand to the parent what has become ready besides hot messages, and do the chores."""
        self._next_cold_look = now + LONGEST_WAIT
        for chore in self._chores:
            chore()
        if now >= self._next_housekeeping:
            self._next_housekeeping = now + HOUSEKEEPING_PERIOD
            self._gather_cold()
            super().spin_once(timeout_sec=0.0)
        wait_set = self._cold_wait_set
        wait_set.clear_entities()
        for subscription in self._cold:
            wait_set.add_subscription(subscription.handle)
        for service in self._services:
            wait_set.add_service(service.handle)
        wait_set.wait(0)
        ready = len(wait_set.get_ready_entities("subscription"))
        ready += len(wait_set.get_ready_entities("service"))
        for _ in range(ready):
            super().spin_once(timeout_sec=0.0)

    def _gather_cold(self) -> None:
        nodes = self.get_nodes()
        subscriptions = [subscription for node in nodes for subscription in node.subscriptions]
        self._cold = [
            subscription for subscription in subscriptions if id(subscription) not in self._hot_subscriptions
        ]
        self._services = [service for node in nodes for service in node.services]
        self._cold_wait_set = _rclpy.WaitSet(
            len(self._cold), 0, 0, 0, len(self._services), 0, self.context.handle
        )
