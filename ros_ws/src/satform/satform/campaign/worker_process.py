# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A process of this machine that flies chunks, one after another, and how it ended. Standard library only."""

import os
import pickle
import signal
import subprocess
import sys
import time
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO, Any

from satform.campaign.engine import Chunk, EngineError, Outcome
from satform.campaign.worker import REPORT_PERIOD, Message

MOST_STARTS = 3
"""Workers in a row that may end before they can fly anything."""

_START_LIMIT = 120.0
"""Wall-clock time in which a worker has to start, s."""

_END_LIMIT = 5.0
"""Wall-clock time in which a worker has to end once its pipe is closed, s."""

_PROGRAM = "from satform.campaign.worker import main; main({})"

_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


class WorkerProcess:
    """A process that flies one chunk after another.

    Attributes:
        connection: this end of its pipe, for `multiprocessing.connection.wait`.
        chunk: that it flies; None while it flies none.
        not_started: how it ended before it could fly anything, in a sentence; empty when it did not.
    """

    def __init__(self, job: bytes, time_limit: float | None, log: IO[bytes] | int) -> None:
        """Start a worker.

        Args:
            job: pickled.
            time_limit: of a case, s; None for no limit.
            log: where it writes to standard error, or a constant of `subprocess`.

        Raises:
            EngineError: it cannot be started.
        """
        self.chunk: Chunk | None = None
        self.not_started = ""
        self._limit = time_limit
        # Sent when it asks for it: a large one would fill the pipe to a process that does not read yet.
        self._job: bytes | None = job
        self._ready = False
        self._begun: tuple[int, ...] = ()
        self._deadline = time.monotonic() + _START_LIMIT
        self._next_sign = float("inf")
        self.connection: Connection[Any, Any]
        self.connection, other = Pipe()
        # Of this process's path nothing is found anew: the working directory may hold modules of any name.
        path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
        environment = {**os.environ, "PYTHONPATH": path, **dict.fromkeys(_ONE_THREAD, "1")}
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _PROGRAM.format(other.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=log,
                pass_fds=(other.fileno(),),
                env=environment,
                # Ctrl-C is for the process that flies the campaign.
                start_new_session=True,
            )
            other.close()
        except OSError as error:
            other.close()
            self.connection.close()
            raise EngineError(f"a worker process cannot be started: {error.strerror}") from None

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    def start(self, chunk: Chunk) -> None:
        """Have it fly a chunk; it flies none at present."""
        self.chunk = chunk
        self._begun = chunk.numbers
        if self._ready:
            self._set_deadline()
        if self._job is None:
            self._send(pickle.dumps(chunk.numbers))

    def receive(self) -> list[Outcome]:
        """Take in all messages that it has sent, and its end if it has ended; waits for none.

        Returns:
            What has come of its chunk, in order.

        Raises:
            EngineError: it could not start.
        """
        found: list[Outcome] = []
        while self.alive and self.connection.poll():
            outcome = self._receive_one()
            if outcome is not None:
                found.append(outcome)
        return found

    def _receive_one(self) -> Outcome | None:
        try:
            message: Message = self.connection.recv()
        except (EOFError, OSError, pickle.UnpicklingError):
            return self._lost(f"its worker process ended {self._how_it_ended()}")
        if message.kind in {"started", "ready"}:
            self._take_start(message)
            return None
        if not self._ready:
            raise EngineError(f"a worker process cannot use the campaign: {message.failure}")
        if message.kind == "begin":
            self._begun = message.numbers
            self._set_deadline()
            return None
        return self._outcome(message)

    def _take_start(self, message: Message) -> None:
        if message.kind == "ready":
            self._ready = True
            self._set_deadline()
        elif self._job is not None:
            self._send(self._job)
            self._job = None
            if self.chunk is not None:
                self._send(pickle.dumps(self.chunk.numbers))

    def _outcome(self, message: Message) -> Outcome | None:
        chunk, begun = self.chunk, self._begun
        if chunk is None:
            return None
        if message.kind in {"results", "advanced"}:
            self._set_next_sign()
            return Outcome(chunk, message.results, ended=False, under_way=message.part * len(begun))
        self.chunk = None
        return Outcome(chunk, message.results, failure=message.failure, suspects=begun)

    def overdue(self) -> Outcome | None:
        """End it if its time is over; what has come of its chunk then.

        Raises:
            EngineError: it has not started in time.
        """
        # A message that was not received yet may tell that the cases in question have ended in time.
        deadline = min(self._deadline, self._next_sign)
        if not self.alive or time.monotonic() < deadline or self.connection.poll():
            return None
        if not self._ready:
            self.kill()
            raise EngineError(f"a worker process has not started within {_START_LIMIT:g} s")
        if self.chunk is None or self._limit is None:
            return None
        self.kill()
        chunk, self.chunk = self.chunk, None
        sentence = f"timeout: not flown within {self._limit:g} s of wall-clock time"
        return Outcome(chunk, failure=sentence, suspects=self._begun, timed_out=True)

    @property
    def alive(self) -> bool:
        """Whether it can take chunks."""
        return not self.connection.closed

    @property
    def ready(self) -> bool:
        """Whether it has started."""
        return self._ready

    def close(self) -> None:
        """End it: at once while it flies, in order otherwise."""
        if self.chunk is not None:
            self.kill()
        if self.alive:
            self.connection.close()
        try:
            self._process.wait(_END_LIMIT)
        except subprocess.TimeoutExpired:
            self.kill()

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()
        self._process.wait()
        if self.alive:
            self.connection.close()

    def kill_keeping_pipe(self) -> None:
        """End it at once, while another thread may wait for its messages.

        The pipe stays open here, so that `receive` in that thread finds its end.
        """
        self._process.kill()
        self._process.wait()

    def _send(self, data: bytes) -> None:
        # One that has ended is noticed by the end of its pipe.
        with suppress(BrokenPipeError, ConnectionResetError):
            self.connection.send_bytes(data)

    def _set_deadline(self) -> None:
        limit = float("inf") if self._limit is None else self._limit * max(1, len(self._begun))
        self._deadline = time.monotonic() + limit
        self._set_next_sign()

    def _set_next_sign(self) -> None:
        # A stack that does not advance for as long as one case may last holds a case that does not end. It is
        # then halved, so that this case costs some limits and not as many as the stack has cases.
        limit = float("inf") if self._limit is None else self._limit
        self._next_sign = time.monotonic() + limit + REPORT_PERIOD

    def _lost(self, sentence: str) -> Outcome | None:
        self.connection.close()
        if not self._ready:
            self.not_started = sentence
            return None
        chunk, self.chunk = self.chunk, None
        return None if chunk is None else Outcome(chunk, failure=sentence, suspects=self._begun)

    def _how_it_ended(self) -> str:
        try:
            code = self._process.wait(_END_LIMIT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        if code >= 0:
            return f"with exit code {code}"
        with suppress(ValueError):
            return f"by {signal.Signals(-code).name}"
        return f"by signal {-code}"
