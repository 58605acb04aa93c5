# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flights on the wall clock, flown once more from their bags, and satellites brought back by hand."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from flights import shipped, shortened
from flown import HeldRestart, assert_flies_again, flown, processes_of
from satform_tools.run.command import RunOptions, run

pytestmark = pytest.mark.unmeasured


def satform(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "satform_tools", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_a_flight_on_the_wall_clock_meets_its_expectations_and_has_all_figures(tmp_path: Path) -> None:
    outcome = run(
        shipped("realtime_triangle"), "realtime", record=True, out=tmp_path, options=RunOptions(rate=4.0)
    )
    assert outcome.exit_code == 0, outcome.reason
    kept = json.loads((tmp_path / "result.json").read_text())
    assert all(expectation["met"] for expectation in kept["expectations"])
    figures = kept["punctuality"]
    assert {"delay_mean", "delay_99", "delay_largest", "overruns", "misses", "late"} <= figures.keys()
    assert set(figures["satellites"]) == {"sat1", "sat2", "sat3"}


def test_a_satellite_that_is_silent_on_the_wall_clock_drifts_after_its_command_s_time_out(
    tmp_path: Path,
) -> None:
    """Held still, its last command is flown for 5 s of flight, a fifth of a second here; then it coasts."""
    changes = ("command_timeout=5.0", "node_timeout=60.0", "dynamics={kind: cw}")
    scenario = shortened("triangle", 150.0, *changes)
    held: list[int] = []

    def hold_and_let_go(done: int, _all: int) -> None:
        if done >= 20 and not held:
            held.extend((processes_of(tmp_path)["sat2"], done))
            os.kill(held[0], signal.SIGSTOP)
        elif len(held) == 2 and done >= held[1] + 80:
            os.kill(held[0], signal.SIGCONT)
            held.append(done)

    flight, bag = flown(scenario, tmp_path, hold_and_let_go, rate=25.0)
    assert flight.lost == ()
    record = bag.record
    off = np.flatnonzero((record.acceleration[:, 1] == 0.0).all(axis=-1))
    # A busy machine may hold any process for a moment, too: the long time is meant.
    spells = np.split(off, np.flatnonzero(np.diff(off) > 1) + 1)
    longest = max(spells, key=len)
    assert longest.size > 30
    first, last = int(longest[0]), int(longest[-1])
    # The last command before is held for ten steps after its own.
    assert len(np.unique(record.acceleration[first - 11 : first, 1], axis=0)) == 1
    assert flight.punctuality["timed_out"]["sat2"] >= longest.size - 1
    # Without thrust the relative motion is that of Clohessy and Wiltshire.
    coasted = coast(record.position[first, 1], record.velocity[first, 1], (last - first) * record.step)
    np.testing.assert_allclose(record.position[last, 1], coasted, rtol=1e-9)


def coast(position: np.ndarray, velocity: np.ndarray, time: float) -> np.ndarray:
    """Clohessy and Wiltshire's closed solution about a chief of 6000 s period, m."""
    n = 2.0 * np.pi / 6000.0
    sine, cosine = np.sin(n * time), np.cos(n * time)
    (x, y, z), (u, v, w) = position, velocity
    return np.array(
        [
            (4.0 - 3.0 * cosine) * x + sine / n * u + 2.0 / n * (1.0 - cosine) * v,
            6.0 * (sine - n * time) * x
            + y
            - 2.0 / n * (1.0 - cosine) * u
            + (4.0 * sine - 3.0 * n * time) / n * v,
            cosine * z + sine / n * w,
        ]
    )


def test_a_flight_with_a_kill_has_the_same_bits_when_it_is_replayed(tmp_path: Path) -> None:
    killed: list[int] = []

    def kill(done: int, _all: int) -> None:
        if done > 300 and not killed:
            killed.append(processes_of(tmp_path)["sat3"])
            os.kill(killed[0], signal.SIGKILL)

    flown(shortened("triangle", 400.0), tmp_path, kill)
    done = satform("replay", str(tmp_path), "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads(done.stdout)
    assert (told["steps"], told["events"], told["differences"]) == (800, 1, [])


def test_a_lost_satellite_that_is_started_by_hand_takes_part_again(tmp_path: Path) -> None:
    held = HeldRestart(tmp_path, 300, "sat2", held="sat1", restarted="sat2.again1")
    commands: list[subprocess.Popen[bytes]] = []

    def kill_and_rejoin(done: int, steps: int) -> None:
        held(done, steps)
        if held.helper is not None and not commands:
            command = [sys.executable, "-m", "satform_tools", "rejoin", str(tmp_path), "sat2"]
            commands.append(subprocess.Popen(command, stdout=subprocess.DEVNULL))

    flight, bag = flown(shortened("triangle", 1500.0, "node_timeout=300.0"), tmp_path, kill_and_rejoin)
    with commands[0] as command:
        assert command.wait(300) == 0
    assert [loss.name for loss in flight.losses] == ["sat2"]
    assert [back.name for back in flight.returns] == ["sat2"]
    assert_flies_again(bag)
