# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Gains can be read and changed in flight, and a change takes effect at a numbered step."""

import re
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rclpy
from mcap_ros2.reader import read_ros2_messages
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.node import Node
from satform_msgs.msg import Command

from flights import shortened
from flown import assert_flies_again
from satform.bag.reader import read_bag
from satform.common.exit_codes import EXIT_BAD_INPUT
from satform.communication.topic_table import topic_name
from satform.flight.compile import compile_scenario
from satform.flight.simulate import simulate
from satform_bringup.deployment.node_processes import processes
from satform_nodes.transport import qos

STEPS = 1500


@pytest.fixture
def operator() -> Node:
    rclpy.init()
    node = Node("operator")
    yield node
    node.destroy_node()
    rclpy.shutdown()


def call(operator: Node, kind: type, service: str, request: object) -> object:
    client = operator.create_client(kind, service)
    assert client.wait_for_service(30.0), f"{service} is not there"
    future = client.call_async(request)
    rclpy.spin_until_future_complete(operator, future, timeout_sec=30.0)
    assert future.done(), f"{service} does not answer"
    return future.result()


def set_switching_gain(operator: Node, value: list[float]) -> object:
    parameter = Parameter(
        name="controller.switching_gain",
        value=ParameterValue(type=ParameterType.PARAMETER_DOUBLE_ARRAY, double_array_value=value),
    )
    request = SetParameters.Request(parameters=[parameter])
    return call(operator, SetParameters, "/sat1/set_parameters", request).results[0]


def fly_until_some_steps_are_taken(operator: Node, fleet: Callable[..., list], file: Path, bag: Path) -> list:
    """Start a flight and hold its plant still somewhere in the middle; returns the processes."""
    scenario = shortened("triangle", STEPS * 0.5)
    file.write_text(scenario.to_json())
    steps: list[int] = []
    operator.create_subscription(
        Command, topic_name("command", "sat1"), lambda command: steps.append(command.step), qos.LOCKSTEP
    )
    running = fleet(processes(compile_scenario(scenario), file, bag))
    end = time.monotonic() + 60.0
    while not steps:
        assert time.monotonic() < end, "the flight has not begun"
        rclpy.spin_once(operator, timeout_sec=0.05)
    running[0].send_signal(signal.SIGSTOP)
    return running


@pytest.mark.unmeasured
def test_a_gain_changed_in_flight_acts_from_the_step_that_the_reply_names(
    operator: Node, fleet: Callable[..., list], tmp_path: Path
) -> None:
    running = fly_until_some_steps_are_taken(operator, fleet, tmp_path / "scenario.json", tmp_path / "bag")
    try:
        request = GetParameters.Request(names=["controller.switching_gain", "controller.kind"])
        values = call(operator, GetParameters, "/sat1/get_parameters", request).values
        assert list(values[0].double_array_value) == [0.1, 0.1, 0.1]
        assert values[1].string_value == "sliding_mode"

        request = DescribeParameters.Request(names=["controller.switching_gain"])
        described = call(operator, DescribeParameters, "/sat1/describe_parameters", request).descriptors[0]
        assert described.type == ParameterType.PARAMETER_DOUBLE_ARRAY
        assert "m/s^2" in described.description

        refused = set_switching_gain(operator, [-1.0, 0.1, 0.1])
        assert not refused.successful
        assert "switching_gain" in refused.reason
        assert "-1" in refused.reason

        reply = set_switching_gain(operator, [0.2, 0.2, 0.2])
        assert reply.successful
    finally:
        running[0].send_signal(signal.SIGCONT)
    named = int(re.search(r"step (\d+)", reply.reason)[1])
    end = time.monotonic() + 60.0
    for process in running:
        process.wait(max(0.0, end - time.monotonic()))

    bag = read_bag(tmp_path / "bag")
    assert bag.complete
    assert 0 < named < STEPS
    unchanged = simulate(bag.scenario)
    np.testing.assert_array_equal(bag.record.acceleration[:named], unchanged.acceleration[:named])
    # A larger switching gain pulls harder by the difference of the gains times sat(s / 0.1 m/s).
    pull = -(0.2 - 0.1) * np.clip(unchanged.sliding_variable[named, 0] / 0.1, -1.0, 1.0)
    assert np.abs(pull).max() > 1e-6
    harder = bag.record.acceleration[named, 0] - unchanged.acceleration[named, 0]
    np.testing.assert_allclose(harder, pull, atol=1e-12)
    np.testing.assert_array_equal(bag.record.acceleration[named, 1:], unchanged.acceleration[named, 1:])

    told = [
        message.ros_msg for message in read_ros2_messages(str(bag.path), topics=["/sat1/parameter_changes"])
    ]
    assert [(change.step, change.name, list(change.value)) for change in told] == [
        (named, "controller.switching_gain", [0.2, 0.2, 0.2])
    ]


GIVEN = {"controller.switching_gain": [5.0, 5.0, 5.0], "controller.reaching_gain": [0.2, 0.1, 0.1]}


@pytest.mark.parametrize("group", [3, pytest.param(1, marks=pytest.mark.unmeasured)])
def test_what_a_node_is_given_at_its_start_is_flown_from_step_0_on_and_on_record(
    group: int, fleet: Callable[..., list], tmp_path: Path
) -> None:
    scenario = shortened("triangle", 20.0)
    file = tmp_path / "scenario.json"
    file.write_text(scenario.to_json())
    nodes = processes(compile_scenario(scenario), file, tmp_path / "bag", group)
    given = [
        replace(node, parameters={**node.parameters, **GIVEN}) if node.name in ("sat1", "group0") else node
        for node in nodes
    ]
    assert given != nodes
    for process in fleet(given):
        assert process.wait(60) == 0
    bag = read_bag(tmp_path / "bag")
    assert bag.complete
    changed = ["sat1"] if group == 1 else ["sat1", "sat2", "sat3"]
    gains = {name.removeprefix("controller."): tuple(value) for name, value in GIVEN.items()}
    law = scenario.satellite(0).controller.model_copy(update=gains)
    satellites = [
        own.model_copy(update={"controller": law}) if own.name in changed else own
        for own in scenario.satellites
    ]
    written = simulate(scenario.model_copy(update={"satellites": tuple(satellites)}))
    # The bits of the scenario in which they are written down, and not those of the one that was given.
    assert written.differences(bag.record) == []
    assert simulate(scenario).differences(bag.record)
    assert_flies_again(bag)
    told = [
        (message.channel.topic, message.ros_msg.step, message.ros_msg.name, list(message.ros_msg.value))
        for message in read_ros2_messages(str(bag.path))
        if message.channel.topic.endswith("/parameter_changes")
    ]
    assert sorted(told) == sorted(
        (f"/{name}/parameter_changes", 0, parameter, value)
        for name in changed
        for parameter, value in GIVEN.items()
    )


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("controller.switching_gain", [-1.0, 5.0, 5.0], "switching_gain[0]: found -1"),
        ("controller.switching_gian", 5.0, "did you mean controller.switching_gain?"),
        ("controller.kind", "lqr", "change it in the scenario"),
        ("controller.boundary_layer", True, "controller.boundary_layer: found true"),
    ],
)
def test_what_a_node_cannot_fly_by_is_refused_at_its_start(
    name: str, value: object, sentence: str, fleet: Callable[..., list], tmp_path: Path
) -> None:
    scenario = shortened("triangle", 20.0)
    file = tmp_path / "scenario.json"
    file.write_text(scenario.to_json())
    (node,) = [node for node in processes(compile_scenario(scenario), file, None) if node.name == "sat1"]
    (process,) = fleet([replace(node, parameters={**node.parameters, name: value})])
    assert process.wait(60) == EXIT_BAD_INPUT
    printed = (tmp_path / "sat1.log").read_text()
    assert sentence in printed
    assert "Traceback" not in printed
