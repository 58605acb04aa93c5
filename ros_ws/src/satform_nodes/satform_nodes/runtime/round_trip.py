# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The bare cost of a round trip over DDS on this machine: what every other figure is held against.

Two processes, one small message there and back, raw bytes, a cached wait set and nothing else. Run
as a program it is one of the two sides.
"""

import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from satform_msgs.msg import Command

from satform.communication import topic_table
from satform_nodes.runtime.signals import StopRequest
from satform_nodes.transport import qos
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.executor import StepExecutor

_COMMAND = layout(Command, topic_table.FRAME)
_MESSAGE = _COMMAND.pack(*(0 for _ in _COMMAND.fields))
_PING, _PONG = "/ping_pong/ping", "/ping_pong/pong"
_TIMEOUT = 20.0


@dataclass(frozen=True)
class RoundTrip:
    """What a round trip costs.

    Attributes:
        median: wall-clock time, s.
        count: number of round trips measured.
    """

    median: float
    count: int


def measure(count: int = 3000) -> RoundTrip:
    """Measure round trips between this process and another one.

    Args:
        count: number of round trips, after a tenth as many that do not count.

    Returns:
        Their median.

    Raises:
        RuntimeError: the other process does not answer.
    """
    other = subprocess.Popen([sys.executable, "-m", __name__])
    try:
        return _measure(count)
    finally:
        other.terminate()
        try:
            other.wait(_TIMEOUT)
        except subprocess.TimeoutExpired:
            other.kill()
            other.wait()


def _measure(count: int) -> RoundTrip:
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node("ping", context=context)
        executor = StepExecutor(context=context)
        executor.add_node(node)
        returned: list[float] = []
        publisher = node.create_publisher(Command, _PING, qos.LOCKSTEP)
        subscription = executor.subscribe(
            node, Command, _PONG, lambda _data, _number: returned.append(time.perf_counter()), qos.LOCKSTEP
        )
        both = _both_matched(publisher.get_subscription_count, subscription.get_publisher_count)
        # The first message from the other side shows that it has discovered this side, too.
        if not executor.spin_until(both, _TIMEOUT) or not executor.spin_while(lambda: not returned, _TIMEOUT):
            raise RuntimeError("the other side of the round trip has not appeared")
        times = []
        for _ in range(count + count // 10):
            returned.clear()
            sent = time.perf_counter()
            publisher.publish(_MESSAGE)
            if not executor.spin_while(lambda: not returned, _TIMEOUT):
                raise RuntimeError("the other side of the round trip does not answer")
            times.append(returned[0] - sent)
        node.destroy_node()
    finally:
        rclpy.shutdown(context=context)
    counted = times[count // 10 :]
    return RoundTrip(statistics.median(counted), len(counted))


def _both_matched(subscribers: Callable[[], int], publishers: Callable[[], int]) -> Callable[[], bool]:
    return lambda: subscribers() > 0 and publishers() > 0


def main() -> int:
    """The side that sends everything back, until it is ended."""
    stop = StopRequest()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = Node("pong")
    executor = StepExecutor()
    executor.add_node(node)
    publisher = node.create_publisher(Command, _PONG, qos.LOCKSTEP)
    subscription = executor.subscribe(
        node, Command, _PING, lambda data, _number: publisher.publish(data), qos.LOCKSTEP
    )
    both = _both_matched(publisher.get_subscription_count, subscription.get_publisher_count)
    if executor.spin_until(both, _TIMEOUT):
        publisher.publish(_MESSAGE)
        executor.spin_while(lambda: not stop.asked, _TIMEOUT)
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
