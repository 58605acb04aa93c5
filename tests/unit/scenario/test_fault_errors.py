# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Links, changes of the graph and faults of a scenario that cannot be, each named with its line."""

import pytest

from flights import SCENARIOS
from satform.scenario import parse_scenario
from scenario_problems import DISTURBED, changed_field, line_of, problems

BYZANTINE = "kind: byzantine, satellite: sat1, at: 50.0, drift: 1.0"


def test_a_scenario_in_which_much_goes_wrong_is_a_scenario_all_the_same() -> None:
    scenario = parse_scenario(DISTURBED)
    assert scenario.links is not None
    assert len(scenario.graph_schedule) == len(scenario.faults) == 2
    assert parse_scenario(scenario.to_json()) == scenario


@pytest.mark.parametrize(
    ("old", "new", "field", "sentence"),
    [
        ("loss: 0.1", "loss: 1.1", "links.default.loss", "found 1.1; it should be"),
        ("loss: 0.1", "lost: 0.1", "links.default.lost", "there is no such field; did you mean loss?"),
        ("delay: 2.0", "delay: 9000.0", "links.default", "which is more than 10000 steps of 0.5 s"),
        ("sender: sat1", "sender: sat9", "links.edges[0]", "no satellite sat9; there are sat1, sat2, sat3"),
        ("receiver: sat2", "receiver: sat1", "links.edges[0]", "sat1 has no link to itself"),
        ("end: 20.0", "end: 10.0", "links.edges[0].outages[0]", "end 10 s is not later than begin 10 s"),
        (
            "graph_schedule:",
            "    - {sender: sat1, receiver: sat2}\ngraph_schedule:",
            "links.edges[1]",
            "the link from sat1 to sat2 is described twice",
        ),
        ("at: 100.0", "at: 12000.0", "graph_schedule[0].at", "not earlier than the flight's end at 12000 s"),
        ("graph: {kind: line}", "graph: {kind: lime}", "graph_schedule[0].graph", "did you mean line?"),
        ("graph: {kind: line}", "", "graph_schedule[0]", "nothing changes: give a graph, or edges"),
        ("graph: {kind: line}", "graph: {kind: star, centre: 3}", "graph_schedule[0]", "numbered 0 to 2"),
        ("[[sat1, sat3]]", "[[sat1, sat4]]", "graph_schedule[1]", "there is no satellite sat4; there are"),
        ("[[sat1, sat3]]", "[[sat1, sat1]]", "graph_schedule[1]", "sat1 cannot receive from itself"),
        ("[[sat1, sat3]]", "[[sat1, sat2]]", "graph_schedule[1]", "cannot both come and go"),
        ("[[sat1, sat3]]", "[[sat1]]", "graph_schedule[1].add[0][1]", "is missing"),
        ("kind: satellite_lost", "kind: lost", "faults[0]", "there is no kind 'lost'"),
        ("satellite: sat2", "satellite: sat7", "faults[0].satellite", "no satellite sat7; there are sat1"),
        ("at: 500.0", "at: 0.0", "faults[0]", "a satellite that never flies is left out instead"),
        ("at: 500.0", "at: 12000.0, memory: plan", "faults[0]", "rejoin_at 600 s is earlier than at 12000 s"),
        ("rejoin_at: 600.0", "rejoin_at: 400.0", "faults[0]", "rejoin_at 400 s is earlier than at 500 s"),
        ("at: 50.0", "at: 12000.0", "faults[1].at", "at 12000 s is not earlier than the flight's end"),
        (
            "  - {kind: byzantine",
            "  - {kind: satellite_lost, satellite: sat2, at: 600.0}\n  - {kind: byzantine",
            "faults[1]",
            "sat2 does not fly at 600 s, so that it cannot be lost then",
        ),
        (
            BYZANTINE,
            "kind: weak_thruster, satellite: sat1, at: 50.0, factor: 0.5",
            "faults[1]",
            "sat1 has no thruster that could fail in this way",
        ),
        (
            BYZANTINE,
            "kind: frozen_sensor, satellite: sat1, at: 50.0",
            "faults[1]",
            "sat1 has no sensor that could fail in this way",
        ),
        (
            BYZANTINE,
            "kind: clock_offset, satellite: sat1, at: 50.0, until: 40.0, offset: 1.0",
            "faults[1]",
            "until 40 s is not later than at 50 s",
        ),
        ("checkpoint_period: 60.0", "checkpoint_period: 0.0", "checkpoint_period", "found 0.0; it should be"),
        (
            "checkpoint_period",
            "tolerated_losses: -1\ncheckpoint_period",
            "tolerated_losses",
            "found -1; it should",
        ),
    ],
)
def test_what_cannot_go_wrong_in_this_way_is_named_with_its_line(
    old: str, new: str, field: str, sentence: str
) -> None:
    found, below = changed_field(DISTURBED, old, new, field)
    assert sentence in found
    assert -1 <= below <= 1


def test_who_comes_back_from_a_checkpoint_needs_one() -> None:
    text = DISTURBED.replace("checkpoint_period: 60.0\n", "")
    (problem,) = problems(text)
    assert (problem.field, problem.line) == ("faults[0]", line_of("- {kind: satellite_lost", text))
    assert (
        "none are stored: give the scenario a checkpoint_period, or the fault memory: plan"
        in problem.sentence
    )


def test_who_follows_a_neighbour_keeps_its_graph_and_tells_no_phase_to_lie_about() -> None:
    text = (SCENARIOS / "directed_triangle.yaml").read_text()
    (change,) = problems(text + "graph_schedule: [{at: 1.0, graph: {kind: none}}]\n")
    assert "needs it as an in-neighbour all the time" in change.sentence
    assert change.line == len(text.splitlines()) + 1
    (lie,) = problems(text + "faults: [{kind: byzantine, satellite: sat1, at: 1.0}]\n")
    assert "send no phase to falsify" in lie.sentence


def test_a_fault_of_the_command_line_is_meant_for_the_flight_that_is_set_there() -> None:
    late = "faults=[{kind: byzantine, satellite: sat1, at: 200.0}]"
    (problem,) = problems(DISTURBED, "timing.duration=150.0", "expect=[]", late)
    assert problem.file == f"--set {late}"
    assert "not earlier than the flight's end at 150 s" in problem.sentence
