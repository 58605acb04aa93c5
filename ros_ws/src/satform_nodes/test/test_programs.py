# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The programs of the installed package are there."""

import os
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix

from satform_nodes import programs
from satform_nodes.runtime.start_parameters import PROGRAMS


@pytest.mark.parametrize("name", sorted(PROGRAMS))
def test_every_program_is_installed_and_has_its_entry_point(name: str) -> None:
    file = Path(get_package_prefix("satform_nodes")) / "lib" / "satform_nodes" / name
    assert os.access(file, os.X_OK)
    assert f"import {name}" in file.read_text(encoding="utf-8")
    assert callable(getattr(programs, name))
