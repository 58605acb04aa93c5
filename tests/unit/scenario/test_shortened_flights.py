# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flights shortened by a setting: what lies beyond the new end is left out, and said."""

import pytest

from flights import SCENARIOS, shipped
from satform.scenario import load_scenario, parse_scenario
from scenario_problems import DISTURBED, TRIANGLE, line_of, problems


def test_what_a_file_expects_beyond_the_end_of_a_shortened_flight_is_left_out_and_said() -> None:
    said: list[str] = []
    scenario = load_scenario(SCENARIOS / "triangle.yaml", ["timing.duration=6000.0"], said.append)
    every = shipped("triangle").expect
    # Those that name no end are about the whole flight as it was written.
    kept = ["arc-length spread at 6000 s", "arc-length spread settles to 1 %"]
    assert [expectation.describe() for expectation in scenario.expect] == kept
    labels = [expectation.describe() for expectation in every]
    assert list(scenario.omitted_expectations) == [label for label in labels if label not in kept]
    assert said == [f"{len(every) - 2} expectations need a longer flight and are omitted"]


def test_what_is_left_out_stays_known_to_who_reads_the_shorter_flight_again() -> None:
    scenario = load_scenario(SCENARIOS / "triangle.yaml", ["timing.duration=6000.0"])
    again = parse_scenario(scenario.to_json())
    assert again == scenario
    # Shortened once more, it lacks those of both.
    shorter = parse_scenario(scenario.to_json(), changes=["timing.duration=3000.0"])
    assert len(shorter.omitted_expectations) == len(scenario.omitted_expectations) + 2
    # What is not judged does not make it another flight.
    assert again.model_copy(update={"omitted_expectations": ()}).digest() == scenario.digest()


@pytest.mark.parametrize("change", ["timing.duration=12000.0", "timing.duration=12000.5", "timing.step=1.0"])
def test_nothing_is_left_out_of_a_flight_that_is_no_shorter(change: str) -> None:
    said: list[str] = []
    scenario = load_scenario(SCENARIOS / "triangle.yaml", [change], said.append)
    assert scenario.expect == shipped("triangle").expect
    assert not said


def test_a_file_that_expects_something_beyond_its_own_end_stays_wrong() -> None:
    short = TRIANGLE.replace("duration: 12000.0", "duration: 9600.0")
    for changes in ((), ("timing.duration=9000.0",)):
        (first, *_) = problems(short, *changes)
        assert first.line == line_of("- {kind: arc_length_spread, at: 12000.0", short)
        assert "at 12000 s is later than the flight's end" in first.sentence


def test_what_is_expected_on_the_command_line_is_meant_for_the_flight_that_is_set_there() -> None:
    late = "expect=[{kind: arc_length_spread, at: 5000.0, below: 1.0, source: a test}]"
    (problem,) = problems(TRIANGLE, "timing.duration=3000.0", late)
    assert problem.file == f"--set {late}"
    (problem,) = problems(TRIANGLE, "timing.duration=3000.0", "expect.0.at=5000.0")
    assert problem.field == "expect[0]"


def test_problems_of_a_shortened_flight_keep_their_lines() -> None:
    last = TRIANGLE.rstrip().rpartition("\n")[2]
    unknown = TRIANGLE.replace(
        last, "  - {kind: arc_length_spread, at: 1.0, below: 1.0, source: a, labell: a}"
    )
    (problem,) = problems(unknown, "timing.duration=3000.0")
    line = line_of("- {kind: arc_length_spread, at: 1.0,", unknown)
    assert (problem.line, problem.field) == (line, "expect[16].labell")


def test_what_would_happen_beyond_the_end_of_a_shortened_flight_is_left_out_and_said() -> None:
    said: list[str] = []
    scenario = parse_scenario(DISTURBED, changes=["timing.duration=150.0", "expect=[]"], remark=said.append)
    assert [fault.satellite for fault in scenario.faults] == ["sat1"]
    assert len(scenario.graph_schedule) == 1
    assert said == [
        "1 fault begins after the end of the shorter flight and is omitted",
        "1 change of the graph is after the end of the shorter flight and is omitted",
    ]
    shortest: list[str] = []
    parse_scenario(DISTURBED, changes=["timing.duration=50.0", "expect=[]"], remark=shortest.append)
    assert shortest == [
        "2 faults begin after the end of the shorter flight and are omitted",
        "2 changes of the graph are after the end of the shorter flight and are omitted",
    ]
