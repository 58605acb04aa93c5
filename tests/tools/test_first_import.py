# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A program may import any module of the figures first."""

import subprocess
import sys
from importlib.metadata import entry_points

import pytest

MODULES = sorted({entry.module for entry in entry_points(group="satform.metrics")})


@pytest.mark.parametrize("module", [name for name in MODULES if name.startswith("satform.")])
def test_a_module_of_figures_can_be_the_first_that_a_program_imports(module: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", f"import {module}"], capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
