# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Trace of spans in a process, to measure where the time of a step goes; off by default.

Marks go into an array that is allocated before the flight and written when the process ends. All processes of
a machine read the same monotonic clock, so their traces can be compared.
"""

import json
import os
import time
from array import array
from collections.abc import Sequence
from pathlib import Path
from typing import Final, TypeAlias

FOLDER = "SATFORM_TRACE"
"""Environment variable: the existing folder to which every process writes its trace; unset for no trace."""

CAPACITY = 1 << 18
"""Largest number of marks of one process; later ones are dropped."""


class Trace:
    """Begin and end of spans, in ns of the machine's monotonic clock.

    Attributes:
        on: True; lets a hot path skip the calls.
    """

    on: Final = True

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: list[str] = []
        # A begin is marked by the name's number, an end by its complement, which is negative.
        self._what = array("i", bytes(4 * CAPACITY))
        self._when = array("q", bytes(8 * CAPACITY))
        self._count = 0
        self._written = False

    def name(self, text: str) -> int:
        """The number of a kind of span, to be asked for before the flight."""
        if text not in self._names:
            self._names.append(text)
        return self._names.index(text)

    def begin(self, name: int) -> None:
        """A span begins; spans of a process may lie within each other."""
        self._mark(name)

    def end(self, name: int) -> None:
        """The span that was begun last under this name ends."""
        self._mark(~name)

    def write(self, nodes: Sequence[str]) -> None:
        """Write the trace to the folder, once; a missing folder is no error.

        Args:
            nodes: names of the nodes of this process.
        """
        if self._written:
            return
        self._written = True
        count = self._count
        data = {
            "nodes": list(nodes),
            "process": os.getpid(),
            "names": self._names,
            "what": self._what[:count].tolist(),
            "when": self._when[:count].tolist(),
        }
        path = self._folder / f"{os.getpid()}.json"
        unfinished = path.with_suffix(".part")
        try:
            unfinished.write_text(json.dumps(data), encoding="utf-8")
            # A reader finds the whole file or none, also if this process is killed meanwhile.
            unfinished.replace(path)
        except OSError:
            return

    def _mark(self, what: int) -> None:
        count = self._count
        if count < CAPACITY:
            self._when[count] = time.monotonic_ns()
            self._what[count] = what
            self._count = count + 1


class NoTrace:
    """Keeps nothing."""

    on: Final = False

    def name(self, text: str) -> int:
        """Any number."""
        return len(text)

    def begin(self, name: int) -> None:
        """Nothing."""

    def end(self, name: int) -> None:
        """Nothing."""

    def write(self, nodes: Sequence[str]) -> None:
        """Nothing."""


AnyTrace: TypeAlias = Trace | NoTrace


def trace_from_environment() -> AnyTrace:
    """A trace if one is asked for."""
    folder = os.environ.get(FOLDER)
    return Trace(Path(folder)) if folder else NoTrace()
