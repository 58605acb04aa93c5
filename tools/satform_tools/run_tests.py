# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole test command: code checks, types, tests and coverage; plain calls of ruff, mypy and pytest."""

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass

from satform_tools import console
from satform_tools.run.scenario_library import ROOT

_TYPED = (
    *(f"ros_ws/src/{package}/{package}" for package in ("satform", "satform_nodes", "satform_bringup")),
    "tools/satform_tools",
    "tools/satform_setup",
)

_PYTEST = ("-m", "pytest", "--dist", "worksteal", "--durations", "20", "-n")
"""Tests run side by side, in as many processes as the next argument says."""

_MEASURED = ("-m", "coverage", "run", "--rcfile", "pyproject.toml")
"""Measures the tests and their child processes, among them every node."""


@dataclass(frozen=True)
class Part:
    """A part of the test command.

    Attributes:
        name: of the part.
        command: arguments of Python.
    """

    name: str
    command: tuple[str, ...]


PARTS = (
    Part("ruff check", ("-m", "ruff", "check", ".")),
    Part("ruff format", ("-m", "ruff", "format", "--check", ".")),
    Part("licence headers", ("tools/lint/licence_headers.py",)),
    Part("words of names and docs", ("tools/lint/words.py",)),
    Part("mypy --strict", ("-m", "mypy", "--strict", *_TYPED)),
    Part("unit tests", (*_MEASURED, *_PYTEST, "2", "tests/unit")),
    # Each flight over DDS has a domain of its own; two at a time leave each test a core.
    Part("figures, nodes", (*_MEASURED, *_PYTEST, "2", "-m", "not unmeasured", "tests/numbers", "tests/dds")),
    # Long or repeated flights, of code that is measured above: coverage would double their time.
    Part("long flights", (*_PYTEST, "2", "-m", "unmeasured", "tests/numbers", "tests/dds")),
    Part("commands, damaged input", (*_PYTEST, "2", "tests/tools", "tests/fuzz")),
    Part("coverage", ("tools/lint/coverage_figures.py",)),
)
"""In the order in which they run."""


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
    for part in PARTS:
        console.note(f"== {part.name}")
        codes[part.name] = _call(part.command)
    for name, code in codes.items():
        console.line(f"{name}: {'failed' if code else 'passed'}", "red" if code else "green")
    console.line(f"{time.perf_counter() - begun:.0f} s")
    return int(any(codes.values()))


def _call(arguments: Sequence[str]) -> int:
    """Run Python with some arguments.

    Its output is unbuffered, so that the lines of the parts and what they print stay in order; coverage data
    of child processes go to the project's folder wherever they run.
    """
    sys.stdout.flush()
    environment = {**os.environ, "PYTHONUNBUFFERED": "1", "COVERAGE_FILE": str(ROOT / ".coverage")}
    return subprocess.run([sys.executable, *arguments], cwd=ROOT, env=environment, check=False).returncode
