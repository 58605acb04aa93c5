# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Filter of the attitude while the gyro is late or out: NEES, closed forms, and the bits of each alone."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from attitude_truth import BIAS_WALK, RATE, STEP, Truth, filter_of, flown, tracker
from satform.attitude.attitude_filter import (
    error_transition,
    small_rotation,
)
from satform.attitude.held_rate import held_transition
from satform.equipment.sensors.star_tracker import StarTrackerSpec
from satform.numeric.elementwise import Array
from satform.numeric.modified_rodrigues import composed_mrp, mrp_of_rotation
from satform.numeric.stacking import item, stack

LATE_OR_MISSING: dict[str, tuple[list[StarTrackerSpec], dict[str, Any]]] = {
    "gyro out": ([tracker(period=2.0, latency=1.0)], {"gyro_outage": range(12, 34), "known": 1e-3}),
    "gyro and tracker out": (
        [tracker(outages=[{"begin": 12.0, "end": 34.0}])],
        {"gyro_outage": range(10, 36), "known": 1e-3},
    ),
    "late gyro": ([tracker()], {"gyro_latency": 3, "known": 1e-3}),
    "late and slow gyro, out, two trackers": (
        [tracker(latency=2.0), tracker(boresight=[1.0, 1.0, 0.0], period=3.0)],
        {"gyro_steps": 4, "gyro_latency": 2, "gyro_outage": range(12, 30), "acceleration": 1e-11},
    ),
}


@pytest.mark.parametrize("case", LATE_OR_MISSING)
def test_errors_are_as_large_as_the_covariance_says_while_the_gyro_is_late_or_out(case: str) -> None:
    """As above, with the error of the held rate: in and after an outage, and over the latency."""
    specs, fields = LATE_OR_MISSING[case]
    truths = [Truth(seed, specs, **{"acceleration": 1e-8, **fields}) for seed in range(25)]
    nees, memory = flown(truths, stack([filter_of(truth) for truth in truths]), 44)
    low, high = chi2.ppf([5e-5, 1.0 - 5e-5], 9 * len(truths))
    for step in (9, 12, 20, 33, 36, 44):
        assert low < nees[step].sum() < high, step
    assert not memory.now.rejected.any()


def test_in_an_outage_of_all_sensors_the_covariance_grows_as_the_closed_form_of_white_acceleration() -> None:
    """P_a + 2 t P_aw + t^2 P_w + q t^3 / 3 of the attitude (Bar-Shalom et al. 2001, ch. 6.2.2), at rest."""
    density, steps = 1e-8, 40
    own = filter_of(Truth(8, [tracker()], acceleration=density))
    mixed = np.random.default_rng(1).standard_normal((9, 9))
    start = 1e-6 * mixed @ mixed.T
    estimate = replace(own.start, covariance=start)
    for _ in range(steps):
        estimate = own.predicted(estimate, np.full(3, np.nan))
    time, unit = steps * STEP, np.eye(3)
    turn, drift, rate = slice(0, 3), slice(3, 6), slice(6, 9)
    expected = start.copy()
    cross = start[turn, rate]
    expected[turn, turn] += time * (cross + cross.T) + time**2 * start[rate, rate]
    expected[turn, turn] += density * time**3 / 3.0 * unit
    expected[turn, rate] += time * start[rate, rate] + density * time**2 / 2.0 * unit
    expected[rate, turn] = expected[turn, rate].T
    expected[turn, drift] += time * start[rate, drift]
    expected[drift, turn] = expected[turn, drift].T
    expected[rate, rate] += density * time * unit
    expected[drift, drift] += BIAS_WALK**2 * time * unit
    assert estimate.covariance == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("measured", [True, False])
def test_the_transition_with_a_held_rate_is_the_derivative_of_what_the_estimate_does(measured: bool) -> None:
    own = filter_of(Truth(0, [tracker()], acceleration=1e-8))
    start = replace(own.start, rate=RATE - 0.002)
    reading = RATE + 0.001 if measured else np.full(3, np.nan)

    def later(error: Array) -> Array:
        turned = composed_mrp(mrp_of_rotation(error[:3]), start.mrp)
        off = replace(start, mrp=turned, bias=start.bias + error[3:6], rate=start.rate + error[6:])
        moved, usual = own.predicted(off, reading), own.predicted(start, reading)
        rotation = small_rotation(moved.mrp, usual.mrp)
        return np.concatenate((rotation, moved.bias - usual.bias, moved.rate - usual.rate))

    width = 1e-6
    rows = [(later(width * axis) - later(-width * axis)) / (2.0 * width) for axis in np.eye(9)]
    turning = reading - start.bias if measured else start.rate
    found = held_transition(error_transition(STEP * turning, STEP), np.asarray(measured))
    assert found == pytest.approx(np.column_stack(rows), abs=1e-9)


def test_filters_whose_gyros_are_out_at_different_times_have_in_one_the_bits_of_each_alone() -> None:
    outages = (range(0), range(3, 9), range(2, 6))
    truths = [
        Truth(seed, [tracker()], acceleration=1e-8, gyro_outage=own) for seed, own in enumerate(outages)
    ]
    filters = [filter_of(truth) for truth in truths]
    together = stack(filters)
    values = [truth.values() for truth in truths]
    memory, alone = (
        together.first(np.stack(values)),
        [own.first(values[row]) for row, own in enumerate(filters)],
    )
    for _ in range(12):
        for truth in truths:
            truth.advance()
        values = [truth.values() for truth in truths]
        memory = together.observe(memory, np.stack(values))
        alone = [own.observe(alone[row], values[row]) for row, own in enumerate(filters)]
        for row, single in enumerate(alone):
            np.testing.assert_equal(asdict(item(memory, row)), asdict(single))
