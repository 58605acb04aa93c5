# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The communication graph of a flight can be read from its topics, and is the adjacency matrix."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import rclpy
from rclpy.node import Node
from satform_msgs.msg import FormationStatus

from flights import shortened
from satform.communication import topic_table
from satform.communication.topic_table import topic_name
from satform.flight.compile import compile_scenario
from satform.scenario import Scenario
from satform_bringup.deployment.node_processes import processes
from satform_nodes.transport import qos

DIRECTED = "{kind: matrix, rows: [[0,1,0,0],[0,0,1,0],[0,0,0,1],[1,1,0,0]]}"
"""Row i hears column j; the last satellite hears two, and not everyone is heard back."""


def four_satellites(graph: str) -> Scenario:
    names = ("one", "two", "three", "four")
    satellites = ", ".join(f"{{name: {name}, curve: {{kind: circle, radius: 1000.0}}}}" for name in names)
    return shortened("triangle", 3600.0, f"graph={graph}", f"satellites=[{satellites}]")


def listeners(observer: Node, scenario: Scenario) -> np.ndarray:
    """Adjacency as seen on the network: entry i, j is 1 when satellite i subscribes to what j announces."""
    names = [satellite.name for satellite in scenario.satellites]
    seen = np.zeros((len(names), len(names)), dtype=int)
    for column, name in enumerate(names):
        for endpoint in observer.get_subscriptions_info_by_topic(
            topic_name(scenario.consensus.announces, name)
        ):
            if endpoint.node_name in names:
                seen[names.index(endpoint.node_name), column] += 1
    return seen


def everyone_is_seen(observer: Node, scenario: Scenario) -> bool:
    """Whether discovery has shown the observer all subscriptions of every satellite.

    A node's subscriptions become known in the order in which they were made, the status last.
    """
    seen = {endpoint.node_name for endpoint in observer.get_subscriptions_info_by_topic(topic_table.STATUS)}
    return {satellite.name for satellite in scenario.satellites} <= seen


@pytest.mark.parametrize(
    "graph",
    [
        DIRECTED,
        *(
            pytest.param(f"{{kind: {kind}}}", marks=pytest.mark.unmeasured)
            for kind in ("complete", "ring", "line", "star", "none")
        ),
    ],
)
def test_a_satellite_subscribes_to_its_neighbours_and_to_nobody_else(
    graph: str, observer: Node, fleet: Callable[..., None], tmp_path: Path
) -> None:
    flies_on_its_graph(four_satellites(graph), observer, fleet, tmp_path)


def test_where_satellites_share_their_motion_each_hears_the_one_that_it_follows_and_nothing_else(
    observer: Node, fleet: Callable[..., None], tmp_path: Path
) -> None:
    scenario = shortened("directed_triangle", 200.0)
    flies_on_its_graph(scenario, observer, fleet, tmp_path)
    names = {satellite.name for satellite in scenario.satellites}
    for name in names:
        for topic, _ in observer.get_subscriber_names_and_types_by_node(name, "/"):
            speakers = {endpoint.node_name for endpoint in observer.get_publishers_info_by_topic(topic)}
            assert (
                not speakers & (names - {name})
                or topic.endswith("/motion")
                or topic == topic_table.NODE_READY
            )


def flies_on_its_graph(
    scenario: Scenario, observer: Node, fleet: Callable[..., None], tmp_path: Path
) -> None:
    """Start a scenario's nodes and hold what satellites subscribe to against the adjacency matrix."""
    wanted = scenario.communication_graph().adjacency.astype(int)
    file = tmp_path / "scenario.json"
    file.write_text(scenario.to_json())
    flying: list[int] = []
    observer.create_subscription(
        FormationStatus, topic_table.STATUS, lambda status: flying.append(status.phase), qos.LATCHED
    )
    fleet(processes(compile_scenario(scenario), file, None))
    end = time.monotonic() + 60.0
    # Once the formation flies, every satellite has matched everyone it will ever talk to.
    while FormationStatus.FLYING not in flying or not everyone_is_seen(observer, scenario):
        assert time.monotonic() < end, f"not flying; seen so far:\n{listeners(observer, scenario)}"
        rclpy.spin_once(observer, timeout_sec=0.05)
    np.testing.assert_array_equal(listeners(observer, scenario), wanted)
