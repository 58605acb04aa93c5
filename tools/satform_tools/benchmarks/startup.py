"""From the command to the first step: whole commands as a user types them."""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from satform_tools.benchmarks.scaling import ring

_TIMEOUT = 300.0


def command_to_first_step(satellites: int) -> tuple[float, float]:
    """Start `satform run` once.

    Args:
        satellites: on a ring, each in a process of its own, with a recorder.

    Returns:
        Wall-clock time from the command to the first command that the plant hears, and of this the time from
        the first process on, s.

    Raises:
        RuntimeError: the command failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder) / "ring.json"
        scenario.write_text(ring(satellites, 1).to_json(), encoding="utf-8")
        words = ["run", str(scenario), "--json", "--out", str(Path(folder) / "run")]
        # All processes of a machine mark their traces by one clock.
        environment = {**os.environ, "SATFORM_TRACE": folder}
        begin = time.monotonic_ns()
        done = subprocess.run(
            [sys.executable, "-m", "satform_tools", *words],
            env=environment,
            capture_output=True,
            text=True,
            timeout=_TIMEOUT,
            check=False,
        )
        if done.returncode:
            raise RuntimeError(f"satform {' '.join(words)}: {done.stderr.strip() or done.stdout.strip()}")
        first = _first_mark_of_plant(Path(folder))
        start = float(json.loads(done.stdout)["speed"]["start_seconds"])
    return (first - begin) * 1e-9, start


def _first_mark_of_plant(folder: Path) -> int:
    """When the plant heard the first command, ns of the monotonic clock."""
    for path in folder.glob("*.json"):
        if path.stem.isdigit():
            data = json.loads(path.read_text(encoding="utf-8"))
            if "plant" in data["nodes"]:
                return int(data["when"][0])
    raise RuntimeError("the plant has left no trace of its first step")
