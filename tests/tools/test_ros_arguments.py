# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Arguments that ROS rejects end a node with one sentence and the exit code of bad input."""

import subprocess
import sys
from pathlib import Path

import pytest

PLANT = "from satform_nodes.plant.flight_loop import main; raise SystemExit(main())"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--bogus"], "--bogus"),
        (["-r", "foo"], "Couldn't parse remap rule: '-r foo'"),
        (["--params-file", "mixed.yaml"], "Couldn't parse params file: '--params-file mixed.yaml'"),
    ],
)
def test_arguments_that_ros_does_not_understand_are_a_sentence_and_bad_input(
    tmp_path: Path, arguments: list[str], words: str
) -> None:
    (tmp_path / "mixed.yaml").write_text("/**:\n  ros__parameters:\n    x: [1, 2.0]\n")
    command = [sys.executable, "-c", PLANT, "--ros-args", *arguments]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60)
    assert ended.returncode == 2, ended.stderr
    # rcl may have lines of its own before.
    line = ended.stderr.splitlines()[-1]
    assert "Traceback" not in ended.stderr
    assert line.startswith("plant: ROS cannot be started with these arguments: ")
    assert words in line
    assert "/src/" not in line
