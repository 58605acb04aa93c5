"""Gains can be read and changed in flight, and a change takes effect at a numbered step."""

import re
import signal
import time
from collections.abc import Callable
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
from satform.simulate import simulate
from satform_bringup.processes import processes
from satform_nodes import topics
from satform_nodes.bag_reader import read_bag

STEPS = 3000


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
        Command, topics.command("sat1"), lambda command: steps.append(command.step), topics.STEPPED
    )
    running = fleet(processes(scenario, file, bag))
    end = time.monotonic() + 60.0
    while not steps:
        assert time.monotonic() < end, "the flight has not begun"
        rclpy.spin_once(operator, timeout_sec=0.05)
    running[0].send_signal(signal.SIGSTOP)
    return running


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
