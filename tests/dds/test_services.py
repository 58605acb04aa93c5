# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What anyone may ask of a formation in flight acts at the step that the reply names, and is on record."""

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import rclpy
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from satform_msgs.srv import SetGraph
from std_srvs.srv import Trigger

from flights import shortened
from flown import assert_flies_again
from satform.bag.reader import Bag, read_bag
from satform.flight.compile import compile_scenario
from satform.flight.simulate import simulate
from satform.membership.formation import SatelliteRejoined
from satform.scenario import Scenario
from satform_bringup.deployment.node_processes import processes
from satform_nodes.plant import services
from satform_nodes.runtime.lifecycle import plant_timeout

STEPS = 1200


class Operator:
    """Someone at a flight's services."""

    def __init__(self, node: Node, fleet: Callable[..., list], folder: Path) -> None:
        self._node, self._fleet, self.folder = node, fleet, folder
        self.running: list = []
        self._clients: dict = {}

    def fly(self, scenario: Scenario, group: int = 1) -> None:
        file = self.folder / "scenario.json"
        file.write_text(scenario.to_json())
        checkpoints = self.folder / "checkpoints" if scenario.checkpoint_period else None
        self.running = self._fleet(
            processes(compile_scenario(scenario), file, self.folder / "bag", group, checkpoints)
        )

    def call(self, kind: type, service: str, request: object) -> object:
        client = self._clients.get(service) or self._node.create_client(kind, service)
        self._clients[service] = client
        assert client.wait_for_service(60.0), f"{service} is not there"
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self._node, future, timeout_sec=60.0)
        assert future.done(), f"{service} does not answer"
        return future.result()

    def ask(self, service: str) -> int:
        """The step that the reply names."""
        reply = self.call(Trigger, service, Trigger.Request())
        assert reply.success, reply.message
        return int((re.search(r"\d+", reply.message) or ["-1"])[0])

    def pause(self) -> int:
        """Pause as soon as the flight has begun."""
        end = time.monotonic() + 60.0
        while True:
            reply = self.call(Trigger, services.PAUSE, Trigger.Request())
            if reply.success:
                return int(re.search(r"\d+", reply.message)[0])
            assert "not begun" in reply.message
            assert time.monotonic() < end

    def set_graph(self, rows: list[list[int]]) -> object:
        return self.call(SetGraph, services.SET_GRAPH, SetGraph.Request(adjacency=np.ravel(rows).tolist()))

    def fly_with_losses(self, satellite: str, first: int, checkpoint_period: float) -> None:
        """Fly the triangle as a group on a line, a satellite lost every 200 steps and back 20 steps later.

        In a group it comes back without anyone to start it.
        """
        losses = ", ".join(
            f"{{kind: satellite_lost, satellite: {satellite}, at: {at}, rejoin_at: {at + 10}}}"
            for at in range(first // 2, STEPS // 2 - 50, 100)
        )
        changes = (f"faults=[{losses}]", f"checkpoint_period={checkpoint_period}", "graph={kind: line}")
        self.fly(shortened("triangle", STEPS * 0.5, *changes), group=3)

    def set_graph_at(self, step: int, rows: list[list[int]]) -> int:
        """Set the graph at the next step that is this one or 200, 400, ... steps later; its number."""
        paused = self.pause()
        due = paused // 200 * 200 + (step if paused % 200 < step - 1 else step + 200)
        for _ in range(due - paused):
            self.ask(services.STEP)
        self.wait_before(due)
        reply = self.set_graph(rows)
        assert reply.success
        assert reply.step == due
        return due

    def wait_before(self, step: int) -> None:
        """Wait until the single steps that were asked for are taken, and the flight stands before a step."""
        end = time.monotonic() + 60.0
        while True:
            reply = self.call(Trigger, services.PAUSE, Trigger.Request())
            if reply.message == f"the flight is paused already, before step {step}":
                return
            assert reply.message == "the flight is paused already, and takes a step"
            assert time.monotonic() < end

    def set(self, satellite: str, name: str, value: object) -> object:
        kinds = {
            float: ("double_value", ParameterType.PARAMETER_DOUBLE),
            list: ("double_array_value", ParameterType.PARAMETER_DOUBLE_ARRAY),
            str: ("string_value", ParameterType.PARAMETER_STRING),
        }
        field, kind = kinds[type(value)]
        parameter = Parameter(name=name, value=ParameterValue(type=kind, **{field: value}))
        request = SetParameters.Request(parameters=[parameter])
        return self.call(SetParameters, f"/{satellite}/set_parameters", request).results[0]

    def landed(self) -> Bag:
        """The bag, after all processes have ended by themselves and well."""
        for process in self.running:
            assert process.wait(120) == 0
        bag = read_bag(self.folder / "bag")
        assert bag.complete
        return bag


@pytest.fixture
def operator(fleet: Callable[..., list], tmp_path: Path) -> Iterator[Operator]:
    rclpy.init()
    node = Node("operator")
    yield Operator(node, fleet, tmp_path)
    node.destroy_node()
    rclpy.shutdown()


def test_a_paused_flight_loses_nobody_takes_single_steps_and_keeps_its_bits(operator: Operator) -> None:
    timeout = 2.0
    operator.fly(shortened("triangle", STEPS * 0.5, f"node_timeout={timeout}"))
    paused = operator.pause()
    time.sleep(plant_timeout(timeout) + 1.0)  # tests that time alone, beyond all timeouts, loses no satellite
    taken = [operator.ask(services.STEP) for _ in range(3)]
    assert taken == [paused, paused + 1, paused + 2]
    operator.wait_before(paused + 3)
    assert operator.ask(services.RESUME) == paused + 3
    bag = operator.landed()
    assert bag.events == {}
    assert simulate(bag.scenario).differences(bag.record) == []


def test_a_paused_flight_can_be_stopped(operator: Operator) -> None:
    operator.fly(shortened("triangle", STEPS * 0.5))
    paused = operator.pause()
    assert operator.call(Trigger, services.STOP, Trigger.Request()).success
    assert [process.wait(60) for process in operator.running] == [130, 0, 0, 0, 0]
    assert abs(read_bag(operator.folder / "bag").record.steps - paused) <= 1


def test_a_graph_set_in_flight_acts_at_its_step_also_with_edges_that_the_scenario_never_had(
    operator: Operator,
) -> None:
    operator.fly(shortened("triangle", STEPS * 0.5, "graph={kind: line}"))
    operator.pause()
    refused = operator.set_graph([[0, 1], [1, 0]])
    assert not refused.success
    assert "4 entries" in refused.message
    assert "diagonal" in operator.set_graph([[1, 0, 0], [0, 0, 0], [0, 0, 0]]).message
    reply = operator.set_graph([[0, 0, 1], [0, 0, 1], [1, 0, 0]])
    assert reply.success, reply.message
    operator.ask(services.RESUME)
    bag = operator.landed()
    assert list(bag.events) == [reply.step]
    unchanged = simulate(bag.scenario)
    np.testing.assert_array_equal(
        bag.record.arc_length[: reply.step + 1], unchanged.arc_length[: reply.step + 1]
    )
    assert (bag.record.arc_length[reply.step + 2] != unchanged.arc_length[reply.step + 2]).any()
    assert_flies_again(bag)


def test_gains_phase_and_orbit_set_in_flight_act_at_their_step_and_fly_again(operator: Operator) -> None:
    operator.fly(shortened("triangle", STEPS * 0.5))
    paused = operator.pause()
    for satellite, name, value in [
        ("sat1", "controller.reaching_gain", [0.2, 0.2, 0.2]),
        ("sat2", "phase.offset", 500.0),
        ("sat3", "curve.centre", [0.0, 10.0, -100.0e3]),
    ]:
        reply = operator.set(satellite, name, value)
        assert reply.successful, (name, reply.reason)
        assert f"step {paused}" in reply.reason
    operator.ask(services.RESUME)
    bag = operator.landed()
    assert {(event.satellite, event.name) for event in bag.events[paused]} == {
        (0, "controller.reaching_gain"),
        (1, "phase.offset"),
        (2, "curve.centre"),
    }
    assert_flies_again(bag)


def test_a_hostile_value_is_refused_with_a_reason_and_changes_nothing(operator: Operator) -> None:
    operator.fly(shortened("triangle", STEPS * 0.5))
    operator.pause()
    for name, value in [
        ("controller.reaching_gain", [float("nan")] * 3),
        ("controller.reaching_gain", [float("inf")] * 3),
        ("controller.reaching_gain", [-1.0, 1.0, 1.0]),
        ("controller.reaching_gain", [1.0]),
        ("controller.reaching_gain", "much"),
        ("controller.kind", "feedback_linearisation"),
        ("controller.no_such_gain", 1.0),
        ("phase.offset", float("nan")),
        ("curve.first_axis", [0.0, 0.0, 0.0]),
        ("scenario", "/etc/passwd"),
    ]:
        reply = operator.set("sat1", name, value)
        assert not reply.successful, (name, value)
        assert len(reply.reason) > 10, (name, value, reply.reason)
    operator.ask(services.RESUME)
    bag = operator.landed()
    assert bag.events == {}
    assert simulate(bag.scenario).differences(bag.record) == []


@pytest.mark.unmeasured
def test_a_planned_loss_in_single_steps_and_another_graph_at_the_same_step_keep_their_bits(
    operator: Operator,
) -> None:
    operator.fly_with_losses("sat2", 100, 10.0)
    due = operator.set_graph_at(100, [[0, 0, 1], [1, 0, 1], [1, 1, 0]])
    for _ in range(30):
        operator.ask(services.STEP)
    operator.ask(services.RESUME)
    bag = operator.landed()
    assert list(bag.events) == [due]
    assert_flies_again(bag)


@pytest.mark.unmeasured
def test_a_satellite_comes_back_from_a_checkpoint_of_before_it_got_another_neighbour(
    operator: Operator,
) -> None:
    # Checkpoints every 50 steps; lost 10 steps after the last one, between which the graph changes.
    operator.fly_with_losses("sat1", 60, 25.0)
    due = operator.set_graph_at(55, [[0, 1, 1], [1, 0, 1], [1, 1, 0]])
    operator.ask(services.RESUME)
    bag = operator.landed()
    assert list(bag.events) == [due]
    (first,) = [
        event
        for event in bag.scenario.membership_plan().events[due + 25]
        if isinstance(event, SatelliteRejoined)
    ]
    assert first.checkpoint == due - 5
    assert_flies_again(bag)
