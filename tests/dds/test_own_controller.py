# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A user's own controller is found on PYTHONPATH and flies, without a change to this project."""

from pathlib import Path

import pytest

from own_package import fly_both_ways, made, satform

pytestmark = pytest.mark.unmeasured


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the package."""
    return made("controller", tmp_path_factory.mktemp("own") / "spring_law")


def test_own_controller_is_under_forty_lines(package: Path) -> None:
    assert len((package / "spring_law.py").read_text().splitlines()) < 40


def test_own_controller_flies_as_expected_and_with_the_same_bits_both_ways(
    package: Path, tmp_path: Path
) -> None:
    fly_both_ways(package, tmp_path)


def test_own_gains_are_checked_and_described_as_ours_are(package: Path, tmp_path: Path) -> None:
    change = ("--set", "satellite_defaults.controller.stiffness=-1")
    refused = satform(package, "run", package / "spring_law.yaml", *change, "--out", tmp_path / "never")
    assert refused.returncode == 2
    assert "stiffness" in refused.stderr
    assert "Acceleration per position error, per axis, 1/s^2." in satform(package, "schema").stdout


def test_without_the_package_the_scenario_is_refused_in_words(package: Path, tmp_path: Path) -> None:
    done = satform(tmp_path, "run", package / "spring_law.yaml", "--out", tmp_path / "never")
    assert done.returncode == 2
    assert "spring_law" in done.stderr
