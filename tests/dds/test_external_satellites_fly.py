# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Satellites of somebody else fly with two of ours, with the same bits; what goes wrong is a sentence."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flights import shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate

pytestmark = pytest.mark.unmeasured

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "external_satellites"
FOREIGN = [sys.executable, str(EXAMPLES / "python" / "foreign_satellite.py")]
EXTERNAL = ("--set", "satellites[sat2].external=true")
DURATION = 50.0


def result(run: Path) -> dict[str, object]:
    return dict(json.loads((run / "result.json").read_text()))


@pytest.mark.parametrize("language", ["python", "c"])
def test_flight_with_a_foreign_satellite_has_the_bits_of_the_flight_with_our_own(
    language: str,
    in_c: list[str],
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_program: Callable[..., "subprocess.Popen[str]"],
    tmp_path: Path,
) -> None:
    flight = start_run("triangle", "--set", f"timing.duration={DURATION}", *EXTERNAL)
    program = start_program(tmp_path / "run", FOREIGN if language == "python" else in_c)
    _, messages = flight.communicate(timeout=200)
    assert "waiting up to 120 s for the node /sat2" in messages
    assert flight.returncode == 0, messages
    assert program.wait(20) == 0
    assert result(tmp_path / "run")["state_hash"] == simulate(shortened("triangle", DURATION)).digest()


def test_satellite_with_another_law_flies_any_satellite(
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_program: Callable[..., "subprocess.Popen[str]"],
    tmp_path: Path,
) -> None:
    options = ("--set", "satellites[sat3].external=true", "--set", "timing.duration=50")
    flight = start_run("triangle", *options)
    program = start_program(
        tmp_path / "run", [sys.executable, str(EXAMPLES / "hold" / "hold_position.py"), "sat3"]
    )
    _, messages = flight.communicate(timeout=200)
    assert (flight.returncode, program.wait(20)) == (0, 0), messages
    record = read_bag(tmp_path / "run" / "bag").record
    # Across the orbital plane the law is a critically damped oscillator that begins in its anchor:
    # z = v t exp(-t / 100 s), but for the orbit's own 1.1e-6 1/s^2 and the disturbance.
    time_since = np.arange(101) * 0.5
    speed = record.velocity[0, 2, 2]
    moved = record.position[:, 2, 2] - record.position[0, 2, 2]
    pulled = 0.5 * (1.1e-6 * 1.1e5 + 0.01) * time_since**2
    assert (
        np.abs(moved - speed * time_since * np.exp(-0.01 * time_since)) <= pulled + 0.1 * np.abs(moved)
    ).all()
    assert np.isnan(record.reference_position[:, 2]).all()


def test_satellite_that_knows_no_scenario_flies_on_a_graph_with_a_schedule(
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_program: Callable[..., "subprocess.Popen[str]"],
    tmp_path: Path,
) -> None:
    # Until 20 s sat1 receives from sat2 alone, then from sat4 alone.
    change = "{at: 20.0, add: [[sat4, sat1], [sat1, sat4]], remove: [[sat1, sat2], [sat2, sat1]]}"
    options = ("satellites[sat1].external=true", f"graph_schedule=[{change}]", "timing.duration=40")
    flight = start_run("switching_graph", *(part for option in options for part in ("--set", option)))
    program = start_program(
        tmp_path / "run", [sys.executable, str(EXAMPLES / "hold" / "hold_position.py"), "sat1"]
    )
    _, messages = flight.communicate(timeout=200)
    assert (flight.returncode, program.wait(20)) == (0, 0), messages
    phase = read_bag(tmp_path / "run" / "bag").record.arc_length
    # It announces what it received for the step before, of its only in-neighbour.
    assert phase[2:20, 0].tolist() == phase[1:19, 1].tolist()
    assert phase[22:40, 0].tolist() == phase[21:39, 3].tolist()


def test_example_in_python_is_under_eighty_lines() -> None:
    lines = (EXAMPLES / "python" / "foreign_satellite.py").read_text().splitlines()
    assert len([line for line in lines if line.strip()]) < 80


def test_satellite_that_does_not_come_ends_the_run(
    start_run: Callable[..., "subprocess.Popen[str]"], tmp_path: Path
) -> None:
    flight = start_run("triangle", *EXTERNAL, "--set", "external_timeout=10.0")
    output, _ = flight.communicate(timeout=120)
    assert flight.returncode == 3
    assert "there is no node sat2, which is external: somebody else starts it" in " ".join(output.split())


def test_satellite_of_another_interface_is_refused_at_once(
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_faulty: Callable[[Path, str], "subprocess.Popen[str]"],
    tmp_path: Path,
) -> None:
    flight = start_run("triangle", *EXTERNAL)
    start_faulty(tmp_path / "run", "OtherInterface")
    output, _ = flight.communicate(timeout=110)
    assert flight.returncode == 3
    sentence = "sat2 was written by version 99 of the interface, and these nodes by version 1"
    assert sentence in " ".join(output.split())


def test_satellite_with_another_definition_of_a_message_is_refused(
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_faulty: Callable[[Path, str], "subprocess.Popen[str]"],
    tmp_path: Path,
) -> None:
    flight = start_run("triangle", *EXTERNAL, "--set", "external_timeout=20.0")
    start_faulty(tmp_path / "run", "OtherDefinition")
    output, _ = flight.communicate(timeout=120)
    assert flight.returncode == 3
    sentence = (
        "sat2 publishes /sat2/command with another definition of satform_msgs/msg/Command (RIHS01_00010203"
    )
    assert sentence in " ".join(output.split())


def test_satellite_that_comes_twice_is_named(
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_faulty: Callable[[Path, str], "subprocess.Popen[str]"],
    tmp_path: Path,
) -> None:
    flight = start_run("triangle", *EXTERNAL, "--set", "external_timeout=15.0", "--set", "timing.duration=10")
    for _ in range(2):
        # Neither reports that it is ready before both are there.
        start_faulty(tmp_path / "run", "Unready")
    output, _ = flight.communicate(timeout=120)
    assert flight.returncode == 3
    assert "2 nodes are called sat2, and all of them publish /sat2/" in " ".join(output.split())


def test_satellite_that_leaves_is_lost_and_rejoins_when_started_again(
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_program: Callable[..., "subprocess.Popen[str]"],
    tmp_path: Path,
) -> None:
    # Long enough for a program that starts slowly beside other work.
    flight = start_run("triangle", *EXTERNAL, "--set", "node_timeout=1.0", "--set", "timing.duration=4000")
    program = start_program(tmp_path / "run", FOREIGN)
    bag = tmp_path / "run" / "bag" / "bag_0.mcap"
    end = time.monotonic() + 100.0
    while not bag.exists() or bag.stat().st_size < 200_000:
        assert time.monotonic() < end, "the flight does not begin"
        time.sleep(0.05)  # polls: another process writes it
    program.send_signal(signal.SIGKILL)
    program.wait(10)
    again = start_program(tmp_path / "run", FOREIGN)
    output, _ = flight.communicate(timeout=250)
    assert again.wait(20) == 0, output
    events = " ".join(str(event) for event in result(tmp_path / "run")["events"])  # type: ignore[attr-defined]
    assert "no answer within 1 s from sat2" in events
    assert "sat2 rejoined at step" in events
    assert flight.returncode == 0
