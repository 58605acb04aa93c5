"""Whether everyone a node talks to is there, by name, seen from this node's side."""

from collections import Counter
from collections.abc import Collection
from typing import Any

from rclpy.node import Node


class Company:
    """The nodes at the other ends of a node's topics.

    A count of endpoints would not do: someone looking in with `ros2 topic echo` would stand in for a
    satellite that is not there yet, and the first message to it would be lost.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._missing: list[tuple[Any, bool, set[str]]] = []

    def speaks(self, subscription: Any, names: Collection[str]) -> None:
        """Expect these nodes to publish on the subscription's topic."""
        self._missing.append((subscription, True, set(names)))

    def listens(self, publisher: Any, names: Collection[str]) -> None:
        """Expect these nodes to subscribe to the publisher's topic."""
        self._missing.append((publisher, False, set(names)))

    def complete(self, lost: Collection[str] = ()) -> bool:
        """Whether all of them are there; endpoints once found are not looked for again.

        Args:
            lost: nodes that are not to be waited for at present.
        """
        gone = set(lost)
        missing = [(end, speaking, names - gone) for end, speaking, names in self._missing]
        self._missing = [entry for entry in missing if not self._there(*entry)]
        return not self._missing

    def _there(self, endpoint: Any, speaking: bool, names: set[str]) -> bool:
        count = endpoint.get_publisher_count() if speaking else endpoint.get_subscription_count()
        if count < len(names):
            return False
        look = (
            self._node.get_publishers_info_by_topic
            if speaking
            else self._node.get_subscriptions_info_by_topic
        )
        found = Counter(other.node_name for other in look(endpoint.topic_name))
        # Two writers with one name cannot be told apart before either has spoken.
        return all(found[name] == 1 if speaking else found[name] >= 1 for name in names)
