# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Parquet files from anywhere, read by a process of their own (`parquet_process`) in bounded memory and time.

One process reads all files of this one, several at a time where they are asked for in turn.
"""

import atexit
import itertools
import os
import subprocess
import sys
from collections.abc import Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from satform.campaign.parquet_process import Answer, Request

MOST_MEMORY = 2 * 2**30
"""Bytes of address space of the process that reads: series of one file have 64 megabytes."""

_LIMIT = 300.0
"""Wall-clock time within which a thousand rows have to be there, s."""

_PROGRAM = "from satform.campaign.parquet_process import main; main({}, {})"


class ParquetError(ValueError):
    """Content that is no Parquet file, or cannot be read; the message says why."""


class ParquetFile:
    """The rows of a Parquet file.

    Attributes:
        metadata: of the file.
    """

    def __init__(self, content: bytes) -> None:
        """Open a file.

        Args:
            content: of the file.

        Raises:
            ParquetError: it is none.
            OSError: the process that reads it cannot be started.
        """
        self._number = next(_NUMBERS)
        self._reader = _reader()
        self.metadata = self._reader.ask(Request("open", self._number, content)).metadata

    def batches(self) -> Iterator[dict[str, Any]]:
        """Some rows at a time: columns by name, of lists their ends and all their values.

        Raises:
            ParquetError: they cannot be read.
        """
        while (columns := self._reader.ask(Request("next", self._number)).columns) is not None:
            yield columns

    def close(self) -> None:
        """Have no more of it read."""
        self._reader.close_file(self._number)


class _Reader:
    """A process that reads Parquet files."""

    def __init__(self) -> None:
        self.owner = os.getpid()
        own, other = Pipe()
        self._connection: Connection[Request, Answer] = own
        path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
        with other:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _PROGRAM.format(other.fileno(), MOST_MEMORY)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                # The parser writes there before it raises an error.
                stderr=subprocess.DEVNULL,
                pass_fds=(other.fileno(),),
                env={**os.environ, "PYTHONPATH": path},
                # Ctrl-C is for the process that asks.
                start_new_session=True,
            )

    @property
    def alive(self) -> bool:
        return not self._connection.closed

    def ask(self, request: Request) -> Answer:
        if not self.alive:
            raise ParquetError("the process that reads it has ended")
        try:
            self._connection.send(request)
            if not self._connection.poll(_LIMIT):
                self.end()
                raise ParquetError(f"it was not read within {_LIMIT:g} s")
            answer = self._connection.recv()
        except (EOFError, BrokenPipeError, ConnectionResetError):
            self.end()
            raise ParquetError("it needs more memory than files of results do, or ends its reader") from None
        except BaseException:
            # An answer that nobody takes would be taken for that of the next request.
            self.end()
            raise
        if answer.failure:
            raise ParquetError(answer.failure)
        return answer

    def close_file(self, number: int) -> None:
        if self.alive and self.owner == os.getpid():
            self.ask(Request("close", number))

    def end(self) -> None:
        """End the process, which holds nothing that would have to be written."""
        self._connection.close()
        if self.owner == os.getpid():
            self._process.kill()
            self._process.wait()


_NUMBERS = itertools.count()
_READERS: list[_Reader] = []


def _reader() -> _Reader:
    """The process that reads the files of this one; started for the first of them, and when it has ended."""
    if not _READERS or not _READERS[-1].alive or _READERS[-1].owner != os.getpid():
        _READERS[:] = [_Reader()]
    return _READERS[-1]


@atexit.register
def _end() -> None:
    for reader in _READERS:
        reader.end()
