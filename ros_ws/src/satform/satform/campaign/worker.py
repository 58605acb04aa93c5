# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Worker process of a campaign: flies chunks until the pipe from its parent ends.

The pipe carries pickles between processes of one user: the job once the worker has asked for it, then the
numbers of each chunk, and back messages of the type `Message`. A worker whose parent has ended ends itself.
"""

import faulthandler
import os
import pickle
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any, Literal

from satform.campaign.engine import Job
from satform.campaign.results import CaseResult, failure_text

REPORT_PERIOD = 0.25
"""Wall-clock time between two messages with results of a chunk under way, s."""


@dataclass(frozen=True)
class Message:
    """What a worker sends.

    Attributes:
        kind: `started` once it reads its pipe and wants its job, `ready` once it has that, `begin` before
            cases are flown, `advanced` while they are, `results` of some cases, `done` at the end of a chunk
            with the results that were not sent before, `failed` in its stead.
        numbers: of the cases that begin.
        part: of these cases that is flown.
        results: of finished cases.
        failure: what went wrong, in a sentence without a full stop.
    """

    kind: Literal["started", "ready", "begin", "advanced", "results", "done", "failed"]
    numbers: tuple[int, ...] = ()
    part: float = 0.0
    results: tuple[CaseResult, ...] = ()
    failure: str = ""


class _Reports:
    """Sends what a chunk under way reports, results and advances not more often than once a period."""

    def __init__(self, connection: "Connection[Any, Any]") -> None:
        self._connection = connection
        self._waiting: list[CaseResult] = []
        self._next = time.monotonic() + REPORT_PERIOD
        self.sent: set[int] = set()

    def begin(self, numbers: Sequence[int]) -> None:
        self._connection.send(Message("begin", tuple(numbers)))

    def advanced(self, part: float) -> None:
        if self._is_due():
            self._connection.send(Message("advanced", part=part))

    def finished(self, results: Sequence[CaseResult]) -> None:
        self._waiting += results
        if self._is_due():
            self._connection.send(Message("results", results=tuple(self._waiting)))
            self.sent.update(result.number for result in self._waiting)
            self._waiting = []

    def _is_due(self) -> bool:
        now = time.monotonic()
        if now < self._next:
            return False
        self._next = now + REPORT_PERIOD
        return True


def main(descriptor: int) -> None:
    """Fly chunks until the pipe ends.

    Args:
        descriptor: of this process's end of the pipe.
    """
    faulthandler.enable()
    connection: Connection[Any, Any] = Connection(descriptor)
    received: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(connection, received), daemon=True).start()
    connection.send(Message("started"))
    try:
        job: Job = pickle.loads(received.get())  # noqa: S301 - from the parent process
    except Exception as error:  # a campaign may name classes of other packages
        connection.send(Message("failed", failure=failure_text(error)))
        return
    connection.send(Message("ready"))
    while True:
        connection.send(_flown(job, pickle.loads(received.get()), _Reports(connection)))  # noqa: S301


def _flown(job: Job, numbers: tuple[int, ...], reports: _Reports) -> Message:
    try:
        results = job.fly(job.campaign, numbers, reports, job.records)
    except Exception as error:  # of a user's own controller or figure, or of this program
        return Message("failed", failure=failure_text(error))
    return Message("done", results=tuple(result for result in results if result.number not in reports.sent))


def _receive(connection: "Connection[Any, Any]", received: "SimpleQueue[bytes]") -> None:
    """Receive while a chunk is flown, so that the end of the parent is noticed."""
    try:
        while True:
            received.put(connection.recv_bytes())
    except (EOFError, OSError):
        os._exit(0)
