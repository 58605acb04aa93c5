# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flights without a recorder, and flights at the same time, have the bits of a flight alone with one."""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from satform_msgs.msg import Command

from flights import shortened
from flown import assert_as_in_one_process
from satform.bag.reader import read_bag
from satform.communication.topic_table import topic_name
from satform.flight.simulate import simulate
from satform_bringup.supervisor.run import fly
from satform_nodes.transport import qos

pytestmark = pytest.mark.unmeasured

NAMES = ("sat1", "sat2", "sat3")


class Listener:
    """Someone who hears what the satellites command."""

    def __init__(self) -> None:
        self.heard: dict[tuple[int, int], list[float]] = {}
        self._node = rclpy.create_node("listener")
        for index, name in enumerate(NAMES):
            self._node.create_subscription(
                Command, topic_name("command", name), self._listen_to(index), qos.LOCKSTEP_READER
            )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin)
        self._thread.start()

    def _listen_to(self, index: int):
        def note(command: Command) -> None:
            given = command.acceleration
            self.heard[int(command.step), index] = [given.x, given.y, given.z]

        return note

    def close(self) -> None:
        self._executor.shutdown()
        self._thread.join()
        self._node.destroy_node()


@pytest.fixture
def listener() -> Iterator[Listener]:
    rclpy.init()
    listener = Listener()
    yield listener
    listener.close()
    rclpy.shutdown()


def test_a_flight_that_is_not_recorded_has_the_bits_of_the_in_process_run(
    listener: Listener, tmp_path: Path
) -> None:
    scenario = shortened("triangle", 600.0)
    flight = fly(scenario, tmp_path, record=False, progress=lambda _done, _all: None)
    assert (flight.lost, flight.bag, flight.steps) == ((), None, scenario.timing.steps)
    expected = simulate(scenario).acceleration
    # Nobody waits for whoever looks in: it may come late, and the last words may still be on their way.
    assert len(listener.heard) > 100
    for (step, index), heard in listener.heard.items():
        np.testing.assert_array_equal(heard, expected[step, index])


def test_two_runs_at_once_on_one_machine_do_not_hear_each_other(tmp_path: Path) -> None:
    # As from two terminals in which nobody has chosen a domain.
    untold = {name: value for name, value in os.environ.items() if not name.startswith(("ROS_", "SATFORM_"))}
    changes = {"one": "graph={kind: line}", "other": "graph={kind: complete}"}
    running = {
        name: subprocess.Popen(
            [
                *(sys.executable, "-m", "satform_tools", "run", "triangle", "--out", str(tmp_path / name)),
                *("--set", "timing.duration=400.0", "--set", "expect=[]", "--set", change),
            ],
            env=untold,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        for name, change in changes.items()
    }
    said = {name: process.communicate(timeout=120)[0] for name, process in running.items()}
    assert {name: process.returncode for name, process in running.items()} == {"one": 0, "other": 0}, said
    for name in running:
        assert_as_in_one_process(read_bag(tmp_path / name / "bag"))
