# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole test command: code checks, types, tests and coverage; plain calls of ruff, mypy and pytest."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass

from satform_tools import console
from satform_tools.run.scenario_library import ROOT

_TYPED = (
    *(
        f"ros_ws/src/{package}/{package}"
        for package in ("satform", "satform_nodes", "satform_bringup", "satform_transport")
    ),
    "tools/satform_tools",
    "tools/satform_setup",
)

_PYTEST = ("-m", "pytest", "--durations", "20")

_COVERAGE = ("-m", "coverage", "run", "--rcfile", "pyproject.toml")
"""Measures the tests and their child processes, among them every node."""

_MEASURED = (*_COVERAGE, "--source", "satform,satform_nodes,satform_bringup", *_PYTEST)

_MEASURED_NODES = (*_COVERAGE, "--source", "satform.protocol,satform_nodes,satform_bringup", *_PYTEST)
"""Leaves out the rest of the library, in which nodes spend most of their time; other parts measure it."""

_EXTERNAL = ("tests/dds/test_conformance.py", "tests/dds/test_external_satellites_fly.py")
"""Flights with satellites that are programs of their own: a part, so that the longest part is shorter."""

_AT_ONCE = 2
"""Parts that run at the same time: each leaves the flights over DDS of the other a core."""

_BACKGROUND_AT_ONCE = 2
"""Parts that run beside these: flights over DDS wait for messages much of the time, and leave cores idle."""

_BACKGROUND_NICENESS = 10


@dataclass(frozen=True)
class Part:
    """A part of the test command.

    Attributes:
        name: of the part.
        command: arguments of Python.
        background: whether it runs at low priority beside the others, in the time in which they wait; for
            parts that fly no nodes.
    """

    name: str
    command: tuple[str, ...]
    background: bool = False


@dataclass(frozen=True)
class Outcome:
    """What a part came to.

    Attributes:
        code: exit code.
        output: what it printed.
        seconds: how long it ran.
        processor_seconds: time of all cores that it took, with the processes that it started and waited for.
    """

    code: int
    output: str
    seconds: float
    processor_seconds: float = 0.0


PARTS = (
    # Long or repeated flights, of code that is measured in the next part: coverage would double their time.
    Part(
        "long flights of nodes",
        (*_PYTEST, "-m", "unmeasured", "tests/dds", *(f"--ignore={file}" for file in _EXTERNAL)),
    ),
    Part("nodes", (*_MEASURED_NODES, "-m", "not unmeasured", "tests/dds")),
    Part("external satellites", (*_PYTEST, *_EXTERNAL)),
    Part("commands", (*_PYTEST, "-m", "not setup_from_scratch", "tests/tools")),
    Part("ruff check", ("-m", "ruff", "check", ".")),
    Part("ruff format", ("-m", "ruff", "format", "--check", ".")),
    Part("licence headers", ("tools/lint/licence_headers.py",)),
    Part("words of names and docs", ("tools/lint/words.py",)),
    Part("long figures", (*_PYTEST, "-m", "unmeasured", "tests/numbers"), background=True),
    Part("unit tests", (*_MEASURED, "tests/unit"), background=True),
    Part("figures", (*_MEASURED, "-m", "not unmeasured", "tests/numbers"), background=True),
    Part("set-up", (*_PYTEST, "-m", "setup_from_scratch", "tests/tools"), background=True),
    Part("permissions enforced", (*_PYTEST, "tests/dds_security"), background=True),
    Part("damaged input", (*_PYTEST, "tests/fuzz", "tests/failing_calls"), background=True),
    Part("protocol explored", (*_PYTEST, "tests/protocol"), background=True),
    Part("mypy --strict", ("-m", "mypy", "--strict", *_TYPED), background=True),
)
"""In the order in which they start, the longest first, so that the last to end are short."""

COVERAGE = Part("coverage", ("tools/lint/coverage_figures.py",))
"""Runs after all others."""


def run(arguments: Sequence[str]) -> int:
    """Check code and run the tests.

    Args:
        arguments: for pytest, which then runs alone; all parts run when there are none.

    Returns:
        0 when every part passes, pytest's own exit code when it runs alone, else 1.
    """
    if arguments:
        return _call(("-m", "pytest", *arguments))
    begun = time.perf_counter()
    for data in ROOT.glob(".coverage*"):
        data.unlink()
    codes: dict[str, int] = {}
    processor_seconds = 0.0
    for part, outcome in _side_by_side(PARTS):
        times = f"{outcome.seconds:.0f} s, {outcome.processor_seconds:.0f} s of processor time"
        console.note(f"== {part.name} ({times})")
        processor_seconds += outcome.processor_seconds
        console.line(outcome.output)
        codes[part.name] = outcome.code
    console.note(f"== {COVERAGE.name}")
    codes[COVERAGE.name] = _call(COVERAGE.command)
    for name in [part.name for part in (*PARTS, COVERAGE)]:
        console.line(f"{name}: {'failed' if codes[name] else 'passed'}", "red" if codes[name] else "green")
    elapsed = time.perf_counter() - begun
    console.line(f"{elapsed:.0f} s, {processor_seconds:.0f} s of processor time")
    return int(any(codes.values()))


def _side_by_side(parts: Sequence[Part]) -> Iterator[tuple[Part, Outcome]]:
    """Run parts, some at a time; yields each as soon as it has ended, with all of its output."""
    foreground = ThreadPoolExecutor(_AT_ONCE)
    # Linux lowers the priority of the thread alone, and of what it starts.
    background = ThreadPoolExecutor(
        _BACKGROUND_AT_ONCE, initializer=os.nice, initargs=(_BACKGROUND_NICENESS,)
    )
    try:
        started: dict[Future[Outcome], Part] = {
            (background if part.background else foreground).submit(_outcome, part): part for part in parts
        }
        for ended in as_completed(started):
            yield started[ended], ended.result()
    finally:
        # After Ctrl-C, which the running parts get too, no other part starts.
        for pool in (foreground, background):
            pool.shutdown(cancel_futures=True)


def _outcome(part: Part) -> Outcome:
    """Run a part to its end."""
    console.note(f"== {part.name}: started")
    begun = time.perf_counter()
    # A file, not a pipe: a process that a failed test left behind would hold the pipe open.
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(
            [sys.executable, *part.command],
            cwd=ROOT,
            env=_environment(),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        text = output.read().decode("utf-8", "replace")
    return Outcome(process.returncode, text, time.perf_counter() - begun, used.ru_utime + used.ru_stime)


def _call(arguments: Sequence[str]) -> int:
    """Run Python with some arguments, its output being that of this process."""
    sys.stdout.flush()
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=ROOT, env=_environment(), check=False).returncode


def _environment() -> dict[str, str]:
    """Variables of the parts.

    Output is unbuffered, so that the lines of a part and of what it starts stay in order; coverage data of
    child processes go to the project's folder wherever they run. Bytecode is stored, also where
    `PYTHONDONTWRITEBYTECODE` is set: otherwise every process of pytest rewrites the assertions of all tests,
    which is two thirds of the time in which it collects them.
    """
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**kept, "PYTHONUNBUFFERED": "1", "COVERAGE_FILE": str(ROOT / ".coverage")}
