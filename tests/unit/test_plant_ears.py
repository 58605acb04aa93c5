"""Who is to blame when a step does not go on: not those who wait for a word of somebody else themselves."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from satform_msgs.msg import Command

from flights import shortened
from satform.channels import PLANT, channels, heard_by
from satform.muster import Muster
from satform_nodes import plant_ears, topics
from satform_nodes.entry import Refusals
from satform_nodes.plant_ears import PlantEars
from satform_nodes.wire import layout


class Network:
    """Stands for the executor: brings to the plant what a satellite says."""

    def __init__(self) -> None:
        self._callbacks: dict[str, Callable[[bytes, str], None]] = {}

    def subscribe(self, _node: Any, _kind: Any, topic: str, callback: Any, *_: Any) -> None:
        self._callbacks[topic] = callback

    def command(self, name: str, step: int) -> None:
        data = layout(Command, topics.FRAME).pack(0, 0, step, *[0.0] * 6, 0, 0, *[0.0] * 8)
        self._callbacks[topics.command(name)](data, name)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(plant_ears.time, "monotonic", lambda: clock.now)
    return clock


def test_who_repeats_what_it_said_last_is_not_quiet_and_who_says_nothing_is(clock: SimpleNamespace) -> None:
    scenario = shortened("triangle", 10.0)
    network = Network()
    ears = PlantEars(
        SimpleNamespace(),  # type: ignore[arg-type]
        network,  # type: ignore[arg-type]
        heard_by(PLANT, channels(scenario)),
        Muster(scenario, ["recorder"]),
        Refusals(),
        lambda: None,
        lambda _name, _checkpoint: None,
        clocked=False,
    )
    names = ["sat1", "sat2", "sat3"]
    for name in names:
        network.command(name, 0)
    clock.now += 1.0
    # The second has been stopped before it told its neighbours where it is; they wait, and repeat themselves.
    for name in ("sat1", "sat3"):
        network.command(name, 0)
    clock.now += 1.0
    assert ears.quiet(names, 2.0) == ["sat2"]
    assert ears.quiet(["sat1", "recorder"], 2.0) == ["recorder"]
    assert ears.quiet(names, 0.5) == names
