# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs pip and colcon with their output in the log and their progress on the screen."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from satform_setup.layout import Layout

# In the variables of all that a set-up starts, and so of all that those start.
_MARK = "SATFORM_SETUP_OF"


class Job(NamedTuple):
    """What all parts of one set-up share.

    Attributes:
        layout: paths of the project.
        ros: where ROS comes from, see `find_ros`.
        environment: the shell's variables.
    """

    layout: Layout
    ros: str
    environment: Mapping[str, str]


class Outcome(NamedTuple):
    """How a program ended.

    Attributes:
        code: exit code, 0 for success.
        output: what it printed, both streams.
    """

    code: int
    output: str


class Progress:
    """One line of the screen for one part of the set-up.

    Args:
        what: the part, and how long it usually takes.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._counted = ""
        self._total = 0
        self._steps = 0
        self._start = time.monotonic()
        self._live = sys.stderr.isatty()
        self._write("", "" if self._live else "\n")

    def count(self, counted: str, total: int) -> None:
        """Show steps from now on.

        Args:
            counted: start of the output lines that mark one more step.
            total: number of steps.
        """
        self._counted, self._total, self._steps = counted, total, 0

    def read_line(self, line: str) -> None:
        """Count one line of a program's output."""
        if self._counted and line.startswith(self._counted):
            self._steps += 1
            if self._live:
                self._write(f" {self._steps}/{self._total}", "")

    def end(self) -> None:
        """Leave the line, with the time it took."""
        if self._live:
            self._write(f" {time.monotonic() - self._start:.0f} s", "\n")

    def _write(self, detail: str, end: str) -> None:
        start = "\r\x1b[K" if self._live else ""
        sys.stderr.write(f"{start}satform: {self._what}{detail}{end}")
        sys.stderr.flush()


def run_logged(
    job: Job, command: Sequence[str], variables: Mapping[str, str], progress: Progress, folder: Path
) -> Outcome:
    """Run a program to its end.

    Args:
        job: the set-up, which must hold the folder's lock.
        command: program and arguments.
        variables: all its variables.
        progress: line of the screen that shows how far it is.
        folder: where it runs.

    Returns:
        Exit code and output.
    """
    lines: list[str] = []
    with (
        job.layout.log.open("a", encoding="utf-8", buffering=1) as log,
        subprocess.Popen(
            command,
            env={**variables, _MARK: str(job.layout.root)},
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
        ) as process,
    ):
        log.write(f"$ {' '.join(command)}\n")
        try:
            for line in process.stdout or ():
                log.write(line)
                lines.append(line)
                progress.read_line(line)
            code = process.wait()
        except BaseException:
            end_orphans(job.layout)
            raise
    return Outcome(code, "".join(lines))


def end_orphans(layout: Layout) -> None:
    """End what a set-up that was killed has left running: it would write into the next one.

    Only the holder of the lock may call this: what then still bears the mark of this folder's set-up is an
    orphan.

    Args:
        layout: paths of the project.
    """
    mark = os.fsencode(f"{_MARK}={layout.root}")
    for _ in range(100):
        orphans = [process for process in Path("/proc").glob("[0-9]*") if mark in _variables(process)]
        if not orphans:
            return
        for process in orphans:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(int(process.name), signal.SIGKILL)
        time.sleep(0.05)  # polls: they are no children of this process, and may start more until they end


def _variables(process: Path) -> list[bytes]:
    # It may have ended, or belong to another user.
    try:
        return (process / "environ").read_bytes().split(b"\0")
    except OSError:
        return []
