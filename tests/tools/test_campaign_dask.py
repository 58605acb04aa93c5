# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns on dask workers: separate processes, one of them killed, and two machines on a network."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import pytest

import chunks
from flights import SCENARIOS
from namespaces import Network, network
from satform.campaign.dask_engine import DaskEngine
from satform.campaign.engine import ChunkScheduler, EngineError, Job
from satform.campaign.results import CaseResult
from satform_tools.cli import main as cli
from small_campaign import results_hash

CAMPAIGN = """
name: on_dask
scenario: triangle.yaml
runs: 24
seed: 7
set: {timing.duration: 4.0, expect: []}
dispersions:
  - path: satellites[*].arc_length
    distribution: {kind: uniform, low: -15.0e3, high: 15.0e3}
    applied: add
figures: [{name: effort, measure: {kind: delta_v}}]
"""

Start = Callable[..., subprocess.Popen[bytes]]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    shutil.copy(SCENARIOS / "triangle.yaml", tmp_path)
    (tmp_path / "on_dask.yaml").write_text(CAMPAIGN)
    return tmp_path / "on_dask.yaml"


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts `dask`, on another machine of a network if need be; all are ended with the test."""
    processes: list[subprocess.Popen[bytes]] = []

    def begin(*words: str, before: tuple[str, ...] = ()) -> subprocess.Popen[bytes]:
        log = (tmp_path / f"dask-{len(processes)}.log").open("wb")
        # A worker imports the functions of this test from its path.
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry)}
        process = subprocess.Popen(
            [*before, sys.executable, "-m", "dask", *words],
            cwd=tmp_path,
            env=environment,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
        log.close()
        processes.append(process)
        return process

    yield begin
    for process in processes[::-1]:
        process.terminate()
    for process in processes:
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def scheduler(start: Start, folder: Path, host: str = "127.0.0.1", before: tuple[str, ...] = ()) -> str:
    """Address of a scheduler that was started."""
    file = folder / "scheduler.json"
    words = ("--host", host, "--port", "0", "--no-dashboard", "--no-show", "--scheduler-file", str(file))
    return written_address(file, start("scheduler", *words, before=before))


def written_address(file: Path, process: subprocess.Popen[bytes]) -> str:
    """The address that a scheduler writes to a file once it can be reached."""
    end = time.monotonic() + 120.0
    while True:
        assert process.poll() is None, (file.parent / "dask-0.log").read_text()
        assert time.monotonic() < end
        try:
            return str(json.loads(file.read_text())["address"])
        except (OSError, ValueError):
            time.sleep(0.05)  # polls: there is no event for a file that another process writes


def worker(start: Start, address: str, *words: str, **options: Any) -> subprocess.Popen[bytes]:
    return start("worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny", *words, **options)


def test_a_campaign_on_dask_workers_has_the_hash_of_one_in_this_process(
    file: Path, tmp_path: Path, start: Start, capsys: pytest.CaptureFixture[str]
) -> None:
    address = scheduler(start, tmp_path)
    for _ in range(2):
        worker(start, address)
    words = ["campaign", "run", str(file), "--engine", "dask", "--scheduler", address, "--json"]
    assert cli.main([*words, "--out", str(tmp_path / "out")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["flown"], found["lost"], found["speed"]["engine"]) == (24, 0, "dask")
    assert found["results_hash"] == results_hash(file)


def test_a_killed_dask_worker_costs_no_case_and_accidents_are_results(tmp_path: Path, start: Start) -> None:
    address = scheduler(start, tmp_path)
    workers = [worker(start, address) for _ in range(2)]
    accidents = {5: "exit", 11: "hang", 17: "kill once"}
    found: list[CaseResult] = []
    engine = DaskEngine(Job(chunks.fly, accidents, str(tmp_path), 4.0), address)
    killed: list[int] = []

    def kill_one(done: int) -> None:
        if done >= 8 and not killed:
            killed.append(workers[0].pid)
            workers[0].send_signal(signal.SIGKILL)

    try:
        assert ChunkScheduler(chunks.changes, found.extend, report=kill_one).fly(range(60), 4, engine)
    finally:
        engine.close()
    assert killed
    assert sorted(result.number for result in found) == list(range(60))
    by_number = {result.number: result for result in found}
    assert by_number[5].reason == "its worker process ended with exit code 3"
    assert by_number[11].reason == "timeout: not flown within 4 s of wall-clock time"
    rest = [result for result in found if result.number not in (5, 11)]
    expected = [chunks.result(number) for number in range(60) if number not in (5, 11)]
    assert chunks.hashed(rest) == chunks.hashed(expected)


def test_a_scheduler_that_is_not_there_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("satform.campaign.dask_engine._CONNECT_LIMIT", 0.5)
    with pytest.raises(EngineError, match="there is no dask scheduler at tcp://127"):
        DaskEngine(Job(chunks.fly, {}), "tcp://127.0.0.1:9")


@pytest.mark.parametrize("lost", ["scheduler", "worker"])
def test_a_scheduler_or_the_last_worker_that_is_gone_ends_the_campaign_with_a_sentence(
    lost: str, tmp_path: Path, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("satform.campaign.dask_engine._CONNECT_LIMIT", 5.0)
    monkeypatch.setattr("satform.campaign.dask_engine._NO_WORKER_LIMIT", 1.0)
    monkeypatch.setattr("satform.campaign.dask_engine._LOOK_PERIOD", 0.2)
    words = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show")
    file = tmp_path / "scheduler.json"
    processes = {"scheduler": start("scheduler", *words, "--scheduler-file", str(file))}
    address = written_address(file, processes["scheduler"])
    processes["worker"] = worker(start, address)
    found: list[CaseResult] = []
    engine = DaskEngine(Job(chunks.fly, {9: "hang"}), address)

    def end_it(done: int) -> None:
        if done == 8:
            processes[lost].kill()

    scheduler = ChunkScheduler(chunks.changes, found.extend, report=end_it)
    try:
        with pytest.raises(EngineError, match=r"dask (scheduler|worker)"):
            scheduler.fly(range(12), 4, engine)
    finally:
        engine.close()
    assert sorted(result.number for result in found)[:8] == list(range(8))


class SilentClient:
    """A client of dask whose scheduler has one worker at first and then answers nothing any more."""

    status = "running"

    def __init__(self, *_words: object, **_options: object) -> None:
        self.silent = threading.Event()
        self.calls: list[str] = []

    def wait_for_workers(self, *_words: object, **_options: object) -> None:
        """There is one."""

    def nthreads(self) -> dict[str, int]:
        self._answer("nthreads")
        return {"a": 1}

    def cancel(self, *_words: object, **_options: object) -> None:
        self.silent.set()
        self._answer("cancel")

    def run(self, *_words: object) -> None:
        self._answer("run")

    def close(self, **_options: object) -> None:
        self.calls.append("close")

    def as_current(self) -> AbstractContextManager[None]:
        return nullcontext()

    def _answer(self, call: str) -> None:
        if self.silent.is_set():
            threading.Event().wait(20.0)
        self.calls.append(call)


def test_a_scheduler_that_answers_nothing_is_waited_for_within_bounds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("distributed.Client", SilentClient)
    monkeypatch.setattr("distributed.wait", lambda *_words, **_options: None)
    monkeypatch.setattr("satform.campaign.dask_engine._CLOSE_LIMIT", 0.2)
    engine = DaskEngine(Job(chunks.fly, {}), "tcp://127.0.0.1:9")
    monkeypatch.setattr("satform.campaign.dask_engine._CONNECT_LIMIT", 0.2)
    monkeypatch.setattr("satform.campaign.dask_engine._LOOK_PERIOD", 0.0)
    engine._next_look = 0.0
    engine._client.silent.set()
    with pytest.raises(EngineError, match=r"does not answer any more: no answer within 0\.2 s"):
        engine.wait(0.0)
    engine.close()
    assert engine._client.calls == ["nthreads", "close"]


@pytest.fixture
def two_machines(tmp_path: Path) -> Iterator[Network]:
    with network(tmp_path, {"alpha": "10.91.0.1", "beta": "10.91.0.2"}) as found:
        yield found


def test_a_campaign_is_flown_on_two_machines_of_a_network(
    two_machines: Network, file: Path, tmp_path: Path, start: Start
) -> None:
    def on(name: str) -> tuple[str, ...]:
        return ("ip", "netns", "exec", two_machines.namespace(name))

    address = scheduler(start, tmp_path, "10.91.0.1", on("alpha"))
    for name, host in (("alpha", "10.91.0.1"), ("beta", "10.91.0.2")):
        worker(start, address, "--host", host, "--name", name, before=on(name))
    words = ["campaign", "run", str(file), "--engine", "dask", "--scheduler", address, "--json"]
    process = two_machines.start("alpha", [*words, "--out", str(tmp_path / "out")])
    output, _ = process.communicate(timeout=300)
    assert process.returncode == 0, output
    found = json.loads(output[output.index("{") :])
    assert (found["flown"], found["lost"]) == (24, 0)
    assert found["results_hash"] == results_hash(file)
