# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A user's own sensor is found on PYTHONPATH and flies with the same bits both ways."""

from pathlib import Path

import pytest

from own_package import fly_both_ways, made, satform

pytestmark = pytest.mark.unmeasured


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the package."""
    return made("sensor", tmp_path_factory.mktemp("own") / "own_beacon")


def test_own_sensor_flies_as_expected_and_with_the_same_bits_both_ways(package: Path, tmp_path: Path) -> None:
    fly_both_ways(package, tmp_path)


def test_own_fields_are_checked_and_described_as_ours_are(package: Path) -> None:
    change = ("--set", "satellites.visitor.sensors[0].noise=-1")
    refused = satform(package, "run", package / "own_beacon.yaml", *change)
    assert refused.returncode == 2
    assert "noise" in refused.stderr
    assert "Position of the beacon, LVLH, m." in satform(package, "schema").stdout
