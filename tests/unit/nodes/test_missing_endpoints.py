# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Why a flight does not begin: the node, its topic and what is wrong with it are named, and nobody else."""

import time
from collections.abc import Iterator

import pytest
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from satform_msgs.msg import ArcLength, Command, FormationStatus, RelativeState, Tracking
from std_msgs.msg import String

from flights import shortened
from satform.common.exit_codes import EXIT_DONE, EXIT_LOST, EXIT_STOPPED
from satform.communication.topic_table import RECORDER, Channel, channels
from satform.flight.compile import topic_plan
from satform.protocol.formation_view import STOPPED
from satform_bringup.deployment.domain_lock import own_domain
from satform_nodes.runtime.lifecycle import exit_code_of
from satform_nodes.transport import message_definitions, missing_endpoints, qos, topic_types
from satform_nodes.transport.missing_endpoints import Shortcoming, changed_types, in_words, shortcomings

SCENARIO = shortened("triangle", 60.0)
TABLE = channels(topic_plan(SCENARIO))
NODES = ("plant", "sat1", "sat2", "sat3", RECORDER)


@pytest.fixture
def context() -> Iterator[rclpy.Context]:
    made = rclpy.Context()
    with own_domain() as domain:
        rclpy.init(context=made, domain_id=domain)
        yield made
        made.shutdown()


def formation(context: rclpy.Context, *without: tuple[str, str]) -> dict[str, Node]:
    """A node for each of the flight's, with every endpoint but some, given by node and topic."""
    nodes = {name: Node(name, context=context, start_parameter_services=False) for name in NODES}
    for channel in TABLE:
        profile = qos.PUBLISHER_BY_RHYTHM[channel.rhythm]
        kind = topic_types.TYPES[channel.kind]
        for name in channel.publishers:
            if (name, channel.topic) not in without and not channel.optional:
                nodes[name].create_publisher(kind, channel.topic, profile)
        for name in channel.subscribers:
            if (name, channel.topic) not in without:
                nodes[name].create_subscription(kind, channel.topic, lambda _: None, profile)
    return nodes


def found(nodes: dict[str, Node], wanted: str = "", *, recorded: bool = True) -> list[Shortcoming]:
    """What is found once a sentence is the first of it, or nothing is where none is wanted."""
    end = time.monotonic() + 30.0
    while True:
        seen = shortcomings(nodes["plant"], TABLE, recorded=recorded)
        if (seen[0].sentence if seen else "") == wanted or time.monotonic() > end:
            return seen
        time.sleep(0.02)  # polls: rclpy has no event for discovery


def test_of_a_formation_with_all_it_needs_nothing_is_found(context: rclpy.Context) -> None:
    # Without publishers of /diagnostics and of parameter changes, which a flight does without.
    assert found(formation(context)) == []
    assert "recorder has discovered all its topics" in in_words([], [RECORDER])


def test_of_a_formation_without_recorder_nothing_is_asked_for_the_recorder(context: rclpy.Context) -> None:
    progress = "/formation/recorder_progress"
    nodes = formation(context, ("plant", progress))
    nodes.pop(RECORDER).destroy_node()
    assert found(nodes, "there is no node recorder")
    assert found(nodes, recorded=False) == []


def test_the_node_that_lacks_a_publisher_is_named_and_not_the_one_that_waits_for_it(
    context: rclpy.Context,
) -> None:
    wanted = "sat2 does not publish /sat2/tracking"
    assert found(formation(context, ("sat2", "/sat2/tracking")), wanted) == [Shortcoming("sat2", wanted)]


def test_a_node_that_does_not_listen_is_named_with_its_topic(context: rclpy.Context) -> None:
    wanted = "sat3 does not subscribe to /sat1/arc_length"
    assert found(formation(context, ("sat3", "/sat1/arc_length")), wanted) == [Shortcoming("sat3", wanted)]


def test_a_node_that_is_not_there_is_named_once(context: rclpy.Context) -> None:
    nodes = formation(context)
    nodes.pop("sat3").destroy_node()
    wanted = "there is no node sat3"
    assert found(nodes, wanted) == [Shortcoming("sat3", wanted)]


def test_a_second_node_of_a_name_is_told_as_such(context: rclpy.Context) -> None:
    nodes = formation(context)
    second = Node("sat2", context=context, start_parameter_services=False)
    second.create_publisher(Command, "/sat2/command", qos.LOCKSTEP)
    wanted = "2 nodes are called sat2, and all of them publish /sat2/command"
    assert found(nodes, wanted) == [Shortcoming("sat2", wanted)]


def test_a_type_that_does_not_fit_is_told(context: rclpy.Context) -> None:
    nodes = formation(context, ("sat1", "/sat1/tracking"))
    # One participant cannot have two types on a topic.
    other = rclpy.Context()
    rclpy.init(context=other, domain_id=context.get_domain_id())
    try:
        stranger = Node("sat1", context=other, start_parameter_services=False)
        stranger.create_publisher(String, "/sat1/tracking", qos.LOCKSTEP)
        wanted = "sat1 publishes /sat1/tracking as std_msgs/msg/String, not as satform_msgs/msg/Tracking"
        assert found(nodes, wanted) == [Shortcoming("sat1", wanted, "type")]
    finally:
        other.shutdown()


def test_a_quality_of_service_that_does_not_fit_is_told(context: rclpy.Context) -> None:
    nodes = formation(context, ("sat2", "/sat2/tracking"))
    loose = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    nodes["sat2"].create_publisher(Tracking, "/sat2/tracking", loose)
    wanted = "sat2 publishes /sat2/tracking as best effort, and its readers want reliable"
    assert found(nodes, wanted) == [Shortcoming("sat2", wanted, "QoS")]


@pytest.mark.parametrize(
    ("topic", "kind", "changed", "ending"),
    [
        (
            "/sat1/arc_length",
            ArcLength,
            {"reliability": ReliabilityPolicy.BEST_EFFORT},
            "best effort, and it has to be reliable",
        ),
        ("/formation/status", FormationStatus, {}, "volatile, and it has to be transient local"),
        (
            "/sat2/state",
            RelativeState,
            {"durability": DurabilityPolicy.TRANSIENT_LOCAL},
            "transient local, and its publishers offer volatile",
        ),
    ],
    ids=["best effort", "not latched", "never matched"],
)
def test_a_quality_of_service_of_a_subscription_that_does_not_fit_is_told(
    context: rclpy.Context, topic: str, kind: type, changed: dict[str, object], ending: str
) -> None:
    nodes = formation(context, ("sat2", topic))
    nodes["sat2"].create_subscription(kind, topic, lambda _: None, QoSProfile(depth=1000, **changed))
    wanted = f"sat2 subscribes to {topic} as {ending}"
    assert found(nodes, wanted) == [Shortcoming("sat2", wanted, "QoS")]


def test_a_long_list_is_counted() -> None:
    many = [Shortcoming("a", f"a{number}") for number in range(5)]
    assert in_words(many, []) == "a0; a1; a2; and 2 more"


class Stop:
    def __init__(self, *, asked: bool) -> None:
        self.asked = asked


@pytest.mark.parametrize(
    ("asked", "phase", "reason", "code"),
    [
        (False, FormationStatus.ABORTED, "not ready within 63 s: there is no node sat2", EXIT_LOST),
        (False, FormationStatus.ABORTED, "lost at step 7: no answer", EXIT_LOST),
        (False, FormationStatus.ABORTED, STOPPED, EXIT_DONE),
        (False, FormationStatus.FINISHED, "", EXIT_DONE),
        (True, FormationStatus.ABORTED, "lost", EXIT_STOPPED),
    ],
)
def test_nodes_that_are_told_of_a_lost_flight_end_with_3(
    asked: bool, phase: int, reason: str, code: int
) -> None:
    assert exit_code_of(Stop(asked=asked), FormationStatus(phase=phase, reason=reason)) == code


def test_every_topic_of_the_table_is_known() -> None:
    assert {channel.kind for channel in TABLE if isinstance(channel, Channel)} <= topic_types.TYPES.keys()


def test_message_of_the_same_name_and_another_definition_is_told_by_its_hash(
    context: rclpy.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    nodes = formation(context)
    assert found(nodes) == []
    assert changed_types(nodes["plant"], TABLE, ["sat2"]) == []
    here = message_definitions.type_hash
    monkeypatch.setattr(
        missing_endpoints, "type_hash", lambda kind: "RIHS01_0" if kind is Command else here(kind)
    )
    (changed,) = changed_types(nodes["plant"], TABLE, ["sat2"])
    assert changed.node == "sat2"
    assert changed.sentence.startswith(
        "sat2 publishes /sat2/command with another definition of satform_msgs/msg/Command (RIHS01_"
    )
    assert changed_types(nodes["plant"], TABLE, []) == []
