# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""An executor for nodes that live from a few small messages at every step.

The stock executor gathers all entities, builds a wait set and makes a task for every message, which
costs several times what DDS itself does. Here the hot subscriptions stand in a wait set that is built
once, and their messages go straight to their callbacks, in the thread that waits; where a step awaits very
many, in a wait set of the one that is awaited. Another one, looked at now and then, holds all else
(parameter services, latched topics); what is ready there is handed to the parent class.
"""

import os
import time
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

from rclpy.executors import (
    ConditionReachedException,
    ShutdownException,
    SingleThreadedExecutor,
    TimeoutException,
)
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node

from satform.communication.topic_graph import relative
from satform_nodes.transport.authorised_publishers import Speakers
from satform_nodes.transport.filtered_subscription import Ear
from satform_nodes.transport.node_error import NodeError
from satform_nodes.transport.serialized_take import Taker
from satform_nodes.transport.trace import AnyTrace, trace_from_environment

HOUSEKEEPING_PERIOD = 1.0
"""Wall-clock time between two looks at what no wait set holds, such as timers and events, s."""

HOUSEKEEPING_AT_LEISURE = 20.0
"""Times its own length that passes between the beginnings of two such looks at least."""

LONGEST_HOUSEKEEPING_PERIOD = 30.0
"""Wall-clock time that passes between them at most, however long one took, s."""

LONGEST_WAIT = 0.02
"""Wall-clock time after which a wait is broken off to look at the condition and at all else, s."""

LONGEST_PUT_OFF = 0.1
"""Wall-clock time by which such a look is put off at most for the sake of a moment, s."""

COLD_LOOK = 0.001
"""Wall-clock time that a look at what is not hot is granted where a moment has to be met, s."""

LEISURE = 0.005
"""Wall-clock time that a node which nobody waits for lets messages gather, s."""

PATIENCE_OF_A_STEP = 0.1
"""Wall-clock time without progress after which a node says once more what it said last, s."""

ABSENCE = 0.25
"""Wall-clock time of one round from which on this process was not running, rather than waiting, s."""

LONGEST_IDLE = 1.0
"""Longest wall-clock time between two such repetitions, s."""

MANY = 64
"""Awaited messages of a step from which on it pays to wait for one after another."""

STOCK = "SATFORM_STOCK_EXECUTOR"
"""Environment variable: when set, all is left to the parent class, to measure what this one gains."""

_NANOSECONDS = 1_000_000_000


@runtime_checkable
class CountsFaults(Protocol):
    """A node that logs and counts what its callbacks raise."""

    def note_fault(self, name: str, error: BaseException) -> None:
        """Log and count an error.

        Args:
            name: of the callback's topic or service.
            error: what it raised.
        """


class StepExecutor(SingleThreadedExecutor):
    """A single-threaded executor with a fast path for chosen raw subscriptions."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.trace: AnyTrace = trace_from_environment()
        self._stock = STOCK in os.environ
        self._handed_out = 0
        self._taker = Taker()
        self._names: list[str] = []
        self._hot: list[Ear] = []
        self._overheard: list[Ear] = []
        self._ears: dict[int, Ear] = {}
        self._chores: list[Callable[[], None]] = []
        self._cold: list[Any] = []
        self._services: list[Any] = []
        self._hot_wait_set: Any = None
        self._next_awaited: Callable[[], Any] | None = None
        self._single_wait_set: Any = None
        self._cold_wait_set: Any = None
        self._next_housekeeping = 0.0
        self._next_cold_look = 0.0

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for a callback and run it, as the parent class does; what it raises does not end the node.

        Requests and events come from outside: what they make a callback raise is logged and counted. Only a
        `NodeError`, by which a node ends itself, goes through.
        """
        try:
            ready: tuple[Any, Any, Any] = self.wait_for_ready_callbacks(timeout_sec, None, _never)
        except (ShutdownException, TimeoutException, ConditionReachedException):
            return
        handler, entity, node = ready
        handler()
        error = handler.exception()
        if isinstance(error, NodeError):
            raise error
        if error is not None and isinstance(node, CountsFaults):
            node.note_fault(_name_of(entity), error)

    def add_node(self, node: Node) -> bool:
        """Have a node's work done here; its name is kept, since the node may go before this does."""
        self._names.append(node.get_name())
        return bool(super().add_node(node))

    def add_chore(self, chore: Callable[[], None]) -> None:
        """Have something done at every look at what is not hot, some fifty times a second."""
        self._chores.append(chore)

    def wake(self) -> None:
        """Called by rclpy when a node has got or given up something: what is not hot is gathered anew."""
        self._next_housekeeping = 0.0
        super().wake()

    def look_soon(self) -> None:
        """Look at what is not hot as soon as the present callback has ended."""
        self._next_cold_look = 0.0

    def subscribe(
        self,
        node: Node,
        message_type: Any,
        topic: str,
        callback: Callable[[bytes, str], None],
        qos: Any,
        speakers: Speakers | None = None,
        *,
        vital: bool = True,
    ) -> Any:
        """Subscribe to a topic on the fast path.

        Args:
            node: the node that subscribes, already added to this executor.
            message_type: rosidl's class of the message.
            topic: name of the topic in the root namespace.
            callback: called with the serialised message and the name of the node that said it.
            qos: quality of service.
            speakers: who is believed there; anyone, whose name is empty then, when left out.
            vital: whether its messages are waited for and count as progress; if not, they are taken at the
                looks at what is not hot.

        Returns:
            rclpy's subscription.
        """

        def _never_called(_data: bytes) -> None:
            """What is taken for the parent goes through the ear, too."""

        subscription = node.create_subscription(message_type, relative(topic), _never_called, qos, raw=True)
        ear = Ear(subscription, speakers, self._traced(topic, callback, vital=vital), self._taker)
        self._ears[id(subscription)] = ear
        if vital:
            self._hot.append(ear)
            self._hot_wait_set = None
        else:
            self._overheard.append(ear)
        return subscription

    def await_in_turn(self, next_awaited: Callable[[], Any] | None) -> None:
        """Wait for one hot subscription after another instead of for all of them at once.

        Where a step needs a message from each of `MANY`, a wait for all of them costs time for each of them
        every time that some have come. What else arrives is taken at the looks at what is not hot. Among
        fewer it gains more to take what comes while the others are still speaking.

        Args:
            next_awaited: tells a subscription without whose next message the step does not go on, or None
                where that is not known and all are waited for; None to wait for all from now on.
        """
        self._next_awaited = next_awaited

    def _traced(
        self, topic: str, callback: Callable[[bytes, str], None], *, vital: bool
    ) -> Callable[[bytes, str], None]:
        """A callback that leaves its marks where a trace is asked for."""
        trace = self.trace
        if not (trace.on or self._stock):
            return callback
        name = trace.name(topic)

        def marked(data: bytes, speaker: str) -> None:
            self._handed_out += vital
            trace.begin(name)
            callback(data, speaker)
            trace.end(name)

        return marked

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """End, and leave what was traced where it was asked for."""
        self.trace.write(self._names)
        return bool(super().shutdown(timeout_sec))

    def _take_subscription(self, sub: Any) -> Any:
        """The parent's way to a message; here it is the same as on the fast path."""
        ear = self._ears.get(id(sub))
        if ear is None:
            return super()._take_subscription(sub)

        async def _hear() -> None:
            ear.hear()

        return _hear

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
        last = seen = time.monotonic()
        before = progress() if progress else None
        wait, due = PATIENCE_OF_A_STEP, last + PATIENCE_OF_A_STEP
        while condition():
            now = time.monotonic()
            if now - seen > ABSENCE:
                # This process was held itself: what came meanwhile is still to be read.
                last += now - seen
            seen = now
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
            overdue = now - self._next_cold_look
            if overdue > LONGEST_PUT_OFF or (overdue >= 0.0 and moment - now > COLD_LOOK):
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
        """Work until a condition holds, whatever arrives meanwhile.

        Args:
            condition: asked after every round.
            timeout: wall-clock time after which to give up, s.

        Returns:
            Whether the condition holds.
        """
        end = time.monotonic() + timeout
        while not condition():
            now = time.monotonic()
            if now >= end:
                return False
            if now >= self._next_cold_look:
                self._look_at_cold(now)
            self._take_hot(min(end - now, LONGEST_WAIT))
        return True

    def _reconsider(self) -> None:
        """Hand on what was held back until it was known whose it is."""
        for ear in (*self._hot, *self._overheard):
            if ear.holds:
                ear.reconsider()

    def _take_hot(self, timeout: float) -> bool:
        """Wait for hot messages and hand them out; whether there were any."""
        if self._stock or not self._hot:
            before = self._handed_out
            self.spin_once(timeout_sec=timeout)
            return self._handed_out != before
        awaited = self._next_awaited and self._next_awaited()
        return self._take_any(timeout) if awaited is None else self._take_in_turn(awaited, timeout)

    def _take_in_turn(self, awaited: Any, timeout: float) -> bool:
        """Hand out what is awaited, one after another, as long as it is there; wait for the first of them."""
        taken_any = False
        # A bound: what is believed and yet no answer to a step may come faster than it is read.
        for _ in range(len(self._hot)):
            if awaited is None or not self._ears[id(awaited)].hear():
                break
            taken_any = True
            awaited = self._next_awaited and self._next_awaited()
        if taken_any or awaited is None:
            return taken_any
        wait_set = self._single_wait_set
        if wait_set is None:
            wait_set = self._single_wait_set = _rclpy.WaitSet(1, 0, 0, 0, 0, 0, self.context.handle)
        wait_set.clear_entities()
        wait_set.add_subscription(awaited.handle)
        wait_set.wait(int(timeout * _NANOSECONDS))
        # When it does not come there may be a reason, which somebody else has told.
        return self._ears[id(awaited)].hear() or self._take_any(0.0)

    def _take_any(self, timeout: float) -> bool:
        """Wait for hot messages of anyone, and hand out one of each that has some; whether there were any."""
        wait_set = self._hot_wait_set
        if wait_set is None:
            wait_set = _rclpy.WaitSet(len(self._hot), 0, 0, 0, 0, 0, self.context.handle)
            self._hot_wait_set = wait_set
        wait_set.clear_entities()
        add = wait_set.add_subscription
        for ear in self._hot:
            add(ear.subscription.handle)
        wait_set.wait(int(timeout * _NANOSECONDS))
        taken_any = False
        # What is heard may bring in new subscriptions, which are not in this wait set.
        for index, ear in enumerate(tuple(self._hot)):
            if wait_set.is_ready("subscription", index):
                taken_any |= ear.hear()
        return taken_any

    def _drain_hot(self) -> bool:
        """Hand out the hot messages that have arrived, without waiting; whether there were any."""
        if self._stock or not self._hot:
            return self._take_hot(0.0)
        taken_any = False
        for ear in tuple(self._hot):
            taken_any |= ear.hear_all()
        return taken_any

    def _look_at_cold(self, now: float) -> None:
        """Do the chores, take what is overheard, and hand to the parent what else has become ready."""
        self._next_cold_look = now + LONGEST_WAIT
        self._reconsider()
        for chore in self._chores:
            chore()
        for ear in self._overheard:
            ear.hear_all()
        if self._next_awaited is not None and not self._stock:
            self._take_any(0.0)
        if now >= self._next_housekeeping:
            self._keep_house()
        if not (self._cold or self._services):
            return
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
            self.spin_once(timeout_sec=0.0)

    def _keep_house(self) -> None:
        """Let the parent class look at everything, and find out what is not hot."""
        begin = time.monotonic()
        self.spin_once(timeout_sec=0.0)
        # After the callback, which may have given something up; another one that does wakes this executor.
        self._gather_cold()
        # The parent class looks at every entity of every node, of which a group has thousands.
        pause = min(HOUSEKEEPING_AT_LEISURE * (time.monotonic() - begin), LONGEST_HOUSEKEEPING_PERIOD)
        self._next_housekeeping = begin + max(HOUSEKEEPING_PERIOD, pause)

    def _gather_cold(self) -> None:
        nodes = self.get_nodes()
        subscriptions = [subscription for node in nodes for subscription in node.subscriptions]
        self._cold = [subscription for subscription in subscriptions if id(subscription) not in self._ears]
        self._services = [service for node in nodes for service in node.services]
        self._cold_wait_set = _rclpy.WaitSet(
            len(self._cold), 0, 0, 0, len(self._services), 0, self.context.handle
        )


def _never() -> bool:
    return False


def _name_of(entity: Any) -> str:
    """What a callback belongs to, by the name of its topic or service where it has one."""
    found = getattr(entity, "srv_name", None) or getattr(entity, "topic_name", None)
    return str(found or type(entity).__name__.lower())
