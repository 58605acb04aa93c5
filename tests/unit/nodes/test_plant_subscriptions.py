# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who is to blame when a step does not go on: not those who wait for a word of somebody else themselves."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from rclpy.serialization import serialize_message
from satform_msgs.msg import Command, NodeReady

from flights import shortened
from satform.communication import topic_table
from satform.communication.message_validator import RejectionCounter
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import PLANT, channels, subscribed_by, topic_name
from satform.flight.compile import topic_plan
from satform.membership.membership_manager import MembershipManager
from satform.scenario import Scenario
from satform_nodes.plant import subscriptions as plant_subscriptions
from satform_nodes.plant.subscriptions import PlantSubscriptions
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.fast_path import MANY_SUBSCRIPTIONS
from satform_tools.bench.scaling import ring


class Network:
    """Stands for the executor: brings to the plant what a satellite says."""

    def __init__(self, scenario: Scenario) -> None:
        self._callbacks: dict[str, Callable[[bytes, str], None]] = {}
        self._stamps = Stamps(scenario.timing.step, scenario.timing.step_nanoseconds)
        self.next_awaited: Callable[[], Any] | None = None
        self.lacking: Callable[[], Any] = lambda: None

    def subscribe(self, _node: Any, _kind: Any, topic: str, callback: Any, *_: Any) -> str:
        self._callbacks[topic] = callback
        return topic

    def await_in_turn(self, next_awaited: Callable[[], Any] | None) -> None:
        self.next_awaited = next_awaited

    def await_together(self, lacking: Callable[[], Any]) -> None:
        self.lacking = lacking

    def command(self, name: str, step: int) -> None:
        nothing = (*[0.0] * 6, 0, 0, *[0.0] * 8, 0, 0.0)
        data = layout(Command, topic_table.FRAME).pack(*self._stamps.at(step), step, *nothing)
        self._callbacks[topic_name("command", name)](data, name)

    def publish(self, topic: str, message: Any, publisher: str) -> None:
        self._callbacks[topic](serialize_message(message), publisher)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(plant_subscriptions.time, "monotonic", lambda: clock.now)
    return clock


def plant_ears_of(scenario: Scenario, network: Network, membership: MembershipManager) -> PlantSubscriptions:
    def take(index: int, data: bytes) -> None:
        subscriptions.commands.take(index, data)

    subscriptions = PlantSubscriptions(
        SimpleNamespace(),  # type: ignore[arg-type]
        network,  # type: ignore[arg-type]
        subscribed_by(PLANT, channels(topic_plan(scenario))),
        membership,
        RejectionCounter(),
        take,
        lambda _name, _checkpoint: None,
        lambda _name, _version: None,
        Stamps(scenario.timing.step, scenario.timing.step_nanoseconds),
        clocked=False,
    )
    return subscriptions


def test_who_repeats_what_it_said_last_is_not_quiet_and_who_says_nothing_is(clock: SimpleNamespace) -> None:
    scenario = shortened("triangle", 10.0)
    network = Network(scenario)
    ears = plant_ears_of(scenario, network, MembershipManager(scenario.membership_plan(), ["recorder"]))
    names = ["sat1", "sat2", "sat3"]
    for name in names:
        network.command(name, 0)
    clock.now += 1.0
    # The second has been stopped before it told its neighbours where it is; they wait, and repeat themselves.
    for name in ("sat1", "sat3"):
        network.command(name, 0)
    clock.now += 1.0
    assert ears.unresponsive(names, 2.0) == ["sat2"]
    assert ears.unresponsive(["sat1", "recorder"], 2.0) == ["recorder"]
    assert ears.unresponsive(names, 0.5) == names


def test_of_many_the_last_whose_command_is_due_is_waited_for_and_the_lost_are_not(
    clock: SimpleNamespace,
) -> None:
    scenario = ring(MANY_SUBSCRIPTIONS, 10)
    network = Network(scenario)
    membership = MembershipManager(scenario.membership_plan(), [])
    ears = plant_ears_of(scenario, network, membership)
    assert network.next_awaited is None
    ears.begin()
    assert network.next_awaited is not None
    last = f"s{MANY_SUBSCRIPTIONS - 1}"
    assert network.next_awaited() == topic_name("command", last)
    for name in membership.names:
        network.command(name, 0)
    assert network.next_awaited() is None
    assert membership.complete
    membership.begin(1)
    assert network.next_awaited() is None
    membership.close()
    assert network.next_awaited() == topic_name("command", last)
    for place in (2, 1, 4):
        network.command(f"s{MANY_SUBSCRIPTIONS - place}", 1)
    assert network.next_awaited() == topic_name("command", f"s{MANY_SUBSCRIPTIONS - 3}")
    membership.lose(MANY_SUBSCRIPTIONS - 3, "gone")
    assert network.next_awaited() == topic_name("command", f"s{MANY_SUBSCRIPTIONS - 5}")


def test_few_are_all_waited_for_at_once(clock: SimpleNamespace) -> None:
    scenario = shortened("triangle", 10.0)
    network = Network(scenario)
    membership = MembershipManager(scenario.membership_plan(), [])
    plant_ears_of(scenario, network, membership).begin()
    assert network.next_awaited is None
    assert network.lacking() == ["/sat1/command", "/sat2/command", "/sat3/command"]
    network.command("sat2", 0)
    assert network.lacking() == ["/sat1/command", "/sat3/command"]
    for name in ("sat1", "sat3"):
        network.command(name, 0)
    assert network.lacking() == []
    membership.begin(1)
    # No command is due before the states are published.
    assert network.lacking() is None
    membership.close()
    membership.lose(0, "gone")
    assert network.lacking() == ["/sat2/command", "/sat3/command"]


@pytest.mark.parametrize(
    ("version", "offered", "other"),
    [(topic_table.INTERFACE_VERSION, ["sat2"], []), (topic_table.INTERFACE_VERSION + 1, [], ["sat2"])],
)
def test_node_written_by_another_version_of_the_interface_is_not_ready(
    version: int, offered: list[str], other: list[str]
) -> None:
    scenario = shortened("triangle", 10.0)
    network = Network(scenario)
    ready: list[str] = []
    rejected: list[str] = []
    PlantSubscriptions(
        SimpleNamespace(),  # type: ignore[arg-type]
        network,  # type: ignore[arg-type]
        subscribed_by(PLANT, channels(topic_plan(scenario))),
        MembershipManager(scenario.membership_plan()),
        RejectionCounter(),
        lambda _index, _data: None,
        lambda name, _checkpoint: ready.append(name),
        lambda name, _version: rejected.append(name),
        Stamps(scenario.timing.step, scenario.timing.step_nanoseconds),
        clocked=False,
    )
    network.publish(topic_table.NODE_READY, NodeReady(node="/sat2", interface=version), "sat2")
    assert (ready, rejected) == (offered, other)
