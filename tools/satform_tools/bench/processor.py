# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""CPU time of the processes of a flight, nearly independent of other load on the machine."""

import os
from pathlib import Path

_TICK = 1.0 / os.sysconf("SC_CLK_TCK")


class ProcessorClock:
    """Reads the processor time of all node processes as the flight goes on."""

    def __init__(self) -> None:
        self._processes: list[int] = []
        self._readings: list[tuple[int, float]] = []

    def read(self, steps: int, _total: int) -> None:
        """Take a reading; to be given to a flight as what is called with its progress.

        Args:
            steps: flown so far.
        """
        if not self._processes:
            self._processes = _node_processes()
        times = [processor_time(process) for process in self._processes]
        if times and None not in times:
            self._readings.append((steps, sum(time for time in times if time is not None)))

    def per_step(self) -> float:
        """Processor time of a step, s, from the first reading to the last; NaN with fewer than two."""
        if len(self._readings) < 2 or self._readings[-1][0] == self._readings[0][0]:
            return float("nan")
        (first, begin), (last, end) = self._readings[0], self._readings[-1]
        return (end - begin) / (last - first)


def _node_processes() -> list[int]:
    """Child processes of the process server."""
    from multiprocessing import forkserver  # noqa: PLC0415 - only where there is a process server

    # There is no public way to ask for the server's number.
    server = getattr(forkserver._forkserver, "_forkserver_pid", None)
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and _stat(int(entry.name))[1:2] == [str(server)]:
            found.append(int(entry.name))
    return found


def processor_time(process: int) -> float | None:
    """User and system time of a process and of all its threads, s; None when it has ended."""
    fields = _stat(process)
    return (int(fields[11]) + int(fields[12])) * _TICK if len(fields) > 12 else None


def _stat(process: int) -> list[str]:
    """The fields of a process in /proc after its name; empty when it has ended."""
    try:
        text = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return []
    return text.rpartition(")")[2].split()
