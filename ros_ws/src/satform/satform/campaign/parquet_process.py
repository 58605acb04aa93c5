# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Program that reads Parquet files for another process, in memory and errors apart from it.

`parquet_file` starts it. A file from anywhere may have the parser allocate any amount of memory, or end the
process that it runs in; here this is a process that holds nothing else.
"""

import resource
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any, Literal

from satform.common.printable_text import reason

_BATCH = 1024
"""Rows that are read at once."""


@dataclass(frozen=True)
class Request:
    """What is asked for.

    Attributes:
        kind: `open` a file, its `next` rows, or `close` it.
        number: of the file, chosen by who asks.
        content: of the file, when it is opened.
    """

    kind: Literal["open", "next", "close"]
    number: int
    content: bytes = b""


@dataclass(frozen=True)
class Answer:
    """What comes of a request.

    Attributes:
        metadata: of a file that was opened.
        columns: of the next rows by name: a list of values, or of a column of lists the ends of these and all
            their values; None at the end of the file.
        failure: why it cannot be read; empty where it can.
    """

    metadata: dict[str, str] = field(default_factory=dict)
    columns: dict[str, Any] | None = None
    failure: str = ""


def main(descriptor: int, memory: int) -> None:
    """Answer requests until the pipe ends.

    Args:
        descriptor: of the pipe.
        memory: bytes of address space that this process may have.
    """
    # More than the process has already cannot be forbidden.
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    connection: Connection[Answer, Request] = Connection(descriptor)
    files: dict[int, Iterator[Any]] = {}
    while True:
        try:
            request = connection.recv()
        except EOFError:
            return
        try:
            answer = _answer(request, files)
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:  # a parser in Rust raises errors that are no `Exception`
            files.pop(request.number, None)
            answer = Answer(failure=reason(error))
        connection.send(answer)


def _answer(request: Request, files: dict[int, Iterator[Any]]) -> Answer:
    if request.kind == "close":
        files.pop(request.number, None)
        return Answer()
    if request.kind == "open":
        from arro3.io import read_parquet  # noqa: PLC0415 - an extra

        reader = read_parquet(request.content, batch_size=_BATCH)
        files[request.number] = iter(reader)
        metadata = reader.schema.metadata
        return Answer({name.decode(): value.decode(errors="replace") for name, value in metadata.items()})
    rows = next(files[request.number], None)
    if rows is None:
        return Answer()
    return Answer(columns={name: _values(rows[name]) for name in rows.schema.names})


def _values(column: Any) -> Any:
    from arro3.core import DataType, list_flatten, list_offsets  # noqa: PLC0415 - an extra

    if not DataType.is_list(column.type):
        return column.to_pylist()
    return list_offsets(column).to_numpy(), list_flatten(column).to_numpy()
