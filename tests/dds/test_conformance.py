# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Conformance with the interface: own nodes and examples keep all rules, a faulty program breaks its own."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix

from satform_tools.conformance.rules import RULES

pytestmark = pytest.mark.unmeasured

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "external_satellites"
NODE = f"{get_package_prefix('satform_nodes')}/lib/satform_nodes/satellite_node"

AT_ONCE = 6
"""Programs that are tested at the same time, in domains of their own: they wait most of the time."""

Outcome = tuple[int, dict[str, dict[str, object]]]
"""Exit code, and outcome of each rule."""


def own_node(name: str) -> str:
    parameters = f"-p 'scenario:=\"{{scenario}}\"' -p satellite:={name} -p recorded:=true"
    return f"{NODE} --ros-args -r __node:={name} {parameters}"


def in_python(program: Path, *arguments: str) -> str:
    return " ".join([sys.executable, str(program), *arguments])


FAULTS = {
    "Doubled": "E1",
    "NotLatched": "E2",
    "Unready": "R1",
    "ReadyAgain": "R1",
    "Endless": "X1",
    "NotMatched": "R2",
    "OtherInterface": "V1",
    "OtherDefinition": "V2",
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
    "ReadyOnce": "L2",
    "LateCheckpoint": "L2",
    "TooEarly": "L3",
    "DropsFirstState": "L3",
    "Silent": "S3",
    "Forgetful": "S9",
    "FixedNeighbours": "F3",
    "NoNewEdge": "F3",
}
"""The rule that each fault of `faulty_satellite.py` breaks."""

IN_RING = ("FixedNeighbours", "NoNewEdge")
"""Faults that show in a graph to which an edge can be added."""

NOT_TRIED = {
    "R3": "a node waits without an end; the procedure has one",
    "X2": "a flight ends once, and the procedure ends it by FINISHED (X1)",
}
"""Rules of the page that the procedure does not try, with the reason."""

TIMEOUT = 40
"""Wall-clock time for which it is waited for a faulty program to be ready, s."""

PROGRAMS = {
    "own node": ("/sat2", "triangle", own_node("sat2")),
    "own node with a sparse graph": ("/sat1", "ring_six", own_node("sat1")),
    "example in Python": ("/sat2", "triangle", in_python(EXAMPLES / "python" / "foreign_satellite.py")),
    "example in C": ("/sat2", "triangle", ""),
    "example that knows no scenario": (
        "/sat1",
        "ring_six",
        in_python(EXAMPLES / "hold" / "hold_position.py", "sat1"),
    ),
    **{
        fault: (
            "/sat2",
            "ring_six" if fault in IN_RING else "triangle",
            in_python(Path(__file__).with_name("faulty_satellite.py"), fault, "{scenario}"),
        )
        for fault in FAULTS
    },
}
"""Of each program the node, the scenario and the command."""


def put_to_test(program: str, command: str) -> Outcome:
    """Test one program by the command line."""
    node, scenario, _ = PROGRAMS[program]
    options = ["--scenario", scenario, "--command", command, "--json"]
    if program in FAULTS:
        options += ["--timeout", str(TIMEOUT)]
    done = subprocess.run(
        [sys.executable, "-m", "satform_tools", "conformance", node, *options],
        env={name: value for name, value in os.environ.items() if name != "ROS_DOMAIN_ID"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode in (0, 1), done.stdout + done.stderr
    return done.returncode, json.loads(done.stdout)


def _start_order(program: str) -> tuple[bool, bool]:
    """The programs that take longest first; the example in C is built while the others are tested."""
    return program == "example in C", program not in ("ReadyOnce", "Unready")


@pytest.fixture(scope="module")
def outcome(request: pytest.FixtureRequest) -> Iterator[Callable[[str], Outcome]]:
    """Outcome of a program; all programs of the selected tests are tested side by side."""
    items = [item for item in request.session.items if item.fspath == request.fspath]
    wanted = [item.callspec.params["program"] for item in items if hasattr(item, "callspec")]
    with ThreadPoolExecutor(AT_ONCE) as pool:
        programs = sorted(dict.fromkeys(wanted), key=_start_order)
        running = {}
        for program in programs:
            command = PROGRAMS[program][2]
            if program == "example in C":
                command = " ".join(request.getfixturevalue("in_c"))
            running[program] = pool.submit(put_to_test, program, command)
        yield lambda program: running[program].result()


@pytest.mark.parametrize("program", [name for name in PROGRAMS if name not in FAULTS])
def test_program_keeps_all_rules(program: str, outcome: Callable[[str], Outcome]) -> None:
    code, found = outcome(program)
    assert {rule: each["found"] for rule, each in found.items() if each["found"]} == {}
    untried = {rule for rule, each in found.items() if each["outcome"] == "not tried"}
    # Of the complete graph no edge is missing that could be a new one.
    assert untried == ({"F3"} if PROGRAMS[program][1] == "triangle" else set())
    assert all("every other satellite" in str(found[rule]["why_not_tried"]) for rule in untried)
    assert code == 0


@pytest.mark.parametrize("program", FAULTS)
def test_faulty_program_breaks_its_rule_and_no_other(program: str, outcome: Callable[[str], Outcome]) -> None:
    code, found = outcome(program)
    assert [rule for rule, each in found.items() if each["outcome"] == "broken"] == [FAULTS[program]]
    assert code == 1


def test_each_rule_of_the_procedure_is_broken_by_a_faulty_program() -> None:
    assert set(RULES) - set(FAULTS.values()) == set()


def test_rules_that_are_tried_are_those_of_the_page() -> None:
    page = (ROOT / "docs" / "interface.md").read_text(encoding="utf-8")
    rules = set(re.findall(r"^\| ([A-Z]\d+) \|", page, re.MULTILINE))
    assert set(RULES) == rules - set(NOT_TRIED)
    assert set(NOT_TRIED) < rules


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
