# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The first use of a fresh clone, killed half-way and repeated; needs the network and a minute or two."""

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from flights import shortened
from satform.flight.simulate import simulate

ROOT = Path(__file__).resolve().parents[2]
USES_EVERYTHING = """
import rclpy, satform, satform_msgs.msg, satform_nodes
from rclpy.serialization import deserialize_message, serialize_message
sent = satform_msgs.msg.NodeReady(step=7, node="/a")
assert deserialize_message(serialize_message(sent), satform_msgs.msg.NodeReady) == sent
rclpy.init()
rclpy.create_node("probe").destroy_node()
rclpy.shutdown()
print("all of it works")
"""


def until_it_installs(venv, process):
    """Wait until the first package is there that does not come with the virtual environment itself."""
    until = time.monotonic() + 1800
    while process.poll() is None and time.monotonic() < until:
        found = {path.name.partition("-")[0] for path in venv.glob("lib/python*/site-packages/*.dist-info")}
        if found - {"pip", "setuptools"}:
            return
        time.sleep(0.02)  # polls: there is no event for a file that another process writes
    raise AssertionError(f"no package was installed (exit code {process.poll()})")


@pytest.mark.setup_from_scratch
def test_a_first_use_killed_half_way_is_made_good_by_the_next_and_a_change_builds_one_package(
    tmp_path, bare_environment
):
    # A path with a blank and with letters of other scripts, and a locale that knows none of them.
    clone = tmp_path / "zwei Wörter 轨道"
    bare_environment |= {"LANG": "C", "LC_ALL": "C"}
    subprocess.run(["git", "clone", "--quiet", ROOT, clone], check=True)

    def satform(*arguments):
        command = [clone / "tools" / "satform", *arguments]
        return subprocess.run(
            command,
            env=bare_environment,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            # Against a hang only: a machine that is busy with other work takes many times as long.
            timeout=3600,
            check=False,
        )

    with subprocess.Popen(
        [clone / "tools" / "satform", "setup"], env=bare_environment, stderr=subprocess.PIPE, text=True
    ) as first:
        until_it_installs(clone / ".venv", first)
        os.kill(first.pid, signal.SIGKILL)
    assert not (clone / ".venv" / "complete.json").exists()

    second = satform("setup")
    assert (second.returncode, "building satform" in second.stderr) == (0, True), second.stderr
    assert "all of it works" in satform("exec", "python", "-c", USES_EVERYTHING).stdout

    flight = satform(
        "run", "triangle", "--set", "timing.duration=5.0", "--set", "expect=[]", "--out", "läuft"
    )
    assert flight.returncode == 0, flight.stdout + flight.stderr
    flown = json.loads((tmp_path / "läuft" / "result.json").read_text(encoding="utf-8"))
    assert flown["state_hash"] == simulate(shortened("triangle", 5.0)).digest()

    stamp = clone / "ros_ws" / "install" / "complete.json"
    before = json.loads(stamp.read_text())["built"]
    assert satform("setup").stderr.count("\n") == 1  # nothing to do, said in one line
    with (clone / "ros_ws" / "src" / "satform_bringup" / "README.md").open("a", encoding="utf-8") as file:
        file.write("\n")
    bare_environment["PYTHONDONTWRITEBYTECODE"] = "1"
    third = satform("setup")
    assert [line for line in third.stderr.splitlines() if "building" in line] == [
        "satform: building satform_bringup (a few seconds)"
    ]
    after = json.loads(stamp.read_text())["built"]
    assert {name for name in after if after[name] != before[name]} == {"satform_bringup"}
    # What is built is compiled, also where Python is told to keep no bytecode: else each start would do it.
    assert list(
        (clone / "ros_ws" / "install").rglob("satform_bringup/supervisor/__pycache__/supervisor.*.pyc")
    )
    assert list((clone / "tools" / "satform_tools" / "cli" / "__pycache__").glob("main.*.pyc"))

    fourth = satform("exec", "true")
    assert (fourth.returncode, fourth.stderr) == (0, "")
