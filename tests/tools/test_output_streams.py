# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands whose output is closed, full or not read to its end, and machines that refuse them things."""

import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from satform.scenario import parse_scenario
from satform_tools import errors
from satform_tools.cli import main as cli
from satform_tools.describe import scenario_list
from satform_tools.run import output_folders, scenario_library

COMMAND = [sys.executable, "-m", "satform_tools"]


def satform(*words: str, **options: Any) -> subprocess.CompletedProcess[str]:
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **options}
    return subprocess.run([*COMMAND, *words], timeout=300, check=False, **options)


def shell(line: str) -> subprocess.CompletedProcess[str]:
    command = ["bash", "-c", line, "bash", *COMMAND]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.parametrize("closing", ["2>&-", "<&- >&- 2>&-"])
def test_closed_streams_end_a_command_in_peace(closing: str) -> None:
    done = shell(f'"$@" list {closing}')
    assert (done.returncode, done.stderr) == (0, "")


def test_a_reader_who_has_seen_enough_ends_a_command_in_peace() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as gone:
        for words in (["schema"], ["--help"]):
            done = satform(*words, stdout=gone)
            assert (done.returncode, done.stderr) == (0, ""), words


def test_a_full_disk_behind_the_output_is_a_sentence() -> None:
    with Path("/dev/full").open("w") as full:
        done = satform("list", stdout=full)
    assert done.returncode == 2
    assert done.stderr == "satform: standard output: the disk is full (no space, or no inodes)\n"


def test_a_folder_whose_name_is_no_text_is_refused_before_anything_is_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    strange = os.fsdecode(os.fsencode(tmp_path) + b"/a\xff")
    words = ["run", "triangle", "--mode", "inprocess", "--set", "timing.duration=5.0"]
    assert cli.main([*words, "--out", strange]) == 2
    assert "is not UTF-8 text (byte 0xff)" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_run_lands_where_the_user_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first, second = output_folders.make(None, "triangle"), output_folders.make(None, "triangle")
    assert first.parent == second.parent == tmp_path / "runs"
    assert first != second
    assert not first.is_relative_to(scenario_library.ROOT)


def limited(**limits: int) -> Any:
    def limit() -> None:
        for name, value in limits.items():
            number = getattr(resource, f"RLIMIT_{name.upper()}")
            resource.setrlimit(number, (value, value))

    return limit


@pytest.mark.parametrize("limits", [{"nofile": 20}, {"as": 250_000_000}, {"fsize": 1000}])
def test_a_machine_that_gives_too_little_is_a_sentence(limits: dict[str, int], tmp_path: Path) -> None:
    out = str(tmp_path / "run")
    words = ["run", "triangle", "--mode", "inprocess", "--set", "timing.duration=500.0", "--out", out]
    done = satform(*words, preexec_fn=limited(**limits))
    assert "Traceback" not in done.stderr
    if done.returncode:
        assert done.returncode == 2, done.stderr
        assert done.stderr.splitlines()[-1].startswith("satform: ")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(28, "No space left on device", "/a/b"), "/a/b: the disk is full"),
        (OSError(24, "Too many open files", "/a/b"), "/a/b: too many files are open (ulimit -n)"),
        (MemoryError(), "not enough memory"),
        (RecursionError("maximum recursion depth exceeded"), "nested too deeply"),
        (UnicodeEncodeError("utf-8", "\udcff", 0, 1, "surrogates not allowed"), "is not UTF-8"),
        (RuntimeError("can't start new thread"), "no more threads"),
        (ImportError("libx.so: failed to map segment from shared object"), "not enough memory"),
    ],
)
def test_what_the_machine_refuses_is_a_sentence_in_every_command(
    error: Exception, words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fails(**_: Any) -> int:
        raise error

    monkeypatch.setattr(scenario_list, "show", fails)
    assert cli.main(["list"]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


def test_a_mistake_of_ours_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(**_: Any) -> int:
        raise KeyError("a")

    monkeypatch.setattr(scenario_list, "show", fails)
    with pytest.raises(KeyError):
        cli.main(["list"])
    assert errors.error_sentences(KeyError("a")) == []


def test_every_problem_of_a_scenario_is_a_sentence_of_its_own() -> None:
    with pytest.raises(ValueError, match="name") as caught:
        parse_scenario("name: 1\n", "f.yaml")
    assert len(errors.error_sentences(caught.value)) > 3
