# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a dask worker does with a chunk, without dask: a process of its own, until there is another job."""

import pickle
import threading
import time
import uuid
import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import chunks
from satform.campaign import dask_engine
from satform.campaign.engine import EngineError, Job
from satform.campaign.software import software


@pytest.fixture(autouse=True)
def no_process_is_left() -> Iterator[None]:
    yield
    for token in {token for token, _ in dask_engine._processes.values()}:
        dask_engine.end_processes(token)


def job(accidents: dict[int, str], folder: Path | None = None, time_limit: float | None = None) -> bytes:
    return zlib.compress(pickle.dumps(Job(chunks.fly, accidents, str(folder), time_limit)))


@pytest.fixture
def token() -> str:
    return uuid.uuid4().hex


def pids() -> list[int]:
    return [process.pid for _, process in dask_engine._processes.values()]


def test_chunks_of_a_job_share_a_process_and_another_campaign_has_its_own(token: str) -> None:
    first = job({})
    flown = dask_engine.fly_on_worker(token, first, (1, 2, 3), None, software())
    assert flown == ([chunks.result(number) for number in (1, 2, 3)], "", (3,), False)
    before = pids()
    assert dask_engine.fly_on_worker(token, first, (4,), None, software())[0] == [chunks.result(4)]
    assert pids() == before
    other = dask_engine.fly_on_worker(f"{token}-2", job({9: "exit"}), (5,), None, software())
    assert other[0] == [chunks.result(5)]
    assert len(pids()) == 1
    assert pids() != before


def test_a_case_that_ends_its_process_or_does_not_end_is_named(tmp_path: Path, token: str) -> None:
    results, failure, suspects, timed_out = dask_engine.fly_on_worker(
        token, job({2: "exit"}), (1, 2, 3), None, software()
    )
    assert (failure, suspects, timed_out) == ("its worker process ended with exit code 3", (2,), False)
    assert [result.number for result in results] in ([], [1])
    limited = job({2: "hang"}, tmp_path, 1.5)
    _, failure, suspects, timed_out = dask_engine.fly_on_worker(
        f"{token}-2", limited, (1, 2), 1.5, software()
    )
    assert (failure, suspects) == ("timeout: not flown within 1.5 s of wall-clock time", (2,))
    assert timed_out


def test_other_software_than_that_of_the_campaign_is_refused(token: str) -> None:
    with pytest.raises(EngineError, match=r"the campaign was started with .*'numpy': '1.0'"):
        dask_engine.fly_on_worker(token, job({}), (1,), None, {**software(), "numpy": "1.0"})
    assert pids() == []


def test_the_end_of_a_campaign_ends_its_processes_only_and_starts_none_again(
    tmp_path: Path, token: str
) -> None:
    other, hanging = f"{token}-2", job({2: "hang once"}, tmp_path)
    assert dask_engine.fly_on_worker(other, job({}), (1,), None, software())[0] == [chunks.result(1)]
    (before,) = pids()
    with ThreadPoolExecutor(1) as threads:
        flown = threads.submit(dask_engine.fly_on_worker, token, hanging, (2,), None, software())
        end = time.monotonic() + 60.0
        # A file of this name tells that the case hangs.
        while not (tmp_path / "2").exists() and time.monotonic() < end:
            threading.Event().wait(0.02)
        dask_engine.end_processes(token)
        assert flown.result(60.0) == ([], "its worker process ended by SIGKILL", (2,), False)
        with pytest.raises(EngineError, match="the campaign was ended"):
            threads.submit(dask_engine.fly_on_worker, token, hanging, (3,), None, software()).result(60.0)
    assert pids() == [before]
    assert dask_engine.fly_on_worker(other, job({}), (4,), None, software())[0] == [chunks.result(4)]
    assert pids() == [before]
