# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Fast path of an executor for the subscriptions of which a step needs a message.

The executor of rclpy collects all entities, builds a wait set and makes a task for every message, which costs
several times as much as DDS itself. Here the vital ("hot") subscriptions are in a wait set that is built
once, and their messages go to their callbacks in the waiting thread; if a step needs very many messages, the
wait set has only the next awaited subscription. All other entities (parameter services, latched topics) are
polled in the background in a wait set of their own, and are executed by the parent class.

Where the compiled part is built (`satform_nodes.transport.arrivals`), it counts the messages as they arrive:
there is no wait set, a wait ends when all messages are there that the step lacks, and services are polled
when they have requests.
"""

import os
import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

from rclpy.action import ActionServer
from rclpy.executors import (
    ConditionReachedException,
    ShutdownException,
    SingleThreadedExecutor,
    TimeoutException,
)
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.waitable import NumberOfEntities

from satform.communication.topic_table import relative
from satform_nodes.transport.arrivals import arrivals
from satform_nodes.transport.authorised_publishers import AuthorisedPublishers
from satform_nodes.transport.filtered_subscription import FilteredSubscription
from satform_nodes.transport.node_error import NodeError
from satform_nodes.transport.serialized_take import SerializedTaker
from satform_nodes.transport.trace import AnyTrace, trace_from_environment

HOUSEKEEPING_PERIOD = 1.0
"""Wall-clock time between two polls of what is in no wait set, such as timers and events, s."""

HOUSEKEEPING_AT_LEISURE = 20.0
"""Time between two such polls at least, in multiples of the duration of one."""

LONGEST_HOUSEKEEPING_PERIOD = 30.0
"""Wall-clock time between two such polls at most, s."""

LONGEST_WAIT = 0.02
"""Wall-clock time after which a wait ends, so that the condition is checked and the background polled, s."""

MANY_SUBSCRIPTIONS = 64
"""Number of messages of a step from which on subscriptions are waited for one after another."""

_MOST_CALLBACKS = 64
"""Callbacks of one background poll at most, beside those of the fast path."""

STOCK = "SATFORM_STOCK_EXECUTOR"
"""Environment variable: which executor of rclpy does everything, to measure the gain of this one.

`single` is the parent class, `events` is `rclpy.experimental.EventsExecutor`, which does not tell a message's
writer."""

SINGLE, EVENTS = "single", "events"
"""Values of the variable."""

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


class FastPathExecutor(SingleThreadedExecutor):
    """A single-threaded executor with a fast path for chosen raw subscriptions."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.trace: AnyTrace = trace_from_environment()
        self._stock = STOCK in os.environ
        self._events: Any = _events_executor() if os.environ.get(STOCK) == EVENTS else None
        self._handed_out = 0
        self._taker = SerializedTaker()
        self._arrivals = None if self._stock else arrivals()
        self._names: list[str] = []
        self._hot: list[FilteredSubscription] = []
        self._background: list[FilteredSubscription] = []
        self._filtered: dict[int, FilteredSubscription] = {}
        self._periodic: list[Callable[[], None]] = []
        self._cold: list[Any] = []
        self._services: list[Any] = []
        self._actions: list[ActionServer] = []
        self._hot_wait_set: Any = None
        self._next_awaited: Callable[[], Any] | None = None
        self._single_wait_set: Any = None
        self._cold_wait_set: Any = None
        self._requests_are_counted = self._requests_are_due = False
        self._next_housekeeping = 0.0
        self.next_background_poll = 0.0

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for a callback and run it, as the parent class does; an exception in it does not end the node.

        Exceptions that requests and events from outside cause are logged and counted. Only a `NodeError`, by
        which a node ends itself, is raised.
        """
        if self._events is not None:
            self._events.spin_once(timeout_sec)
            return
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
        """Add a node; its name is stored, since the node may be destroyed before the executor."""
        self._names.append(node.get_name())
        if self._events is not None:
            return bool(self._events.add_node(node))
        return bool(super().add_node(node))

    def add_periodic(self, chore: Callable[[], None]) -> None:
        """Call a function at every background poll, about fifty times a second."""
        self._periodic.append(chore)

    def wake(self) -> None:
        """Rebuild the background wait set; called by rclpy when a node creates or destroys an entity."""
        self._next_housekeeping = 0.0
        super().wake()

    def poll_soon(self) -> None:
        """Poll the background as soon as the present callback has returned."""
        self.next_background_poll = 0.0

    def subscribe(
        self,
        node: Node,
        message_type: Any,
        topic: str,
        callback: Callable[[bytes, str], None],
        qos: Any,
        authorised: AuthorisedPublishers | None = None,
        *,
        vital: bool = True,
    ) -> Any:
        """Subscribe to a topic on the fast path.

        Args:
            node: the node that subscribes, already added to this executor.
            message_type: rosidl's class of the message.
            topic: name of the topic in the root namespace.
            callback: called with the serialised message and the name of its publisher.
            qos: quality of service.
            authorised: the authorised publishers; by default any, whose name is then empty.
            vital: whether its messages are waited for and count as progress; if not, they are taken at the
                background polls.

        Returns:
            rclpy's subscription.
        """
        handle = self._traced(topic, callback, vital=vital)

        def _of_any_writer(data: bytes) -> None:
            """For the comparison with rclpy's events executor; else `_take_subscription` takes messages."""
            for name in authorised.expected if authorised else ("",):
                handle(data, name)

        subscription = node.create_subscription(message_type, relative(topic), _of_any_writer, qos, raw=True)
        filtered = FilteredSubscription(subscription, authorised, handle, self._taker)
        self._filtered[id(subscription)] = filtered
        if vital:
            self._hot.append(filtered)
            self._hot_wait_set = None
            if self._arrivals is not None:
                # A message of a latched topic may change what the step lacks.
                self._arrivals.add(filtered, urgent=qos.durability == DurabilityPolicy.TRANSIENT_LOCAL)
        else:
            self._background.append(filtered)
        return subscription

    def finish(self, subscription: Any) -> None:
        """Take all messages that have arrived from a process that is lost; its writer counts no longer.

        Args:
            subscription: of the fast path, as `subscribe` returned it.
        """
        self._filtered[id(subscription)].finish()

    def unsubscribe(self, node: Node, subscription: Any) -> None:
        """Remove a subscription that is not vital.

        Args:
            node: that subscribes.
            subscription: as `subscribe` returned it.
        """
        self._background.remove(self._filtered.pop(id(subscription)))
        node.destroy_subscription(subscription)

    def await_in_turn(self, next_awaited: Callable[[], Any] | None) -> None:
        """Wait for one hot subscription after another instead of for all of them at once.

        If a step needs a message from each of `MANY_SUBSCRIPTIONS`, a wait set of all of them costs time for
        each of them at every message. All other messages are taken at the background polls. With fewer it is
        faster to take messages in the order of their arrival.

        Args:
            next_awaited: returns a subscription whose next message the step needs, or None if that is not
                known and all are waited for; None to wait for all from now on.
        """
        self._next_awaited = next_awaited

    def await_together(self, lacking: Callable[[], Sequence[Any] | None]) -> None:
        """Let a wait end when all messages are there that a step lacks, instead of at each of them.

        It also ends at a message of a latched topic. Without the compiled part it ends at each message.

        Args:
            lacking: returns the subscriptions whose next message the step needs, of one of several nodes on
                this executor; None if that is not known.
        """
        if self._arrivals is not None:
            self._arrivals.add_lacking(lacking)

    def _traced(
        self, topic: str, callback: Callable[[bytes, str], None], *, vital: bool
    ) -> Callable[[bytes, str], None]:
        """The callback, with trace marks around it if tracing is on."""
        trace = self.trace
        if not (trace.on or self._stock):
            return callback
        name = trace.name(topic)

        def marked(data: bytes, publisher: str) -> None:
            self._handed_out += vital
            trace.begin(name)
            callback(data, publisher)
            trace.end(name)

        return marked

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Shut down, and write the trace if tracing is on."""
        self.trace.write(self._names)
        if self._events is not None:
            self._events.shutdown(timeout_sec)
        return bool(super().shutdown(timeout_sec))

    def _take_subscription(self, sub: Any) -> Any:
        """How the parent class takes a message; here the same as on the fast path."""
        filtered = self._filtered.get(id(sub))
        if filtered is None:
            return super()._take_subscription(sub)

        async def _take() -> None:
            filtered.take_one()

        return _take

    def _retry_held(self) -> None:
        """Pass on messages that were held back until their publisher is known."""
        for filtered in (*self._hot, *self._background):
            if filtered.holds:
                filtered.retry_held()

    def take_hot(self, timeout: float) -> bool:
        """Wait for hot messages and call their callbacks; whether there were any."""
        if self._stock or not self._hot:
            before = self._handed_out
            self.spin_once(timeout_sec=timeout)
            return self._handed_out != before
        awaited = self._next_awaited and self._next_awaited()
        if self._arrivals is not None:
            return self._arrivals.take(timeout, awaited)
        return self._take_any(timeout) if awaited is None else self._take_in_turn(awaited, timeout)

    def _take_in_turn(self, awaited: Any, timeout: float) -> bool:
        """Take awaited messages one after another while they are there; wait if the first one is not."""
        taken_any = False
        # A bound: valid messages that do not complete the step may arrive faster than they are taken.
        for _ in range(len(self._hot)):
            if awaited is None or not self._filtered[id(awaited)].take_one():
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
        # If it does not come, a message of another node may contain the reason.
        return self._filtered[id(awaited)].take_one() or self._take_any(0.0)

    def _take_any(self, timeout: float) -> bool:
        """Wait for any hot message, take one of each ready subscription; whether there were any."""
        wait_set = self._hot_wait_set
        if wait_set is None:
            wait_set = _rclpy.WaitSet(len(self._hot), 0, 0, 0, 0, 0, self.context.handle)
            self._hot_wait_set = wait_set
        wait_set.clear_entities()
        add = wait_set.add_subscription
        for filtered in self._hot:
            add(filtered.subscription.handle)
        wait_set.wait(int(timeout * _NANOSECONDS))
        taken_any = False
        # A callback may create subscriptions, which are not in this wait set.
        for index, filtered in enumerate(tuple(self._hot)):
            if wait_set.is_ready("subscription", index):
                taken_any |= filtered.take_one()
        return taken_any

    def drain_hot(self) -> bool:
        """Take the hot messages that have arrived, without waiting; whether there were any."""
        if self._stock or not self._hot:
            return self.take_hot(0.0)
        taken_any = False
        for filtered in tuple(self._hot) if self._arrivals is None else self._arrivals.arrived():
            taken_any |= filtered.take_all()
        return taken_any

    def poll_background(self, now: float) -> None:
        """Call the periodic functions, take messages that are not vital, execute what else is ready."""
        self.next_background_poll = now + LONGEST_WAIT
        self._retry_held()
        for chore in self._periodic:
            chore()
        for filtered in self._background:
            filtered.take_all()
        if self._next_awaited is not None and not self._stock and self._arrivals is None:
            self._take_any(0.0)
        if now >= self._next_housekeeping:
            self._housekeep()
        if self._cold or self._services or self._actions:
            self._poll_cold()

    def _poll_cold(self) -> None:
        """Execute what is ready of the services, actions, and subscriptions without a fast path."""
        if self._requests_are_counted:
            assert self._arrivals is not None  # noqa: S101 - it counts them
            self._requests_are_due |= self._arrivals.take_requests() > 0
            if not self._requests_are_due:
                return
        # The parent class executes one callback at a time, those of subscriptions before those of services.
        for _ in range(_MOST_CALLBACKS + 2 * len(self._hot)):
            if not self._cold_is_ready():
                self._requests_are_due = False
                return
            self.spin_once(timeout_sec=0.0)

    def _cold_is_ready(self) -> bool:
        """Whether there is something to be executed in the background wait set."""
        wait_set = self._cold_wait_set
        wait_set.clear_entities()
        for subscription in self._cold:
            wait_set.add_subscription(subscription.handle)
        for service in self._services:
            wait_set.add_service(service.handle)
        for action in self._actions:
            action.add_to_wait_set(wait_set)
        wait_set.wait(0)
        return any(wait_set.get_ready_entities(kind) for kind in ("subscription", "service"))

    def _housekeep(self) -> None:
        """Let the parent class poll all entities, and rebuild the background wait set."""
        begin = time.monotonic()
        self.spin_once(timeout_sec=0.0)
        if self._arrivals is not None:
            # In case that the middleware has not reported a message.
            for filtered in tuple(self._hot):
                filtered.take_one()
        # After the callback, which may have destroyed an entity; a later one that does wakes this executor.
        self._gather_cold()
        # The parent class polls every entity of every node, of which a group has thousands.
        pause = min(HOUSEKEEPING_AT_LEISURE * (time.monotonic() - begin), LONGEST_HOUSEKEEPING_PERIOD)
        self._next_housekeeping = begin + max(HOUSEKEEPING_PERIOD, pause)

    def _gather_cold(self) -> None:
        nodes = self.get_nodes()
        subscriptions = [subscription for node in nodes for subscription in node.subscriptions]
        self._cold = [
            subscription for subscription in subscriptions if id(subscription) not in self._filtered
        ]
        self._services = [service for node in nodes for service in node.services]
        waitables = [waitable for node in nodes for waitable in node.waitables]
        self._actions = [waitable for waitable in waitables if isinstance(waitable, ActionServer)]
        # Other entities have to be polled, and services with them.
        self._requests_are_counted = self._arrivals is not None and not (self._cold or self._actions)
        if self._arrivals is not None and self._requests_are_counted:
            self._arrivals.count_requests(self._services)
        count = NumberOfEntities(num_subs=len(self._cold), num_services=len(self._services))
        for action in self._actions:
            count += action.get_num_entities()
        self._cold_wait_set = _rclpy.WaitSet(
            count.num_subscriptions,
            count.num_guard_conditions,
            count.num_timers,
            count.num_clients,
            count.num_services,
            count.num_events,
            self.context.handle,
        )


def _events_executor() -> Any:
    from rclpy.experimental import EventsExecutor  # noqa: PLC0415 - only for the comparison

    return EventsExecutor()


def _never() -> bool:
    return False


def _name_of(entity: Any) -> str:
    """Name of a callback's topic or service; of other entities their type."""
    found = getattr(entity, "srv_name", None) or getattr(entity, "topic_name", None)
    return str(found or type(entity).__name__.lower())
