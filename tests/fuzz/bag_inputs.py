# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Damaged bags of a short flight with a lost satellite, its rejoin and a changed gain, and their readers."""

from collections.abc import Callable
from pathlib import Path
from random import Random

from byte_damage import damaged
from input_kind import Input
from mcap_damage import damaged_bag
from rclpy.serialization import serialize_message
from satform_msgs.msg import Command, FormationStatus, ParameterChange
from yaml_damage import Damage, yaml_text

from bag_writing import PROFILES, messages_of, write
from flights import shortened
from satform.bag.errors import BagError
from satform.communication.topic_table import topic_name
from satform.flight.simulate import simulate
from satform_nodes.bag.recovery import is_whole, recover
from satform_nodes.transport.message_definitions import described
from satform_tools.errors import CommandError
from satform_tools.run import stored_run

_STEPS = 4
_NAMES = ["sat1", "sat2", "sat3"]
_COMPLETE = {"edge_receivers": [0, 0, 1, 1, 2, 2], "edge_senders": [1, 2, 0, 2, 0, 1]}

_DESCRIPTIONS = (
    b"[" * 100_000,
    b"{a: &a [x, x, x, x, x, x, x, x, x], b: &b [*a, *a, *a, *a, *a, *a, *a], c: [*b, *b, *b, *b, *b]}",
    b"a: &a {<<: *a}",
    b"\xff\xfe",
    b"- " * 50_000,
)
"""Texts beside a bag where its description should be."""


def bag_inputs(folder: Path) -> Callable[[Random, Path], Input]:
    """What makes damaged bags.

    Args:
        folder: for the whole bag.
    """
    scenario = shortened("triangle", _STEPS * 0.5)
    writer = write(
        folder / "bag", scenario, messages_of(simulate(scenario)), close=False, statuses=list(_statuses())
    )
    changes = described(ParameterChange)
    topic = writer.add_topic(topic_name("parameter_changes", "sat3"), changes, PROFILES)
    change = ParameterChange(step=3, name="controller.switching_gain", value=[0.1, 0.2, 0.3])
    writer.write(topic, 0, serialize_message(change), 3)
    writer.close()
    (file,) = (folder / "bag").glob("*.mcap")
    content, description = file.read_bytes(), (folder / "bag" / "metadata.yaml").read_bytes()
    scenarios = Damage.of([scenario.model_dump(mode="json", exclude_unset=True)])

    def scenario_text(draw: Random) -> bytes:
        whole = scenario.to_json().encode()
        if draw.random() < 0.5:
            return yaml_text(scenarios.changed(draw, scenarios.data[0]))
        return damaged(draw, whole)

    def make(draw: Random, place: Path) -> Input:
        bag = place / "bag_0.mcap"
        bag.write_bytes(damaged_bag(draw, content, scenario_text))
        if draw.random() < 0.1:
            text = draw.choice(_DESCRIPTIONS) if draw.random() < 0.3 else damaged(draw, description)
            (place / "metadata.yaml").write_bytes(text)
        if draw.random() < 0.1:
            return Input(lambda: _recovered(bag, place / "new"), str(place), (BagError,), recovery(bag))
        return Input(lambda: stored_run.find(bag), str(place), (CommandError,), recovery(bag), repairs=True)

    return make


def recovery(bag: Path) -> list[str]:
    """The command that recovers a bag."""
    return ["recover", str(bag), "--out", str(bag.parent / "recovered")]


def _recovered(bag: Path, new: Path) -> None:
    is_whole(bag)
    recover(bag, new)
    if not is_whole(new):
        raise AssertionError(f"what was recovered from {bag} is not whole")


def _statuses() -> list[FormationStatus]:
    """A satellite is lost at step 1 and rejoins at step 3."""

    def status(version: int, step: int, alive: list[bool], **more: object) -> FormationStatus:
        return FormationStatus(
            version=version,
            step=step,
            phase=FormationStatus.FLYING,
            last_step=_STEPS,
            satellites=_NAMES,
            alive=alive,
            algebraic_connectivity=3.0,
            **{**_COMPLETE, **more},
        )

    final = Command(step=0)
    return [
        status(0, 0, [True] * 3),
        status(1, 1, [True, False, True], lost=["sat2"], final_commands=[final], reason="no answer"),
        status(2, 3, [True] * 3, rejoined=["sat2"], rejoin_checkpoints=[1], reason="rejoined"),
    ]
