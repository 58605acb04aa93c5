# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight over DDS has the same bits from any folder, environment and user."""

import json
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from flights import shortened
from satform.flight.simulate import simulate

ROOT = Path(__file__).resolve().parents[2]
LAUNCHER = ROOT / "tools" / "satform"
READ_ONLY = 'mount --bind "$0" "$0" && mount -o remount,bind,ro "$0" && shift && exec "$@"'

# What a shell has and a flight does not need: everything but the way to programs.
BARE = {"PATH": os.environ.get("PATH", os.defpath)}


@pytest.fixture(scope="module")
def expected() -> str:
    """State hash of the flight in one process."""
    return simulate(shortened("triangle", 5.0)).digest()


def flown(folder: Path, before: Sequence[str | Path] = (), environment: dict[str, str] = BARE) -> str | None:
    """State hash of a flight that is started in a folder; its files are written there."""
    words = [
        "run",
        "triangle",
        "--set",
        "timing.duration=5.0",
        "--set",
        "expect=[]",
        "--quiet",
        "--out",
        "run",
    ]
    done = subprocess.run(
        [*before, LAUNCHER, *words],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        # Against a hang only.
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found: str | None = json.loads((folder / "run" / "result.json").read_text())["state_hash"]
    return found


def require(*command: str | Path) -> None:
    """Skip a test where the machine does not allow what it needs."""
    if subprocess.run([*command, "true"], capture_output=True, check=False).returncode:
        pytest.skip(f"NOT TESTED: this machine does not allow {command[0]} {command[1]}")


def test_in_a_folder_with_spaces_and_letters_of_other_scripts(tmp_path: Path, expected: str) -> None:
    folder = tmp_path / "zwei Wörter 轨道"
    folder.mkdir()
    assert flown(folder, environment=BARE | {"HOME": str(tmp_path), "LANG": "C"}) == expected


@pytest.mark.parametrize("home", [{}, {"HOME": "/nonexistent"}], ids=["none", "missing"])
def test_without_a_home(home: dict[str, str], tmp_path: Path, expected: str) -> None:
    assert flown(tmp_path, environment=BARE | home) == expected


def test_with_another_folder_for_temporary_files(tmp_path: Path, expected: str) -> None:
    temporary = tmp_path / "täglich neu"
    temporary.mkdir()
    assert flown(tmp_path, environment=BARE | {"TMPDIR": str(temporary)}) == expected


@pytest.mark.parametrize("limit", ["nice -n 19", "ulimit -n 256 && exec"], ids=["priority", "open files"])
def test_with_little_of_the_machine(limit: str, tmp_path: Path, expected: str) -> None:
    assert flown(tmp_path, ["sh", "-c", f'{limit} "$@"', "sh"]) == expected


def test_by_a_user_who_is_not_root(tmp_path: Path, expected: str) -> None:
    command = ["unshare", "--user", "--map-user=1000", "--map-group=1000"]
    require(*command)
    assert flown(tmp_path, command) == expected


def test_in_a_copy_of_the_project_that_nobody_may_write_to(tmp_path: Path, expected: str) -> None:
    command = ["unshare", "--mount", "--map-root-user"]
    require(*command)
    assert flown(tmp_path, [*command, "sh", "-c", READ_ONLY, ROOT, "sh"]) == expected
