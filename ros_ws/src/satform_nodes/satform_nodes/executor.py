"""An executor for nodes that live from a few small messages at every step.

The stock executor gathers all entities, builds a wait set and makes a task for every message, which
costs several times what DDS itself does. Here the hot subscriptions stand in a wait set of their own
that is built once, and their messages go straight to their callbacks, in the thread that waits.
Everything else (parameters, services, events, timers) is handed to the parent class now and then.
"""

import time
from collections.abc import Callable
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node

HOUSEKEEPING_PERIOD = 0.02
"""Wall-clock time between two looks at everything that is not hot, s."""

_NANOSECONDS = 1_000_000_000


class StepExecutor(SingleThreadedExecutor):
    """A single-threaded executor with a fast path for chosen raw subscriptions."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._hot: list[tuple[Any, Any, Callable[[bytes], None]]] = []
        self._wait_set: Any = None
        self._next_housekeeping = 0.0

    def subscribe(
        self, node: Node, message_type: Any, topic: str, callback: Callable[[bytes], None], qos: Any
    ) -> Any:
        """Subscribe to a topic on the fast path.

        Args:
            node: the node that subscribes, already added to this executor.
            message_type: rosidl's class of the message.
            topic: name of the topic.
            callback: called with the serialised message.
            qos: quality of service.

        Returns:
            rclpy's subscription.
        """
        subscription = node.create_subscription(message_type, topic, callback, qos, raw=True)
        self._hot.append((subscription, message_type, callback))
        self._wait_set = None
        return subscription

    def spin_while(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Work until the condition no longer holds, or nothing hot has arrived for too long.

        Args:
            condition: asked after every round.
            timeout: wall-clock time without any hot message after which to give up, s.

        Returns:
            True when the condition has ended; False when the time was up.
        """
        last = time.monotonic()
        while condition():
            now = time.monotonic()
            if now >= self._next_housekeeping:
                self._housekeeping()
                self._next_housekeeping = time.monotonic() + HOUSEKEEPING_PERIOD
                continue
            if self._take_hot(self._next_housekeeping - now):
                last = now
            elif now - last > timeout:
                return False
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
            super().spin_once(timeout_sec=min(left, HOUSEKEEPING_PERIOD))
        return True

    def _take_hot(self, timeout: float) -> bool:
        """Wait for hot messages and hand them out; whether there were any."""
        wait_set = self._wait_set or self._build()
        wait_set.clear_entities()
        for subscription, _, _ in self._hot:
            wait_set.add_subscription(subscription.handle)
        wait_set.wait(int(timeout * _NANOSECONDS))
        ready = False
        for index, (subscription, message_type, callback) in enumerate(self._hot):
            if not wait_set.is_ready("subscription", index):
                continue
            taken = subscription.handle.take_message(message_type, True)
            if taken is not None:
                ready = True
                callback(taken[0])
        return ready

    def _build(self) -> Any:
        self._wait_set = _rclpy.WaitSet(len(self._hot), 0, 0, 0, 0, 0, self.context.handle)
        return self._wait_set

    def _housekeeping(self) -> None:
        """One round of the parent for each thing that waits there, without waiting."""
        super().spin_once(timeout_sec=0.0)
