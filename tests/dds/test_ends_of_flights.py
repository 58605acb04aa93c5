# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""However a flight ends, no process or file is left behind, and the bag can be read."""

import os
import random
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

import rosbag2_format
from flights import shortened
from flown import assert_flies_again, processes_of
from process_ends import ended
from satform.bag.reader import read_bag
from satform.flight.compile import compile_scenario
from satform.flight.simulate import simulate
from satform_bringup.deployment.node_processes import processes
from satform_bringup.supervisor import supervisor
from satform_bringup.supervisor.run import fly
from satform_nodes.bag.recovery import is_whole, recover

pytestmark = pytest.mark.unmeasured


def recorder_alone(fleet: Callable[..., list], tmp_path: Path) -> tuple[list, Path]:
    scenario = shortened("triangle", 12000.0)
    file = tmp_path / "scenario.json"
    file.write_text(scenario.to_json())
    bag = tmp_path / "bag"
    return fleet(processes(compile_scenario(scenario), file, bag)), bag


def wait_for_bytes(file: Path, size: int) -> None:
    end = time.monotonic() + 60.0
    while not file.exists() or file.stat().st_size < size:
        assert time.monotonic() < end, f"{file} does not grow to {size} bytes"
        time.sleep(0.01)  # polls: there is no event for a file that another process writes


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_recorder_ended_by_a_signal_leaves_a_bag_that_opens(
    number: signal.Signals, fleet: Callable[..., list], tmp_path: Path
) -> None:
    running, bag = recorder_alone(fleet, tmp_path)
    recorder = running[-1]
    wait_for_bytes(bag / "bag_0.mcap", random.Random(number).randrange(300_000, 1_000_000))
    recorder.send_signal(number)
    recorder.wait(20)
    read = read_bag(bag)
    steps = read.record.steps
    assert steps > 100
    assert not read.complete
    whole = simulate(shortened("triangle", steps * 0.5))
    assert whole.differences(read.record) == []
    # Only a recorder that ends itself describes its bag; what the killed one left can be made whole.
    assert is_whole(bag) == (number != signal.SIGKILL)
    recovered = tmp_path / "recovered"
    assert recover(bag, recovered).messages == sum(read.messages.values())
    rosbag2_format.read(recovered)
    assert read_bag(recovered).record.differences(read.record) == []


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


@pytest.mark.parametrize("times", [1, 2])
def test_nodes_that_a_launch_file_started_end_with_0_on_ctrl_c_and_say_what_they_flew(
    times: int, installed_fleet: Callable[..., list], tmp_path: Path
) -> None:
    scenario, file, bag = shortened("triangle", 12000.0), tmp_path / "scenario.json", tmp_path / "bag"
    file.write_text(scenario.to_json())
    nodes = [
        replace(node, parameters={**node.parameters, "stopped_exit_code": 0})
        for node in processes(compile_scenario(scenario), file, bag)
    ]
    running = installed_fleet(nodes)
    wait_for_bytes(bag / "bag_0.mcap", 300_000)
    for _ in range(times):
        for process in running:
            process.send_signal(signal.SIGINT)
    assert [process.wait(20) for process in running] == [0] * len(nodes)
    plant, recorder = ((tmp_path / f"{name}.log").read_text() for name in ("plant", "recorder"))
    assert "flying triangle: 3 satellites, 24000 steps of 0.5 s, in lockstep" in plant
    assert f"recording into {bag}" in recorder
    if times == 1:
        assert "stopped at step" in plant
        assert f"bag: {bag}, " in recorder
        assert read_bag(bag).record.steps > 100


def test_a_lost_satellite_is_named_and_the_others_fly_on_as_one_process_does(tmp_path: Path) -> None:
    scenario = shortened("triangle", 500.0)
    killed: list[int] = []

    def kill_one(done: int, _all: int) -> None:
        if done > 200 and not killed:
            assert len(processes_of(tmp_path)) == 5
            killed.append(processes_of(tmp_path)["sat2"])
            os.kill(killed[0], signal.SIGKILL)

    flight = fly(scenario, tmp_path, record=True, progress=kill_one)
    assert flight.lost == ("sat2",)
    (loss,) = flight.losses
    assert not loss.planned
    assert "signal 9" in loss.reason
    assert flight.steps == scenario.timing.steps
    assert processes_of(tmp_path) == {}
    bag = read_bag(tmp_path / "bag")
    assert bag.complete
    assert_flies_again(bag)
    assert np.isnan(bag.record.arc_length[loss.step + 1 :, 1]).all()


def test_a_silent_plant_is_named_and_not_those_who_notice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Nobody waits for the end of one that stands still: that would take ten minutes here.
    monkeypatch.setattr(supervisor, "SHUTDOWN_TIMEOUT", 600.0)
    scenario = shortened("triangle", 12000.0, "node_timeout=3.0")
    held: list[int] = []

    def hold_the_plant(done: int, _all: int) -> None:
        if done > 200 and not held:
            held.append(processes_of(tmp_path)["plant"])
            os.kill(held[0], signal.SIGSTOP)

    flight = fly(scenario, tmp_path, record=False, progress=hold_the_plant)
    assert flight.lost == ("plant",)
    assert "nothing received from the plant" in flight.reason
    assert processes_of(tmp_path) == {}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("moment", ["before the first step", "in flight"])
def test_a_signal_to_everyone_in_the_terminal_is_a_clean_end(
    moment: str, number: signal.Signals, start_run: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    process = start_run("triangle")
    folder = tmp_path / "run"
    if moment == "in flight":
        wait_for_bytes(folder / "bag" / "bag_0.mcap", 400_000)
        assert len(processes_of(folder)) == 5
    else:
        wait_for_bytes(folder / "scenario.json", 1)
    os.killpg(process.pid, number)
    output, errors = process.communicate(timeout=180)
    assert process.returncode == 130, output + errors
    assert "Traceback" not in output + errors
    assert processes_of(folder) == {}
    if moment == "in flight":
        assert read_bag(folder / "bag").record.steps > 100


@pytest.mark.parametrize("numbers", [(signal.SIGINT, signal.SIGINT), (signal.SIGINT, signal.SIGTERM)])
def test_two_signals_at_once_stop_a_flight_too(
    numbers: tuple[signal.Signals, ...], start_run: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    process = start_run("triangle")
    wait_for_bytes(tmp_path / "run" / "bag" / "bag_0.mcap", 400_000)
    for number in numbers:
        process.send_signal(number)
        time.sleep(0.005)  # `timeout` sends a signal to its child and, a moment later, to its child's group
    output, errors = process.communicate(timeout=180)
    assert process.returncode == 130, output + errors
    assert "Stopped at step" in output
    assert processes_of(tmp_path / "run") == {}
    if len(set(numbers)) == 1:
        assert is_whole(tmp_path / "run" / "bag")


def test_a_folder_for_temporary_files_whose_path_is_too_long_is_a_sentence(
    start_run: Callable[..., subprocess.Popen[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / ("x" * 100)
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    process = start_run("triangle")
    _, errors = process.communicate(timeout=180)
    assert process.returncode == 2
    assert "set TMPDIR to a shorter one" in errors
    assert "Traceback" not in errors


def test_when_a_run_has_ended_nothing_of_it_is_left(
    start_run: Callable[..., subprocess.Popen[str]],
) -> None:
    process = start_run("triangle", "--set", "timing.duration=20.0", "--set", "expect=[]")
    assert process.wait(60) == 0
    # Nodes have sessions of their own and have ended before; who helped to start them is of the run's.
    sessions = [int(words[3]) for words in map(fields_of_stat, Path("/proc").glob("[0-9]*/stat")) if words]
    assert process.pid not in sessions


def fields_of_stat(file: Path) -> list[str]:
    """What the kernel says of a process after its name: state, parent, group, session, and so on."""
    try:
        return file.read_text().rpartition(") ")[2].split()
    except OSError:
        return []


def test_nobody_flies_on_when_the_one_who_started_it_is_killed(
    start_run: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    process = start_run("triangle")
    folder = tmp_path / "run"
    wait_for_bytes(folder / "bag" / "bag_0.mcap", 200_000)
    flying = processes_of(folder)
    assert len(flying) == 5
    process.kill()
    assert ended(flying.values(), 30.0), f"still flying: {processes_of(folder)}"
    assert processes_of(folder) == {}
