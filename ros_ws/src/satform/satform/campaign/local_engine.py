# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flies chunks in processes of this machine, and replaces worker processes that have ended.

What becomes of the cases of such a worker is decided in `engine`. Needs the standard library only.
"""

import pickle
import subprocess
from multiprocessing.connection import wait
from pathlib import Path
from typing import IO

from satform.campaign.engine import Chunk, EngineError, Job, Outcome
from satform.campaign.worker_process import MOST_STARTS, WorkerProcess


class LocalEngine:
    """Flies chunks in some processes of this machine."""

    def __init__(self, job: Job, workers: int, log: Path | None = None) -> None:
        """Take a job; workers are started when there is something to fly.

        Args:
            job: of every worker.
            workers: number of processes.
            log: file to which they write to standard error; None to drop that.
        """
        self._job = pickle.dumps(job)
        self._limit = job.time_limit
        self._log: IO[bytes] | None = None if log is None else log.open("ab")
        self._count = workers
        self._processes: list[WorkerProcess] = []
        self._failed_starts = 0

    @property
    def workers(self) -> int:
        """Number of processes."""
        return self._count

    @property
    def free(self) -> int:
        """Chunks that can be submitted now."""
        return self._count - sum(process.chunk is not None for process in self._processes)

    @property
    def pids(self) -> list[int]:
        """Numbers of the worker processes."""
        return [process.pid for process in self._processes]

    def submit(self, chunk: Chunk) -> None:
        """Have a chunk flown.

        Raises:
            EngineError: no worker can be started.
        """
        idle = (process for process in self._processes if process.chunk is None and process.alive)
        (next(idle, None) or self._new()).start(chunk)

    def _new(self) -> WorkerProcess:
        log = subprocess.DEVNULL if self._log is None else self._log
        self._processes.append(WorkerProcess(self._job, self._limit, log))
        return self._processes[-1]

    def wait(self, duration: float) -> list[Outcome]:
        """What has come of the chunks within some time.

        Raises:
            EngineError: a worker cannot be started.
        """
        wait([process.connection for process in self._processes], duration)
        found = [outcome for process in self._processes for outcome in process.receive()]
        found += [outcome for process in self._processes if (outcome := process.overdue()) is not None]
        ended = [process for process in self._processes if not process.alive]
        self._processes = [process for process in self._processes if process.alive]
        if any(process.ready for process in self._processes):
            self._failed_starts = 0
        for process in ended:
            chunk = process.chunk
            process.close()
            if process.not_started and chunk is not None:
                self._start_again(chunk, process.not_started)
        return found

    def _start_again(self, chunk: Chunk, sentence: str) -> None:
        """Have a chunk flown whose worker has ended before it could fly anything."""
        self._failed_starts += 1
        if self._failed_starts >= MOST_STARTS:
            raise EngineError(f"{MOST_STARTS} worker processes ended before they could fly: {sentence}")
        self._new().start(chunk)

    def close(self) -> None:
        """End all workers, whatever they do."""
        for process in self._processes:
            if process.chunk is not None:
                process.kill()
        for process in self._processes:
            process.close()
        self._processes = []
        if self._log is not None:
            self._log.close()
            self._log = None
