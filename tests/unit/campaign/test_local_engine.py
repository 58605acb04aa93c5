# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The local engine: every case has one result, whatever happens to the processes that fly them."""

import os
import signal
from collections.abc import Callable, Iterator, Mapping
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import chunks
from satform.campaign.engine import (
    MOST_SERIES_BYTES,
    Chunk,
    ChunkScheduler,
    EngineError,
    Job,
    Outcome,
    chunk_size,
)
from satform.campaign.local_engine import LocalEngine
from satform.campaign.results import CaseResult
from satform.campaign.worker import Message
from satform.campaign.worker_process import WorkerProcess


def flown(
    accidents: Mapping[int, str],
    folder: Path,
    *,
    cases: int = 40,
    workers: int = 2,
    size: int = 7,
    time_limit: float | None = None,
) -> dict[int, CaseResult]:
    """Results of cases by number; none comes twice."""
    found: list[CaseResult] = []
    job = Job(chunks.fly, accidents, str(folder), time_limit)
    engine = LocalEngine(job, workers, folder / "workers.log")
    try:
        assert ChunkScheduler(chunks.changes, found.extend).fly(range(cases), size, engine)
        pids = engine.pids
    finally:
        engine.close()
    assert sorted(result.number for result in found) == list(range(cases))
    # Ended and waited for: there is no such child any more.
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
    return {result.number: result for result in found}


def test_the_hash_is_the_same_for_any_number_of_workers_and_any_size_of_a_chunk(tmp_path: Path) -> None:
    wanted = chunks.hashed(chunks.result(number) for number in range(40))
    assert chunks.hashed(flown({}, tmp_path, workers=1, size=40).values()) == wanted
    assert chunks.hashed(flown({}, tmp_path, workers=2, size=7).values()) == wanted
    assert chunks.hashed(flown({}, tmp_path, workers=7, size=1).values()) == wanted


@pytest.mark.parametrize(
    ("accident", "reason"),
    [
        ("exit", "its worker process ended with exit code 3"),
        ("kill", "its worker process ended by SIGKILL"),
        ("memory", "there was not enough memory for it"),
        ("error", "RuntimeError: no such thing"),
    ],
)
def test_a_case_that_ends_its_worker_is_a_result_with_the_reason_and_costs_no_other(
    accident: str, reason: str, tmp_path: Path
) -> None:
    results = flown({11: accident, 12: accident}, tmp_path)
    for number in (11, 12):
        assert (results[number].reason, results[number].lost) == (reason, True)
        assert results[number].changes == chunks.changes(number)
    others = {number: result for number, result in results.items() if number not in (11, 12)}
    assert others == {number: chunks.result(number) for number in others}


def test_a_worker_that_dies_once_costs_no_result(tmp_path: Path) -> None:
    results = flown({3: "kill once", 20: "exit once", 39: "error once"}, tmp_path)
    assert results == {number: chunks.result(number) for number in range(40)}


def test_a_case_that_does_not_end_in_time_is_a_result_and_the_rest_of_its_chunk_is_flown(
    tmp_path: Path,
) -> None:
    results = flown({5: "hang", 6: "hang"}, tmp_path, cases=12, size=12, time_limit=1.5)
    for number in (5, 6):
        assert results[number].reason == "timeout: not flown within 1.5 s of wall-clock time"
        assert results[number].lost
    assert all(results[number] == chunks.result(number) for number in range(12) if number not in (5, 6))


def test_a_campaign_that_no_worker_can_read_is_an_error_and_not_a_loop(tmp_path: Path) -> None:
    class Unknown:
        """Pickled by a name that is not there in the worker."""

    Unknown.__qualname__ = "Unknown"
    Unknown.__module__ = "chunks"
    chunks.Unknown = Unknown  # type: ignore[attr-defined]
    engine = LocalEngine(Job(chunks.fly, Unknown()), 2)
    del chunks.Unknown  # type: ignore[attr-defined]
    try:
        with pytest.raises(EngineError, match="cannot use the campaign: AttributeError"):
            ChunkScheduler(chunks.changes, lambda _: None).fly(range(4), 2, engine)
    finally:
        engine.close()


def test_workers_that_end_before_they_start_are_an_error_and_not_a_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "python"
    program.write_text("#!/bin/sh\nexit 7\n")
    program.chmod(0o755)
    monkeypatch.setattr("satform.campaign.worker_process.sys.executable", str(program))
    engine = LocalEngine(Job(chunks.fly, {}), 2)
    try:
        with pytest.raises(EngineError, match=r"3 worker processes ended before .* with exit code 7"):
            ChunkScheduler(chunks.changes, lambda _: None).fly(range(4), 2, engine)
    finally:
        engine.close()


def test_a_stopped_campaign_ends_its_workers_and_has_what_was_finished(tmp_path: Path) -> None:
    found: list[CaseResult] = []
    engine = LocalEngine(Job(chunks.fly, {20: "hang"}), 1)
    scheduler = ChunkScheduler(chunks.changes, found.extend, stop=lambda: len(found) >= 20, period=0.05)
    try:
        assert not scheduler.fly(range(40), 10, engine)
        pids = engine.pids
    finally:
        engine.close()
    assert [result.number for result in found] == list(range(20))
    with pytest.raises(ProcessLookupError):
        os.kill(pids[0], signal.SIGTERM)


@pytest.mark.parametrize(
    ("cases", "workers", "satellites", "size"),
    [
        (1000, 2, 3, 500),
        (10_000, 2, 3, 512),
        (10, 7, 3, 2),
        (1_000_000, 2, 3, 512),
        (1000, 1, 1000, 4),
        (5, 1, 10_000, 1),
    ],
)
def test_a_chunk_has_a_share_of_the_cases_within_the_bounds_of_memory(
    cases: int, workers: int, satellites: int, size: int
) -> None:
    assert chunk_size(cases, workers, satellites) == size


def test_the_series_of_a_chunk_are_within_the_bounds_of_memory() -> None:
    assert chunk_size(10_000, 2, 3, MOST_SERIES_BYTES // 10) == 10
    assert chunk_size(10_000, 2, 3, MOST_SERIES_BYTES * 2) == 1
    assert chunk_size(10_000, 2, 3, 1000) == chunk_size(10_000, 2, 3)


class OneWorker:
    """An engine of one worker, which answers a chunk with outcomes one after the other."""

    workers = 1

    def __init__(self, answer: Callable[[Chunk], list[Outcome]]) -> None:
        self.free = 1
        self.submitted: list[Chunk] = []
        self._answer = answer
        self._outcomes: list[Outcome] = []

    def submit(self, chunk: Chunk) -> None:
        self.free = 0
        self.submitted.append(chunk)
        self._outcomes = self._answer(chunk)

    def wait(self, _duration: float) -> list[Outcome]:
        outcome = self._outcomes.pop(0)
        self.free = int(not self._outcomes)
        return [outcome]

    def close(self) -> None:
        """Nothing to end."""


def whole(chunk: Chunk) -> Outcome:
    """A chunk that is flown as a whole."""
    return Outcome(chunk, tuple(map(chunks.result, chunk.numbers)))


def test_cases_that_are_flown_in_part_count_as_that_part_until_they_have_results() -> None:
    def in_steps(chunk: Chunk) -> list[Outcome]:
        results = whole(chunk).results
        return [
            Outcome(chunk, ended=False, under_way=1.0),
            Outcome(chunk, ended=False, under_way=3.5),
            Outcome(chunk, results[:3], ended=False),
            Outcome(chunk, results[3:]),
        ]

    reported: list[int] = []
    scheduler = ChunkScheduler(chunks.changes, lambda _: None, report=reported.append)
    assert scheduler.fly(range(4), 4, OneWorker(in_steps))
    assert list(dict.fromkeys(reported)) == [1, 3, 4]


def test_a_stack_that_ends_its_worker_is_halved_until_the_case_is_alone_that_does_so() -> None:
    def as_a_stack(chunk: Chunk) -> list[Outcome]:
        """One stack, which ends its worker if case 2 is in it."""
        if 2 in chunk.numbers:
            return [Outcome(chunk, failure="died", suspects=chunk.numbers)]
        return [whole(chunk)]

    found: list[CaseResult] = []
    engine = OneWorker(as_a_stack)
    assert ChunkScheduler(chunks.changes, found.extend).fly(range(6), 4, engine)
    stacks = [(0, 1, 2, 3), (0, 1), (2, 3), (2,), (3,), (2,), (4, 5)]
    assert [chunk.numbers for chunk in engine.submitted] == stacks
    assert [result.reason for result in sorted(found, key=lambda result: result.number)][2] == "died"


def asleep(folder: Path) -> str:
    """Path of a program that does nothing for a while, whatever its arguments are."""
    program = folder / "asleep"
    program.write_text("#!/bin/sh\nexec sleep 20\n")
    program.chmod(0o755)
    return str(program)


@pytest.mark.parametrize("campaign", [{}, {0: "x" * 4_000_000}], ids=["small", "large"])
def test_a_worker_that_does_not_start_is_an_error_without_a_time_limit_of_a_case(
    campaign: Mapping[int, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("satform.campaign.worker_process.sys.executable", asleep(tmp_path))
    monkeypatch.setattr("satform.campaign.worker_process._START_LIMIT", 0.2)
    looks = iter(range(100))
    scheduler = ChunkScheduler(
        chunks.changes, lambda _: None, stop=lambda: next(looks, None) is None, period=0.05
    )
    engine = LocalEngine(Job(chunks.fly, campaign), 2)
    try:
        with pytest.raises(EngineError, match=r"a worker process has not started within 0\.2 s"):
            scheduler.fly(range(4), 2, engine)
    finally:
        engine.close()


class Played:
    """A worker whose messages are sent by the test, and a clock that the test sets."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, time_limit: float | None) -> None:
        ours, theirs = Pipe()
        self._end: Connection[Any, Any] = Connection(os.dup(theirs.fileno()))
        self.now = 1000.0
        monkeypatch.setattr("satform.campaign.worker_process.Pipe", lambda: (ours, theirs))
        monkeypatch.setattr("satform.campaign.worker_process.sys.executable", asleep(folder))
        clock = SimpleNamespace(monotonic=lambda: self.now)
        monkeypatch.setattr("satform.campaign.worker_process.time", clock)
        self.process = WorkerProcess(b"job", time_limit, -3)

    def send(self, *messages: Message) -> None:
        for message in messages:
            self._end.send(message)

    def close(self) -> None:
        self.process.kill()
        self._end.close()


@pytest.fixture
def played(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Played]:
    found = Played(tmp_path, monkeypatch, 10.0)
    yield found
    found.close()


def test_the_time_of_a_case_is_not_judged_before_all_messages_are_received(played: Played) -> None:
    process, results = played.process, [chunks.result(number) for number in range(3)]
    played.send(Message("ready"))
    assert process.receive() == []
    process.start(Chunk((0, 1, 2)))
    played.send(Message("begin", (0,)))
    assert process.receive() == []
    # The parent was busy for longer than the limit; meanwhile case 1 has ended and case 2 has begun.
    played.now += 11.0
    played.send(
        Message("begin", (1,)), Message("results", results=tuple(results[:2])), Message("begin", (2,))
    )
    assert process.overdue() is None
    assert [outcome.results for outcome in process.receive()] == [tuple(results[:2])]
    assert process.overdue() is None
    played.now += 9.0
    assert process.overdue() is None
    played.now += 2.0
    outcome = process.overdue()
    assert outcome is not None
    assert (outcome.timed_out, outcome.suspects) == (True, (2,))


def test_a_case_that_was_not_flown_when_the_time_was_over_is_no_time_out() -> None:
    def timed_out(chunk: Chunk) -> list[Outcome]:
        """The timeout of case 0 with its result."""
        if chunk.numbers == (0, 1):
            return [Outcome(chunk, (chunks.result(0),), failure="late", suspects=(0,), timed_out=True)]
        return [whole(chunk)]

    found: list[CaseResult] = []
    assert ChunkScheduler(chunks.changes, found.extend).fly(range(2), 2, OneWorker(timed_out))
    assert found == [chunks.result(0), chunks.result(1)]


def test_a_stack_that_does_not_advance_within_the_time_of_a_case_is_a_time_out(played: Played) -> None:
    process, numbers = played.process, tuple(range(8))
    played.send(Message("ready"))
    process.receive()
    process.start(Chunk(numbers))
    played.send(Message("begin", numbers))
    process.receive()
    for part in (0.25, 0.5):
        played.now += 9.0
        assert process.overdue() is None
        played.send(Message("advanced", part=part))
        assert [outcome.under_way for outcome in process.receive()] == [8 * part]
    # One limit of 10 s, and what may pass between two reports.
    played.now += 10.2
    assert process.overdue() is None
    played.now += 0.1
    outcome = process.overdue()
    assert outcome is not None
    assert (outcome.timed_out, outcome.suspects) == (True, numbers)


def test_a_stack_that_advances_has_the_time_of_its_cases_and_no_more(played: Played) -> None:
    process, numbers = played.process, (0, 1)
    played.send(Message("ready"))
    process.receive()
    process.start(Chunk(numbers))
    played.send(Message("begin", numbers))
    process.receive()
    for part in (0.3, 0.6):
        played.now += 9.5
        assert process.overdue() is None
        played.send(Message("advanced", part=part))
        process.receive()
    played.now += 1.1
    outcome = process.overdue()
    assert outcome is not None
    assert (outcome.timed_out, outcome.suspects) == (True, numbers)
