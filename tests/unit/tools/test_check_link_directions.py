# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warning about directions of links to turned antennas about an eccentric chief."""

import math
from typing import Any

import pytest

from flights import shipped
from satform.scenario import Scenario
from satform_tools.check.link_directions import link_direction_warnings

RADIO: dict[str, Any] = {"kind": "radio", "frequency": 2.2e9, "power": 1.0, "rate": 1e5}
LASER: dict[str, Any] = {
    "kind": "optical",
    "wavelength": 1.55e-6,
    "power": 1.0,
    "rate": 1e9,
    "divergence": 1e-4,
    "aperture": 0.1,
}


def eccentric(eccentricity: float, channel: dict[str, Any] | None, *, turned: bool = True) -> Scenario:
    attitude = {"pointing": {"kind": "satellite_pointing", "target": "circular"}, "maximum_step": 1.0}
    return shipped("eccentric_rigid").with_(
        {
            "timing.step": 5.0,
            "timing.duration": 50.0,
            "dynamics.chief.eccentricity": eccentricity,
            "graph": {"kind": "complete"},
            "satellites[1].curve": {"kind": "fixed_point", "position": [0.0, -150.0, 30.0]},
            "satellites[0].attitude": attitude if turned else None,
            "links": {"default": {"channel": channel}},
        },
        expect=[],
    )


@pytest.mark.parametrize(
    ("channel", "directed"),
    [
        (None, False),
        (RADIO, False),
        (RADIO | {"antenna": {"kind": "beam", "peak_gain": 10.0, "beamwidth": 0.5}}, True),
        (RADIO | {"receive_antenna": {"kind": "array", "elements": [[0.0, 0.0, 0.0]]}}, True),
        (LASER, False),
        (LASER | {"field_of_regard": 1.0}, True),
    ],
)
def test_directed_links_about_an_eccentric_chief_have_a_warning(
    channel: dict[str, Any] | None, *, directed: bool
) -> None:
    assert bool(link_direction_warnings(eccentric(0.1, channel))) == directed


def test_the_warning_has_the_error_and_there_is_none_about_a_circle_or_without_attitude() -> None:
    channel = LASER | {"field_of_regard": 1.0}
    scenario = eccentric(0.01, channel)
    (sentence,) = link_direction_warnings(scenario)
    anomaly = scenario.chief.mean_anomaly  # type: ignore[union-attr]
    # The equation of the centre, 2 e sin M, less that at the start.
    expected = math.degrees(0.02 * (1.0 + abs(math.sin(anomaly))))
    found = float(sentence.removesuffix(" deg").rpartition(" ")[2])
    assert found == pytest.approx(expected, rel=0.02)
    assert link_direction_warnings(eccentric(0.0, channel)) == []
    assert link_direction_warnings(eccentric(0.01, channel, turned=False)) == []
