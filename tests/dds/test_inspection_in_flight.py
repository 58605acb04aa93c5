# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that inspect a flight print its state, change nothing, and do not count as satellites."""

import csv
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from flights import shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform_bringup.supervisor.run_registry import registered_runs
from satform_tools.cli import main as cli

pytestmark = pytest.mark.unmeasured

LONG = ("--set", "timing.duration=100000.0", "--set", "expect=[]", "--set", "graph={kind: line}")
"""A flight that does not end before the looks do, on a graph on which not everyone hears everyone."""

CLOCKED = ("--mode", "realtime", "--rate", "10")
"""On the wall clock: a flight that leaves the processor to those who look."""

PATIENCE = ("--timeout", "60")

Look = Callable[..., str]


@pytest.fixture
def look(capsys: pytest.CaptureFixture[str]) -> Look:
    """Runs a command that looks into the flight; returns what it prints."""

    def run(*words: str, code: int = 0) -> str:
        capsys.readouterr()
        assert cli.main([*words, *PATIENCE]) == code, capsys.readouterr().err
        captured = capsys.readouterr()
        return captured.out + captured.err

    return run


def test_nodes_and_topics_are_those_of_the_formation_and_whoever_looks_is_none_of_them(
    start_run: Callable[..., subprocess.Popen[str]], look: Look, domain: int, tmp_path: Path
) -> None:
    start_run("triangle", *LONG, *CLOCKED)
    assert json.loads(look("nodes", "--json")) == ["/plant", "/recorder", "/sat1", "/sat2", "/sat3"]
    (run,) = (run for run in registered_runs() if run.domain == domain)
    assert (run.scenario, run.folder) == ("triangle", str(tmp_path / "run"))
    topics = {entry["topic"]: entry for entry in json.loads(look("topics", "--json"))}
    assert topics["/sat2/state"]["type"] == "satform_msgs/msg/RelativeState"
    listeners = {}
    for name in ("sat1", "sat2", "sat3"):
        info = json.loads(look("topics", "info", f"/{name}/arc_length", "--json"))
        assert [entry["node"] for entry in info["endpoints"] if entry["role"] == "publisher"] == [f"/{name}"]
        listeners[name] = {entry["node"] for entry in info["endpoints"] if entry["role"] == "subscription"}
        assert topics[f"/{name}/arc_length"]["subscriptions"] == len(listeners[name])
        assert {entry["reliability"] for entry in info["endpoints"]} == {"reliable"}
    assert listeners == {
        "sat1": {"/recorder", "/sat2"},
        "sat2": {"/recorder", "/sat1", "/sat3"},
        "sat3": {"/recorder", "/sat2"},
    }
    subscribed = json.loads(look("nodes", "info", "sat1", "--json"))["subscriptions"]
    assert set(subscribed) == {"/formation/status", "/sat1/state", "/sat2/arc_length"}
    assert "did you mean /sat3/state?" in look("topics", "info", "/sat4/state", code=2)


def test_what_is_heard_is_what_was_flown_and_the_flight_stays_the_same(
    start_run: Callable[..., subprocess.Popen[str]], look: Look, tmp_path: Path
) -> None:
    run = start_run("triangle", *LONG)
    state = json.loads(look("echo", "/sat2/state", "--once", "--json"))
    heading, row = csv.reader(look("echo", "/sat1/state", "--once", "--csv").splitlines())
    vectors = ("position", "velocity", "applied_acceleration")
    assert heading[-9:] == [f"{vector}.{axis}" for vector in vectors for axis in "xyz"]
    assert (
        look("echo", "/formation/status", "--once", "--field", "satellites")
        == "- sat1\n- sat2\n- sat3\n---\n"
    )
    assert json.loads(look("topics", "hz", "/sat1/state", "--count", "1", "--json"))["rate"] > 0.0
    seen = json.loads(look("watch", "--once", "--json"))
    os.killpg(run.pid, signal.SIGINT)
    run.communicate(timeout=180)
    assert run.returncode == 130
    flown = read_bag(tmp_path / "run" / "bag").record
    oracle = simulate(shortened("triangle", flown.steps * 0.5, "graph={kind: line}"))
    assert oracle.differences(flown) == []
    assert list(state["position"].values()) == oracle.position[state["step"], 1].tolist()
    read = dict(zip(heading, row, strict=True))
    assert [float(read[f"velocity.{axis}"]) for axis in "xyz"] == oracle.velocity[
        int(read["step"]), 0
    ].tolist()
    assert (seen["phase"], seen["last_step"], len(seen["links"])) == ("flying", 200_000, 4)
    for index, satellite in enumerate(seen["satellites"]):
        assert satellite["alive"]
        # The frame's words may be of neighbouring steps.
        apart = np.linalg.norm(oracle.position[:, index] - satellite["position"], axis=1)
        assert abs(int(np.argmin(apart)) - seen["step"]) < 100
        assert apart.min() < 1e-6


def test_a_gain_is_described_and_changed_and_its_node_says_no_with_a_reason(
    start_run: Callable[..., subprocess.Popen[str]], look: Look
) -> None:
    start_run("triangle", *LONG, *CLOCKED)
    gain = ("sat1", "controller.switching_gain")
    described = json.loads(look("params", "describe", *gain, "--json"))
    assert described["type"] == "double array"
    assert "m/s^2" in described["description"]
    assert "takes effect at step" in look("params", "set", *gain, "[0.2, 0.2, 1]")
    assert json.loads(look("params", "get", *gain, "--json")) == [0.2, 0.2, 1.0]
    assert "greater than or equal to 0" in look("params", "set", *gain, "[-0.2, 0.2, 0.2]", code=2)
    assert "did you mean controller.kind?" in look("params", "get", "sat1", "controller.kindd", code=2)
    assert json.loads(look("params", "list", "sat1", "--json"))["satellite"] == "sat1"
    reply = json.loads(look("call", "/sat1/get_parameters", "{names: [satellite]}", "--json"))
    assert reply["values"][0]["string_value"] == "sat1"
    assert "did you mean names?" in look("call", "/sat1/get_parameters", "{name: [x]}", code=2)


def test_new_targets_are_followed_given_up_refused_and_taken_back(
    start_run: Callable[..., subprocess.Popen[str]], look: Look
) -> None:
    start_run("triangle", *LONG, *CLOCKED)
    assert "there is no satellite sat9; there are" in look("reconfigure", "sat9={scale: 2.0}", code=2)
    assert "a target is written SATELLITE=" in look("reconfigure", "sat2", code=2)
    moved = json.loads(look("reconfigure", "sat2={phase_offset: 50.0}", "--tolerance", "1e6", "--json"))
    assert moved["outcome"] == "reached"
    assert moved["delta_v"].keys() == {"sat2"}
    far = "sat2={curve: {kind: circle, radius: 2.0e6}}"
    assert "not reached within 5 s" in look("reconfigure", far, "--within", "5", code=1)
    words = [
        sys.executable,
        "-u",
        "-m",
        "satform_tools",
        "reconfigure",
        far.replace("2.0e6", "3.0e6"),
        *PATIENCE,
    ]
    following = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert following.stdout is not None
    assert "changed at step" in following.stdout.readline()
    following.send_signal(signal.SIGINT)
    said, _ = following.communicate(timeout=180)
    assert "cancelled: the former targets are back since step" in said
    assert following.returncode == 1


def frames(text: str) -> Sequence[dict[str, object]]:
    return [json.loads(line) for line in text.splitlines()]


def test_watching_ends_by_itself_with_the_flight(
    start_run: Callable[..., subprocess.Popen[str]], look: Look
) -> None:
    # Whoever watches is there before the first step, as a run takes longer to start.
    run = start_run("triangle", "--set", "timing.duration=750.0", "--set", "expect=[]")
    seen = frames(look("watch", "--json"))
    assert (seen[-1]["phase"], seen[-1]["step"], seen[-1]["last_step"]) == ("finished", 1500, 1500)
    assert [entry["step"] for entry in seen] == sorted(entry["step"] for entry in seen)
    run.communicate(timeout=180)
    assert run.returncode == 0


def test_one_who_watches_when_a_flight_is_stopped_is_told_why_it_ended(
    start_run: Callable[..., subprocess.Popen[str]],
) -> None:
    run = start_run("triangle", *LONG, *CLOCKED)
    command = [sys.executable, "-m", "satform_tools", "watch", "--json", *PATIENCE]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as watching:
        assert watching.stdout is not None
        assert json.loads(watching.stdout.readline())["phase"] == "flying"
        os.killpg(run.pid, signal.SIGINT)
        rest, _ = watching.communicate(timeout=180)
    last = frames(rest)[-1]
    assert (watching.returncode, last["phase"]) == (0, "aborted")
    assert "asked to stop" in " ".join(map(str, last["events"]))
