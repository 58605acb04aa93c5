# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The executables of the nodes: their help, and Ctrl-C while they are still importing."""

import os
import signal
import subprocess
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix

PROGRAMS = Path(get_package_prefix("satform_nodes")) / "lib" / "satform_nodes"


def started(program: str, *words: str, first_on_path: Path | None = None) -> subprocess.Popen[str]:
    path = [str(first_on_path)] if first_on_path else []
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*path, os.environ["PYTHONPATH"]])}
    # A program started by nohup ignores SIGHUP, and so would the node.
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    try:
        return subprocess.Popen(
            [str(PROGRAMS / program), *words],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.fixture
def endless_import(tmp_path: Path) -> Path:
    """A folder whose `rclpy` says when its import begins, and never comes to its end."""
    module = tmp_path / "rclpy.py"
    # Not for ever in one call: a signal just before it would be handled only after the next one.
    endless = "while True:\n    select.select([], [], [], 0.1)\n"
    module.write_text(f"import select\nprint('importing', flush=True)\n{endless}")
    return tmp_path


@pytest.mark.parametrize("program", ["plant_node", "satellite_node"])
@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize(("words", "code"), [((), 130), (("--ros-args", "-p", "stopped_exit_code:=0"), 0)])
def test_a_node_that_is_stopped_while_it_imports_ends_without_a_traceback(
    program: str, stop: signal.Signals, words: tuple[str, ...], code: int, endless_import: Path
) -> None:
    process = started(program, *words, first_on_path=endless_import)
    assert process.stdout is not None
    assert process.stdout.readline() == "importing\n"
    process.send_signal(stop)
    try:
        _, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert err == ""
    assert process.returncode == code


def test_help_is_printed_and_nothing_is_flown() -> None:
    out, err = started("recorder_node", "--help").communicate(timeout=60)
    assert out.startswith("usage: ros2 run satform_nodes recorder_node --ros-args")
    assert "folder of the bag to be written" in out
    assert err == ""


def test_an_exit_code_that_is_none_is_refused() -> None:
    process = started("plant_node", "--ros-args", "-p", "stopped_exit_code:=256")
    _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "stopped_exit_code is 256; it is an exit code, 0 to 255" in err
