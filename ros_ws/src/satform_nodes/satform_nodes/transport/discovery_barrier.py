# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether everyone a node talks to is there, by name, seen from this node's side."""

from collections import Counter
from collections.abc import Collection
from typing import Any

from rclpy.node import Node

from satform_nodes.transport.authorised_publishers import Speakers
from satform_nodes.transport.node_names import local_name


class Company:
    """The nodes at the other ends of a node's topics.

    A count of endpoints would not do: someone looking in with `ros2 topic echo` would stand in for a
    satellite that is not there yet, and the first message to it would be lost.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._missing: list[tuple[Any, Speakers | None, set[str]]] = []

    def is_used_by_neighbours(
        self, subscription: Any, speakers: Speakers, names: Collection[str] | None = None
    ) -> None:
        """Expect nodes to publish on the subscription's topic.

        Args:
            subscription: of the node.
            speakers: who is believed there; they are told whose the writers are that have been found.
            names: of those who are expected; all who are believed when left out.
        """
        self._missing.append((subscription, speakers, set(speakers.expected if names is None else names)))

    def listens(self, publisher: Any, names: Collection[str]) -> None:
        """Expect these nodes to subscribe to the publisher's topic."""
        self._missing.append((publisher, None, set(names)))

    def complete(self, lost: Collection[str] = ()) -> bool:
        """Whether all of them are there; endpoints once found are not looked for again.

        Args:
            lost: nodes that are not to be waited for at present.
        """
        gone = set(lost)
        missing = [(end, speakers, names - gone) for end, speakers, names in self._missing]
        self._missing = [entry for entry in missing if not self._there(*entry)]
        return not self._missing

    def _there(self, endpoint: Any, speakers: Speakers | None, names: set[str]) -> bool:
        namespace = self._node.get_namespace()
        if speakers is None:
            if endpoint.get_subscription_count() < len(names):
                return False
            listening = self._node.get_subscriptions_info_by_topic(endpoint.topic_name)
            return names <= {local_name(other, namespace) for other in listening}
        if endpoint.get_publisher_count() < len(names):
            return False
        speaking = self._node.get_publishers_info_by_topic(endpoint.topic_name)
        found = Counter(local_name(other, namespace) for other in speaking)
        # Two writers with one name cannot be told apart before either has spoken.
        if any(found[name] != 1 for name in names):
            return False
        speakers.introduce(speaking)
        return True
