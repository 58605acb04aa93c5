# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of a long coast flies the trajectories with which its time is compared."""

import json
import math

import pytest

from satform_tools.bench import coast, output


def test_a_tenth_of_a_day_is_flown_beside_brahe_and_ends_where_brahe_does(
    capsys: pytest.CaptureFixture[str],
) -> None:
    figure = coast.measure(0.1, 1)
    assert coast.scenario(0.1).timing.steps == 8
    output.show([figure], None, as_json=True)
    (printed,) = json.loads(capsys.readouterr().out)["figures"]
    assert math.isfinite(printed["ratio"])
    assert printed["yardstick"] == "brahe RKN1210"
    # Another method, with the same forces: neither equal nor far away.
    assert 0.0 < printed["details"]["distance_from_rkf78"] < 1e-3
    assert 1e-3 < printed["details"]["rkn1210_from_rkf78"] < 1.0
    output.details([figure])
    assert "distance from rkf78" in capsys.readouterr().out
