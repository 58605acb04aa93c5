# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Start-up time of whole commands, from the command to the first step."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from satform_nodes.transport import trace
from satform_tools.bench.scaling import ring

_TIMEOUT = 300.0
"""Wall-clock time within which a command has to end, s."""

_LEAVING = 30.0
"""Wall-clock time within which it has to end once it is asked to, s."""


def command_to_first_step(satellites: int) -> tuple[float, float]:
    """Start `satform run` once.

    Args:
        satellites: on a ring, each in a process of its own, with a recorder.

    Returns:
        Wall-clock time from the command to the first command that the plant receives, and of this the time
        from the first process on, s.

    Raises:
        RuntimeError: the command failed, or has not ended in time.
    """
    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder) / "ring.json"
        scenario.write_text(ring(satellites, 1).to_json(), encoding="utf-8")
        arguments = ["run", str(scenario), "--json", "--out", str(Path(folder) / "run")]
        # All processes of a machine mark their traces by one clock.
        environment = {**os.environ, trace.FOLDER: folder}
        begin = time.monotonic_ns()
        printed = _printed(arguments, environment)
        first = _first_mark_of_plant(Path(folder))
        start = float(json.loads(printed)["speed"]["start_seconds"])
    return (first - begin) * 1e-9, start


def _printed(arguments: list[str], environment: dict[str, str]) -> str:
    """What a command prints; one that does not end in time is ended as Ctrl-C ends it, with its processes."""
    command = subprocess.Popen(
        [sys.executable, "-m", "satform_tools", *arguments],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        output, errors = command.communicate(timeout=_TIMEOUT)
    except subprocess.TimeoutExpired:
        _end(command)
        raise RuntimeError(f"satform {' '.join(arguments)}: has not ended within {_TIMEOUT:g} s") from None
    except BaseException:
        _end(command)
        raise
    if command.returncode:
        raise RuntimeError(f"satform {' '.join(arguments)}: {errors.strip() or output.strip()}")
    return output


def _end(command: subprocess.Popen[str]) -> None:
    command.send_signal(signal.SIGINT)
    try:
        command.communicate(timeout=_LEAVING)
    except subprocess.TimeoutExpired:
        command.kill()
        command.communicate()


def _first_mark_of_plant(folder: Path) -> int:
    """When the plant received the first command, ns of the monotonic clock."""
    for path in folder.glob("*.json"):
        if path.stem.isdigit():
            data = json.loads(path.read_text(encoding="utf-8"))
            if "plant" in data["nodes"]:
                return int(data["when"][0])
    raise RuntimeError("the plant has left no trace of its first step")
