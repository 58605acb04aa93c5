# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Multiplicative extended Kalman filter of the attitude, against a truth that scipy's rotations turn.

scipy's rotations are active: of a rotation from inertial to body axes they have the inverse matrix, so that
attitudes are composed in the other order. Gyro and star tracker readings are drawn here, not by the sensors.
"""

import math
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from attitude_truth import (
    ANGLE_WALK,
    ARCSEC,
    BIAS_WALK,
    RATE,
    STEP,
    TURN_ON,
    Truth,
    channels_of,
    filter_of,
    flown,
    gyro,
    mrp_of,
    tracker,
)
from satform.attitude.attitude_filter import (
    AttitudeEstimate,
    error_transition,
    small_rotation,
)
from satform.attitude.attitude_filter_spec import AttitudeFilterSpec
from satform.equipment.sensors.gyro import GyroSpec
from satform.equipment.sensors.star_tracker import StarTrackerSpec
from satform.numeric.elementwise import Array
from satform.numeric.modified_rodrigues import composed_mrp, mrp_of_rotation
from satform.numeric.stacking import item, stack


@pytest.mark.parametrize("length", [0.0, 1e-5, 0.04999, 0.05001, 1.0, 3.0])
def test_the_transition_of_the_error_is_the_matrix_exponential(length: float) -> None:
    rotation = length * np.array([2.0, -3.0, 6.0]) / 7.0
    x, y, z = rotation / STEP
    generator = np.zeros((6, 6))
    generator[:3, :3] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    generator[:3, 3:] = -np.eye(3)
    assert error_transition(rotation, STEP) == pytest.approx(expm(generator * STEP), abs=3e-14)


def test_transition_and_correction_are_the_derivatives_of_what_the_attitude_does() -> None:
    truth = Truth(0, [tracker()])
    own = filter_of(truth)
    start, rate = own.start, RATE + 0.001

    def later(error: Array) -> Array:
        """Error after a step of an attitude and a bias that are off by a given error at its start."""
        off = replace(
            start, mrp=composed_mrp(mrp_of_rotation(error[:3]), start.mrp), bias=start.bias + error[3:]
        )
        moved = own.predicted(off, rate)
        return np.concatenate(
            (small_rotation(moved.mrp, own.predicted(start, rate).mrp), moved.bias - start.bias)
        )

    width = 1e-6
    differences = np.column_stack(
        [(later(width * axis) - later(-width * axis)) / (2.0 * width) for axis in np.eye(6)]
    )
    transition = error_transition(STEP * (rate - start.bias), STEP)
    assert transition == pytest.approx(differences, abs=1e-9)
    # What a star tracker sees of the error: the rotation itself, and nothing of the bias.
    seen = np.column_stack(
        [
            small_rotation(composed_mrp(mrp_of_rotation(width * axis), start.mrp), start.mrp) / width
            for axis in np.eye(3)
        ]
    )
    assert seen == pytest.approx(np.eye(3), abs=1e-9)


def test_steady_covariance_is_the_closed_form_of_farrenkopf() -> None:
    """Farrenkopf 1978 in the form of Markley & Crassidis 2014, ch. 6.2, with equal noise about all axes."""
    noise = 10.0 * ARCSEC
    truth = Truth(1, [tracker(boresight_noise=noise)])
    own = filter_of(truth)
    _, memories = flown([truth], stack([own]), 300)
    memory = item(memories, 0)
    before = own.predicted(memory.now, memory.rate).covariance
    walk, bias = ANGLE_WALK * math.sqrt(STEP) / noise, BIAS_WALK * STEP**1.5 / noise
    gamma = math.sqrt(1.0 + walk**2 / 4.0 + bias**2 / 48.0)
    zeta = gamma + bias / 4.0 + 0.5 * math.sqrt(2.0 * gamma * bias + walk**2 + bias**2 / 3.0)
    half = 0.5 * BIAS_WALK**2 * STEP
    rate = BIAS_WALK * noise / math.sqrt(STEP) * (zeta - 1.0 / zeta)
    after = memory.now.covariance
    assert np.diag(before)[:3] == pytest.approx(noise**2 * (zeta**2 - 1.0), rel=1e-6)
    assert np.diag(after)[:3] == pytest.approx(noise**2 * (1.0 - 1.0 / zeta**2), rel=1e-6)
    assert np.diag(before)[3:] == pytest.approx(rate + half, rel=1e-6)
    assert np.diag(after)[3:] == pytest.approx(rate - half, rel=1e-6)


CASES = {
    "one tracker": ([tracker()], 1),
    "late, rare, with an outage": (
        [tracker(period=2.0, latency=3.0, outages=[{"begin": 12.0, "end": 40.0}])],
        1,
    ),
    "two trackers and a slow gyro": (
        [tracker(latency=2.0), tracker(boresight=[1.0, 1.0, 0.0], period=3.0, boresight_noise=20.0 * ARCSEC)],
        4,
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_errors_are_as_large_as_the_covariance_says(case: str) -> None:
    """Sum of the NEES over seeds is chi-square distributed; within its 99.99 % interval at several steps."""
    specs, gyro_steps = CASES[case]
    truths = [Truth(seed, specs, gyro_steps) for seed in range(25)]
    nees, memory = flown(truths, stack([filter_of(truth) for truth in truths]), 44)
    low, high = chi2.ppf([5e-5, 1.0 - 5e-5], 6 * len(truths))
    for step in (0, 4, 32, 44):
        assert low < nees[step].sum() < high, step
    assert not memory.now.rejected.any()


def test_many_filters_in_one_have_the_bits_of_each_alone() -> None:
    specs, gyro_steps = CASES["two trackers and a slow gyro"]
    truths = [Truth(seed, specs, gyro_steps) for seed in range(3)]
    filters = [filter_of(truth) for truth in truths]
    together = stack(filters)
    values = [np.stack([truth.values() for truth in truths])]
    for _ in range(12):
        for truth in truths:
            truth.advance()
        values.append(np.stack([truth.values() for truth in truths]))
    memory = together.first(values[0])
    alone = [own.first(values[0][row]) for row, own in enumerate(filters)]
    for step in values[1:]:
        memory = together.observe(memory, step)
        alone = [
            own.observe(single, step[row])
            for row, (own, single) in enumerate(zip(filters, alone, strict=True))
        ]
    for row, single in enumerate(alone):
        np.testing.assert_equal(asdict(item(memory, row)), asdict(single))


@pytest.mark.parametrize(
    ("late_tracker", "turning"),
    [(tracker(latency=4.0), {}), (tracker(), {"acceleration": 1e-8, "gyro_latency": 4})],
    ids=["tracker", "gyro"],
)
def test_a_late_reading_ends_where_a_prompt_one_would(
    late_tracker: StarTrackerSpec, turning: dict[str, Any]
) -> None:
    """What a late star tracker or gyro gives comes out as without latency, once all has arrived."""
    prompt, late = Truth(3, [tracker()], **turning | {"gyro_latency": 0}), Truth(3, [late_tracker], **turning)
    own, own_late = filter_of(prompt), filter_of(late)
    memory, memory_late = own.first(prompt.values()), own_late.first(late.values())
    then: list[AttitudeEstimate] = [memory.now]
    for _ in range(30):
        for truth in (prompt, late):
            truth.advance()
        memory = own.observe(memory, prompt.values())
        memory_late = own_late.observe(memory_late, late.values())
        then.append(memory.now)
    np.testing.assert_equal(asdict(memory_late.oldest), asdict(then[-1 - 4]))


def test_the_gate_rejects_outliers_and_takes_a_new_start_from_the_last_of_several() -> None:
    truth = Truth(4, [tracker()])
    own = filter_of(truth, max_consecutive_rejections=3)
    values = truth.values()
    memory = own.first(values)
    for _ in range(20):
        truth.advance()
        memory = own.observe(memory, truth.values())
    before = memory.now
    for number in range(1, 4):
        truth.advance()
        off = truth.values()
        off[3:] = mrp_of(truth.body * Rotation.from_rotvec([0.01, 0.0, 0.0]))
        memory = own.observe(memory, off)
        assert float(memory.now.rejected) == number
        if number < 3:
            assert np.abs(truth.error(memory.now)[:3]).max() < 1e-3
    assert memory.now.mrp == pytest.approx(off[3:], abs=1e-15)
    assert float(memory.now.in_a_row) == 0.0
    assert np.abs(before.bias - memory.now.bias).max() == 0.0
    assert np.linalg.eigvalsh(memory.now.covariance[:3, :3])[0] == pytest.approx((10.0 * ARCSEC) ** 2)


def test_after_a_gap_the_next_reading_gives_the_attitude_and_the_bias_is_still_known() -> None:
    truth = Truth(5, [tracker(latency=2.0)])
    own = filter_of(truth)
    memory = own.first(truth.values())
    for _ in range(25):
        truth.advance()
        memory = own.observe(memory, truth.values())
    for _ in range(50):
        truth.advance()
        truth.values()
    memory = own.resume(memory, 50)
    for _ in range(3):
        truth.advance()
        memory = own.observe(memory, truth.values())
    assert truth.nees(memory.now) < chi2.ppf(0.9999, 6)
    assert np.abs(truth.error(memory.now)[:3]).max() < 500.0 * ARCSEC
    assert math.sqrt(memory.now.covariance[3, 3]) < 0.1 * TURN_ON


def test_a_filter_that_begins_again_in_flight_takes_the_attitude_from_the_first_reading() -> None:
    truth = Truth(7, [tracker()])
    own = filter_of(truth)
    for _ in range(25):
        truth.advance()
        values = truth.values()
    memory = own.first(values, begins_again=True)
    assert memory.now.rejected == 0.0
    assert np.abs(truth.error(memory.now)[:3]).max() < 500.0 * ARCSEC


def test_a_first_estimate_that_is_far_off_converges_in_one_reading() -> None:
    truth = Truth(6, [tracker()])
    own = filter_of(truth, initial_attitude_error=1.0)
    memory = own.first(truth.values())
    assert np.abs(truth.error(own.start)[:3]).max() > 0.5
    assert np.abs(truth.error(memory.now)[:3]).max() < 250.0 * ARCSEC


@pytest.mark.parametrize(
    ("specs", "complaint"),
    [
        ([gyro()], "1 and 0"),
        ([tracker()], "0 and 1"),
        ([gyro(), gyro(), tracker()], "2 and 1"),
        ([gyro(angle_random_walk=0.0), tracker()], "noise of zero"),
        ([gyro(turn_on_bias=0.0), tracker()], "initial_bias_error"),
        ([gyro(latency=2.0), tracker()], "gyro with latency .* an angular_acceleration_density"),
        (
            [gyro(outages=[{"begin": 1.0, "end": 2.0}]), tracker()],
            "gyro with outages .* angular_acceleration",
        ),
    ],
)
def test_a_filter_that_cannot_be_built_says_why(
    specs: list[GyroSpec | StarTrackerSpec], complaint: str
) -> None:
    with pytest.raises(ValueError, match=complaint):
        AttitudeFilterSpec().build(channels_of(*specs), STEP, np.zeros(3), np.zeros(3))
