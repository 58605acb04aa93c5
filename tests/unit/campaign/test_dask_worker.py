# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a dask worker does with a chunk, without dask: a process of its own, until there is another job."""

import pickle
import zlib
from collections.abc import Iterator
from pathlib import Path

import pytest

import chunks
from satform.campaign import dask_engine
from satform.campaign.engine import EngineError, Job
from satform.campaign.software import software


@pytest.fixture(autouse=True)
def no_process_is_left() -> Iterator[None]:
    yield
    dask_engine.end_processes()


def job(accidents: dict[int, str], folder: Path | None = None, time_limit: float | None = None) -> bytes:
    return zlib.compress(pickle.dumps(Job(chunks.fly, accidents, str(folder), time_limit)))


def pids() -> list[int]:
    return [process.pid for _, process in dask_engine._processes.values()]


def test_chunks_of_a_job_share_a_process_and_another_job_has_its_own() -> None:
    first = job({})
    flown = dask_engine.fly_on_worker(first, (1, 2, 3), None, software())
    assert flown == ([chunks.result(number) for number in (1, 2, 3)], "", (3,), False)
    before = pids()
    assert dask_engine.fly_on_worker(first, (4,), None, software())[0] == [chunks.result(4)]
    assert pids() == before
    assert dask_engine.fly_on_worker(job({9: "exit"}), (5,), None, software())[0] == [chunks.result(5)]
    assert len(pids()) == 1
    assert pids() != before


def test_a_case_that_ends_its_process_or_does_not_end_is_named(tmp_path: Path) -> None:
    results, failure, suspects, timed_out = dask_engine.fly_on_worker(
        job({2: "exit"}), (1, 2, 3), None, software()
    )
    assert (failure, suspects, timed_out) == ("its worker process ended with exit code 3", (2,), False)
    assert [result.number for result in results] in ([], [1])
    limited = job({2: "hang"}, tmp_path, 1.5)
    _, failure, suspects, timed_out = dask_engine.fly_on_worker(limited, (1, 2), 1.5, software())
    assert (failure, suspects) == ("time-out: not flown within 1.5 s of wall-clock time", (2,))
    assert timed_out


def test_other_software_than_that_of_the_campaign_is_refused() -> None:
    with pytest.raises(EngineError, match=r"the campaign was started with .*'numpy': '1.0'"):
        dask_engine.fly_on_worker(job({}), (1,), None, {**software(), "numpy": "1.0"})
    assert pids() == []
