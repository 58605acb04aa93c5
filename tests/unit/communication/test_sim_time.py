# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""No node of a flight goes by `/clock`: asked for at the start or later, that is refused with the reason."""

import signal
from collections.abc import Iterator

import pytest
import rclpy
from rclpy.parameter import Parameter

from satform.common.exit_codes import EXIT_BAD_INPUT
from satform_bringup.deployment.domain_lock import on_domain, own_domain
from satform_nodes.plant import flight_loop as plant_node
from satform_nodes.recorder import flight_loop as recorder_node
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.satellite import single_node as satellite_node


@pytest.fixture(autouse=True)
def domain() -> Iterator[int]:
    with own_domain() as number, on_domain(number):
        yield number


@pytest.fixture
def signals() -> Iterator[None]:
    """What a node's program does about signals ends with it."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    yield
    signal.set_wakeup_fd(-1)
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def node() -> Iterator[FormationNode]:
    rclpy.init()
    node = FormationNode("sat1")
    yield node
    node.destroy_node()
    rclpy.shutdown()


def test_in_flight_the_parameter_cannot_be_set(node: FormationNode) -> None:
    (result,) = node.set_parameters([Parameter("use_sim_time", value=True)])
    assert not result.successful
    assert "never from /clock" in result.reason
    assert node.get_parameter("use_sim_time").value is False
    assert not node.get_clock().ros_time_is_active
    # What it is already may be said again.
    (result,) = node.set_parameters([Parameter("use_sim_time", value=False)])
    assert result.successful


@pytest.mark.parametrize("module", [plant_node, satellite_node, recorder_node])
def test_a_node_that_is_started_with_it_ends_with_a_sentence(
    module: object, signals: None, capfd: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--ros-args", "-p", "use_sim_time:=true"]
    assert module.main(arguments) == EXIT_BAD_INPUT
    assert "use_sim_time is true; satform's nodes take simulated time" in capfd.readouterr().err
