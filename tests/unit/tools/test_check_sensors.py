# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about sensors in vain and about accelerations of neighbours that a filter does not allow for."""

import math
from typing import Any

import pytest

from flights import shipped
from formations import formation
from satform.scenario import Scenario
from satform_tools.check.neighbour_accelerations import neighbour_acceleration_warnings
from satform_tools.check.sensors import sensor_warnings

GNSS = {"kind": "gnss", "position_noise": 2.0}
CAMERA = {"kind": "bearing_camera", "targets": ["sat2"], "sunlit_only": False}
FILTER = {
    "kind": "extended",
    "acceleration_density": 1e-8,
    "initial_position_error": 1.0,
    "initial_velocity_error": 0.01,
}
DURATION = 20.0


def pair(*sensors: dict[str, Any], **navigation: Any) -> Scenario:
    """Two satellites, the first of which flies by its sensors."""
    first = {"arc_length": 0.0, "sensors": list(sensors), "navigation": {**FILTER, **navigation}}
    return formation([first, {"arc_length": 300.0}], DURATION)


@pytest.mark.parametrize(
    ("sensor", "field", "sentence"),
    [
        ({**GNSS, "latency": 20.0}, ".latency", "20 s, but the flight lasts 20 s: no reading arrives"),
        ({**GNSS, "period": 20.0}, ".period", "20 s, but the flight lasts 20 s: there is one reading"),
        (
            {**GNSS, "outages": [{"begin": 5.0, "end": 6.0}, {"begin": 30.0, "end": 40.0}]},
            ".outages[1]",
            "begins at 30 s, after the flight's end at 20 s",
        ),
        (
            {**GNSS, "outages": [{"begin": 0.0, "end": 12.0}, {"begin": 12.0, "end": 20.0}]},
            ".outages",
            "cover all readings of the flight",
        ),
    ],
)
def test_times_that_the_flight_is_too_short_for_are_warned_of(
    sensor: dict[str, Any], field: str, sentence: str
) -> None:
    (found,) = sensor_warnings(pair(GNSS, sensor))
    assert found.startswith(f"satellites[0].sensors[1]{field}: ")
    assert sentence in found


@pytest.mark.parametrize(
    "fields", [{"field_of_view": 1e-6}, {"maximum_range": 1.0}, {"line_of_sight_margin": 9e5}]
)
def test_a_channel_without_a_reading_on_the_planned_motion_is_warned_of(fields: dict[str, float]) -> None:
    assert sensor_warnings(pair(GNSS, CAMERA)) == []
    (found,) = sensor_warnings(pair(GNSS, {**CAMERA, **fields}))
    assert found.startswith("sensors of sat1: bearing_camera sat2 has no reading on the planned motion")


def test_a_sensor_that_nobody_uses_is_warned_of() -> None:
    (found,) = sensor_warnings(formation([{"arc_length": 0.0, "sensors": [GNSS]}], DURATION))
    assert found.startswith("satellites[0].sensors[0]: measures, and sat1 has no navigation")


def test_a_reference_that_is_named_twice_is_refused() -> None:
    with pytest.raises(ValueError, match="references: sat2 is named twice"):
        pair(GNSS, references=["sat2", "sat2"])


@pytest.mark.parametrize("noise", [1e-200, 9e-13])
def test_a_noise_whose_square_is_lost_is_refused(noise: float) -> None:
    with pytest.raises(ValueError, match=r"greater than or equal to 0\.000000000001"):
        pair({**GNSS, "position_noise": noise})
    with pytest.raises(ValueError, match=r"greater than or equal to 0\.000000000001"):
        pair(GNSS, initial_position_error=noise)


def test_planned_accelerations_of_others_have_to_be_within_the_density_or_be_sent() -> None:
    """A circle of radius a in the orbit plane, flown at the orbit rate n against free motion.

    With x = a cos nt, y = a sin nt the CW equations need x'' - 2 n y' - 3 n^2 x = -6 n^2 a cos nt on the
    radial and y'' + 2 n x' = -3 n^2 a sin nt on the along-track axis.
    """
    radius, step, mean_motion = 1000.0, 10.0, 2.0 * math.pi / 5700.0
    circle = {"kind": "ellipse", "first_axis": [radius, 0.0, 0.0], "second_axis": [0.0, radius, 0.0]}
    largest = 6.0 * mean_motion**2 * radius

    def found(part: float, exchange: str) -> list[str]:
        density = [(part * largest) ** 2 * step, (0.6 * largest) ** 2 * step, 1e-20]
        changes = {
            "expect": [],
            "satellites[deputy].curve": circle,
            "satellite_defaults.navigation.exchange": exchange,
            "satellite_defaults.navigation.neighbour_acceleration_density": density,
        }
        return neighbour_acceleration_warnings(shipped("gnss_differential_pair").with_(changes))

    (sentence,) = found(0.97, "none")
    words = "navigation of chief: the plan of deputy has accelerations of "
    assert sentence.startswith(words)
    assert float(sentence.removeprefix(words).split()[0]) == pytest.approx(largest, rel=0.01)
    assert found(1.01, "none") == []
    assert found(0.1, "information_consensus") == []
