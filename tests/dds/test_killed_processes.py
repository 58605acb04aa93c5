# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Processes killed or stopped at any moment: no flight hangs, bags can be read, losses are recorded."""

import json
import os
import random
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import forkserver
from pathlib import Path

import pytest

from flights import shortened
from flown import HeldRestart, assert_as_in_one_process, assert_flies_again, flown, processes_of, repetitions
from satform.bag.reader import read_bag
from satform.common.exit_codes import EXIT_DONE, EXIT_LOST
from satform_bringup.supervisor import process_server, supervisor
from satform_bringup.supervisor.flight import Policy
from satform_bringup.supervisor.run import fly
from satform_bringup.supervisor.supervisor import PROCESS_SERVER
from satform_nodes.transport.fast_path import MANY_SUBSCRIPTIONS
from satform_tools.bench.scaling import ring
from satform_tools.cli.main import main

pytestmark = pytest.mark.unmeasured

STEPS = 500
KILLED_AT = 150
"""Step from which on processes are killed: late enough for a history, with as much of the flight to come."""
SCENARIO = ("triangle", STEPS * 0.5)


class Killer:
    """Sends signals to processes of a flight when it has come to a step."""

    def __init__(self, folder: Path, step: int, *names: str, number: int = signal.SIGKILL) -> None:
        self.hit: list[int] = []
        self._folder, self._step, self._names, self._number = folder, step, names, number

    def __call__(self, done: int, _all: int) -> None:
        if done >= self._step and not self.hit:
            there = processes_of(self._folder)
            self.hit = [there[name] for name in self._names]
            for process in self.hit:
                os.kill(process, self._number)


@pytest.fixture
def brief_shutdown(monkeypatch: pytest.MonkeyPatch) -> None:
    """For flights that end while nodes wait for another one, and end only by the timeout for their end."""
    monkeypatch.setattr(supervisor, "SHUTDOWN_TIMEOUT", 5.0)


@pytest.mark.parametrize("seed", range(repetitions(3)))
def test_a_kill_at_any_moment_costs_the_killed_and_nothing_else(seed: int, tmp_path: Path) -> None:
    draw = random.Random(seed)
    killer = Killer(tmp_path, draw.randrange(STEPS - 200), draw.choice(["sat1", "sat2", "sat3"]))
    flight, bag = flown(shortened(*SCENARIO), tmp_path, progress=killer)
    if flight.steps < STEPS:
        # Killed before its first command there is nothing that could be flown again without it.
        assert "before its first command" in flight.reason
        return
    assert killer.hit
    if not flight.losses:
        # The word of its step came to the killer when all had been taken: nothing was lost.
        assert flight.lost == ()
        assert_as_in_one_process(bag)
        return
    (loss,) = flight.losses
    assert loss.name in flight.lost
    assert f"step {loss.step}" not in loss.reason or loss.step > 0
    assert bag.complete
    assert_flies_again(bag)


@pytest.mark.parametrize("seed", range(repetitions(3)))
def test_a_kill_at_any_time_of_a_short_flight_is_on_record_or_without_effect(
    seed: int, tmp_path: Path
) -> None:
    # Over in a second: the kill meets the start, the flight, its last step, or those who are leaving.
    draw = random.Random(seed)
    wait, name = draw.uniform(0.2, 1.6), draw.choice(["plant", "recorder", "sat1", "sat2", "sat3"])
    scenario = shortened("triangle", 100.0)
    hit: list[str] = []

    def kill() -> None:
        process = processes_of(tmp_path).get(name)
        if process is not None:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
                hit.append(name)

    timer = threading.Timer(wait, kill)
    timer.start()
    try:
        flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    finally:
        timer.cancel()
        timer.join()
    assert processes_of(tmp_path) == {}
    assert {loss.name for loss in flight.losses} <= set(hit)
    assert set(flight.lost) <= set(hit), flight
    if flight.steps < scenario.timing.steps:
        assert set(flight.lost) == set(hit), flight
        assert name in flight.reason
    elif name != "recorder":
        bag = read_bag(tmp_path / "bag")
        assert bag.complete
        assert_flies_again(bag)


def test_two_killed_at_once_are_both_named_and_the_third_flies_on(tmp_path: Path) -> None:
    flight, bag = flown(shortened(*SCENARIO), tmp_path, Killer(tmp_path, KILLED_AT, "sat1", "sat3"))
    assert sorted(flight.lost) == ["sat1", "sat3"]
    assert flight.steps == STEPS
    assert_flies_again(bag)


def test_when_all_are_killed_the_flight_ends_and_says_so(tmp_path: Path) -> None:
    killer = Killer(tmp_path, KILLED_AT, "sat1", "sat2", "sat3")
    flight, bag = flown(shortened(*SCENARIO), tmp_path, killer)
    assert sorted(flight.lost) == ["sat1", "sat2", "sat3"]
    assert "no satellite is left" in flight.reason
    assert KILLED_AT <= flight.steps < STEPS
    assert bag.record.steps > KILLED_AT - 100


@pytest.mark.usefixtures("brief_shutdown")
def test_a_restart_says_that_it_brings_back_nobody_when_all_are_lost(tmp_path: Path) -> None:
    killer = Killer(tmp_path, KILLED_AT, "sat1", "sat2", "sat3")
    flight = fly(shortened(*SCENARIO), tmp_path, record=False, progress=killer, policy=Policy(restart=True))
    if len(flight.lost) == 3:
        # One that was killed last may have been waited for by one that had been started again.
        assert "no satellite is left, and a satellite is restarted only while another" in flight.reason


def test_a_killed_process_of_a_group_takes_all_its_satellites_with_it(tmp_path: Path) -> None:
    scenario = shortened("ring_six", 300.0)
    flight, bag = flown(scenario, tmp_path, Killer(tmp_path, 100, "group1"), group=2)
    assert sorted(flight.lost) == ["sat3", "sat4"]
    assert flight.steps == 300
    assert_flies_again(bag)


def test_among_many_of_whom_one_is_waited_for_after_the_other_the_killed_are_missed(tmp_path: Path) -> None:
    flight, bag = flown(
        ring(MANY_SUBSCRIPTIONS, 60), tmp_path, Killer(tmp_path, 20, "group1"), group=MANY_SUBSCRIPTIONS // 2
    )
    assert sorted(flight.lost) == sorted(
        f"s{place}" for place in range(MANY_SUBSCRIPTIONS // 2, MANY_SUBSCRIPTIONS)
    )
    assert flight.steps == 60
    assert_flies_again(bag)


@pytest.mark.usefixtures("brief_shutdown")
@pytest.mark.parametrize("name", ["sat2", "recorder", "plant"])
def test_a_process_killed_before_the_first_step_ends_the_flight_by_name(name: str, tmp_path: Path) -> None:
    # The first step is a minute away as long as one process stands still.
    scenario = shortened(*SCENARIO)

    def kill_early() -> None:
        end = time.monotonic() + 60.0
        while name not in processes_of(tmp_path) and time.monotonic() < end:
            time.sleep(0.01)  # polls: another process does not notify this one
        os.kill(processes_of(tmp_path)[name], signal.SIGKILL)

    threading.Thread(target=kill_early, daemon=True).start()
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    assert name in flight.lost
    assert flight.steps < STEPS
    assert name in flight.reason
    assert not flight.stopped
    assert processes_of(tmp_path) == {}


def test_with_restart_a_killed_satellite_comes_back_from_its_checkpoint(tmp_path: Path) -> None:
    scenario = shortened("triangle", 1000.0, "checkpoint_period=20.0", "node_timeout=300.0")
    killer = HeldRestart(tmp_path, 300, "sat2", held="sat1", restarted="sat2.1")
    flight, bag = flown(scenario, tmp_path, killer, restart=True)
    # Back at the end it is not lost any more; both are on record.
    assert flight.lost == ()
    (loss,), (back,) = flight.losses, flight.returns
    assert (loss.name, back.name) == ("sat2", "sat2")
    assert 0 < loss.step < back.step < scenario.timing.steps
    assert back.seconds > 0.0
    (event,) = bag.events[back.step]
    assert event.checkpoint is not None
    assert loss.step - 40 <= event.checkpoint <= loss.step
    assert_flies_again(bag)


def test_without_its_recorder_a_flight_goes_on_only_when_told_so(tmp_path: Path) -> None:
    for without in (False, True):
        folder = tmp_path / str(without)
        killer = Killer(folder, KILLED_AT, "recorder")
        folder.mkdir()
        flight = fly(
            shortened(*SCENARIO),
            folder,
            record=True,
            progress=killer,
            policy=Policy(without_recorder=without),
        )
        assert "recorder" in flight.lost
        assert (flight.steps == STEPS) == without
        assert processes_of(folder) == {}
        cut = read_bag(folder / "bag")
        assert not cut.complete
        assert cut.record.steps > 0
        assert_flies_again(cut)


@pytest.mark.parametrize("late", [0.0, 0.5], ids=["at once", "late"])
def test_a_killed_process_server_is_a_lost_process_and_no_stop(
    late: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    killed: list[int] = []
    watched, ended = os.pipe()
    report = threading.Timer(late, os.close, [ended])

    def kill(done: int, _all: int) -> None:
        if done >= 300 and not killed:
            killed.append(forkserver._forkserver._forkserver_pid)
            os.kill(killed[0], signal.SIGKILL)
            report.start()

    if late:
        # On a busy machine the kernel reports the end of a process well after it has closed its files.
        monkeypatch.setattr(process_server, "watch_server", lambda: watched)
    flight = fly(shortened("triangle", 6000.0), tmp_path, record=True, progress=kill)
    report.join()
    process_server.close()
    assert killed
    assert flight.lost == (PROCESS_SERVER,)
    assert not flight.stopped
    assert flight.reason.startswith("the process server ended after step")
    assert processes_of(tmp_path) == {}
    assert read_bag(tmp_path / "bag").record.steps > 200


def test_when_the_plant_is_killed_satellites_turn_their_thrusters_off_and_end(tmp_path: Path) -> None:
    scenario = shortened(*SCENARIO, "node_timeout=2.0")
    flight = fly(scenario, tmp_path, record=True, progress=Killer(tmp_path, KILLED_AT, "plant"))
    assert flight.lost == ("plant",)
    assert "plant was ended by signal 9" in flight.reason
    assert processes_of(tmp_path) == {}
    assert not read_bag(tmp_path / "bag").complete


def test_a_satellite_that_stood_still_for_too_long_is_fenced_when_it_goes_on(tmp_path: Path) -> None:
    scenario = shortened("triangle", 900.0, "node_timeout=2.0")
    stopped: list[int] = []

    def stop_and_continue(done: int, _all: int) -> None:
        if done >= KILLED_AT and not stopped:
            stopped.append(processes_of(tmp_path)["sat2"])
            os.kill(stopped[0], signal.SIGSTOP)
        elif done >= 2 * KILLED_AT and len(stopped) == 1:
            os.kill(stopped[0], signal.SIGCONT)
            stopped.append(0)

    flight, bag = flown(scenario, tmp_path, stop_and_continue)
    assert len(stopped) == 2
    assert flight.lost == ("sat2",)
    assert flight.steps == scenario.timing.steps
    (loss,) = flight.losses
    assert "no answer within 2 s from sat2" in loss.reason
    words = (tmp_path / "log" / "sat2.log").read_text()
    assert "the plant counts sat2 as lost" in words
    assert_flies_again(bag)


@pytest.mark.parametrize(("tolerated", "code"), [(0, EXIT_LOST), (1, EXIT_DONE)])
def test_the_exit_code_says_whether_the_scenario_allows_the_loss(
    tolerated: int, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from satform_bringup.supervisor import run as supervisor_run

    out = tmp_path / "run"
    whole: Callable[..., object] = supervisor_run.fly
    killer = Killer(out, KILLED_AT, "sat2")
    monkeypatch.setattr(
        supervisor_run, "fly", lambda *given, **named: whole(*given, **{**named, "progress": killer})
    )
    words = [
        "run",
        "triangle",
        "--out",
        str(out),
        "--set",
        f"timing.duration={STEPS * 0.5}",
        "--set",
        "expect=[]",
    ]
    monkeypatch.setattr(sys, "argv", ["satform", *words])
    assert main([*words, "--set", f"tolerated_losses={tolerated}"]) == code
    result = json.loads((out / "result.json").read_text())
    assert result["lost"] == ["sat2"]
    assert len(result["state_hash"]) == 64
