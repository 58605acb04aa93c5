"""The whole test command: code checks, types, tests."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from tempfile import TemporaryFile
from typing import IO

from satform_tools import say
from satform_tools.catalogue import ROOT

_PARALLEL = ("-n", "2", "--dist", "worksteal")
"""Tests that start no nodes share two processes; whichever is done first takes over from the other."""

_TYPED = ("ros_ws/src/satform/satform", "tools/satform_tools", "tools/satform_setup")

_LEAST = 19
"""Niceness at which a process gets what of the processor nobody else wants."""


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
    # Flights over DDS wait a good part of their time, for each other and for what is to be noticed late.
    Part("whole flights, set-up", ("pytest", *_PARALLEL, "tests/whole_flights", "tests/setup"), beside=True),
    # One after another: nodes that wait for each other want the cores for themselves.
    Part("flights over DDS", ("pytest", "tests/integration")),
)
"""In the order in which they begin."""


@dataclass
class _Running:
    """A part that runs beside others."""

    part: Part
    process: subprocess.Popen[bytes]
    output: IO[bytes]
    start: float = field(default_factory=time.perf_counter)


def run(arguments: Sequence[str]) -> int:
    """Check code and run the tests.

    Args:
        arguments: for pytest, which then runs alone; all parts run when there are none.

    Returns:
        0 when every part passes, pytest's own exit code when it runs alone, else 1.
    """
    if arguments:
        return _call(("pytest", *arguments))
    results: list[tuple[str, int, float]] = []
    with _beside() as running:
        for part in PARTS:
            say.note(f"== {part.name}{', beside what follows' if part.beside else ''}")
            if part.beside:
                running.append(_begin(part))
                continue
            start = time.perf_counter()
            code = _call(part.command)
            results.append((part.name, code, time.perf_counter() - start))
        for other in running:
            say.note(f"== {other.part.name}")
            code = other.process.wait()
            results.append((other.part.name, code, time.perf_counter() - other.start))
            other.output.seek(0)
            sys.stdout.write(other.output.read().decode(errors="replace"))
    for name, code, seconds in results:
        say.line(f"{name}: {'failed' if code else 'passed'} ({seconds:.1f} s)", "red" if code else "green")
    return int(any(code for _, code, _ in results))


@contextmanager
def _beside() -> Iterator[list[_Running]]:
    """Room for parts that run beside others; whatever happens, none of them is left running."""
    running: list[_Running] = []
    try:
        yield running
    finally:
        for other in running:
            other.process.terminate()
            other.process.wait()
            other.output.close()


def _begin(part: Part) -> _Running:
    output = TemporaryFile()  # noqa: SIM115 - open for as long as the part runs
    command = ("nice", "-n", str(_LEAST), sys.executable, "-m", *part.command)
    process = subprocess.Popen(command, cwd=ROOT, env=_environment(), stdout=output, stderr=subprocess.STDOUT)
    return _Running(part, process, output)


def _call(command: Sequence[str]) -> int:
    sys.stdout.flush()
    return subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, env=_environment(), check=False
    ).returncode


def _environment() -> Mapping[str, str]:
    """Unbuffered, so that the lines of the parts and what they print stay in order."""
    return {**os.environ, "PYTHONUNBUFFERED": "1"}
