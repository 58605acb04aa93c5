# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Names of nodes as a node of the same formation sees them, whatever namespace the formation is in."""

from typing import Any

UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"
"""Name that rmw gives to the node of an endpoint before it is discovered."""


def local_name(endpoint: Any, namespace: str) -> str:
    """Name of an endpoint's node as seen from a namespace.

    Two formations in one domain have nodes of the same names, and a few topics in common (`/clock`,
    `/diagnostics`): only a node of the own namespace is named without its namespace.

    Args:
        endpoint: as rclpy returns it for publishers and subscriptions.
        namespace: of the node that asks.

    Returns:
        The bare name of a node in that namespace; of any other its name from the root.
    """
    name = str(endpoint.node_name)
    if name == UNKNOWN_NODE or endpoint.node_namespace == namespace:
        return name
    return f"{endpoint.node_namespace.rstrip('/')}/{name}"
