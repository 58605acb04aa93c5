# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The test command: which parts it runs, and what it says of them."""

import platform
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import pytest

from satform_tools import run_tests
from satform_tools.cli import main as cli


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The commands of the parts, of which mypy fails, instead of running them."""
    commands: list[list[str]] = []

    def call(command: Sequence[str]) -> int:
        commands.append(list(command))
        return int("mypy" in command)

    class Begun:
        def __init__(self, command: Sequence[str], **_: Any) -> None:
            commands.append(list(command[len(run_tests._LEAST) + 2 :]))

        def wait(self, _timeout: float = 0.0) -> int:
            return 0

        def terminate(self) -> None:
            pass

    monkeypatch.setattr(run_tests, "_call", call)
    monkeypatch.setattr(run_tests.subprocess, "Popen", Begun)
    return commands


def test_test_runs_every_part_and_fails_when_one_does(
    called: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["test"]) == 1
    assert [command[0] for command in called] == ["ruff", "ruff", "mypy", *["pytest"] * 3]
    printed = capsys.readouterr().out
    assert "mypy --strict: failed" in printed
    assert "unit tests: passed" in printed
    assert "whole flights, commands, set-up: passed" in printed


def test_a_part_that_runs_beside_others_counts_and_what_it_printed_comes_at_the_end(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    parts = [
        run_tests.Part("beside", ("this_module_is_missing",), beside=True),
        run_tests.Part("in front", ("platform",)),
    ]
    monkeypatch.setattr(run_tests, "PARTS", parts)
    assert cli.main(["test"]) == 1
    printed = capfd.readouterr().out
    assert "in front: passed" in printed
    assert "beside: failed" in printed
    assert printed.index(platform.platform(aliased=True)) < printed.index("this_module_is_missing")


def test_a_part_beside_others_is_ended_when_one_in_front_is_interrupted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun: list[subprocess.Popen[bytes]] = []

    class Noted(subprocess.Popen[bytes]):
        def __init__(self, command: Sequence[str], **options: Any) -> None:
            # It runs until it is ended.
            begun.append(self)
            super().__init__([sys.executable, "-c", "import signal; signal.pause()"], **options)

    def interrupted(_command: Sequence[str]) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(run_tests.subprocess, "Popen", Noted)
    monkeypatch.setattr(run_tests, "_call", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_tests.run([])
    assert begun == []
    monkeypatch.setattr(
        run_tests,
        "PARTS",
        (run_tests.Part("beside", ("x",), beside=True), run_tests.Part("in front", ("x",))),
    )
    with pytest.raises(KeyboardInterrupt):
        run_tests.run([])
    assert [process.returncode for process in begun] == [-15]


def test_the_parts_of_the_test_command_run_every_folder_of_tests() -> None:
    told = {word for part in run_tests.PARTS if part.command[0] == "pytest" for word in part.command}
    folders_of_tests = {file.parent for file in (run_tests.ROOT / "tests").rglob("test_*.py")}
    for folder in folders_of_tests:
        within = folder.relative_to(run_tests.ROOT)
        assert told & {str(within), *map(str, within.parents)}, within


def test_the_types_of_every_package_are_checked() -> None:
    (checked,) = (part.command for part in run_tests.PARTS if "mypy" in part.command)
    sources = run_tests.ROOT / "ros_ws" / "src"
    packages = {
        folder.name for folder in sources.iterdir() if (folder / folder.name / "__init__.py").exists()
    }
    packages |= {folder.parent.name for folder in (run_tests.ROOT / "tools").glob("satform_*/__init__.py")}
    assert packages <= {word.rpartition("/")[2] for word in checked}


def test_test_with_arguments_is_pytest_alone(called: list[list[str]]) -> None:
    assert cli.main(["test", "tests/unit", "-k", "curve", "--help"]) == 0
    assert called == [["pytest", "tests/unit", "-k", "curve", "--help"]]
