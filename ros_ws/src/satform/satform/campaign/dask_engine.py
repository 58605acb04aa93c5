# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flies chunks on the workers of a dask.distributed scheduler, on this machine and others.

A thread of a dask worker flies its chunks in a worker process of its own, as the local engine does, since a
task of dask can neither be ended by a time limit nor survive what ends its process. A chunk whose dask worker
is lost is flown by another one. The optional dependencies `satform[dask]` are needed here and on the workers.
"""

import pickle
import platform
import subprocess
import threading
import time
import uuid
import zlib
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from multiprocessing.connection import wait
from typing import Any

from satform.campaign.engine import Chunk, EngineError, Job, Outcome
from satform.campaign.results import CaseResult
from satform.campaign.software import software
from satform.campaign.worker_process import MOST_STARTS, WorkerProcess

_CONNECT_LIMIT = 20.0
"""Wall-clock time in which the scheduler has to answer, also after a lost connection, s."""

_FIRST_WORKER_LIMIT = 30.0
"""Wall-clock time in which the scheduler has to have a worker, s."""

_QUEUED_PER_WORKER = 2
"""Chunks that a thread of a worker has, so that it does not wait for the next."""

_NO_WORKER_LIMIT = 60.0
"""Wall-clock time for which there may be no worker, as while they are restarted, s."""

_LOOK_PERIOD = 2.0
"""Wall-clock time after which the workers are counted again, s."""

_CLOSE_LIMIT = 10.0
"""Wall-clock time in which the workers have to end their processes, s."""

_PERIOD = 0.5
"""Wall-clock time after which a time limit is looked at, s."""


class DaskEngine:
    """Flies chunks on the workers of a scheduler."""

    def __init__(self, job: Job, address: str) -> None:
        """Connect to a scheduler that has a worker at least.

        Args:
            job: of every worker.
            address: of the scheduler, such as `tcp://10.0.0.1:8786`.

        Raises:
            EngineError: dask is not installed, or there is no scheduler or no worker.
        """
        try:
            from distributed import Client  # noqa: PLC0415 - an extra
        except ImportError as error:
            raise EngineError(f"the engine dask needs the packages of satform[dask] ({error})") from None
        self._job = zlib.compress(pickle.dumps(job))
        self._token = uuid.uuid4().hex
        self._limit = job.time_limit
        self._futures: dict[Any, Chunk] = {}
        try:
            self._client: Any = Client(address, timeout=_CONNECT_LIMIT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise EngineError(f"there is no dask scheduler at {address}: {error}") from None
        try:
            self._client.wait_for_workers(1, timeout=_FIRST_WORKER_LIMIT)
        except TimeoutError:
            self._client.close()
            raise EngineError(
                f"the dask scheduler at {address} has no worker; start some with: dask worker {address}"
            ) from None
        self._threads = 1
        self._had_workers = self._next_look = time.monotonic()
        self._count()

    def _count(self) -> None:
        """Count the threads of all workers now and then.

        Raises:
            EngineError: the scheduler does not answer, or there has been no worker for a while.
        """
        now = time.monotonic()
        if now < self._next_look:
            return
        self._next_look = now + _LOOK_PERIOD
        try:
            self._threads = sum(_within(_CONNECT_LIMIT, self._client.nthreads).values())
        except (OSError, TimeoutError) as error:
            raise EngineError(f"the dask scheduler does not answer any more: {error}") from None
        if self._threads:
            self._had_workers = now
        elif now - self._had_workers > _NO_WORKER_LIMIT:
            raise EngineError(f"there has been no dask worker for {_NO_WORKER_LIMIT:g} s")

    @property
    def workers(self) -> int:
        """Threads of all workers, each of which flies one chunk at a time."""
        return max(1, self._threads)

    @property
    def free(self) -> int:
        """Chunks that can be submitted now."""
        return _QUEUED_PER_WORKER * self.workers - len(self._futures)

    def submit(self, chunk: Chunk) -> None:
        """Have a chunk flown."""
        future = self._client.submit(
            fly_on_worker,
            self._token,
            self._job,
            chunk.numbers,
            self._limit,
            software(),
            pure=False,
            retries=0,
        )
        self._futures[future] = chunk

    def wait(self, duration: float) -> list[Outcome]:
        """What has come of the chunks within some time.

        Raises:
            EngineError: the scheduler cannot be reached any more, or the workers cannot fly anything.
        """
        from distributed import wait as wait_for  # noqa: PLC0415 - an extra

        with suppress(TimeoutError, CancelledError), self._client.as_current():
            wait_for(list(self._futures), timeout=duration, return_when="FIRST_COMPLETED")
        if self._client.status != "running":
            raise EngineError(f"the dask scheduler is gone: the connection is {self._client.status}")
        self._count()
        done = [future for future in self._futures if future.done()]
        outcomes = {future: self._outcome(future, self._futures[future]) for future in done}
        found = {future: outcome for future, outcome in outcomes.items() if outcome is not None}
        for future in found:
            del self._futures[future]
        return list(found.values())

    def _outcome(self, future: Any, chunk: Chunk) -> Outcome | None:
        """What has come of a chunk; None where its results were lost with a worker and are made again."""
        from distributed import KilledWorker  # noqa: PLC0415 - an extra

        if future.status == "finished":
            try:
                results, failure, suspects, timed_out = future.result(timeout=_CONNECT_LIMIT)
            except TimeoutError:
                return None
            return Outcome(chunk, results, failure=failure, suspects=suspects, timed_out=timed_out)
        error = future.exception() if future.status == "error" else None
        if isinstance(error, KilledWorker):
            return Outcome(chunk, failure="its dask workers ended", suspects=chunk.numbers)
        if error is None:
            # Lost with the scheduler's memory of it, not by anything that it did.
            return Outcome(chunk, failure="its task was cancelled", suspects=chunk.numbers)
        raise EngineError(f"the dask workers cannot fly the campaign: {type(error).__name__}: {error}")

    def close(self) -> None:
        """Cancel all chunks, and end the worker processes of this campaign."""
        with suppress(Exception):  # a scheduler that is gone has nothing to cancel
            _within(_CLOSE_LIMIT, self._end)
        self._futures = {}
        with suppress(Exception):
            self._client.close(timeout=5)

    def _end(self) -> None:
        self._client.cancel(list(self._futures), force=True)
        self._client.run(end_processes, self._token)


def _within(limit: float, call: Callable[[], Any]) -> Any:
    """What a call gives that has no timeout of its own.

    Raises:
        TimeoutError: it has not ended within the limit, s; it goes on in its thread.
    """
    found: Future[Any] = Future()

    def run() -> None:
        try:
            found.set_result(call())
        except Exception as error:  # raised again in the thread that waits
            found.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    try:
        return found.result(limit)
    except TimeoutError:
        raise TimeoutError(f"no answer within {limit:g} s") from None


_processes: dict[int, tuple[str, WorkerProcess]] = {}
"""Of a dask worker: by thread, the token of the campaign and the process that flies it."""

_ended: set[str] = set()
"""Tokens of campaigns for which this dask worker starts no process any more."""

_ending = threading.Lock()
"""Held where `_processes` and `_ended` are changed."""


def fly_on_worker(
    token: str,
    job: bytes,
    numbers: tuple[int, ...],
    time_limit: float | None,
    versions: Mapping[str, str],
) -> tuple[list[CaseResult], str, tuple[int, ...], bool]:
    """Fly a chunk in a process of this thread of a dask worker.

    Args:
        token: of the campaign, which no other campaign has on these dask workers.
        job: pickled and compressed.
        numbers: of the cases.
        time_limit: of a case, s; None for no limit.
        versions: of the software with which the campaign was started.

    Returns:
        Results; why cases have none; which cases were flown then; whether the time limit was the reason.

    Raises:
        EngineError: no worker process can be started, its software is another one, or the campaign was ended.
    """
    if software() != versions:
        raise EngineError(f"{platform.node()} has {software()}, the campaign was started with {versions}")
    found: list[CaseResult] = []
    process = _process_of_thread(token, job, time_limit)
    for attempt in range(MOST_STARTS):
        process.start(Chunk(numbers))
        outcome = _last_outcome(process, found)
        if outcome is not None:
            return found, outcome.failure, outcome.suspects, outcome.timed_out
        if attempt < MOST_STARTS - 1:
            process = _process_of_thread(token, job, time_limit)
    raise EngineError(f"{MOST_STARTS} worker processes ended before they could fly: {process.not_started}")


def _last_outcome(process: WorkerProcess, found: list[CaseResult]) -> Outcome | None:
    """Wait for the end of the chunk of a process; None where the process ended before it could fly."""
    while process.alive:
        wait([process.connection], _PERIOD)
        outcomes = process.receive()
        overdue = process.overdue()
        for outcome in outcomes if overdue is None else [*outcomes, overdue]:
            found += outcome.results
            if outcome.ended:
                return outcome
    return None


def _process_of_thread(token: str, job: bytes, time_limit: float | None) -> WorkerProcess:
    thread = threading.get_ident()
    with _ending:
        known, process = _processes.get(thread, ("", None))
        if process is not None and known == token and process.alive:
            return process
        _processes.pop(thread, None)
    if process is not None:
        process.close()
    pickled = zlib.decompress(job)
    with _ending:
        if token in _ended:
            raise EngineError("the campaign was ended")
        process = WorkerProcess(pickled, time_limit, subprocess.DEVNULL)
        _processes[thread] = token, process
    return process


def end_processes(token: str) -> None:
    """End the worker processes that this dask worker has for a campaign, whatever they do.

    Args:
        token: of the campaign; none is started for it afterwards.
    """
    with _ending:
        _ended.add(token)
        own = {thread: process for thread, (known, process) in _processes.items() if known == token}
        for thread in own:
            del _processes[thread]
    for process in own.values():
        process.kill_keeping_pipe()
