# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line's runs, from what is typed to what is printed, kept and returned."""

import json
import os
import signal
import sys
import types
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from flights import shortened
from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_LOST, EXIT_STOPPED
from satform.flight.simulate import simulate
from satform.record.archive import load_record
from satform.scenario import load_scenario
from satform.scenario.loader import SCENARIO_FILE
from satform_tools.cli import main as cli
from satform_tools.run import command as run_command
from satform_tools.run import output_folders, ros_packages

SHORT = ("--set", "timing.duration=20.0", "--set", "expect=[]")


def run_in_process(out: Path, *words: str) -> int:
    return cli.main(["run", "ring_six", "--mode", "inprocess", "--out", str(out), *words])


def test_a_run_that_gives_what_it_promises_ends_with_0_and_keeps_the_flight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    agreement_guarantee = (
        "expect=[{kind: arc_length_spread, at: 10.0, value: 64990.5, absolute: 1.0, source: a test}]"
    )
    code = run_in_process(tmp_path / "run", "--set", "timing.duration=20.0", "--set", agreement_guarantee)
    printed = capsys.readouterr().out
    assert code == 0
    assert "arc-length spread at 10 s" in printed
    assert "pass" in printed
    assert "x real time" in printed
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["steps"] == result["steps_planned"] == 20
    assert result["expectations"][0]["origin"] == "a test"
    assert result["versions"]["numpy"]
    assert load_record(tmp_path / "run" / "record.npz").steps == 20


def test_a_run_that_misses_a_promise_ends_with_1_and_says_which(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    agreement_guarantee = "expect=[{kind: arc_length_spread, at: 10.0, below: 5.0, source: a test}]"
    code = run_in_process(tmp_path / "run", "--set", "timing.duration=20.0", "--set", agreement_guarantee)
    assert code == 1
    assert "MISSED: 1 of 1" in capsys.readouterr().out


def test_a_shorter_run_is_judged_by_what_lies_within_it_and_says_what_does_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["run", "geo_sphere_lqr", "--mode", "inprocess", "--out", str(tmp_path / "run")]
    # The distance first reaches its reference at 391 s and comes within 5 % at 344 s; the rest is later.
    assert cli.main([*words, "--set", "timing.duration=400.0"]) == 0
    captured = capsys.readouterr()
    assert captured.err.count("6 expectations need a longer flight and are omitted\n") == 1
    assert "As expected: 2 of 2 met; 6 expectations need a longer flight: not judged." in captured.out
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["judged"]
    assert [entry["label"].partition(", ")[0] for entry in result["expectations"]] == [
        "distance to the chief first reaches its reference",
        "distance to the chief settles to 5 %",
    ]
    assert len(result["omitted_expectations"]) == 6
    assert cli.main(["report", str(tmp_path / "run")]) == 0
    assert (
        "As expected: 2 of 2 met; 6 expectations need a longer flight: not judged" in capsys.readouterr().out
    )
    assert "6 expectations need a longer flight" in (tmp_path / "run" / "report" / "report.html").read_text()


def test_a_run_too_short_for_every_expectation_is_flown_and_not_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["run", "geo_sphere_lqr", "--mode", "inprocess", "--out", str(tmp_path / "run")]
    assert cli.main([*words, "--set", "timing.duration=20.0"]) == 0
    said = "Flown to the end and not judged: 8 expectations need a longer flight"
    assert f"{said}.\n" in capsys.readouterr().out
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert (result["judged"], result["expectations"]) == (False, [])
    assert len(result["omitted_expectations"]) == 8
    assert cli.main(["report", str(tmp_path / "run"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["judged"], told["omitted_expectations"]) == (False, result["omitted_expectations"])
    assert said in (tmp_path / "run" / "report" / "report.html").read_text()


def test_a_run_of_which_nothing_is_expected_is_not_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_in_process(tmp_path / "run", *SHORT) == 0
    assert "Flown to the end and not judged: the scenario expects nothing.\n" in capsys.readouterr().out
    assert json.loads((tmp_path / "run" / "result.json").read_text())["judged"] is False


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run", "triangel"], "did you mean triangle?"),
        (["run", "nowhere/at_all.yaml"], "nowhere/at_all.yaml: cannot be read: No such file or directory"),
        (
            ["run", "triangle", "--set", "timing.stepp=1"],
            "--set timing.stepp=1: timing.stepp: there is no such",
        ),
        (["run", "triangle", "--set", "timing"], "--set timing: is not of the form key=value"),
        (["run", "triangle", "--seed", "-1"], "--set seed=-1: seed: found -1"),
        (["show", "triangel"], "did you mean triangle?"),
        (["report", "nowhere"], "nowhere: there is no such run or bag"),
        (["run", "triangle", "--mode", "sideways"], "sideways"),
    ],
)
def test_bad_input_ends_with_2_and_a_sentence_on_standard_error(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(words) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert "Traceback" not in captured.err
    assert not captured.out


def test_a_run_never_touches_what_is_there_already(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.txt").write_text("kept")
    assert run_in_process(tmp_path, *SHORT) == 2
    assert "already exists" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


ARRAYS = ("--satellites-per-process", "3", "--arrays")
"""Options of a flight of groups that exchange arrays."""


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--mode", "inprocess", "--restart"], "--restart needs several processes"),
        (
            ["--mode", "inprocess", "--satellites-per-process", "2"],
            "--satellites-per-process needs several processes",
        ),
        (
            ["--mode", "inprocess", "--measure-round-trip"],
            "--measure-round-trip needs several processes",
        ),
        (
            ["--mode", "inprocess", "--continue-without-recorder"],
            "--continue-without-recorder needs a recorder process",
        ),
        (["--mode", "inprocess", "--rate", "10"], "--rate needs --mode realtime"),
        (["--rate", "1"], "--mode lockstep does not follow the wall clock"),
        (["--mode", "realtime", "--profile"], "--profile is for lockstep"),
        (["--display", "--secure", "keys"], "--display and --secure exclude each other"),
        (["--mode", "inprocess", "--arrays"], "--arrays needs several processes"),
        (["--arrays"], "--arrays needs --satellites-per-process N with at least 2"),
        ([*ARRAYS, "--mode", "realtime"], "--arrays and --mode realtime exclude each other yet"),
        ([*ARRAYS, "--restart"], "--arrays and --restart exclude each other yet"),
        ([*ARRAYS, "--profile"], "--arrays and --profile exclude each other yet"),
        ([*ARRAYS, "--set", "checkpoint_period=10.0"], "arrays cannot fly checkpoints yet"),
        ([*ARRAYS, "--set", "satellites[sat2].external=true"], "arrays cannot fly an external satellite yet"),
        (
            [*ARRAYS, "--set", "faults=[{kind: satellite_lost, satellite: sat1, at: 5.0}]"],
            "arrays cannot fly faults yet",
        ),
    ],
)
def test_what_cannot_be_had_together_is_a_sentence_before_anything_is_made(
    words: list[str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["run", "triangle", "--out", str(tmp_path / "run"), *words]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("words", "present"),
    [
        (["run", "triangle", "--group", "2"], "--group is now --satellites-per-process"),
        (["run", "triangle", "--group=2"], "--group is now --satellites-per-process"),
        (["run", "triangle", "--measure"], "--measure is now --measure-round-trip"),
        (["run", "triangle", "--without-recorder"], "--without-recorder is now --continue-without-recorder"),
        (["topics", "--wait", "5"], "--wait is now --timeout"),
        (["echo", "/sat1/state", "--wait", "5"], "--wait is now --timeout"),
        (["params", "set", "/sat1", "name", "1.0", "--wait", "5"], "--wait is now --timeout"),
        (["bench", "--times", "5", "ping-pong"], "--times is now --repetitions"),
        (["bench", "ping-pong", "--keep", "history"], "--keep is now --history"),
    ],
)
def test_an_earlier_name_of_an_option_is_answered_with_the_present_one(
    words: list[str], present: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(words) == 2
    assert capsys.readouterr().err.endswith(f"Error: {present}\n")


def test_an_unknown_option_is_not_taken_for_a_renamed_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["list", "--wait", "5"]) == 2
    assert capsys.readouterr().err.endswith("Error: No such option: --wait\n")


def test_a_folder_that_cannot_be_made_is_a_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert run_in_process(tmp_path / "file" / "run", *SHORT) == 2
    assert "the run's folder cannot be written" in capsys.readouterr().err


def test_two_runs_of_one_moment_get_folders_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    made = {output_folders.make(None, "triangle") for _ in range(3)}
    assert len(made) == 3
    assert all(folder.is_dir() and folder.name.startswith("triangle-") for folder in made)


def test_json_is_all_that_is_printed_when_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_in_process(tmp_path / "run", "--json", "--seed", "7", *SHORT) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["seed"] == 7
    assert data["exit_code"] == 0
    assert data["speed"]["steps_per_second"] > 0.0


def fly_like(monkeypatch: pytest.MonkeyPatch, **outcome: Any) -> None:
    """Put a flight over DDS that ends in a given way in the place of the real one."""
    ended = {
        "steps": 20,
        "seconds": 2.0,
        "start_seconds": 0.5,
        "plant_seconds": 0.4,
        "satellite_seconds": {"sat1": 0.6, "sat2": 0.5},
        "lost": (),
        "losses": (),
        "returns": (),
        "punctuality": {},
        "reason": "",
        "stopped": False,
        "bag": None,
        "messages": 0,
        "missed": (),
        "warnings": (),
        "early_end": None,
        **outcome,
    }
    stand_in = types.ModuleType("satform_bringup.supervisor.run")
    stand_in.fly = lambda *_, **__: types.SimpleNamespace(**ended)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "satform_bringup.supervisor.run", stand_in)


def run_lockstep(out: Path) -> int:
    return cli.main(["run", "ring_six", "--no-record", "--out", str(out), *SHORT])


@pytest.mark.parametrize("missing", ["rclpy", "satform_msgs"])
def test_without_ros_a_sentence_says_so_before_anything_is_started(
    missing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise AssertionError("started in spite of it")

    monkeypatch.setattr(ros_packages, "find_spec", lambda name: None if name == missing else object())
    monkeypatch.setattr("satform_bringup.supervisor.process_server.prepare", fail)
    assert run_lockstep(tmp_path / "run") == EXIT_BAD_INPUT == 2
    assert f"ROS 2 is not in this environment (there is no {missing})" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
    assert run_in_process(tmp_path / "run", *SHORT) == 0


def test_the_scenario_of_a_run_is_kept_once_by_those_who_fly_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fly_like(monkeypatch)
    assert run_lockstep(tmp_path / "over_dds") == 0
    assert [path.name for path in (tmp_path / "over_dds").iterdir()] == [output_folders.RESULT]
    assert run_in_process(tmp_path / "in_process", *SHORT) == 0
    kept = load_scenario(tmp_path / "in_process" / SCENARIO_FILE)
    assert kept.digest() == shortened("ring_six", 20.0).digest()


@pytest.mark.parametrize("range_before", [None, "SUBNET"])
def test_the_bare_exchange_is_measured_on_a_domain_of_its_own_and_leaves_no_trace(
    range_before: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[tuple[str | None, str | None]] = []

    def measure(_count: int) -> Any:
        seen.append((os.environ.get("ROS_DOMAIN_ID"), os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE")))
        return types.SimpleNamespace(median=1.0e-4)

    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
    if range_before:
        monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", range_before)
    before = dict(os.environ)
    stand_in = types.ModuleType("satform_nodes.runtime.round_trip")
    stand_in.measure = measure  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "satform_nodes.runtime.round_trip", stand_in)
    fly_like(monkeypatch)
    out = str(tmp_path / "run")
    assert cli.main(["run", "ring_six", "--no-record", "--measure-round-trip", "--out", out, *SHORT]) == 0
    ((domain, where),) = seen
    assert domain is not None
    assert domain.isdigit()
    assert where == (range_before or "SYSTEM_DEFAULT")
    assert dict(os.environ) == before


@pytest.mark.parametrize(("mode", "hashed"), [("lockstep", True), ("realtime", False)])
def test_a_state_hash_is_given_only_where_the_bits_are_promised(
    mode: str, hashed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = simulate(shortened("ring_six", 20.0))
    fly_like(monkeypatch, bag=tmp_path)
    monkeypatch.setattr(run_command, "_read", lambda *_: record)
    assert cli.main(["run", "ring_six", "--mode", mode, "--out", str(tmp_path / "run"), *SHORT]) == 0
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["state_hash"] == (record.digest() if hashed else None)


def test_a_lost_process_ends_with_3_and_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fly_like(monkeypatch, steps=12, lost=("sat2",), reason="sat2 was silent for 10 s")
    assert run_lockstep(tmp_path / "run") == EXIT_LOST == 3
    assert "Lost sat2 at step 12 of 20: sat2 was silent for 10 s." in capsys.readouterr().out


def test_messages_missing_from_the_bag_are_no_success(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fly_like(monkeypatch, missed=("/sat1/command: 19 of 20 messages",))
    assert run_lockstep(tmp_path / "run") == EXIT_LOST
    assert "cannot be evaluated: /sat1/command: 19 of 20 messages" in capsys.readouterr().out


def test_a_flight_that_was_stopped_ends_with_130(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fly_like(monkeypatch, steps=7, stopped=True, reason="stopped by a signal")
    assert run_lockstep(tmp_path / "run") == EXIT_STOPPED == 130
    assert "Stopped at step 7 of 20" in capsys.readouterr().out


def test_without_a_record_a_flight_to_the_end_is_flown_but_not_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fly_like(monkeypatch)
    assert run_lockstep(tmp_path / "run") == 0
    printed = capsys.readouterr().out
    assert "no expectation is evaluated" in printed
    assert (
        "DDS and waiting 50 % (50000 us), plant 20 % (20000 us), slowest satellite 30 % (30000 us)" in printed
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_flight_in_process_that_was_stopped_keeps_what_was_flown(
    number: signal.Signals,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    @contextmanager
    def stopping(_scenario: Any, **_options: Any) -> Iterator[Any]:
        yield lambda done, _total: os.kill(os.getpid(), number) if done == 7 else None

    monkeypatch.setattr("satform_tools.run.progress.displayed", stopping)
    # A SIGHUP that the parent of the tests ignores would be ignored here, too.
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    folder = tmp_path / "run"
    code = run_in_process(folder, *SHORT)
    signal.signal(signal.SIGHUP, before)
    assert code == EXIT_STOPPED == 130
    assert "Stopped at step 7 of 20: no expectation is evaluated." in capsys.readouterr().out
    result = json.loads((folder / "result.json").read_text())
    assert result["reason"] == f"stopped by {number.name}"
    assert (result["stopped"], result["steps"], result["exit_code"]) == (True, 7, 130)
    kept = load_record(folder / "record.npz")
    assert simulate(shortened("ring_six", 7.0)).differences(kept) == []
    assert cli.main(["report", str(folder), "--json", "--out", str(tmp_path / "report")]) == 0
    assert json.loads(capsys.readouterr().out)["cut_short"] == "cut short at step 7 of 20"
