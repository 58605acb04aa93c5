# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What has been found of a formation from outside, and whether that is all of it.

Whoever comes to a flight finds its nodes and their endpoints one by one, in no order.
"""

from dataclasses import dataclass

from satform_msgs.msg import FormationStatus

from satform.communication.topic_graph import KINDS_OF_A_SATELLITE, PLANT, RECORDER, topic_name
from satform_nodes.transport import topics
from satform_nodes.transport.node_names import UNKNOWN_NODE


@dataclass(frozen=True)
class Ends:
    """Names of the nodes at the two ends of a topic, in order; a node stands there once for each endpoint."""

    speakers: list[str]
    listeners: list[str]


@dataclass(frozen=True)
class Graph:
    """Nodes and endpoints that have been found.

    Attributes:
        nodes: names of the nodes.
        ends: of each topic, by its name.
    """

    nodes: frozenset[str]
    ends: dict[str, Ends]


def is_whole(graph: Graph, status: FormationStatus) -> bool:
    """Whether each satellite that flies is there, is told its state, commands, and hears whom it should.

    Args:
        graph: what has been found.
        status: what the plant says about the formation.
    """
    names, ends_of = status.satellites, graph.ends
    flying = [name for name, alive in zip(names, status.alive, strict=True) if alive]
    own = {PLANT, RECORDER, *names}
    if any(not _is_found(ends, graph, own) for ends in ends_of.values()):
        return False
    recorders = [RECORDER] if RECORDER in graph.nodes else []
    spoken = {topics.STATUS: (PLANT, flying)}
    if recorders:
        spoken[topics.CLOCK] = (PLANT, [])
    for name in flying:
        spoken[topics.state(name)] = (PLANT, [name])
        spoken[topics.command(name)] = (name, [PLANT])
    # Of the rest, which depends on the scenario, whatever somebody says is recorded.
    about = {topic_name(kind, name) for kind in KINDS_OF_A_SATELLITE for name in flying}
    spoken |= {
        topic: (ends_of[topic].speakers[0], [])
        for topic in about & ends_of.keys() - spoken.keys()
        if own.intersection(ends_of[topic].speakers)
    }
    missing = Ends([], [])
    if any(
        speaker not in ends_of.get(topic, missing).speakers
        or not set(listeners + recorders).issubset(ends_of.get(topic, missing).listeners)
        for topic, (speaker, listeners) in spoken.items()
    ):
        return False
    edges = zip(status.edge_receivers, status.edge_senders, strict=True)
    return all(
        any(names[hears] in ends_of.get(topic, missing).listeners for topic in _words_of(names[heard]))
        for hears, heard in edges
        if names[hears] in flying and names[heard] in flying
    )


def _is_found(ends: Ends, graph: Graph, own: set[str]) -> bool:
    """Whether it is known whose the ends of a topic are, and whoever listens has someone to listen to."""
    there = {*ends.speakers, *ends.listeners}
    # An endpoint may be found before the node that it belongs to, and that before its name.
    if UNKNOWN_NODE in there or not graph.nodes >= own & there:
        return False
    # What others listen to that nobody says, a tool with a display for instance, is not the formation's.
    return bool(ends.speakers) or not own.intersection(ends.listeners)


def _words_of(satellite: str) -> tuple[str, str]:
    """Topics on which a satellite tells its neighbours of itself, one or the other."""
    return topics.arc_length(satellite), topics.motion(satellite)
