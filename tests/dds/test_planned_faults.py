# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Faults that a scenario plans have the same bits over DDS as in one process."""

from pathlib import Path

import pytest

from flights import shortened
from flown import assert_as_in_one_process, flown, repetitions
from satform.scenario import Scenario

LOST_AND_BACK = (
    "checkpoint_period=10.0",
    "faults=[{kind: satellite_lost, satellite: sat2, at: 30.0, rejoin_at: 60.0}]",
)
BAD_LINKS = (
    "links={default: {loss: 0.2, delay: 1.0, jitter: 1.5, duplication: 0.1, reordering: 0.1}, "
    "edges: [{sender: sat1, receiver: sat2, loss: 0.5}]}"
)
CHANGING_GRAPH = (
    "graph_schedule=[{at: 20.0, remove: [[sat1, sat2]]}, {at: 40.0, graph: {kind: line}}, "
    "{at: 60.0, graph: {kind: complete}}]"
)


def triangle(*changes: str, duration: float = 100.0) -> Scenario:
    return shortened("triangle", duration, *changes)


def hexagon(*changes: str) -> Scenario:
    return shortened("ring_six", 100.0, *changes)


@pytest.mark.parametrize(
    ("memory", "group"),
    [
        ("checkpoint", 1),
        ("plan", 3),
        pytest.param("checkpoint", 3, marks=pytest.mark.unmeasured),
        pytest.param("plan", 1, marks=pytest.mark.unmeasured),
    ],
)
def test_a_satellite_that_the_scenario_kills_and_brings_back_flies_as_in_one_process(
    memory: str, group: int, tmp_path: Path
) -> None:
    fault = f"faults=[{{kind: satellite_lost, satellite: sat2, at: 30.0, rejoin_at: 60.0, memory: {memory}}}]"
    flight, bag = flown(triangle("checkpoint_period=10.0", fault), tmp_path / "run", group=group)
    assert flight.lost == ()
    assert [(loss.name, loss.step, loss.planned) for loss in flight.losses] == [("sat2", 60, True)]
    assert [(back.name, back.step) for back in flight.returns] == [("sat2", 120)]
    assert_as_in_one_process(bag)


def test_losses_bad_links_and_a_changing_graph_go_together(tmp_path: Path) -> None:
    flight, bag = flown(triangle(*LOST_AND_BACK, BAD_LINKS, CHANGING_GRAPH), tmp_path / "run")
    assert flight.lost == ()
    assert_as_in_one_process(bag)


@pytest.mark.parametrize(
    "group", [6, *(pytest.param(group, marks=pytest.mark.unmeasured) for group in (2, 3))]
)
def test_satellites_that_share_processes_fly_as_in_one_process(group: int, tmp_path: Path) -> None:
    _, bag = flown(hexagon(), tmp_path / "run", group=group)
    assert_as_in_one_process(bag)


MANY_AT_ONCE = (
    "checkpoint_period=7.0",
    "faults=[{kind: satellite_lost, satellite: sat2, at: 20.0, rejoin_at: 50.0}, "
    "{kind: satellite_lost, satellite: sat5, at: 20.0, rejoin_at: 50.0, memory: plan}, "
    "{kind: satellite_lost, satellite: sat2, at: 51.0, rejoin_at: 80.0}, "
    "{kind: satellite_lost, satellite: sat3, at: 50.0}]",
    "graph_schedule=[{at: 20.0, graph: {kind: line}}, {at: 50.0, graph: {kind: complete}}]",
)
"""Two lost in one step, with another graph; back as a third is lost; one lost again a step later."""


@pytest.mark.parametrize("group", [2, pytest.param(1, marks=pytest.mark.unmeasured)])
def test_losses_and_returns_in_the_same_step_keep_their_bits(group: int, tmp_path: Path) -> None:
    flight, bag = flown(hexagon(*MANY_AT_ONCE), tmp_path / "run", group=group)
    assert flight.lost == ()
    assert len(flight.losses) == 4
    assert_as_in_one_process(bag)


@pytest.mark.usefixtures("busy_cores")
@pytest.mark.unmeasured
def test_the_state_hash_is_the_same_in_every_run_however_busy_the_machine(tmp_path: Path) -> None:
    scenario = triangle(*LOST_AND_BACK, BAD_LINKS)
    hashes = set()
    for number in range(repetitions(2)):
        _, bag = flown(scenario, tmp_path / f"run{number}")
        assert_as_in_one_process(bag)
        hashes.add(bag.record.digest())
    assert len(hashes) == 1
