# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A satellite that is lost and rejoins at one step: over DDS the flight has the bits of one process."""

import os
import signal
import threading
from pathlib import Path

import pytest
import rclpy
from rclpy.node import Node
from satform_msgs.msg import NodeReady
from std_srvs.srv import Trigger

from flights import shortened
from flown import assert_as_in_one_process, assert_flies_again, flown, processes_of
from satform.communication import topic_table
from satform.membership.formation import SatelliteLost, SatelliteRejoined
from satform_nodes.plant import services
from satform_nodes.transport import qos

pytestmark = pytest.mark.unmeasured

LOST_AND_BACK = "{kind: satellite_lost, satellite: sat2, at: 27.0, rejoin_at: 27.0"
OTHER = "{kind: satellite_lost, satellite: sat3, at: %s, rejoin_at: %s, memory: plan}"
PLANNED = {
    "as another is lost, and the graph changes": (f"{LOST_AND_BACK}}}", OTHER % (27.0, 30.0)),
    "as another rejoins": (f"{LOST_AND_BACK}, memory: plan}}", OTHER % (20.0, 27.0)),
}


@pytest.mark.parametrize("faults", PLANNED.values(), ids=PLANNED.keys())
def test_a_planned_loss_and_return_at_one_step_have_the_bits_of_one_process(
    faults: tuple[str, ...], tmp_path: Path
) -> None:
    graphs = "{at: 27.0, graph: {kind: ring}}, {at: 30.0, graph: {kind: complete}}"
    changes = (f"faults=[{', '.join(faults)}]", "checkpoint_period=10.0", f"graph_schedule=[{graphs}]")
    flight, bag = flown(shortened("triangle", 40.0, *changes), tmp_path)
    assert flight.lost == ()
    assert_as_in_one_process(bag)


def ask(node: Node, service: str, *, succeeds: bool = True) -> None:
    client = node.create_client(Trigger, service)
    assert client.wait_for_service(60.0)
    future = client.call_async(Trigger.Request())
    rclpy.spin_until_future_complete(node, future, timeout_sec=60.0)
    assert future.result().success is succeeds, future.result().message


def test_a_loss_and_a_return_within_one_pause_have_the_same_bits_when_flown_again(
    observer: Node, tmp_path: Path
) -> None:
    scenario = shortened("triangle", 800.0, "checkpoint_period=20.0", "node_timeout=60.0")
    ready: list[str] = []
    again = threading.Event()

    def on_ready(message: NodeReady) -> None:
        ready.append(message.node)
        if ready.count("/sat2") == 2:
            again.set()

    observer.create_subscription(NodeReady, topic_table.NODE_READY, on_ready, qos.LATCHED_READER)
    helpers: list[threading.Thread] = []

    def resume() -> None:
        while not again.is_set():
            rclpy.spin_once(observer, timeout_sec=60.0)
        # The plant reads its topics before each request: the offer that has arrived here, too.
        for _ in range(5):
            ask(observer, services.PAUSE, succeeds=False)
        ask(observer, services.RESUME)

    def pause_and_kill(done: int, _all: int) -> None:
        if done > 300 and not helpers:
            ask(observer, services.PAUSE)
            os.kill(processes_of(tmp_path)["sat2"], signal.SIGKILL)
            helpers.append(threading.Thread(target=resume))
            helpers[0].start()

    flight, bag = flown(scenario, tmp_path, pause_and_kill, restart=True)
    helpers[0].join(60)
    (loss,), (back,) = flight.losses, flight.returns
    assert loss.step == back.step
    events = bag.events[loss.step]
    assert [type(event) for event in events] == [SatelliteLost, SatelliteRejoined]
    assert_flies_again(bag)
