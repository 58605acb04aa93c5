# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A user's own sensor is found on PYTHONPATH and flies with the same bits both ways."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.unmeasured

LAUNCHER = Path(__file__).parents[2] / "tools" / "satform"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the package."""
    folder = tmp_path_factory.mktemp("own") / "own_beacon"
    subprocess.run([LAUNCHER, "new", "sensor", "own_beacon", "--out", folder], check=True)
    return folder


def run(package: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [LAUNCHER, *words],
        env={**os.environ, "PYTHONPATH": str(package)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_own_sensor_flies_as_expected_and_with_the_same_bits_both_ways(package: Path, tmp_path: Path) -> None:
    for mode in ("inprocess", "lockstep"):
        done = run(package, "run", package / "own_beacon.yaml", "--mode", mode, "--out", tmp_path / mode)
        assert done.returncode == 0, done.stdout + done.stderr
    # The scenario in the bag can be read only where the package is found.
    compare = (
        "import sys; from pathlib import Path; from satform_tools.report.command import find;"
        "a, b = (find(Path(folder)) for folder in sys.argv[1:]);"
        "assert a.complete and b.complete; found = a.record.differences(b.record); assert not found, found"
    )
    search = os.pathsep.join([str(package), os.environ.get("PYTHONPATH", "")])
    subprocess.run(
        [sys.executable, "-c", compare, str(tmp_path / "inprocess"), str(tmp_path / "lockstep")],
        env={**os.environ, "PYTHONPATH": search},
        check=True,
    )


def test_own_fields_are_checked_and_described_as_ours_are(package: Path) -> None:
    change = ("--set", "satellites.visitor.sensors[0].noise=-1")
    refused = run(package, "run", package / "own_beacon.yaml", *change)
    assert refused.returncode == 2
    assert "noise" in refused.stderr
    assert "Position of the beacon, LVLH, m." in run(package, "schema").stdout
