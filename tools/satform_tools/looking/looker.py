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

from satform_bringup.domain import stay_on_this_machine
from satform_nodes import topics
from satform_nodes.signals import interrupting
from satform_tools.faults import CommandError
from satform_tools.looking import where
from satform_tools.looking.found import Ends, Graph, is_whole

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


class Looker:
    """A node in the domain of a formation.

    Attributes:
        node: rclpy's node; without log topic, parameters and their services.
        domain: DDS domain that it is in.
        patience: wall-clock time within which what is awaited has to be there, s.
    """

    def __init__(self, node: Node, domain: int, patience: float) -> None:
        self.node = node
        self.domain = domain
        self.patience = patience
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

    def find_formation(self) -> None:
        """Wait until the formation flies and its nodes and topics have been found.

        Where some do not come, those that are there have to do.

        Raises:
            CommandError: no plant is there.
        """
        if not self.wait(self._sees_plant, self.patience):
            raise CommandError(where.nobody_flies(self.domain))
        heard: list[FormationStatus] = []
        with self.hearing(FormationStatus, topics.STATUS, heard.append):
            self.wait(self._graph_is_calm(heard), self.patience)

    def hear_status(self) -> FormationStatus:
        """The newest word about the whole formation.

        Raises:
            CommandError: no formation flies here.
        """
        heard: list[FormationStatus] = []
        if not self.wait(self._sees_plant, self.patience):
            raise CommandError(where.nobody_flies(self.domain))
        with self.hearing(FormationStatus, topics.STATUS, heard.append):
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
        publishers = self.node.get_publishers_info_by_topic(topics.STATUS)
        return any(publisher.node_name == "plant" for publisher in publishers)

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
        """What has been found by now."""
        node = self.node
        return Graph(
            frozenset(node.get_node_names()),
            {
                topic: Ends(
                    sorted(entry.node_name for entry in node.get_publishers_info_by_topic(topic)),
                    sorted(entry.node_name for entry in node.get_subscriptions_info_by_topic(topic)),
                )
                for topic, _ in node.get_topic_names_and_types()
            },
        )


@contextmanager
def looking(domain: int, patience: float) -> Iterator[Looker]:
    """Be in the domain of a formation for the length of the block.

    Args:
        domain: DDS domain.
        patience: wall-clock time within which what is awaited has to be there, s.

    Yields:
        The one who looks.
    """
    stay_on_this_machine()
    context = Context()
    # Python's own handling of Ctrl-C ends every wait here within a moment.
    rclpy.init(args=[], context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
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
            looker = Looker(node, domain, patience)
            try:
                yield looker
            finally:
                looker._executor.shutdown(timeout_sec=0.0)
                node.destroy_node()
    finally:
        context.try_shutdown()
