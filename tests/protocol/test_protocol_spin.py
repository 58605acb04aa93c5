# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Spin verifies a model of the protocol, written from the page of the interface, and finds its faults."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

MODEL = Path(__file__).with_name("protocol.pml")

PROPERTIES = ("same_messages", "same_graph", "no_lost_command", "nobody_blamed", "ends")

FAULTS = {
    "M_NO_WAITING": "same_messages",
    "M_FINAL_NOT_USED": "same_messages",
    "M_NO_VERSION_CHECK": "same_graph",
    "M_LOST_APPLIED": "no_lost_command",
    "M_FORGET_FINAL": "nobody_blamed",
    "M_BLAME": "nobody_blamed",
    "M_NO_TIMEOUT": "ends",
}
"""The property that each fault of the model breaks."""

TIMEOUT = 60.0
"""Wall-clock time for each of the programs, s; they take about one."""

MISSING = [name for name in ("spin", "gcc") if shutil.which(name) is None]

pytestmark = pytest.mark.skipif(bool(MISSING), reason=f"NOT TESTED: not installed: {', '.join(MISSING)}")


def run(folder: Path, *command: str) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def verifier(folder: Path, *options: str, schedule: str = "") -> Path:
    """The program that Spin makes of the model, with definitions before it."""
    (folder / MODEL.name).write_text(schedule + MODEL.read_text(encoding="utf-8"), encoding="utf-8")
    run(folder, "spin", *options, "-a", MODEL.name)
    run(folder, "gcc", "-w", "-DCOLLAPSE", "-o", "pan", "pan.c")
    return folder / "pan"


def verified(program: Path, name: str) -> tuple[int, int]:
    """Number of errors of a property, and of states that were visited.

    Every reachable state is visited, unless there is an error before.
    """
    printed = run(program.parent, str(program), "-a", "-m100000", "-N", name)
    assert "max search depth too small" not in printed
    errors = re.search(r"errors: (\d+)", printed)
    states = re.search(r"(\d+) states, stored", printed)
    assert errors, printed
    assert states, printed
    return int(errors[1]), int(states[1])


@pytest.fixture(scope="module")
def correct(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return verifier(tmp_path_factory.mktemp("spin"))


@pytest.mark.parametrize("name", PROPERTIES)
def test_spin_verifies_a_property(correct: Path, name: str) -> None:
    errors, states = verified(correct, name)
    assert errors == 0
    assert states > 10_000


@pytest.mark.parametrize("fault", FAULTS)
def test_spin_finds_a_fault_of_the_model(fault: str, tmp_path: Path) -> None:
    assert verified(verifier(tmp_path, f"-D{fault}"), FAULTS[fault])[0] == 1


def test_each_property_of_the_model_is_verified_and_broken_by_a_fault() -> None:
    text = MODEL.read_text(encoding="utf-8")
    assert set(re.findall(r"^ltl (\w+)", text, re.MULTILINE)) == set(PROPERTIES) == set(FAULTS.values())
    assert set(re.findall(r"\b(M_[A-Z_]+[A-Z])\b", text)) == set(FAULTS)
