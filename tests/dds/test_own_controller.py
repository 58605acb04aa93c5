# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A user's own controller is found on PYTHONPATH and flies, without a change to this project."""

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
    folder = tmp_path_factory.mktemp("own") / "spring_law"
    subprocess.run([LAUNCHER, "new", "controller", "spring_law", "--out", folder], check=True)
    return folder


def run(package: Path, out: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [LAUNCHER, *words, *(["--out", out] if words[0] == "run" else [])],
        env={**os.environ, "PYTHONPATH": str(package)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_own_controller_is_under_forty_lines(package: Path) -> None:
    assert len((package / "spring_law.py").read_text().splitlines()) < 40


def test_own_controller_flies_as_expected_and_with_the_same_bits_both_ways(
    package: Path, tmp_path: Path
) -> None:
    for mode in ("inprocess", "lockstep"):
        done = run(package, tmp_path / mode, "run", package / "spring_law.yaml", "--mode", mode)
        assert done.returncode == 0, done.stdout + done.stderr
    # The scenario in the bag can be read only where the package is installed.
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


def test_own_gains_are_checked_and_described_as_ours_are(package: Path, tmp_path: Path) -> None:
    change = ("--set", "satellite_defaults.controller.stiffness=-1")
    refused = run(package, tmp_path / "never", "run", package / "spring_law.yaml", *change)
    assert refused.returncode == 2
    assert "stiffness" in refused.stderr
    described = run(package, tmp_path, "schema").stdout
    assert "Acceleration per position error, per axis, 1/s^2." in described


def test_without_the_package_the_scenario_is_refused_in_words(package: Path, tmp_path: Path) -> None:
    done = run(tmp_path, tmp_path / "never", "run", package / "spring_law.yaml")
    assert done.returncode == 2
    assert "spring_law" in done.stderr
