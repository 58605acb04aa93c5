# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line, from what is typed to what is printed, kept and returned."""

import json
import math
import os
import re
import signal
import sys
import types
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from flights import SCENARIOS, shortened
from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_LOST, EXIT_STOPPED
from satform.flight.simulate import simulate
from satform.scenario import load_scenario
from satform_bringup import SCENARIO_FILE
from satform_tools import console
from satform_tools.cli import main as cli
from satform_tools.run import command as run_command
from satform_tools.run import folders, ros_packages

SHORT = ("--set", "timing.duration=20.0", "--set", "expect=[]")
NOT_PLAIN = re.compile("[\x1b─-╿]")
"""Escape codes and box drawing."""


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
    assert folders.load_record(tmp_path / "run" / "record.npz").steps == 20


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
    assert captured.err.count("6 expectations lie beyond the shorter flight and are not judged\n") == 1
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


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--mode", "inprocess", "--restart"], "--restart is for processes that are lost"),
        (
            ["--mode", "inprocess", "--satellites-per-process", "2"],
            "--satellites-per-process is for several processes",
        ),
        (
            ["--mode", "inprocess", "--measure-round-trip"],
            "--measure-round-trip is for messages between processes",
        ),
        (
            ["--mode", "inprocess", "--continue-without-recorder"],
            "--continue-without-recorder is for a recorder",
        ),
        (["--mode", "inprocess", "--rate", "10"], "--rate is for --mode realtime"),
        (["--rate", "1"], "--mode lockstep has no wall clock"),
        (["--mode", "realtime", "--profile"], "--profile is for lockstep"),
        (["--display", "--secure", "keys"], "--display and --secure exclude each other"),
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
    made = {folders.make(None, "triangle") for _ in range(3)}
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


def test_numbers_that_are_not_finite_become_null_in_json() -> None:
    assert json.loads(console.to_json({"figure": float("nan"), "list": [float("inf"), 1.0]})) == {
        "figure": None,
        "list": [None, 1.0],
    }


@pytest.mark.parametrize("words", [["list"], ["show", "triangle"], ["--help"], ["check", "triangle"]])
def test_away_from_a_terminal_everything_is_plain_text(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(words) == 0
    printed = capsys.readouterr().out
    assert printed
    assert not NOT_PLAIN.search(printed)


def test_help_says_what_the_exit_codes_mean(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["run", "--help"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    for meaning in ("0 as expected", "1 an expectation was missed", "2 bad input", "3 a process was lost"):
        assert meaning in printed


def test_list_names_every_shipped_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in listed] == sorted(path.stem for path in SCENARIOS.glob("*.yaml"))
    triangle = next(entry for entry in listed if entry["name"] == "triangle")
    assert (triangle["satellites"], triangle["duration"], triangle["graph"]) == (3, 12000.0, "complete")


def test_check_says_everything_about_every_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (SCENARIOS / "triangle.yaml").read_text()
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(text.replace("kind: complete", "kind: complet").replace("period: 6000.0", "period: -1"))
    assert cli.main(["check", str(wrong), "triangle", "unheard_of"]) == 2
    captured = capsys.readouterr()
    lines = text.splitlines()
    graph = next(number for number, line in enumerate(lines, 1) if line.startswith("graph:"))
    assert f"{wrong}:{graph}: graph: there is no kind 'complet'; did you mean complete?" in captured.err
    assert captured.err.count("it should be greater than") == 2
    assert "there is no scenario 'unheard_of'" in captured.err
    assert captured.out.startswith("triangle: warning: dynamics: cw is of first order in the distance")
    assert captured.out.endswith("triangle: OK\n")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("switching_gain: 0.1", "switching_gain: 0.005", "switching_gain on axis x is 0.005 m/s^2"),
        (
            "kind: complete",
            "kind: matrix, rows: [[0, 1, 0], [1, 0, 0], [0, 0, 0]]",
            "graph: it is not connected",
        ),
        ("scale: 0.75", "scale: 0.76", "have equal periods only if"),
        ("step: 0.5,", "step: 600.0,", "consensus: closed once in 600 s, arc_length"),
        ("reaching_gain: 0.1", "reaching_gain: 5.0", "the sampled law diverges"),
    ],
)
def test_check_warns_of_what_is_unwise(
    old: str, new: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (SCENARIOS / "triangle.yaml").read_text()
    assert old in text
    unwise = tmp_path / "unwise.yaml"
    unwise.write_text(text.replace(old, new))
    assert cli.main(["check", str(unwise)]) == 0
    printed = capsys.readouterr().out
    assert "warning: " in printed
    assert said in printed


def test_show_describes_the_graph_its_roots_and_in_neighbours(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["show", "line_six", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["graph"]["in_neighbours"]["sat3"] == ["sat2", "sat4"]
    assert data["consensus"]["modal_roots"][1][0] == pytest.approx(-2.67949e-4, rel=1e-5)
    # With hold and coupling_gain = tracking_gain * rate_gain no delay makes a mode unstable.
    assert data["consensus"]["delay_margin"] is None
    assert data["consensus"]["stable_for_any_delay"]
    # The slowest mode over a step of 1 s.
    agreement = next(loop for loop in data["sampled_loops"] if loop["kind"] == "consensus")
    assert -math.log(agreement["radius"]) == pytest.approx(2.67949e-4, rel=1e-4)
    assert data["orbit"]["altitude"] == pytest.approx(758.5e3, abs=50.0)
    assert {"topic": "/sat3/arc_length", "from": "sat3", "to": ["sat2", "sat4"]} in data["topics"]
    assert data["processes"][0]["node"] == "plant"
    assert len(data["processes"]) == 8


def test_schema_prints_what_stands_beside_the_scenarios(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["schema"]) == 0
    assert capsys.readouterr().out == (SCENARIOS / "scenario.schema.json").read_text()


def test_version_names_what_has_a_part_in_the_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["version", "--json"]) == 0
    assert {"python", "satform", "numpy", "scipy"} <= json.loads(capsys.readouterr().out).keys()


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
    assert [path.name for path in (tmp_path / "over_dds").iterdir()] == [folders.RESULT]
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
    assert "cannot be judged: /sat1/command: 19 of 20 messages" in capsys.readouterr().out


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
    assert "nothing is judged" in printed
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
    def stopping(_scenario: Any) -> Iterator[Any]:
        yield lambda done, _total: os.kill(os.getpid(), number) if done == 7 else None

    monkeypatch.setattr("satform_tools.run.progress.displayed", stopping)
    # A SIGHUP that the parent of the tests ignores would be ignored here, too.
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    folder = tmp_path / "run"
    code = run_in_process(folder, *SHORT)
    signal.signal(signal.SIGHUP, before)
    assert code == EXIT_STOPPED == 130
    assert "Stopped at step 7 of 20: nothing is judged." in capsys.readouterr().out
    result = json.loads((folder / "result.json").read_text())
    assert result["reason"] == f"stopped by {number.name}"
    assert (result["stopped"], result["steps"], result["exit_code"]) == (True, 7, 130)
    kept = folders.load_record(folder / "record.npz")
    assert simulate(shortened("ring_six", 7.0)).differences(kept) == []
    assert cli.main(["report", str(folder), "--json", "--out", str(tmp_path / "report")]) == 0
    assert json.loads(capsys.readouterr().out)["cut_short"] == "cut short at step 7 of 20"


def test_show_says_how_many_liars_a_graph_bears(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["show", "complete_six"]) == 0
    printed = capsys.readouterr().out
    assert "robustness: 3-robust; (r, s)-robust for (1, 6), (2, 6), (3, 6)" in printed
    assert cli.main(["show", "ring_six", "--json"]) == 0
    graph = json.loads(capsys.readouterr().out)["graph"]
    assert graph["robustness"] == {"r": 1, "s": [4], "exact": True}
    assert graph["promise"]["largest_local"] == 0


def test_check_warns_of_more_liars_than_the_graph_bears(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (SCENARIOS / "ring_six.yaml").read_text()
    law = "kind: resilient_arc_length\n  tolerated_byzantine: "
    for liars, warned in ((0, 0), (1, 1)):
        file = tmp_path / "ring.yaml"
        file.write_text(text.replace("kind: arc_length\n", f"{law}{liars}\n", 1))
        assert cli.main(["check", str(file)]) == 0
        assert capsys.readouterr().out.count("consensus.tolerated_byzantine: nothing is promised") == warned


def test_check_warns_of_a_later_graph_that_bears_fewer_liars(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (SCENARIOS / "complete_six.yaml").read_text()
    text = text.replace("kind: arc_length\n", "kind: resilient_arc_length\n  tolerated_byzantine: 1\n", 1)
    for later, warned in (("complete", 0), ("ring", 1)):
        file = tmp_path / "complete.yaml"
        file.write_text(f"{text}\ngraph_schedule:\n  - {{at: 60.0, graph: {{kind: {later}}}}}\n")
        assert cli.main(["check", str(file)]) == 0
        printed = capsys.readouterr().out
        assert printed.count("consensus.tolerated_byzantine: from 60 s on: nothing is promised") == warned
        assert printed.count("consensus.tolerated_byzantine") == warned


def test_show_tells_what_is_planned_to_go_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["show", "satellite_lost_and_rejoined"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "fault: satellite_lost of sat2, at 3100, rejoin_at 4900, memory checkpoint" in printed
    assert "checkpoints: every 500 s" in printed
    # Of two satellites that hear each other the Laplacian has the eigenvalues 0 and 2, of three 0, 3 and 3.
    assert "3100 sat2 is killed by the scenario 2 2 2" in printed
    assert "4900 sat2 is back 3 6 3" in printed


def test_show_tells_links_with_what_they_take_from_the_default(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["show", "lossy_links", "--json"]) == 0
    links = json.loads(capsys.readouterr().out)["links"]
    (own,) = links["edges"]
    assert (own["sender"], own["receiver"], own["loss"], own["delay"]) == ("sat3", "sat1", 0.5, 20.0)
    assert cli.main(["show", "lossy_links"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "links: loss 0.3, delay 20, jitter 10" in printed
    assert "from sat3 to sat1: loss 0.5, delay 20, jitter 10, outages" in printed


def test_show_says_nothing_of_faults_where_there_are_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["show", "triangle"]) == 0
    printed = capsys.readouterr().out
    assert "links:" not in printed
    assert "fault" not in printed


def test_a_large_formation_is_shown_on_a_page(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    data = json.loads(shortened("triangle", 10.0).to_json())
    curve = data["satellites"][0]["curve"]
    data["satellites"] = [{"name": f"s{number}", "curve": curve} for number in range(120)]
    file = tmp_path / "many.json"
    file.write_text(json.dumps(data))
    assert cli.main(["show", str(file)]) == 0
    printed = capsys.readouterr().out
    assert len(printed) < 20_000
    assert len(printed.splitlines()) < 150
    assert max(map(len, printed.splitlines())) < 500
    assert "... and 110 more; --json prints all" in printed
    assert "(119 in all)" in printed
    # Of a few satellites everything is shown.
    assert cli.main(["show", "triangle"]) == 0
    assert "--json prints all" not in capsys.readouterr().out
