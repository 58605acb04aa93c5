"""The whole test command: code checks, types, tests."""

import os
import subprocess
import sys
import time
from collections.abc import Sequence

from satform_tools import say
from satform_tools.catalogue import ROOT

_PARALLEL = ("-n", "2", "--dist", "worksteal")
"""Tests that start no nodes share two processes; whichever is done first takes over from the other."""

_TYPED = ("ros_ws/src/satform/satform", "tools/satform_tools", "tools/satform_setup")

PARTS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("ruff check", ("ruff", "check", ".")),
    ("ruff format", ("ruff", "format", "--check", ".")),
    ("mypy --strict", ("mypy", "--strict", *_TYPED)),
    ("unit tests", ("pytest", *_PARALLEL, "tests/unit")),
    ("whole flights", ("pytest", *_PARALLEL, "tests/whole_flights")),
    # One after another: nodes that wait for each other want the cores for themselves, and two files at a time
    # took as long.
    ("flights over DDS", ("pytest", "tests/integration")),
    ("set-up", ("pytest", "tests/setup")),
)
"""Name of each part, and the module with its arguments."""


def run(arguments: Sequence[str]) -> int:
    """Check code and run the tests.

    Args:
        arguments: for pytest, which then runs alone; all parts run when there are none.

    Returns:
        0 when every part passes, pytest's own exit code when it runs alone, else 1.
    """
    if arguments:
        return _call(("pytest", *arguments))
    failed = []
    results = []
    for name, command in PARTS:
        say.note(f"== {name}")
        start = time.perf_counter()
        code = _call(command)
        results.append((name, code, time.perf_counter() - start))
        if code:
            failed.append(name)
    for name, code, seconds in results:
        say.line(f"{name}: {'failed' if code else 'passed'} ({seconds:.1f} s)", "red" if code else "green")
    return 1 if failed else 0


def _call(command: Sequence[str]) -> int:
    # Unbuffered, so that the lines of the parts and what they print stay in order.
    sys.stdout.flush()
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    return subprocess.run([sys.executable, "-m", *command], cwd=ROOT, env=environment, check=False).returncode
