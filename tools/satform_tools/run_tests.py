# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole test command: code checks, types, tests; plain calls of ruff, mypy and pytest."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from tempfile import TemporaryFile

from satform_tools import console
from satform_tools.run.scenario_library import ROOT

_PARALLEL = ("-n", "2", "--dist", "worksteal")
"""Tests that start no formation share two processes; which is done first takes over from the other."""

_TYPED = (
    *(f"ros_ws/src/{package}/{package}" for package in ("satform", "satform_nodes", "satform_bringup")),
    "tools/satform_tools",
    "tools/satform_setup",
)

_BESIDE = ("tests/numbers", "tests/tools", "tests/fuzz")
"""Long flights in one process, commands as a whole, damaged input by the thousand, and the set-up."""

_LEAST = ("nice", "-n", "19")
"""Gives a process what of the processor nobody else wants."""

_FAREWELL = 20.0
"""Wall-clock time in which a part that is stopped can end, s."""


@dataclass(frozen=True)
class Part:
    """A part of the test command.

    Attributes:
        name: of the part.
        command: the module with its arguments.
        beside: whether it runs beside the parts that follow, on what these leave of the processor; what it
            prints comes when all are done.
    """

    name: str
    command: tuple[str, ...]
    beside: bool = False


PARTS = (
    Part("ruff check", ("ruff", "check", ".")),
    Part("ruff format", ("ruff", "format", "--check", ".")),
    Part("mypy --strict", ("mypy", "--strict", *_TYPED)),
    Part("unit tests", ("pytest", *_PARALLEL, "tests/unit")),
    # Flights over DDS wait a good part of their time, for each other and for what is to be noticed late; only
    # what they leave of the processor is for the part beside them.
    Part("whole flights, commands, set-up", ("pytest", *_PARALLEL, *_BESIDE), beside=True),
    # One after another: two at a time take as long, since nodes that wait for each other want the cores.
    Part("flights over DDS", ("pytest", "tests/dds")),
)
"""In the order in which they begin."""


def run(arguments: Sequence[str]) -> int:
    """Check code and run the tests.

    Args:
        arguments: for pytest, which then runs alone; all parts run when there are none.

    Returns:
        0 when every part passes, pytest's own exit code when it runs alone, else 1.
    """
    if arguments:
        return _call(("pytest", *arguments))
    begun = time.perf_counter()
    codes: dict[str, int] = {}
    with ExitStack() as running:
        beside = {}
        for part in PARTS:
            console.note(f"== {part.name}{', beside what follows' if part.beside else ''}")
            if part.beside:
                beside[part.name] = running.enter_context(_beside(part))
            else:
                codes[part.name] = _call(part.command)
        codes |= {name: process.wait() for name, process in beside.items()}
    for name, code in codes.items():
        console.line(f"{name}: {'failed' if code else 'passed'}", "red" if code else "green")
    console.line(f"{time.perf_counter() - begun:.0f} s")
    return int(any(codes.values()))


def _call(command: Sequence[str]) -> int:
    sys.stdout.flush()
    return subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, env=_environment(), check=False
    ).returncode


@contextmanager
def _beside(part: Part) -> Iterator[subprocess.Popen[bytes]]:
    """Run a part while the block lasts; it is ended with the block, and what it printed comes then."""
    with TemporaryFile() as output:
        process = subprocess.Popen(
            [*_LEAST, sys.executable, "-m", *part.command],
            cwd=ROOT,
            env=_environment(),
            stdout=output,
            stderr=subprocess.STDOUT,
        )
        try:
            yield process
        finally:
            # Not SIGINT, which a background job's processes ignore; pytest's workers end with it.
            process.terminate()
            try:
                process.wait(_FAREWELL)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            console.note(f"== {part.name}")
            output.seek(0)
            sys.stdout.write(output.read().decode(errors="replace"))
            sys.stdout.flush()


def _environment() -> Mapping[str, str]:
    """Unbuffered, so that the lines of the parts and what they print stay in order."""
    return {**os.environ, "PYTHONUNBUFFERED": "1"}
