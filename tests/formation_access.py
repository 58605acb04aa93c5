# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What each node of a formation may publish and subscribe to, written down from the pages on them.

Names are those of DDS, as the ROS 2 design "Topic and Service name mapping to DDS" has them. Nothing here is
computed by the code that writes permissions.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

DISCOVERY = "ros_discovery_info"

OF_THE_PLANT = frozenset(
    {"state", "measurements", "truth", "orbit_state", "attitude", "link_conditions", "propulsion"}
)
"""Kinds of topics about a satellite that the plant publishes; all others are the satellite's own."""

READ_BY_ITS_SATELLITE = frozenset({"state", "measurements", "attitude", "link_conditions"})

READ_BY_NEIGHBOURS = frozenset({"arc_length", "motion", "navigation_estimate"})

READ_BY_THE_PLANT = READ_BY_NEIGHBOURS | {"command"}
"""In a step that does not go on the plant watches what satellites wait for."""

SERVICES_OF_A_NODE = (
    *("describe_parameters", "get_parameter_types", "get_parameters", "get_type_description"),
    *("list_parameters", "set_parameters", "set_parameters_atomically"),
)

SERVICES_OF_THE_FORMATION = (
    *("pause", "resume", "step", "stop", "set_graph"),
    *("reconfigure/_action/send_goal", "reconfigure/_action/cancel_goal", "reconfigure/_action/get_result"),
)


@dataclass
class Permitted:
    """DDS topics of a node.

    Attributes:
        publish: that it may publish.
        subscribe: to which it may subscribe.
    """

    publish: set[str] = field(default_factory=lambda: {DISCOVERY, "rt/parameter_events", "rt/rosout"})
    subscribe: set[str] = field(default_factory=lambda: {DISCOVERY})

    def of(self, kind: str) -> set[str]:
        """The topics of a kind of endpoint, publish or subscribe."""
        return self.publish if kind == "publish" else self.subscribe


def permitted(kinds: Iterable[str], heard: Mapping[str, str]) -> dict[str, Permitted]:
    """What each node may do.

    Args:
        kinds: of the topics that each satellite has.
        heard: for each satellite the names of those whose phases it may read, with spaces between them.
    """
    nodes = {name: Permitted() for name in ("plant", *heard, "recorder", "operator")}
    for name in heard:
        for kind in kinds:
            topic = f"rt/{name}/{kind}"
            nodes["plant" if kind in OF_THE_PLANT else name].publish.add(topic)
            nodes["recorder"].subscribe.add(topic)
            readers = {other for other in heard if name in heard[other].split()}
            if kind in READ_BY_NEIGHBOURS:
                for reader in readers:
                    nodes[reader].subscribe.add(topic)
            if kind in READ_BY_ITS_SATELLITE:
                nodes[name].subscribe.add(topic)
            if kind in READ_BY_THE_PLANT:
                nodes["plant"].subscribe.add(topic)
    _add_topics_of_the_formation(nodes, tuple(heard))
    _add_services(nodes)
    for topic in set().union(*(node.publish for node in nodes.values())):
        if topic.startswith("rt/"):
            nodes["operator"].subscribe.add(topic)
    return nodes


def _add_topics_of_the_formation(nodes: dict[str, Permitted], satellites: tuple[str, ...]) -> None:
    action = {"rt/formation/reconfigure/_action/feedback", "rt/formation/reconfigure/_action/status"}
    nodes["plant"].publish |= {"rt/clock", "rt/formation/status", "rt/diagnostics", *action}
    nodes["plant"].subscribe |= {"rt/formation/node_ready", "rt/formation/recorder_progress"}
    nodes["recorder"].publish.add("rt/formation/recorder_progress")
    nodes["recorder"].subscribe |= {"rt/clock", "rt/diagnostics"}
    for name in (*satellites, "recorder"):
        nodes[name].publish |= {"rt/formation/node_ready", "rt/diagnostics"}
        nodes[name].subscribe.add("rt/formation/status")


def _add_services(nodes: dict[str, Permitted]) -> None:
    for name, node in nodes.items():
        if name == "operator":
            continue
        services = [f"{name}/{service}" for service in SERVICES_OF_A_NODE]
        if name == "plant":
            services += [f"formation/{service}" for service in SERVICES_OF_THE_FORMATION]
        for service in services:
            request, reply = f"rq/{service}Request", f"rr/{service}Reply"
            node.subscribe.add(request)
            node.publish.add(reply)
            nodes["operator"].publish.add(request)
            nodes["operator"].subscribe.add(reply)
