# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Matched endpoints: whether DDS has matched the endpoints of all required nodes, by node name.

Nothing waits here. The flight loops wait until all are matched: `plant.flight_loop` (which also waits until
every node has published that it is ready), `satellite.flight_loop` and `recorder.flight_loop`.
"""

from collections import Counter
from collections.abc import Collection
from typing import Any

from rclpy.node import Node

from satform_nodes.transport.authorised_publishers import AuthorisedPublishers
from satform_nodes.transport.node_names import local_name


class MatchedEndpoints:
    """The matched endpoints of a node's topics, by the names of the nodes that have them.

    A count of endpoints is not enough: an observer such as `ros2 topic echo` would be counted in place of a
    satellite that is not matched yet, and the first message to that satellite would be lost.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._missing: list[tuple[Any, AuthorisedPublishers | None, set[str]]] = []

    def require_publishers(
        self, subscription: Any, authorised: AuthorisedPublishers, names: Collection[str] | None = None
    ) -> None:
        """Require that nodes publish on a subscription's topic.

        Args:
            subscription: of the node.
            authorised: the authorised publishers there; matched endpoints are registered with them.
            names: of the required nodes; all authorised ones by default.
        """
        self._missing.append((subscription, authorised, set(authorised.expected if names is None else names)))

    def require_subscribers(self, publisher: Any, names: Collection[str]) -> None:
        """Require that these nodes subscribe to a publisher's topic."""
        self._missing.append((publisher, None, set(names)))

    def complete(self, lost: Collection[str] = ()) -> bool:
        """Whether all required endpoints are matched; those once matched are not checked again.

        Args:
            lost: names of nodes that are not waited for at present.
        """
        gone = set(lost)
        missing = [(end, authorised, names - gone) for end, authorised, names in self._missing]
        self._missing = [entry for entry in missing if not self._there(*entry)]
        return not self._missing

    def _there(self, endpoint: Any, authorised: AuthorisedPublishers | None, names: set[str]) -> bool:
        namespace = self._node.get_namespace()
        if authorised is None:
            if endpoint.get_subscription_count() < len(names):
                return False
            subscribers = self._node.get_subscriptions_info_by_topic(endpoint.topic_name)
            return names <= {local_name(other, namespace) for other in subscribers}
        if endpoint.get_publisher_count() < len(names):
            return False
        speaking = self._node.get_publishers_info_by_topic(endpoint.topic_name)
        found = Counter(local_name(other, namespace) for other in speaking)
        # Two writers of one node name cannot be distinguished before either has published.
        if any(found[name] != 1 for name in names):
            return False
        authorised.note_endpoints(speaking)
        return True
