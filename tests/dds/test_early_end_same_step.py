# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight that diverges ends over DDS at the step at which it ends in one process, and says the same."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from flights import shortened
from flown import flown
from satform.bag.reader import Bag, read_bag
from satform.common.exit_codes import EXIT_ENDED_EARLY
from satform.flight.compile import compile_scenario
from satform.flight.simulate import simulate
from satform.scenario import Scenario
from satform_bringup.deployment.node_processes import processes
from satform_tools.run import replay as replay_command
from satform_tools.run.replay import compare

UNSTABLE = "satellite_defaults.controller.reaching_gain=5.0"

LOST_COVARIANCE = (
    "satellite_defaults.navigation.initial_position_error=1e12",
    "satellites.1.sensors.1.position_noise=1e-9",
)


def assert_ends_as_in_one_process(scenario: Scenario, bag: Bag) -> None:
    once = simulate(scenario)
    assert once.early_end is not None
    assert bag.record.differences(once) == []
    assert bag.complete
    again = compare(bag.scenario, bag.record, bag.events)
    assert (again.differences, again.early_end) == ((), once.early_end.sentence)


@pytest.mark.parametrize("group", [1, pytest.param(3, marks=pytest.mark.unmeasured)])
@pytest.mark.parametrize("changes", [(), ("limits.speed=5000.0",)], ids=["by a command", "by the truth"])
def test_a_diverging_flight_ends_at_the_step_of_the_flight_in_one_process(
    group: int, changes: tuple[str, ...], tmp_path: Path
) -> None:
    scenario = shortened("triangle", 500.0, UNSTABLE, *changes)
    flight, bag = flown(scenario, tmp_path / "run", group=group)
    assert (flight.lost, flight.stopped) == ((), False)
    assert flight.early_end is not None
    assert flight.reason == flight.early_end.sentence
    assert flight.steps == bag.record.steps
    assert_ends_as_in_one_process(scenario, bag)
    assert replay_command.replay(tmp_path / "run", as_json=True) == EXIT_ENDED_EARLY


def test_a_lost_covariance_ends_the_flight_with_the_sentence_of_the_flight_in_one_process(
    tmp_path: Path,
) -> None:
    scenario = shortened("gnss_differential_pair", 100.0, *LOST_COVARIANCE)
    flight, bag = flown(scenario, tmp_path / "run")
    assert flight.early_end is not None
    assert flight.early_end.quantity == "estimated position"
    assert_ends_as_in_one_process(scenario, bag)


def test_on_the_wall_clock_a_diverging_flight_ends_with_the_same_code(
    start_run: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    options = ["--mode", "realtime", "--rate", "10", "--set", UNSTABLE, "--set", "timing.duration=500.0"]
    process = start_run("triangle", *options)
    output, errors = process.communicate(timeout=180)
    assert process.returncode == EXIT_ENDED_EARLY, output + errors
    assert "ENDED EARLY" in output
    assert "RuntimeWarning" not in output + errors
    assert read_bag(tmp_path / "run" / "bag").record.early_end is not None


def test_started_one_by_one_the_plant_ends_with_the_same_code_and_the_others_in_order(
    fleet: Callable[..., list], tmp_path: Path
) -> None:
    scenario = shortened("triangle", 500.0, UNSTABLE)
    file = tmp_path / "scenario.json"
    file.write_text(scenario.to_json())
    nodes = processes(compile_scenario(scenario), file, tmp_path / "bag")
    codes = {node.name: process.wait(60) for node, process in zip(nodes, fleet(nodes), strict=True)}
    assert codes.pop("plant") == EXIT_ENDED_EARLY
    assert set(codes.values()) == {0}
    assert_ends_as_in_one_process(scenario, read_bag(tmp_path / "bag"))
