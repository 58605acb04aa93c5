# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The template of a user's own controller installs and flies, without a change to this project."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.unmeasured

TEMPLATE = Path(__file__).parents[2] / "docs" / "own_controller"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder into which pip has put the template's package."""
    folder = tmp_path_factory.mktemp("own")
    source, target = folder / "source", folder / "installed"
    shutil.copytree(TEMPLATE, source)
    options = ["--no-deps", "--no-build-isolation", "--disable-pip-version-check", "--quiet"]
    subprocess.run(
        [sys.executable, "-m", "pip", "install", *options, "--target", str(target), str(source)], check=True
    )
    return target


def run(installed: Path, out: Path, *words: str) -> subprocess.CompletedProcess[str]:
    search = os.pathsep.join([str(installed), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-m", "satform_tools", *words, *(["--out", str(out)] if words[0] == "run" else [])],
        env={**os.environ, "PYTHONPATH": search},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


SCENARIO = str(TEMPLATE / "two_springs.yaml")


def test_own_controller_is_under_forty_lines() -> None:
    assert len((TEMPLATE / "own_controller.py").read_text().splitlines()) < 40


def test_own_controller_flies_as_expected_and_with_the_same_bits_both_ways(
    installed: Path, tmp_path: Path
) -> None:
    for mode in ("inprocess", "lockstep"):
        done = run(installed, tmp_path / mode, "run", SCENARIO, "--mode", mode)
        assert done.returncode == 0, done.stdout + done.stderr
    # The scenario in the bag can be read only where the package is installed.
    compare = (
        "import sys; from pathlib import Path; from satform_tools.report.command import find;"
        "a, b = (find(Path(folder)) for folder in sys.argv[1:]);"
        "assert a.complete and b.complete; found = a.record.differences(b.record); assert not found, found"
    )
    search = os.pathsep.join([str(installed), os.environ.get("PYTHONPATH", "")])
    subprocess.run(
        [sys.executable, "-c", compare, str(tmp_path / "inprocess"), str(tmp_path / "lockstep")],
        env={**os.environ, "PYTHONPATH": search},
        check=True,
    )


def test_own_gains_are_checked_and_described_as_ours_are(installed: Path, tmp_path: Path) -> None:
    refused = run(
        installed, tmp_path / "never", "run", SCENARIO, "--set", "satellite_defaults.controller.stiffness=-1"
    )
    assert refused.returncode == 2
    assert "stiffness" in refused.stderr
    described = run(installed, tmp_path, "schema").stdout
    assert "Acceleration per position error, per axis, 1/s^2." in described


def test_without_the_package_the_scenario_is_refused_in_words(tmp_path: Path) -> None:
    done = run(tmp_path, tmp_path / "never", "run", SCENARIO)
    assert done.returncode == 2
    assert "spring_damper" in done.stderr
