# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps that a satellite skips on the wall clock are left out of its figures, as those of a lost one are."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from flights import shortened
from satform.control.protocol import FlightSetting
from satform.evaluation.evaluate import figures_of
from satform.flight.simulate import simulate
from satform.record.flight_record import FlightRecord
from satform.record.quantities import QUANTITIES

TRUE = ("attitude_error", "attitude_rate_error")
"""What follows from the true attitude."""


def is_computed(name: str) -> bool:
    """Whether it is among what a satellite publishes of a step beside its command and its phase."""
    beginnings = ("reference", "estimat", "attitude_", "rejected", "sliding", "unsolved", "innovation")
    return name.startswith(beginnings) and name not in TRUE


def with_skipped(record: FlightRecord, column: int, steps: Sequence[int]) -> FlightRecord:
    """A record as the bag gives it when a satellite skips steps: its command is held, all else is missing."""
    changed = {}
    for name in QUANTITIES:
        values = getattr(record, name).copy()
        if is_computed(name) and len(values):
            values[list(steps), column] = np.nan
        elif name in ("arc_length", "rate"):
            # The phase for a step is computed in the step before, but for the first one of a late satellite.
            values[[step + (step > 0) for step in steps], column] = np.nan
        elif name == "acceleration":
            for step in steps:
                values[step, column] = values[max(step - 1, 0), column]
        changed[name] = values
    return dataclasses.replace(record, clocked=True, **changed)


def figure(record: FlightRecord, scenario: Any, **expectation: Any) -> float:
    """A figure of a flight."""
    changed = scenario.with_({"expect": [expectation]})
    setting = FlightSetting(1e-3, record.step)
    return float(figures_of(changed.expect, record, setting)[0])


@pytest.fixture(scope="module")
def navigated() -> tuple[Any, FlightRecord]:
    scenario = shortened("eccentric_navigation", 1440.0)
    return scenario, simulate(scenario)


@pytest.fixture(scope="module")
def pointed() -> tuple[Any, FlightRecord]:
    scenario = shortened("star_tracker_gyro_pointing", 12.0)
    return scenario, simulate(scenario)


@pytest.mark.parametrize("skipped", [[0], [3, 4, 7], [0, 1, 5]])
@pytest.mark.parametrize(
    ("kind", "series"),
    [("nees", "estimation_error_squared"), ("nis", "innovation")],
)
def test_means_of_motion_filters_are_of_the_other_steps(
    navigated: tuple[Any, FlightRecord], kind: str, series: str, skipped: list[int]
) -> None:
    scenario, record = navigated
    others = [step for step in range(record.steps) if step not in skipped]
    values = getattr(record, series)
    kept = np.concatenate((values[others, 0], values[:, 1:].ravel()))
    found = figure(with_skipped(record, 0, skipped), scenario, kind=kind, below=1e9)
    assert found == pytest.approx(np.nanmean(kept), rel=1e-12)


@pytest.mark.parametrize(
    ("kind", "series"),
    [("attitude_nees", "attitude_error_squared"), ("attitude_estimation_error", "attitude_estimation_error")],
)
def test_figures_of_attitude_filters_are_of_the_other_steps(
    pointed: tuple[Any, FlightRecord], kind: str, series: str
) -> None:
    scenario, record = pointed
    values = np.delete(getattr(record, series), [2, 3, 8], axis=0)
    whole = np.concatenate((values[:, 0], getattr(record, series)[:, 1:].ravel()))
    mean = whole.mean() if kind == "attitude_nees" else math.sqrt((whole**2).mean())
    statistic = "mean" if kind == "attitude_nees" else "rms"
    found = figure(with_skipped(record, 0, [2, 3, 8]), scenario, kind=kind, statistic=statistic, below=1e9)
    assert found == pytest.approx(mean, rel=1e-12)


@pytest.mark.parametrize("skipped", [[0], [4, 9]])
def test_tracking_and_phases_are_judged_by_the_other_steps(skipped: list[int]) -> None:
    scenario = shortened("triangle", 10.0)
    record = simulate(scenario)
    changed = with_skipped(record, 1, skipped)
    others = [step for step in range(record.steps) if step not in skipped]
    errors = np.concatenate((record.tracking_error[others, 1], record.tracking_error[:, [0, 2]].ravel()))
    found = figure(changed, scenario, kind="tracking_error_rms", below=1e9)
    assert found == pytest.approx(math.sqrt((errors**2).mean()), rel=1e-12)
    spread = figure(changed, scenario, kind="arc_length_spread", at=2.0, below=1e9)
    assert spread == pytest.approx(np.ptp(record.arc_length[4]), rel=1e-12)
    # In the step after a skipped one it flies, and its phase for that step is missing.
    row = skipped[-1] + 1
    after = figure(changed, scenario, kind="arc_length_spread", at=0.5 * row, below=1e9)
    present = [0, 1, 2] if row == 1 else [0, 2]
    assert after == pytest.approx(np.ptp(record.arc_length[row, present]), rel=1e-12)
    assert figure(changed, scenario, kind="steps_absent", below=1e9) == 0.0


def test_a_satellite_that_never_publishes_its_reference_still_misses_what_is_expected_of_it() -> None:
    scenario = shortened("triangle", 10.0)
    record = simulate(scenario)
    changed = with_skipped(record, 1, range(1, record.steps - 1))
    changed.reference_position[:, 1] = np.nan
    assert math.isnan(figure(changed, scenario, kind="tracking_error_rms", below=1e9))
