"""What has been found of a formation from outside, and whether that is all of it.

Whoever comes to a flight finds its nodes and their endpoints one by one, in no order.
"""

from dataclasses import dataclass

from satform_msgs.msg import FormationStatus

from satform.channels import PLANT, RECORDER
from satform_nodes import topics
from satform_nodes.speakers import UNKNOWN_NODE


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
    """Whether each satellite that flies is there with its topics, and hears and is heard as it should.

    Args:
        graph: what has been found.
        status: what the plant says about the formation.
    """
    names, nobody = status.satellites, Ends([], [])
    flying = {name for name, alive in zip(names, status.alive, strict=True) if alive}
    # A satellite's subscription to the status is made last of all.
    if not flying.issubset(graph.ends.get(topics.STATUS, nobody).listeners):
        return False
    own = {PLANT, RECORDER, *names}
    for topic, ends in graph.ends.items():
        there = {*ends.speakers, *ends.listeners}
        # An endpoint may be found before the node that it belongs to, and that before its name.
        if UNKNOWN_NODE in there or not graph.nodes >= own & there:
            return False
        # What others listen to that nobody says, a tool with a display for instance, is not the formation's.
        if own.intersection(ends.listeners) and not ends.speakers:
            return False
        unheard = RECORDER in graph.nodes and RECORDER not in ends.listeners
        if unheard and flying.intersection(ends.speakers) and _is_recorded(topic):
            return False
    edges = (
        (names[hears], names[heard]) for hears, heard in zip(status.listeners, status.speakers, strict=True)
    )
    return all(
        any(
            hears in graph.ends.get(topic, nobody).listeners
            for topic in (topics.arc_length(heard), topics.motion(heard))
        )
        for hears, heard in edges
        if {hears, heard} <= flying
    )


def _is_recorded(topic: str) -> bool:
    """Whether a recorder, where there is one, hears what satellites say on a topic."""
    return topic.rpartition("/")[2] in ("arc_length", "motion", "command", "tracking", "parameter_changes")
