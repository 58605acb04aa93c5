# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes and endpoints of a formation that discovery has found so far, and whether they are complete.

An observer that joins a running flight discovers its nodes and endpoints one by one, in no order.
"""

from dataclasses import dataclass

from satform_msgs.msg import FormationStatus

from satform.communication import topic_table
from satform.communication.topic_table import KINDS_OF_A_SATELLITE, PLANT, RECORDER, topic_name
from satform_nodes.transport.node_names import UNKNOWN_NODE


@dataclass(frozen=True)
class Endpoints:
    """Names of the nodes that publish and subscribe on a topic, sorted, once for each endpoint."""

    publishers: list[str]
    subscribers: list[str]


@dataclass(frozen=True)
class DiscoveredGraph:
    """Nodes and endpoints that have been found.

    Attributes:
        nodes: names of the nodes.
        ends: of each topic, by its name.
    """

    nodes: frozenset[str]
    ends: dict[str, Endpoints]


def is_complete(graph: DiscoveredGraph, status: FormationStatus) -> bool:
    """Whether all endpoints of the satellites that fly are found: states, commands, edges of the graph.

    Args:
        graph: what has been found.
        status: of the formation, from the plant.
    """
    names, endpoints_of = status.satellites, graph.ends
    flying = [name for name, alive in zip(names, status.alive, strict=True) if alive]
    own = {PLANT, RECORDER, *names}
    if any(not _is_found(ends, graph, own) for ends in endpoints_of.values()):
        return False
    recorders = [RECORDER] if RECORDER in graph.nodes else []
    expected = {topic_table.STATUS: (PLANT, flying)}
    if recorders:
        expected[topic_table.CLOCK] = (PLANT, [])
    for name in flying:
        expected[topic_name("state", name)] = (PLANT, [name])
        expected[topic_name("command", name)] = (name, [PLANT])
    # All other topics of satellites, which depend on the scenario, are recorded once they have a publisher.
    about = {topic_name(kind, name) for kind in KINDS_OF_A_SATELLITE for name in flying}
    expected |= {
        topic: (endpoints_of[topic].publishers[0], [])
        for topic in about & endpoints_of.keys() - expected.keys()
        if own.intersection(endpoints_of[topic].publishers)
    }
    missing = Endpoints([], [])
    if any(
        sender not in endpoints_of.get(topic, missing).publishers
        or not set(subscribers + recorders).issubset(endpoints_of.get(topic, missing).subscribers)
        for topic, (sender, subscribers) in expected.items()
    ):
        return False
    return all(
        any(
            names[receiver] in endpoints_of.get(topic, missing).subscribers
            for topic in _announcement_topics(names[sender])
        )
        for receiver, sender in zip(status.edge_receivers, status.edge_senders, strict=True)
        if names[receiver] in flying and names[sender] in flying
    )


def _is_found(ends: Endpoints, graph: DiscoveredGraph, own: set[str]) -> bool:
    """Whether the nodes of a topic's endpoints are known, and its subscribers have a publisher."""
    there = {*ends.publishers, *ends.subscribers}
    # An endpoint may be found before the node that it belongs to, and that before its name.
    if UNKNOWN_NODE in there or not graph.nodes >= own & there:
        return False
    # A topic that only other tools subscribe to, such as a display, is not the formation's.
    return bool(ends.publishers) or not own.intersection(ends.subscribers)


def _announcement_topics(satellite: str) -> tuple[str, str]:
    """Topics of which a satellite publishes one for its neighbours."""
    return topic_name("arc_length", satellite), topic_name("motion", satellite)
