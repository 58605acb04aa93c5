# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""An observer uses a discovered graph only when nothing of the formation is missing."""

from dataclasses import replace

import pytest
from satform_msgs.msg import FormationStatus

from satform_nodes.transport.node_names import UNKNOWN_NODE
from satform_tools.inspect.discovered_graph import DiscoveredGraph, Endpoints, is_complete

STATUS = FormationStatus(satellites=["a", "b"], alive=[True, True], edge_receivers=[1], edge_senders=[0])
"""Two satellites, of which the second receives from the first."""

WHOLE = DiscoveredGraph(
    frozenset({"plant", "recorder", "a", "b"}),
    {
        "/formation/status": Endpoints(["plant"], ["a", "b", "recorder"]),
        "/clock": Endpoints(["plant"], ["recorder"]),
        "/a/state": Endpoints(["plant"], ["a", "recorder"]),
        "/b/state": Endpoints(["plant"], ["b", "recorder"]),
        "/a/arc_length": Endpoints(["a"], ["b", "recorder"]),
        "/b/arc_length": Endpoints(["b"], ["recorder"]),
        "/a/command": Endpoints(["a"], ["plant", "recorder"]),
        "/b/command": Endpoints(["b"], ["plant", "recorder"]),
        "/b/tracking": Endpoints(["b"], ["recorder"]),
    },
)


def with_ends(topic: str, publishers: list[str], subscribers: list[str]) -> DiscoveredGraph:
    return replace(WHOLE, ends={**WHOLE.ends, topic: Endpoints(publishers, subscribers)})


def test_what_has_everyone_is_whole_with_a_recorder_and_without() -> None:
    assert is_complete(WHOLE, STATUS)
    without = DiscoveredGraph(
        WHOLE.nodes - {"recorder"},
        {
            topic: Endpoints(ends.publishers, [name for name in ends.subscribers if name != "recorder"])
            for topic, ends in WHOLE.ends.items()
        },
    )
    assert is_complete(without, STATUS)


def without(topic: str) -> DiscoveredGraph:
    return replace(WHOLE, ends={name: ends for name, ends in WHOLE.ends.items() if name != topic})


INCOMPLETE = {
    "nothing": DiscoveredGraph(WHOLE.nodes, {}),
    "a satellite does not receive the status yet": with_ends(
        "/formation/status", ["plant"], ["a", "recorder"]
    ),
    "a neighbour has not subscribed yet": with_ends("/a/arc_length", ["a"], ["recorder"]),
    "the recorder has not subscribed to a satellite yet": with_ends("/a/arc_length", ["a"], ["b"]),
    "the recorder has not subscribed to a topic yet": with_ends("/b/arc_length", ["b"], []),
    "the recorder has not subscribed to the tracking yet": with_ends("/b/tracking", ["b"], []),
    "the recorder has not subscribed to the plant yet": with_ends("/a/state", ["plant"], ["a"]),
    "the recorder has not subscribed to the clock yet": with_ends("/clock", ["plant"], []),
    "the plant does not publish yet": with_ends("/a/state", [], ["a", "recorder"]),
    "the plant has not subscribed yet": with_ends("/a/command", ["a"], ["recorder"]),
    "a satellite has no state topic yet": without("/b/state"),
    "a satellite does not command yet": without("/b/command"),
    "an endpoint of an unknown node": with_ends("/a/command", ["a", UNKNOWN_NODE], ["plant", "recorder"]),
    "a node without its name": replace(WHOLE, nodes=WHOLE.nodes - {"b"}),
}


@pytest.mark.parametrize("found", INCOMPLETE.values(), ids=INCOMPLETE)
def test_an_incomplete_graph_is_not_complete(found: DiscoveredGraph) -> None:
    assert not is_complete(found, STATUS)


def test_a_lost_satellite_is_not_waited_for() -> None:
    lost = FormationStatus(satellites=["a", "b"], alive=[True, False], edge_receivers=[1], edge_senders=[0])
    ends = {topic: WHOLE.ends[topic] for topic in ("/clock", "/a/state", "/a/command")} | {
        "/formation/status": Endpoints(["plant"], ["a", "recorder"]),
        "/a/arc_length": Endpoints(["a"], ["recorder"]),
    }
    assert is_complete(DiscoveredGraph(WHOLE.nodes - {"b"}, ends), lost)


def test_topics_of_other_tools_are_not_waited_for() -> None:
    assert is_complete(with_ends("/goal_pose", [], ["rviz"]), STATUS)
    assert is_complete(with_ends("/a/pose", ["display"], []), STATUS)
