# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""New targets by the action, with progress, cancel and refusal, beside a planned change and a loss."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.node import Node
from satform_msgs.action import Reconfigure
from std_srvs.srv import Trigger

from flights import shortened
from flown import assert_flies_again
from satform.bag.reader import read_bag
from satform.flight.compile import compile_scenario
from satform.flight.simulate import simulate
from satform.membership.reconfiguration import TargetsChanged, TargetSpec
from satform.orbits.curve_specs import FixedPointSpec
from satform_bringup.deployment.node_processes import processes
from satform_nodes.plant import services
from satform_nodes.plant.reconfiguration import RECONFIGURE

LOST = "faults=[{kind: satellite_lost, satellite: behind, at: 3100.0, rejoin_at: 3500.0}]"
NEAR = FixedPointSpec(position=(0.0, 501.0, 0.0))


class Operator:
    """Someone who asks the plant."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self.feedback: list[Any] = []
        self._action = ActionClient(node, Reconfigure, RECONFIGURE)
        self._services: dict[str, Any] = {}

    def done(self, future: Any) -> Any:
        rclpy.spin_until_future_complete(self._node, future, timeout_sec=60.0)
        assert future.done()
        return future.result()

    def ask(self, service: str) -> str:
        client = self._services.get(service) or self._node.create_client(Trigger, service)
        self._services[service] = client
        assert client.wait_for_service(60.0)
        reply = self.done(client.call_async(Trigger.Request()))
        return reply.message if reply.success else ""

    def paused(self, fleet: Callable[..., list], nodes: list) -> tuple[list, int]:
        """Start a flight and pause it; its processes and the step before which it pauses."""
        fleet(nodes[:-1])
        # A flight takes about two seconds: it begins after the service has been discovered.
        assert not self.ask(services.PAUSE)
        running = fleet(nodes[-1:])
        while not (sentence := self.ask(services.PAUSE)):
            pass
        return running, int(sentence.split()[-1])

    def send(self, satellite: str, target: str, **fields: float) -> Any:
        goal = Reconfigure.Goal(satellites=[satellite], targets=[target], tolerance=5.0, **fields)
        assert self._action.wait_for_server(60.0)
        handle = self.done(self._action.send_goal_async(goal, lambda own: self.feedback.append(own.feedback)))
        assert handle.accepted
        return handle

    def outcome(self, handle: Any) -> tuple[int, Any]:
        answer = self.done(handle.get_result_async())
        return answer.status, answer.result


@pytest.fixture
def operator() -> Iterator[Operator]:
    rclpy.init()
    node = Node("operator")
    yield Operator(node)
    node.destroy_node()
    rclpy.shutdown()


def test_targets_asked_for_in_flight_are_followed_cancelled_refused_and_flown_again(
    operator: Operator, fleet: Callable[..., list], tmp_path: Path
) -> None:
    scenario = shortened("reconfiguration", 6000.0, LOST, "checkpoint_period=1000.0")
    file, checkpoints = tmp_path / "scenario.json", tmp_path / "checkpoints"
    file.write_text(scenario.to_json())
    nodes = processes(compile_scenario(scenario), file, tmp_path / "bag", 2, checkpoints)
    running, first = operator.paused(fleet, nodes)

    status, result = operator.outcome(operator.send("nobody", "{scale: 2.0}"))
    assert status == GoalStatus.STATUS_ABORTED
    assert result.message == "there is no satellite nobody; there are ahead, behind"

    near = operator.send("ahead", f'{{"curve": {NEAR.model_dump_json()}}}', hold=30.0)
    refused = operator.outcome(operator.send("behind", "{phase_offset: 1.0}"))
    assert refused[0] == GoalStatus.STATUS_ABORTED
    assert "another reconfiguration is under way" in refused[1].message
    for _ in range(5):
        operator.ask(services.STEP)
    status, result = operator.outcome(near)
    assert status == GoalStatus.STATUS_SUCCEEDED, result.message
    assert result.step == first + 3
    assert f"reached at step {first + 3}" in result.message
    assert result.delta_v[0] > 0.0
    assert {own.since for own in operator.feedback} == {first}
    assert min(own.distance[0] for own in operator.feedback if np.isfinite(own.distance[0])) < 1.01

    far = operator.send("behind", "{curve: {kind: fixed_point, position: [0.0, -900.0, 0.0]}}")
    for _ in range(3):
        operator.ask(services.STEP)
    assert len(operator.done(far.cancel_goal_async()).goals_canceling) == 1
    for _ in range(2):
        operator.ask(services.STEP)
    status, result = operator.outcome(far)
    assert status == GoalStatus.STATUS_CANCELED
    back = result.step
    assert f"the former targets are back since step {back}" in result.message

    kept = operator.send("ahead", "{curve: {kind: fixed_point, position: [0.0, 502.0, 0.0]}}", hold=1e6)
    answer = kept.get_result_async()
    operator.ask(services.RESUME)
    ended = operator.done(answer)
    assert ended.status == GoalStatus.STATUS_ABORTED
    assert ended.result.message == "not reached before ahead got another target at step 300"

    for process in running:
        assert process.wait(120) == 0
    bag = read_bag(tmp_path / "bag")
    assert bag.complete
    changes = {step: event for step, (event,) in bag.events.items()}
    assert changes[first].targets == {0: TargetSpec(curve=NEAR)}
    assert changes[back].targets == {1: TargetSpec()}
    assert len(changes) == 4
    assert all(isinstance(event, TargetsChanged) for event in changes.values())
    reference = bag.record.reference_position
    assert reference[first, 0].tolist() == [0.0, 501.0, 0.0]
    assert reference[back - 1, 1].tolist() == [0.0, -900.0, 0.0]
    assert reference[back, 1].tolist() == [0.0, -500.0, 0.0]
    # The planned change is the last word for both, also for the one that was lost when it came.
    planned = simulate(scenario).reference_position
    np.testing.assert_array_equal(reference[310:, 0], planned[310:, 0])
    np.testing.assert_array_equal(reference[350:, 1], planned[350:, 1])
    assert_flies_again(bag)
