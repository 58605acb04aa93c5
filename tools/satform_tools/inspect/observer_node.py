# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Observer node: subscribes to a running formation without any effect on its flight.

Its subscriptions are best effort with short queues, so that no publisher waits for it or retransmits to it.
Latched messages reach reliable subscriptions only; those are made on topics with rare messages, and
destroyed once a message has been received.
"""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from satform_msgs.msg import FormationStatus

from satform.communication import topic_table
from satform.communication.topic_table import OF_ALL_NAMESPACES, PLANT, in_namespace
from satform_bringup.deployment.domain_lock import stay_on_this_machine
from satform_nodes.runtime.signals import interrupting
from satform_nodes.transport.node_names import local_name
from satform_tools.errors import CommandError
from satform_tools.inspect import target_domain
from satform_tools.inspect.discovered_graph import DiscoveredGraph, Endpoints, is_complete

_POLL_PERIOD = 0.05
"""Wall-clock time between two checks of a condition, s."""

_SETTLING_TIME = 0.25
"""Wall-clock time without a new node or topic after which a complete graph counts as final, s."""


def best_effort(depth: int) -> QoSProfile:
    """QoS of a subscription that publishers neither wait for nor retransmit to."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )


def latched(depth: int) -> QoSProfile:
    """QoS of a subscription that also receives the last messages published before it."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


_NO_LOG_FILE = ["--ros-args", "--disable-external-lib-logs"]
"""An observer writes no log file, for which there may be no home folder."""


class Observer:
    """A node in the domain of a formation.

    Attributes:
        node: of rclpy, without log topic, parameters and their services.
        domain: DDS domain that it is in.
        timeout: wall-clock time to wait for what is asked for, s.
        namespace: of the formation, such as `/f1`; empty for the root, None until it has been found.
    """

    def __init__(self, node: Node, domain: int, timeout: float, namespace: str | None = None) -> None:
        self.node = node
        self.domain = domain
        self.timeout = timeout
        self.namespace = namespace
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)

    def wait(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Process messages until a condition holds; returns whether it holds within the time."""
        until = time.monotonic() + seconds
        while not condition():
            left = until - time.monotonic()
            if left <= 0.0:
                return False
            self._executor.spin_once(timeout_sec=min(left, _POLL_PERIOD))
        return True

    def poll(self) -> None:
        """Process what is there, such as the response of a service; returns at once."""
        self._executor.spin_once(timeout_sec=0.0)

    def full_name(self, topic: str) -> str:
        """Full name of a topic of the formation.

        Args:
            topic: its name in the root namespace.
        """
        return in_namespace(topic, self.namespace or "")

    def require_formation(self) -> None:
        """Wait until a plant is discovered, which gives the namespace of the formation.

        Raises:
            CommandError: there is none, or several and none of them was named.
        """
        if not self.wait(self._finds_plant, self.timeout):
            raise CommandError(target_domain.no_formation_sentence(self.domain, self.namespace))

    def find_formation(self) -> None:
        """Wait until the formation flies and its nodes and topics have been discovered, at most the timeout.

        Raises:
            CommandError: no plant is discovered.
        """
        self.require_formation()
        received: list[FormationStatus] = []
        with self.latched_subscription(FormationStatus, self.full_name(topic_table.STATUS), received.append):
            self.wait(self._graph_is_settled(received), self.timeout)

    def latest_status(self) -> FormationStatus:
        """The newest status of the formation.

        Raises:
            CommandError: no formation flies here.
        """
        self.require_formation()
        received: list[FormationStatus] = []
        with self.latched_subscription(FormationStatus, self.full_name(topic_table.STATUS), received.append):
            if not self.wait(lambda: bool(received), self.timeout):
                raise CommandError(
                    f"the formation on domain {self.domain} has not begun to fly within {self.timeout:g} s"
                )
        return received[-1]

    @contextmanager
    def latched_subscription(self, kind: Any, topic: str, callback: Callable[[Any], None]) -> Iterator[None]:
        """Subscribe to a latched topic, its last message included, for the length of the block."""
        subscription = self.node.create_subscription(kind, topic, callback, latched(1))
        try:
            yield
        finally:
            self.node.destroy_subscription(subscription)

    def _finds_plant(self) -> bool:
        found = [space for space in self._namespaces() if self.namespace in (None, space)]
        if len(found) > 1:
            raise CommandError(
                f"{len(found)} formations fly on domain {self.domain}, in the namespaces "
                f"{', '.join(space or '/' for space in found)}; name one with --namespace"
            )
        if not found:
            return False
        self.namespace = found[0]
        return True

    def plant_exists(self) -> bool:
        """Whether the plant of the formation still exists."""
        return self.namespace in self._namespaces()

    def _namespaces(self) -> list[str]:
        """Namespaces in which a plant publishes the status of its formation."""
        kind = "satform_msgs/msg/FormationStatus"
        found = []
        for topic, kinds in self.node.get_topic_names_and_types():
            space = topic.removesuffix(topic_table.STATUS)
            if kind not in kinds or space == topic:
                continue
            publishers = self.node.get_publishers_info_by_topic(topic)
            if any(local_name(publisher, space or "/") == PLANT for publisher in publishers):
                found.append(space)
        return sorted(found)

    def _graph_is_settled(self, received: list[FormationStatus]) -> Callable[[], bool]:
        """A condition: all nodes and topics are discovered, and nothing new has appeared for a moment."""
        previous: list[Any] = [None]
        since = [time.monotonic()]

        def settled() -> bool:
            now = time.monotonic()
            names = (sorted(self.node.get_topic_names_and_types()), sorted(self.node.get_node_names()))
            if names != previous[0]:
                previous[0], since[0] = names, now
            # The endpoints are asked for last: there are many of them.
            return (
                now - since[0] >= _SETTLING_TIME
                and bool(received)
                and is_complete(self._graph(), received[-1])
            )

        return settled

    def _graph(self) -> DiscoveredGraph:
        """The graph discovered so far, by names as in the root namespace."""
        node, space = self.node, self.namespace or ""

        def names(endpoints: list[Any]) -> list[str]:
            return sorted(local_name(entry, space or "/") for entry in endpoints)

        topics_there = [topic for topic, _ in node.get_topic_names_and_types()]
        own = [topic for topic in topics_there if topic in OF_ALL_NAMESPACES or topic.startswith(f"{space}/")]
        return DiscoveredGraph(
            frozenset(
                name for name, other in node.get_node_names_and_namespaces() if other.rstrip("/") == space
            ),
            {
                topic if topic in OF_ALL_NAMESPACES else topic.removeprefix(space): Endpoints(
                    names(node.get_publishers_info_by_topic(topic)),
                    names(node.get_subscriptions_info_by_topic(topic)),
                )
                for topic in own
            },
        )


@contextmanager
def observe(domain: int, timeout: float, namespace: str | None = None) -> Iterator[Observer]:
    """Create an observer node in the domain of a formation, for the length of the block.

    Args:
        domain: DDS domain.
        timeout: wall-clock time to wait for what is asked for, s.
        namespace: of the formation; None for the only one in the domain.

    Yields:
        The observer.
    """
    stay_on_this_machine()
    context = Context()
    # Python's own handling of Ctrl-C ends every wait here within a moment.
    rclpy.init(
        args=_NO_LOG_FILE, context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO
    )
    try:
        # Publishers keep sending to a participant that ends without leaving, for another 20 s.
        with interrupting():
            # The underscore hides it from tools that list nodes.
            node = Node(
                f"_observer_{os.getpid()}",
                context=context,
                use_global_arguments=False,
                enable_rosout=False,
                start_parameter_services=False,
            )
            observer = Observer(node, domain, timeout, namespace)
            try:
                yield observer
            finally:
                observer._executor.shutdown(timeout_sec=0.0)
                node.destroy_node()
    finally:
        context.try_shutdown()
