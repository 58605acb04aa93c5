"""However a flight ends, nothing is left behind and the bag opens."""

import os
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from flights import shortened
from satform.simulate import simulate
from satform_bringup.processes import processes
from satform_bringup.supervise import fly
from satform_nodes.bag_reader import read_bag


def recorder_alone(fleet: Callable[..., list], tmp_path: Path) -> tuple[list, Path]:
    scenario = shortened("triangle", 12000.0)
    file = tmp_path / "scenario.json"
    file.write_text(scenario.to_json())
    bag = tmp_path / "bag"
    return fleet(processes(scenario, file, bag)), bag


def wait_for_bytes(file: Path, size: int) -> None:
    end = time.monotonic() + 60.0
    while not file.exists() or file.stat().st_size < size:
        assert time.monotonic() < end, f"{file} does not grow to {size} bytes"
        time.sleep(0.01)  # what is awaited is a file of another process, of which nobody tells


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_recorder_ended_by_a_signal_leaves_a_bag_that_opens(
    number: signal.Signals, fleet: Callable[..., list], tmp_path: Path
) -> None:
    running, bag = recorder_alone(fleet, tmp_path)
    recorder = running[-1]
    wait_for_bytes(bag / "bag_0.mcap", random.Random(number).randrange(300_000, 2_000_000))
    recorder.send_signal(number)
    recorder.wait(20)
    read = read_bag(bag)
    steps = read.record.steps
    assert steps > 100
    assert not read.complete
    whole = simulate(shortened("triangle", steps * 0.5))
    assert whole.differences(read.record) == []


def test_a_closed_bag_opens_without_the_workspace(fleet: Callable[..., list], tmp_path: Path) -> None:
    running, bag = recorder_alone(fleet, tmp_path)
    wait_for_bytes(bag / "bag_0.mcap", 500_000)
    running[-1].send_signal(signal.SIGINT)
    running[-1].wait(20)
    with AnyReader([bag]) as reader:
        assert {connection.topic for connection in reader.connections} >= {"/sat1/state", "/clock"}
        connection, _, raw = next(
            message for message in reader.messages() if message[0].topic == "/sat2/command"
        )
        assert reader.deserialize(raw, connection.msgtype).step == 0


def test_a_lost_satellite_ends_the_flight_and_is_named(tmp_path: Path) -> None:
    scenario = shortened("triangle", 12000.0)
    killed: list[int] = []

    def kill_one(done: int, _all: int) -> None:
        if done > 200 and not killed:
            found = subprocess.run(["pgrep", "-x", "sat2"], capture_output=True, text=True, check=True)
            killed.extend(int(number) for number in found.stdout.split())
            for number in killed:
                os.kill(number, signal.SIGKILL)

    flight = fly(scenario, tmp_path, record=True, progress=kill_one)
    assert flight.lost == ("sat2",)
    assert "signal 9" in flight.reason
    assert 200 < flight.steps < scenario.timing.steps
    assert_nothing_runs_in(tmp_path)
    assert read_bag(tmp_path / "bag").record.steps > 100


def test_ctrl_c_is_a_clean_end(start_run: Callable[..., subprocess.Popen[str]], tmp_path: Path) -> None:
    process = start_run("triangle")
    wait_for_bytes(tmp_path / "run" / "bag" / "bag_0.mcap", 400_000)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=30)
    assert process.returncode == 130, output + errors
    assert "Traceback" not in output + errors
    assert_nothing_runs_in(tmp_path)
    assert read_bag(tmp_path / "run" / "bag").record.steps > 100


def assert_nothing_runs_in(folder: Path) -> None:
    assert shutil.which("pgrep"), "pgrep is needed to look for processes left behind"
    left = subprocess.run(["pgrep", "-fa", str(folder)], capture_output=True, text=True, check=False)
    assert left.stdout == ""
