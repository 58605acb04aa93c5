# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of navigation by hand; the central filter of a single satellite is its own."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from flights import shipped, shortened
from satform import simulate
from satform.common.spec import specs
from satform.record.flight_record import FlightRecord
from satform.record.navigation_history import NavigationHistory

STEPS = 4


def figure(kind: str, record: FlightRecord, **fields: Any) -> float:
    spec = specs("satform.metrics")[kind].model_validate({"below": 1.0, "source": "none", **fields})
    return spec.measure(record)  # type: ignore[attr-defined, no-any-return]


def flown() -> FlightRecord:
    """Three satellites in a line, each of which knows where all are, but for 5 m in the second one."""
    record = simulate(shortened("triangle", STEPS * 0.5))
    position = np.zeros_like(record.position)
    position[:, 1, 0], position[:, 2, 0] = 100.0, 300.0
    mean = np.zeros((record.steps, 3, 3, 6))
    mean[..., :3] = position[: record.steps, None]
    mean[:, :, 1, :3] += (0.0, 3.0, 4.0)
    readings = np.full((record.steps + 1, 3, 0), np.nan)
    history = NavigationHistory(readings, mean.reshape(record.steps, 3, 18))
    return replace(record, position=position, navigation=history)


def test_errors_over_range_are_in_percent_of_each_distance() -> None:
    record = flown()
    # From the second, 5 m over 100 m and 200 m; from the third over 200 m, and nothing in the first.
    near, far = {"satellites": ["sat2"], "targets": ["sat1"]}, {"satellites": ["sat2"], "targets": ["sat3"]}
    assert figure("relative_range_error", record, **near) == pytest.approx(5.0)
    assert figure("relative_range_error", record, **far) == pytest.approx(2.5)
    both = math.sqrt((5.0**2 + 2.5**2) / 2)
    assert figure("relative_range_error", record, satellites=["sat2"]) == pytest.approx(both)
    assert figure("relative_range_error", record, satellites=["sat3"]) == pytest.approx(2.5 / math.sqrt(2))
    assert figure("relative_range_error", record, statistic="maximum") == pytest.approx(5.0)


def test_the_ratio_to_a_central_filter_is_that_of_rms_errors_of_all_positions() -> None:
    record = flown()
    central = record.position[: record.steps] + np.array([0.0, 0.0, 2.0])
    with_velocity = np.concatenate((central, np.zeros_like(central)), axis=-1)
    known = replace(record, central_source=lambda _: with_velocity)
    assert figure("central_error_ratio", known) == pytest.approx(math.sqrt(25.0 / 3.0) / 2.0)


def test_steps_of_a_lost_satellite_count_for_neither_filter() -> None:
    record = flown()
    assert record.navigation is not None
    mean = record.navigation.mean.copy()
    # The second satellite is lost after the first step, in which the central filter is wrong by 1 m.
    mean[1:, 1] = np.nan
    reference, acceleration = record.reference_position.copy(), record.acceleration.copy()
    reference[1:, 1], acceleration[1:, 1] = np.nan, 0.0
    error = np.array([1.0, 2.0, 2.0, 2.0])
    central = record.position[: record.steps] + error[:, None, None] * np.array([0.0, 0.0, 1.0])
    lost = replace(
        record,
        reference_position=reference,
        acceleration=acceleration,
        navigation=replace(record.navigation, mean=mean),
        central_source=lambda _: np.concatenate((central, np.zeros_like(central)), axis=-1),
    )
    # 3 satellites know 1 m, and 2 of them 3 times 2 m; each own error is 5 m in one of three positions.
    expected = math.sqrt(25.0 / 3.0) / math.sqrt((3 * 1.0 + 6 * 4.0) / 9)
    assert figure("central_error_ratio", lost) == pytest.approx(expected)
    assert figure("central_error_ratio", lost, satellites=["sat2"]) == pytest.approx(math.sqrt(25.0 / 3.0))


def test_without_estimates_there_are_no_figures() -> None:
    record = simulate(shortened("triangle", 1.0))
    for kind in ("relative_range_error", "central_error_ratio"):
        assert math.isnan(figure(kind, record))
    assert record.central_estimate is None


def test_the_central_filter_of_one_satellite_is_its_own() -> None:
    pair = shipped("gnss_differential_pair")
    alone = pair.with_(
        {"graph": {"kind": "none"}, "expect": [], "timing.duration": 300.0},
        satellites=[pair.satellites[0].model_dump(exclude_unset=True)],
    )
    record = simulate(alone)
    assert record.central_estimate is not None
    assert record.navigation is not None
    assert np.array_equal(record.central_estimate[:, 0], record.navigation.mean[:, 0])


def test_complaints_name_satellites_without_such_a_filter() -> None:
    spec = specs("satform.metrics")["central_error_ratio"].model_validate({"below": 1.0, "source": "none"})
    triangle = shipped("triangle")
    satellites = {own.name: triangle.satellite(index) for index, own in enumerate(triangle.satellites)}
    (sentence,) = spec.complaints_about_satellites(satellites, "arc_length")  # type: ignore[attr-defined]
    assert sentence == "sat1, sat2, sat3 have no navigation that estimates the formation"
