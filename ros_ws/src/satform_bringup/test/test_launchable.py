# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a formation is launched with is installed."""

from importlib.metadata import distribution
from pathlib import Path
from types import SimpleNamespace

import pytest
from ament_index_python.packages import get_package_share_directory

from satform_bringup.deployment.node_processes import processes


def test_the_launch_file_is_where_ros2_launch_looks_for_it() -> None:
    share = Path(get_package_share_directory("satform_bringup"))
    assert (share / "launch" / "scenario.launch.py").is_file()


@pytest.mark.parametrize("group", [1, 2])
def test_every_process_of_a_formation_is_a_program_of_the_nodes_package(group: int) -> None:
    formation = SimpleNamespace(satellites=[SimpleNamespace(name=name) for name in ("a", "b", "c")])
    programs = {entry.name for entry in distribution("satform_nodes").entry_points}
    started = processes(formation, Path("scenario.json"), Path("bag"), group)
    assert len(started) >= 4
    assert {process.executable for process in started} <= programs
