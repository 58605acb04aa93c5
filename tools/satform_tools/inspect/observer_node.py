# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A node that only looks: it says nothing, keeps nobody waiting, and is seen by nobody as a satellite.

Its subscriptions are best effort with shallow queues, so that a publisher neither waits for it nor sends
it anything twice. What a publisher keeps for latecomers is only given to reliable subscriptions; those
are made on topics that are rarely spoken on, and dropped once they have been heard.
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

from satform.communication.topic_graph import OF_ALL_NAMESPACES, PLANT, in_namespace
from satform_bringup.deployment.domain import stay_on_this_machine
from satform_nodes.runtime.signals import interrupting
from satform_nodes.transport import topics
from satform_nodes.transport.node_names import local_name
from satform_tools.errors import CommandError
from satform_tools.inspect import target_domain
from satform_tools.inspect.discovered_graph import Ends, Graph, is_whole

_LOOK = 0.05
"""Wall-clock time between two looks at what is awaited, s."""

_CALM = 0.25
"""Wall-clock time without a new node or topic after which a graph without gaps counts as whole, s."""


def passing(depth: int) -> QoSProfile:
    """Quality of service of a subscription that takes what passes, and costs the publisher least."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )


def latched(depth: int) -> QoSProfile:
    """Quality of service of a subscription that also hears what was said before it came."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


_NO_LOG_FILE = ["--ros-args", "--disable-external-lib-logs"]
"""Whoever looks in leaves no file among the logs of ROS, for which there may be no home folder."""


class Looker:
    """A node in the domain of a formation.

    Attributes:
        node: rclpy's node; without log topic, parameters and their services.
        domain: DDS domain that it is in.
        patience: wall-clock time within which what is awaited has to be there, s.
        namespace: of the formation, such as `/f1`; empty for the root, None until it has been found.
    """

    def __init__(self, node: Node, domain: int, patience: float, namespace: str | None = None) -> None:
        self.node = node
        self.domain = domain
        self.patience = patience
        self.namespace = namespace
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)

    def wait(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Let messages in until a condition holds; returns whether it came to hold in time."""
        until = time.monotonic() + seconds
        while not condition():
            left = until - time.monotonic()
            if left <= 0.0:
                return False
            self._executor.spin_once(timeout_sec=min(left, _LOOK))
        return True

    def full_name(self, topic: str) -> str:
        """Full name of a topic of the formation.

        Args:
            topic: its name in the root namespace.
        """
        return in_namespace(topic, self.namespace or "")

    def require_formation(self) -> None:
        """Wait until a plant is there, which tells in which namespace the formation is.

        Raises:
            CommandError: there is none, or several and none of them was named.
        """
        if not self.wait(self._sees_plant, self.patience):
            raise CommandError(target_domain.nobody_flies(self.domain, self.namespace))

    def find_formation(self) -> None:
        """Wait until the formation flies and its nodes and topics have been found.

        Where some do not come, those that are there have to do.

        Raises:
            CommandError: no plant is there.
        """
        self.require_formation()
        heard: list[FormationStatus] = []
        with self.hearing(FormationStatus, self.full_name(topics.STATUS), heard.append):
            self.wait(self._graph_is_calm(heard), self.patience)

    def hear_status(self) -> FormationStatus:
        """The newest word about the whole formation.

        Raises:
            CommandError: no formation flies here.
        """
        self.require_formation()
        heard: list[FormationStatus] = []
        with self.hearing(FormationStatus, self.full_name(topics.STATUS), heard.append):
            if not self.wait(lambda: bool(heard), self.patience):
                raise CommandError(
                    f"the formation on domain {self.domain} has not begun to fly within {self.patience:g} s"
                )
        return heard[-1]

    @contextmanager
    def hearing(self, kind: Any, topic: str, callback: Callable[[Any], None]) -> Iterator[None]:
        """Hear what was last said on a topic of rare words, and what is said for the length of the block."""
        subscription = self.node.create_subscription(kind, topic, callback, latched(1))
        try:
            yield
        finally:
            self.node.destroy_subscription(subscription)

    def _sees_plant(self) -> bool:
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

    def plant_is_there(self) -> bool:
        """Whether the plant of the formation that has been found is still there."""
        return self.namespace in self._namespaces()

    def _namespaces(self) -> list[str]:
        """Namespaces in which a plant tells the status of its formation."""
        kind = "satform_msgs/msg/FormationStatus"
        found = []
        for topic, kinds in self.node.get_topic_names_and_types():
            space = topic.removesuffix(topics.STATUS)
            if kind not in kinds or space == topic:
                continue
            publishers = self.node.get_publishers_info_by_topic(topic)
            if any(local_name(publisher, space or "/") == PLANT for publisher in publishers):
                found.append(space)
        return sorted(found)

    def _graph_is_calm(self, heard: list[FormationStatus]) -> Callable[[], bool]:
        """Whether all nodes are there with all their topics, and nothing new has come for a moment."""
        seen: list[Any] = [None]
        since = [time.monotonic()]

        def calm() -> bool:
            now = time.monotonic()
            names = (sorted(self.node.get_topic_names_and_types()), sorted(self.node.get_node_names()))
            if names != seen[0]:
                seen[0], since[0] = names, now
            # The endpoints are asked for last: there are many of them.
            return now - since[0] >= _CALM and bool(heard) and is_whole(self._graph(), heard[-1])

        return calm

    def _graph(self) -> Graph:
        """What has been found by now, by the names that it has for the formation's own nodes."""
        node, space = self.node, self.namespace or ""

        def names(endpoints: list[Any]) -> list[str]:
            return sorted(local_name(entry, space or "/") for entry in endpoints)

        topics_there = [topic for topic, _ in node.get_topic_names_and_types()]
        own = [topic for topic in topics_there if topic in OF_ALL_NAMESPACES or topic.startswith(f"{space}/")]
        return Graph(
            frozenset(
                name for name, other in node.get_node_names_and_namespaces() if other.rstrip("/") == space
            ),
            {
                topic if topic in OF_ALL_NAMESPACES else topic.removeprefix(space): Ends(
                    names(node.get_publishers_info_by_topic(topic)),
                    names(node.get_subscriptions_info_by_topic(topic)),
                )
                for topic in own
            },
        )


@contextmanager
def looking(domain: int, patience: float, namespace: str | None = None) -> Iterator[Looker]:
    """Be in the domain of a formation for the length of the block.

    Args:
        domain: DDS domain.
        patience: wall-clock time within which what is awaited has to be there, s.
        namespace: of the formation that is looked for; None for the only one in the domain.

    Yields:
        The one who looks.
    """
    stay_on_this_machine()
    context = Context()
    # Python's own handling of Ctrl-C ends every wait here within a moment.
    rclpy.init(
        args=_NO_LOG_FILE, context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO
    )
    try:
        # One who vanishes without a word is spoken to for another 20 s by everyone it listened to.
        with interrupting():
            # An underscore hides a node from those who ask for the nodes of the formation.
            node = Node(
                f"_looker_{os.getpid()}",
                context=context,
                use_global_arguments=False,
                enable_rosout=False,
                start_parameter_services=False,
            )
            looker = Looker(node, domain, patience, namespace)
            try:
                yield looker
            finally:
                looker._executor.shutdown(timeout_sec=0.0)
                node.destroy_node()
    finally:
        context.try_shutdown()
