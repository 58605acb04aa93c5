# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Signed permissions fit the nodes as they fly: nothing that they need is denied, nothing more is allowed."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import rclpy
from rclpy.node import Node

from flights import shortened
from satform.flight.compile import compile_scenario
from satform_bringup.deployment.node_processes import processes
from satform_tools.security.access import Access, accesses

pytestmark = pytest.mark.unmeasured


def seen(observer: Node, node: str) -> Access:
    """What a node is seen to say, hear and offer on the network."""
    try:
        looks = (
            observer.get_publisher_names_and_types_by_node(node, "/"),
            observer.get_subscriber_names_and_types_by_node(node, "/"),
            observer.get_service_names_and_types_by_node(node, "/"),
        )
    except rclpy.node.NodeNameNonExistentError:
        looks = ([], [], [])
    return Access(node, *(tuple(sorted(name for name, _ in look)) for look in looks))


def while_steps_go_on(access: Access) -> Access:
    """Without what the plant subscribes to only while a step does not go on."""
    if access.node != "plant":
        return access
    watched = ("/arc_length", "/navigation_estimate")
    subscribes = tuple(name for name in access.subscribes if not name.endswith(watched))
    return replace(access, subscribes=subscribes)


# Each hears the next; sensors and thrusters add topics, and so do estimates and standard messages.
@pytest.mark.parametrize(
    ("name", "changes"),
    [
        (
            "noisy_navigation",
            (
                "graph={kind: matrix, rows: [[0,1,0],[0,0,1],[1,0,0]]}",
                "satellite_defaults.thruster={dry_mass: 12.0}",
            ),
        ),
        ("laser_ranging_triangle", ("graph={kind: line}", "publish_sensor_messages=true")),
    ],
)
def test_each_node_has_just_the_topics_and_services_that_it_is_permitted(
    name: str, changes: tuple[str, ...], fleet: Callable[..., list], observer: Node, tmp_path: Path
) -> None:
    scenario = shortened(name, 50_000.0, *changes)
    permitted = [while_steps_go_on(access) for access in accesses(scenario) if access.node != "operator"]
    file = tmp_path / "scenario.json"
    file.write_text(scenario.to_json())
    fleet(processes(compile_scenario(scenario), file, tmp_path / "bag"))
    end = time.monotonic() + 60.0
    while (found := [seen(observer, access.node) for access in permitted]) != permitted:
        assert time.monotonic() < end, [
            pair for pair in zip(found, permitted, strict=True) if pair[0] != pair[1]
        ]
        time.sleep(0.1)  # polls: rclpy has no event for discovery
