# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A program may import any module of the figures first."""

import subprocess
import sys
from importlib.metadata import entry_points

import pytest

MODULES = sorted(
    {entry.module for entry in entry_points(group="satform.metrics") if entry.module.startswith("satform.")}
)

EACH_FIRST = """
import importlib, os, sys
import numpy, pydantic, pydantic_core
known = set(sys.modules)
assert not any(name.partition(".")[0] == "satform" for name in known)
for module in sys.argv[1:]:
    child = os.fork()
    if not child:
        importlib.import_module(module)
        os._exit(0)
    print(module, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
"""Imports each module in a fork of a process that has nothing of satform, only what takes longest to load."""


@pytest.fixture(scope="module")
def ends() -> dict[str, str]:
    """Exit code of a program that imports a module first, by the module's name."""
    done = subprocess.run(
        [sys.executable, "-u", "-c", EACH_FIRST, *MODULES],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return dict(line.split() for line in done.stdout.splitlines())


@pytest.mark.parametrize("module", MODULES)
def test_a_module_of_figures_can_be_the_first_that_a_program_imports(
    module: str, ends: dict[str, str]
) -> None:
    assert ends[module] == "0"
