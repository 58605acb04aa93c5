# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Conformance with the interface: own nodes and examples keep all rules, a faulty program breaks its own."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix

from satform_tools.conformance.rules import RULES

pytestmark = pytest.mark.unmeasured

ROOT = Path(__file__).parents[2]
FOREIGN = f"{sys.executable} {ROOT}/docs/external_satellites/python/foreign_satellite.py"
NODE = f"{get_package_prefix('satform_nodes')}/lib/satform_nodes/satellite_node"


def outcomes(node: str, *options: str) -> tuple[int, dict[str, dict[str, object]]]:
    """Exit code and outcome of each rule."""
    done = subprocess.run(
        [sys.executable, "-m", "satform_tools", "conformance", node, "--json", *options],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode in (0, 1), done.stdout + done.stderr
    return done.returncode, json.loads(done.stdout)


def own_node(name: str) -> str:
    parameters = f"-p 'scenario:=\"{{scenario}}\"' -p satellite:={name} -p recorded:=true"
    return f"{NODE} --ros-args -r __node:={name} {parameters}"


@pytest.mark.parametrize(("scenario", "name"), [("triangle", "sat2"), ("ring_six", "sat1")])
def test_own_node_keeps_all_rules(scenario: str, name: str) -> None:
    code, found = outcomes(f"/{name}", "--scenario", scenario, "--command", own_node(name))
    assert {rule: each["found"] for rule, each in found.items() if each["found"]} == {}
    untried = {rule for rule, each in found.items() if each["outcome"] == "not tried"}
    # Of the complete graph no edge is missing that could be a new one.
    assert untried == ({"F3"} if scenario == "triangle" else set())
    assert code == 0


def test_example_in_python_keeps_all_rules() -> None:
    code, found = outcomes("/sat2", "--command", FOREIGN)
    assert {rule: each["found"] for rule, each in found.items() if each["found"]} == {}
    assert code == 0


def test_example_that_knows_no_scenario_keeps_all_rules_with_new_edges() -> None:
    program = ROOT / "docs" / "external_satellites" / "hold" / "hold_position.py"
    command = f"{sys.executable} {program} sat1"
    code, found = outcomes("/sat1", "--scenario", "ring_six", "--command", command)
    assert {rule: each for rule, each in found.items() if each["outcome"] != "kept"} == {}
    assert code == 0


FAULTS = {
    "NotMatched": "R2",
    "OtherInterface": "V1",
    "NoFirstPhase": "S1",
    "Impatient": "S2",
    "WrongStamp": "S4",
    "NotFinite": "S5",
    "OtherCopy": "S6",
    "Inconstant": "S7",
    "Mute": "S8",
    "AnyVersion": "F1",
    "Faithful": "F2",
    "Undying": "L1",
    "Endless": "X1",
}


@pytest.mark.parametrize("fault", sorted(FAULTS))
def test_faulty_program_breaks_its_rule_and_no_other(fault: str) -> None:
    program = f"{sys.executable} {Path(__file__).with_name('faulty_satellite.py')} {fault}"
    code, found = outcomes("/sat2", "--command", program)
    assert [rule for rule, each in found.items() if each["outcome"] == "broken"] == [FAULTS[fault]]
    assert code == 1


def test_rules_that_are_tried_are_those_of_the_page() -> None:
    page = (ROOT / "docs" / "interface.md").read_text(encoding="utf-8")
    assert [rule for rule in RULES if f"| {rule} |" not in page and rule not in ("V1", "V2")] == []


def test_satellite_that_there_is_not_is_refused_in_a_sentence() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "satform_tools", "conformance", "/sat9"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert "there is no satellite sat9 in triangle; there are sat1, sat2, sat3" in done.stderr
