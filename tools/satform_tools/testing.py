"""The whole test command: code checks, types, tests."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from tempfile import TemporaryFile

from satform_tools import say
from satform_tools.catalogue import ROOT
from satform_tools.leaving import leaving_in_order

_PARALLEL = ("-n", "2", "--dist", "worksteal")
"""Tests that start no formation share two processes; which is done first takes over from the other."""

_TYPED = (
    *(f"ros_ws/src/{package}/{package}" for package in ("satform", "satform_nodes", "satform_bringup")),
    "tools/satform_tools",
    "tools/satform_setup",
)

_LEAST = 19
"""Niceness at which a process gets what of the processor nobody else wants."""

_FAREWELL = 20.0
"""Wall-clock time in which a part that is stopped can put away what it has, s."""


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
    # what they leave of the processor is for the parts beside them.
    Part("whole flights, set-up", ("pytest", *_PARALLEL, "tests/whole_flights", "tests/setup"), beside=True),
    # One after another: two at a time take as long, since nodes that wait for each other want the cores.
    Part("flights over DDS", ("pytest", "tests/integration")),
)
"""In the order in which they begin."""


class _Beside:
    """A part that runs beside others, in a session of its own, in which all that it starts ends with it."""

    def __init__(self, part: Part) -> None:
        self.part = part
        self._output = TemporaryFile()  # noqa: SIM115 - open for as long as the part runs
        self._start = time.perf_counter()
        self._seconds = 0.0
        command = ("nice", "-n", str(_LEAST), sys.executable, "-m", *part.command)
        self._process = subprocess.Popen(
            command,
            cwd=ROOT,
            env=_environment(),
            stdout=self._output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        self._watch = threading.Thread(target=self._note_end, daemon=True)
        self._watch.start()

    def _note_end(self) -> None:
        self._process.wait()
        self._seconds = time.perf_counter() - self._start

    def result(self) -> tuple[str, int, float]:
        """Name, exit code and wall-clock time in s, when it has ended."""
        self._watch.join()
        return self.part.name, self._process.returncode, self._seconds

    def close(self) -> None:
        """Stop it if it still runs, as Ctrl-C would, and print what it has printed."""
        for number in (signal.SIGINT, signal.SIGKILL):
            if self._watch.is_alive():
                with suppress(ProcessLookupError):
                    os.killpg(self._process.pid, number)
                self._watch.join(_FAREWELL)
        self._output.seek(0)
        say.note(f"== {self.part.name}")
        sys.stdout.write(self._output.read().decode(errors="replace"))
        sys.stdout.flush()
        self._output.close()


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
    with leaving_in_order(), ExitStack() as beside:
        running: list[_Beside] = []
        for part in PARTS:
            say.note(f"== {part.name}{', beside what follows' if part.beside else ''}")
            if part.beside:
                running.append(_Beside(part))
                beside.callback(running[-1].close)
                continue
            start = time.perf_counter()
            code = _call(part.command)
            results.append((part.name, code, time.perf_counter() - start))
        results += [other.result() for other in running]
    for name, code, seconds in results:
        say.line(f"{name}: {'failed' if code else 'passed'} ({seconds:.1f} s)", "red" if code else "green")
    return int(any(code for _, code, _ in results))


def _call(command: Sequence[str]) -> int:
    sys.stdout.flush()
    return subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, env=_environment(), check=False
    ).returncode


def _environment() -> Mapping[str, str]:
    """Unbuffered, so that the lines of the parts and what they print stay in order."""
    return {**os.environ, "PYTHONUNBUFFERED": "1"}
