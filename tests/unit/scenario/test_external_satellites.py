# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Satellites that somebody else flies: who starts what, who waits for what, what a scenario says of it."""

from pathlib import Path

import pytest

from flights import shortened
from satform.communication.topic_table import PLANT, RECORDER, channels
from satform.flight.compile import compile_scenario
from satform.flight.simulate import simulate
from satform.scenario import Scenario, ScenarioError
from satform_bringup.deployment.external_nodes import awaited, write_environment
from satform_bringup.deployment.node_processes import processes
from satform_tools.check.external_satellites import external_satellite_warnings

EXTERNAL = {"satellites[sat2].external": True}


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return shortened("triangle", 10.0).with_(EXTERNAL)


@pytest.mark.parametrize("group", [1, 2])
def test_everything_but_the_external_satellite_is_started(scenario: Scenario, group: int) -> None:
    plan = compile_scenario(scenario)
    started = processes(plan, Path("scenario.json"), Path("bag"), group)
    flown = [
        name
        for node in started
        for name in node.parameters.get("satellites", [node.name])  # type: ignore[union-attr]
    ]
    assert flown == ["plant", "sat1", "sat3", "recorder"]


def test_flight_in_one_process_is_flown_by_the_scenarios_own_law_and_has_the_same_digest(
    scenario: Scenario,
) -> None:
    own = shortened("triangle", 10.0)
    assert scenario.digest() == own.digest()
    assert simulate(scenario).digest() == simulate(own).digest()


def test_external_satellite_need_not_publish_for_observers(scenario: Scenario) -> None:
    table = channels(compile_scenario(scenario).topics)
    optional = {channel.topic for channel in table if channel.optional}
    assert {"/sat2/tracking", "/sat2/parameter_changes", "/diagnostics"} <= optional
    assert not optional & {"/sat2/command", "/sat2/arc_length", "/sat2/state", "/sat1/tracking"}
    (tracking,) = [channel for channel in table if channel.topic == "/sat2/tracking"]
    assert tracking.required_subscribers(recorded=True) == (RECORDER,)
    (state,) = [channel for channel in table if channel.topic == "/sat2/state"]
    assert (state.publishers, state.required_subscribers(recorded=False)) == ((PLANT,), ("sat2",))


def test_host_need_not_run_an_external_satellite_and_only_one_may(scenario: Scenario) -> None:
    alpha = {"name": "alpha", "address": "192.168.1.10", "runs": ["plant", "recorder", "sat1", "sat3"]}
    assert len(scenario.with_(hosts=[alpha]).hosts) == 1
    beta = {"name": "beta", "address": "192.168.1.11", "runs": ["sat2"]}
    assert len(scenario.with_(hosts=[alpha, beta]).hosts) == 2
    twice = {**alpha, "runs": [*alpha["runs"], "sat2"]}
    with pytest.raises(ScenarioError, match="sat2 is run 2 times"):
        scenario.with_(hosts=[twice, beta])


def test_environment_is_written_for_a_shell(scenario: Scenario, tmp_path: Path) -> None:
    write_environment(tmp_path, 17, {"A": "with space", "B": "", "ROS_LOG_DIR": "logs"})
    text = (tmp_path / "environment.sh").read_text()
    assert text.splitlines() == ["export ROS_DOMAIN_ID=17", "export A='with space'", "unset B"]
    sentence = awaited(compile_scenario(scenario), tmp_path, "/f1")
    assert "up to 120 s for the node /f1/sat2" in sentence
    assert str(tmp_path / "environment.sh") in sentence


def test_check_names_what_a_foreign_program_would_have_to_do(scenario: Scenario) -> None:
    assert external_satellite_warnings(scenario) == []
    lying = {"kind": "byzantine", "satellite": "sat2", "at": 1.0, "arc_length": 5.0}
    late = {"default": {"loss": 0.1}}
    found = external_satellite_warnings(scenario.with_(faults=[lying], links=late))
    assert [sentence.split(":")[0] for sentence in found] == ["faults[0]", "links"]
    own = shortened("triangle", 10.0).with_(faults=[lying], links=late)
    assert external_satellite_warnings(own) == []
