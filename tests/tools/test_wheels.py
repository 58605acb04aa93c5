# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The wheels are installed without network and compiler and fly; what they require is fetched before."""

import json
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest

from flights import shortened
from satform.flight.simulate import simulate
from satform_tools.wheels import build
from satform_tools.wheels.requirements import pinned, runtime_requirements

ROOT = Path(__file__).resolve().parents[2]
PINS = pinned((ROOT / "requirements.txt").read_text(encoding="utf-8"))

# In a namespace of its own a process has no network but the loopback that it makes.
INSTALLS_AND_FLIES = """
set -eu
ip link set lo up
uv pip install --quiet --no-index --python venv/bin/python --find-links wheels satform-ros
satform run triangle --set timing.duration=20.0 --set 'expect=[]' --quiet --out run
satform list > list
satform docs 2> rejected || true
uv tool install --quiet --no-index --python venv/bin/python --find-links wheels satform-ros
tools/satform run triangle --set timing.duration=20.0 --set 'expect=[]' --quiet --out run_of_tool
"""


def test_every_requirement_of_the_wheel_has_the_version_that_is_pinned() -> None:
    required = dict(line.split("==") for line in runtime_requirements(PINS))
    assert required == {name: PINS[name] for name in required}
    assert {"numpy", "ros-rclpy", "ros-fastrtps", "polars"} & required.keys() == {
        "numpy",
        "ros-rclpy",
        "ros-fastrtps",
    }
    assert not {"cmake", "colcon-core", "pytest", "ruff", "uv"} & required.keys()


@pytest.mark.setup_from_scratch
def test_wheels_are_installed_without_network_and_compiler_and_fly_with_the_same_bits(
    tmp_path: Path, bare_environment: dict[str, str]
) -> None:
    isolated = [str(shutil.which("unshare")), "--net", "--map-root-user"]
    if subprocess.run(
        [*isolated, "ip", "link", "set", "lo", "up"], capture_output=True, check=False
    ).returncode:
        pytest.skip("NOT TESTED: no network namespaces on this machine (unshare --net, iproute2)")
    build.build(tmp_path / "wheels", dependencies=True)
    venv.create(tmp_path / "venv")
    programs = tmp_path / "programs"
    programs.mkdir()
    for name in ("sh", "ip", "env", "uname", "uv"):
        (programs / name).symlink_to(str(shutil.which(name)))
    done = subprocess.run(
        [*isolated, str(shutil.which("sh")), "-c", INSTALLS_AND_FLIES],
        env={
            "HOME": bare_environment["HOME"],
            "PATH": f"{tmp_path / 'venv' / 'bin'}:{programs}",
            "UV_TOOL_BIN_DIR": str(tmp_path / "tools"),
        },
        cwd=tmp_path,
        capture_output=True,
        text=True,
        # Against a hang only.
        timeout=3600,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    expected = simulate(shortened("triangle", 20.0)).digest()
    for run in ("run", "run_of_tool"):
        result = json.loads((tmp_path / run / "result.json").read_text())
        assert (result["mode"], result["steps"], result["state_hash"]) == ("lockstep", 40, expected)
    assert "tandemx_helix" in (tmp_path / "list").read_text()
    assert "installed as a wheel" in (tmp_path / "rejected").read_text()
    (wheel,) = (tmp_path / "wheels").glob("satform_ros-*.whl")
    assert f"-cp{sys.version_info[0]}{sys.version_info[1]}-manylinux_2_" in wheel.name
