# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What happened in a flight, from the messages that tell of it."""

from pathlib import Path

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from satform_msgs.msg import FormationStatus, ParameterChange

from flights import shortened
from satform.bag.events import CHANGE_TYPE, STATUS_TYPE, EventError, Events, read_events
from satform.bag.message_types import TopicMessages
from satform.communication import topic_table
from satform.communication.topic_table import topic_name
from satform.flight.simulate import simulate
from satform.plot.style import Unit
from satform_nodes.transport.message_definitions import definition
from satform_tools.report.event_log import flight_events, graph_states
from satform_tools.report.page.charts import graph_charts
from satform_tools.run.stored_run import StoredRun

NAMES = ["sat1", "sat2", "sat3"]
COMPLETE = {"edge_receivers": [0, 0, 1, 1, 2, 2], "edge_senders": [1, 2, 0, 2, 0, 1]}
STATUS_TEXT = definition(FormationStatus)


def status(step: int, alive: list[bool], reason: str = "", phase: int = FormationStatus.FLYING) -> bytes:
    living = sum(alive)
    said = FormationStatus(
        step=step,
        phase=phase,
        last_step=40,
        satellites=NAMES,
        alive=alive,
        **COMPLETE,
        # Of a complete graph of n it is n.
        algebraic_connectivity=float(living),
        reason=reason,
    )
    return bytes(serialize_message(said))


def told(*messages: bytes) -> TopicMessages:
    return TopicMessages(topic_table.STATUS, STATUS_TYPE, STATUS_TEXT, messages)


@pytest.fixture
def events() -> Events:
    """A satellite is lost and comes back, a gain is changed, and the flight is broken off."""
    change = ParameterChange(step=15, name="controller.switching_gain", value=[0.1, 0.2, 0.3])
    gains = TopicMessages(
        topic_name("parameter_changes", "sat3"),
        CHANGE_TYPE,
        definition(ParameterChange),
        (bytes(serialize_message(change)),),
    )
    everyone = [True, True, True]
    return read_events(
        [
            gains,
            told(
                status(0, everyone),
                status(10, [True, False, True], "no answer within 10 s"),
                status(20, everyone),
                status(30, everyone, "asked to stop", FormationStatus.ABORTED),
            ),
        ]
    )


@pytest.fixture
def kept(events: Events) -> StoredRun:
    scenario = shortened("triangle", 20.0)
    return StoredRun(Path("bag"), scenario, simulate(scenario), True, {}, events)


def test_events_are_what_the_nodes_said(events: Events) -> None:
    assert [entry.step for entry in events.statuses] == [0, 10, 20, 30]
    assert [entry.phase for entry in events.statuses] == ["flying", "flying", "flying", "aborted"]
    assert events.statuses[1].alive == (True, False, True)
    assert events.statuses[1].adjacency == ((0, 1, 1), (1, 0, 1), (1, 1, 0))
    assert events.statuses[1].satellites == tuple(NAMES)
    assert events.statuses[1].reason == "no answer within 10 s"
    change = events.gain_changes[0]
    assert (change.step, change.satellite, change.name) == (15, "sat3", "controller.switching_gain")
    assert change.value == (0.1, 0.2, 0.3)


def test_what_happened_is_told_with_its_time(kept: StoredRun) -> None:
    assert [(entry.time, entry.kind, entry.text) for entry in flight_events(kept)] == [
        (5.0, "loss", "sat2 lost: no answer within 10 s"),
        (7.5, "gain", "sat3: controller.switching_gain is now [0.1, 0.2, 0.3]"),
        (10.0, "return", "sat2 rejoined"),
        (15.0, "phase", "aborted: asked to stop"),
    ]


def test_a_lost_satellite_has_no_edges(kept: StoredRun) -> None:
    lost = graph_states(kept)[1]
    assert lost.adjacency.tolist() == [[0, 0, 1], [0, 0, 0], [1, 0, 0]]
    alive = next(chart for chart in graph_charts(kept, Unit("s", 1.0)) if chart.key == "alive")
    gone = alive.lines[1]
    assert np.isnan(gone.values).tolist() == [False, True, False, False, False]
    assert gone.time.tolist() == [0.0, 5.0, 10.0, 15.0, 20.0]


def test_a_bag_of_an_older_message_still_tells_what_it_knows() -> None:
    older = STATUS_TEXT.replace("uint8 ABORTED=3", "uint8 BROKEN_OFF=3")
    entry = TopicMessages(
        topic_table.STATUS, STATUS_TYPE, older, (status(3, [True] * 3, "", FormationStatus.ABORTED),)
    )
    assert read_events([entry]).statuses[0].phase == "broken_off"


@pytest.mark.parametrize(
    "message",
    [b"", b"\0\1\0\0", status(0, [True, True]), status(0, [True] * 3)[:60]],
    ids=["nothing", "no more than a beginning", "of two satellites", "cut short"],
)
def test_messages_that_are_something_else_are_a_sentence(message: bytes) -> None:
    with pytest.raises(EventError, match=r"/formation/status has messages that are not satform_msgs/msg/F"):
        read_events([told(message)])
