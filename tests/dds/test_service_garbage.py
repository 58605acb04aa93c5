# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Requests of every kind to every service of a flight end no node and change no bit of it."""

import os
import select
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node

from flights import shortened
from flown import assert_as_in_one_process, refused
from satform.bag.reader import read_bag
from satform.flight.compile import compile_scenario
from satform_bringup.deployment import local_discovery
from satform_bringup.deployment.node_processes import NodeProcess, processes

pytestmark = pytest.mark.unmeasured

CALLER = Path(__file__).with_name("caller.py")
CALLED = ("plant", "sat1", "sat2", "recorder")


@pytest.fixture
def call(tmp_path: Path) -> Iterator[Callable[[], subprocess.Popen[bytes]]]:
    """Starts a process that calls all services of some nodes until the test is over; waits for its begin."""
    started: list[subprocess.Popen[bytes]] = []
    (tmp_path / "caller").mkdir()

    def start() -> subprocess.Popen[bytes]:
        told = local_discovery.variables(1, 1, tmp_path / "caller")
        command = [sys.executable, str(CALLER), "13", *CALLED]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, env={**os.environ, **told})
        started.append(process)
        assert process.stdout is not None
        ready, _, _ = select.select([process.stdout], [], [], 60.0)
        assert ready
        assert process.stdout.readline().startswith(b"calling ")
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


def nodes_of(folder: Path, rate: float = 0.0) -> tuple[list[NodeProcess], NodeProcess]:
    """The processes of a short flight without its third satellite, which all others await; and that one."""
    scenario = shortened("triangle", 40.0)
    file = folder / "scenario.json"
    file.write_text(scenario.to_json())
    nodes = processes(compile_scenario(scenario), file, folder / "bag", rate=rate)
    (late,) = [node for node in nodes if node.name == "sat3"]
    return [node for node in nodes if node is not late], late


@pytest.mark.parametrize("rate", [0.0, 20.0])
def test_garbage_to_all_services_at_full_rate_ends_no_node_and_changes_nothing(
    rate: float,
    fleet: Callable[[list[NodeProcess]], list[Any]],
    call: Callable[[], subprocess.Popen[bytes]],
    tmp_path: Path,
) -> None:
    nodes, late = nodes_of(tmp_path, rate)
    fleet(nodes)
    caller = call()
    started = fleet([late])
    assert [process.wait(60) for process in started] == [0] * 5
    assert caller.poll() is None
    bag = read_bag(tmp_path / "bag")
    assert bag.complete
    if not rate:
        assert_as_in_one_process(bag)
    counted = [reason for reason in refused(bag.path) if "not handled" in reason]
    assert {reason.partition(":")[0] for reason in counted} == set(CALLED)


def test_a_parameter_of_a_type_that_does_not_exist_is_refused_with_an_answer(
    fleet: Callable[[list[NodeProcess]], list[Any]], observer: Node, tmp_path: Path
) -> None:
    nodes, late = nodes_of(tmp_path)
    fleet(nodes)
    value = Parameter(name="x", value=ParameterValue(type=77))

    def ask(name: str, service: Any, topic: str) -> Any:
        client = observer.create_client(service, f"/{name}/{topic}")
        assert client.wait_for_service(60.0)
        future = client.call_async(service.Request(parameters=[value]))
        rclpy.spin_until_future_complete(observer, future, timeout_sec=60.0)
        return future.result()

    for name in CALLED:
        (one,) = ask(name, SetParameters, "set_parameters").results
        other = ask(name, SetParametersAtomically, "set_parameters_atomically").result
        for result in (one, other):
            assert not result.successful
            assert "77 is not a valid" in result.reason
    assert [process.wait(60) for process in fleet([late])] == [0] * 5
    assert_as_in_one_process(read_bag(tmp_path / "bag"))
