# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios with mistakes, and what the loader finds in them."""

import pytest

from flights import SCENARIOS
from satform.scenario import Problem, ScenarioError, parse_scenario

TRIANGLE = (SCENARIOS / "triangle.yaml").read_text()


def problems(text: str, *changes: str) -> list[Problem]:
    """What is wrong with the text of a scenario."""
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "f.yaml", changes)
    return caught.value.problems


def broken(old: str, new: str) -> list[Problem]:
    """What is wrong with the triangle after one replacement."""
    assert old in TRIANGLE
    return problems(TRIANGLE.replace(old, new, 1))


def changed_field(text: str, old: str, new: str, field: str) -> tuple[str, int]:
    """What is wrong with a field after one replacement, and how many lines it is below what was replaced."""
    assert old in text
    (problem,) = (found for found in problems(text.replace(old, new, 1)) if found.field == field)
    assert problem.line is not None
    return problem.sentence, problem.line - text[: text.index(old)].count("\n") - 1


def line_of(start: str, text: str = TRIANGLE) -> int:
    return next(number for number, line in enumerate(text.splitlines(), 1) if line.strip().startswith(start))


DISTURBED = (
    TRIANGLE.replace("expect:", "checkpoint_period: 60.0\nexpect:", 1)
    + """links:
  default: {loss: 0.1, delay: 2.0}
  edges:
    - {sender: sat1, receiver: sat2, outages: [{begin: 10.0, end: 20.0}]}
graph_schedule:
  - {at: 100.0, graph: {kind: line}}
  - {at: 200.0, add: [[sat1, sat3]], remove: [[sat1, sat2]]}
faults:
  - {kind: satellite_lost, satellite: sat2, at: 500.0, rejoin_at: 600.0}
  - {kind: byzantine, satellite: sat1, at: 50.0, drift: 1.0}
"""
)
