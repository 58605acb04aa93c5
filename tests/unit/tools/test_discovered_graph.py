# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""One who looks goes by what has been found only when nothing of the formation is missing."""

from dataclasses import replace

import pytest
from satform_msgs.msg import FormationStatus

from satform_nodes.transport.node_names import UNKNOWN_NODE
from satform_tools.inspect.discovered_graph import Ends, Graph, is_whole

STATUS = FormationStatus(satellites=["a", "b"], alive=[True, True], edge_receivers=[1], edge_senders=[0])
"""Two satellites, of which the second hears the first."""

WHOLE = Graph(
    frozenset({"plant", "recorder", "a", "b"}),
    {
        "/formation/status": Ends(["plant"], ["a", "b", "recorder"]),
        "/clock": Ends(["plant"], ["recorder"]),
        "/a/state": Ends(["plant"], ["a", "recorder"]),
        "/b/state": Ends(["plant"], ["b", "recorder"]),
        "/a/arc_length": Ends(["a"], ["b", "recorder"]),
        "/b/arc_length": Ends(["b"], ["recorder"]),
        "/a/command": Ends(["a"], ["plant", "recorder"]),
        "/b/command": Ends(["b"], ["plant", "recorder"]),
        "/b/tracking": Ends(["b"], ["recorder"]),
    },
)


def with_ends(topic: str, speakers: list[str], listeners: list[str]) -> Graph:
    return replace(WHOLE, ends={**WHOLE.ends, topic: Ends(speakers, listeners)})


def test_what_has_everyone_is_whole_with_a_recorder_and_without() -> None:
    assert is_whole(WHOLE, STATUS)
    without = Graph(
        WHOLE.nodes - {"recorder"},
        {
            topic: Ends(ends.speakers, [name for name in ends.listeners if name != "recorder"])
            for topic, ends in WHOLE.ends.items()
        },
    )
    assert is_whole(without, STATUS)


def without(topic: str) -> Graph:
    return replace(WHOLE, ends={name: ends for name, ends in WHOLE.ends.items() if name != topic})


INCOMPLETE = {
    "nothing": Graph(WHOLE.nodes, {}),
    "a satellite does not hear the plant yet": with_ends("/formation/status", ["plant"], ["a", "recorder"]),
    "a neighbour does not hear yet": with_ends("/a/arc_length", ["a"], ["recorder"]),
    "the recorder does not hear a satellite yet": with_ends("/a/arc_length", ["a"], ["b"]),
    "the recorder hears nobody yet on a topic": with_ends("/b/arc_length", ["b"], []),
    "the recorder does not hear the tracking yet": with_ends("/b/tracking", ["b"], []),
    "the recorder does not hear the plant yet": with_ends("/a/state", ["plant"], ["a"]),
    "the recorder does not hear the clock yet": with_ends("/clock", ["plant"], []),
    "the plant does not speak yet": with_ends("/a/state", [], ["a", "recorder"]),
    "the plant does not hear yet": with_ends("/a/command", ["a"], ["recorder"]),
    "a satellite is not told its state yet": without("/b/state"),
    "a satellite does not command yet": without("/b/command"),
    "an end of nobody": with_ends("/a/command", ["a", UNKNOWN_NODE], ["plant", "recorder"]),
    "a node without its name": replace(WHOLE, nodes=WHOLE.nodes - {"b"}),
}


@pytest.mark.parametrize("found", INCOMPLETE.values(), ids=INCOMPLETE)
def test_what_misses_something_is_not(found: Graph) -> None:
    assert not is_whole(found, STATUS)


def test_a_lost_satellite_is_not_waited_for() -> None:
    lost = FormationStatus(satellites=["a", "b"], alive=[True, False], edge_receivers=[1], edge_senders=[0])
    ends = {topic: WHOLE.ends[topic] for topic in ("/clock", "/a/state", "/a/command")} | {
        "/formation/status": Ends(["plant"], ["a", "recorder"]),
        "/a/arc_length": Ends(["a"], ["recorder"]),
    }
    assert is_whole(Graph(WHOLE.nodes - {"b"}, ends), lost)


def test_what_strangers_listen_to_and_nobody_says_keeps_nobody_waiting() -> None:
    assert is_whole(with_ends("/goal_pose", [], ["rviz"]), STATUS)
    assert is_whole(with_ends("/a/pose", ["display"], []), STATUS)
