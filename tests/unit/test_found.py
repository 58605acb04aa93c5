"""One who looks goes by what has been found only when nothing of the formation is missing."""

from dataclasses import replace

import pytest
from satform_msgs.msg import FormationStatus

from satform_nodes.speakers import UNKNOWN_NODE
from satform_tools.looking.found import Ends, Graph, is_whole

STATUS = FormationStatus(satellites=["a", "b"], alive=[True, True], listeners=[1], speakers=[0])
"""Two satellites, of which the second hears the first."""

WHOLE = Graph(
    frozenset({"plant", "recorder", "a", "b"}),
    {
        "/formation/status": Ends(["plant"], ["a", "b", "recorder"]),
        "/a/state": Ends(["plant"], ["a", "recorder"]),
        "/a/arc_length": Ends(["a"], ["b", "recorder"]),
        "/b/arc_length": Ends(["b"], ["recorder"]),
        "/a/command": Ends(["a"], ["plant", "recorder"]),
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


@pytest.mark.parametrize(
    "found",
    [
        Graph(WHOLE.nodes, {}),
        with_ends("/formation/status", ["plant"], ["a", "recorder"]),
        with_ends("/a/arc_length", ["a"], ["recorder"]),
        with_ends("/a/arc_length", ["a"], ["b"]),
        with_ends("/b/arc_length", ["b"], []),
        with_ends("/a/state", [], ["a", "recorder"]),
        with_ends("/a/command", [UNKNOWN_NODE], ["plant", "recorder"]),
        replace(WHOLE, nodes=WHOLE.nodes - {"b"}),
    ],
    ids=[
        "nothing",
        "a satellite that does not hear the plant yet",
        "a neighbour that is not heard yet",
        "a recorder that hears only some",
        "a recorder that hears the other",
        "a speaker that is not there yet",
        "an end of nobody",
        "a node without its name",
    ],
)
def test_what_misses_something_is_not(found: Graph) -> None:
    assert not is_whole(found, STATUS)


def test_a_lost_satellite_is_not_waited_for() -> None:
    lost = FormationStatus(satellites=["a", "b"], alive=[True, False], listeners=[1], speakers=[0])
    ends = {
        "/formation/status": Ends(["plant"], ["a", "recorder"]),
        "/a/arc_length": Ends(["a"], ["recorder"]),
    }
    assert is_whole(Graph(WHOLE.nodes - {"b"}, ends), lost)


def test_what_strangers_listen_to_and_nobody_says_keeps_nobody_waiting() -> None:
    assert is_whole(with_ends("/goal_pose", [], ["rviz"]), STATUS)
    assert is_whole(with_ends("/a/pose", ["display"], []), STATUS)
