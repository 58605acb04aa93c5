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

from satform.attitude.attitude_filter import (
    AttitudeEstimate,
    AttitudeFilter,
    AttitudeMemory,
    error_transition,
    small_rotation,
)
from satform.attitude.attitude_filter_spec import AttitudeFilterSpec
from satform.attitude.held_rate import held_transition
from satform.equipment.sensors.gyro import GyroSpec
from satform.equipment.sensors.protocol import SensorChannel
from satform.equipment.sensors.star_tracker import StarTrackerSpec
from satform.numeric.elementwise import Array
from satform.numeric.modified_rodrigues import composed_mrp, mrp_of_rotation
from satform.numeric.stacking import item, stack

ARCSEC = math.radians(1.0 / 3600.0)
STEP = 1.0
ANGLE_WALK, BIAS_WALK = 1e-5, 1e-7
TURN_ON = 1e-4
RATE = np.array([0.02, -0.01, 0.03])


def tracker(**fields: object) -> StarTrackerSpec:
    return StarTrackerSpec.model_validate(
        {"cross_axis_noise": 10.0 * ARCSEC, "boresight_noise": 60.0 * ARCSEC, **fields}
    )


def gyro(**fields: object) -> GyroSpec:
    given = {"angle_random_walk": ANGLE_WALK, "rate_random_walk": BIAS_WALK, "turn_on_bias": TURN_ON}
    return GyroSpec.model_validate({**given, **fields})


def channels_of(*specs: GyroSpec | StarTrackerSpec) -> list[SensorChannel]:
    return [channel for spec in specs for channel in spec.build(["one"], 0, STEP)]


def mrp_of(rotation: Rotation) -> Array:
    return np.asarray(rotation.as_mrp())


class Truth:
    """A body that turns at a rate that swings, a gyro on it and star trackers, all with scipy's rotations."""

    def __init__(
        self,
        seed: int,
        specs: list[StarTrackerSpec],
        gyro_steps: int = 1,
        *,
        gyro_latency: int = 0,
        gyro_outage: range = range(0),
        acceleration: float = 0.0,
        known: float = 0.0,
    ) -> None:
        """The angular acceleration is white noise of a density (rad^2/s^3) and a known part (rad/s^2)."""
        self.random = np.random.default_rng(seed)
        self.specs, self.gyro_steps = specs, gyro_steps
        self.gyro_latency, self.gyro_outage = gyro_latency, gyro_outage
        self.acceleration, self.turning = acceleration, RATE
        self.known, self.told = known, np.zeros(3)
        self.gyro_sent: list[Array] = []
        # Active: body axes from inertial ones.
        self.body = Rotation.random(random_state=self.random)
        self.bias = TURN_ON * self.random.standard_normal(3)
        self.step = 0
        self.integrated = Rotation.identity()
        self.sent: list[list[Array]] = [[] for _ in specs]

    def values(self) -> Array:
        """Readings that arrive at the present step: the gyro's, then those of each star tracker."""
        gyro = np.full(3, np.nan)
        if self.step % self.gyro_steps == 0:
            time = self.gyro_steps * STEP
            walk = BIAS_WALK * math.sqrt(time) * self.random.standard_normal(3)
            white = math.sqrt(ANGLE_WALK**2 / time + BIAS_WALK**2 * time / 12.0)
            rate = self.integrated.as_rotvec() / time if self.step else self.rate()
            walk = walk if self.step else 0.0 * walk
            gyro = rate + self.bias + 0.5 * walk + white * self.random.standard_normal(3)
            self.bias = self.bias + walk
            self.integrated = Rotation.identity()
        self.gyro_sent.append(np.full(3, np.nan) if self.step in self.gyro_outage else gyro)
        gyro = (
            self.gyro_sent[-1 - self.gyro_latency] if self.gyro_latency <= self.step else np.full(3, np.nan)
        )
        for spec, sent in zip(self.specs, self.sent, strict=True):
            sent.append(self.seen(spec))
        late = [round(spec.latency / STEP) for spec in self.specs]
        arrived = [
            sent[-1 - wait] if wait < len(sent) else np.full(3, np.nan)
            for sent, wait in zip(self.sent, late, strict=True)
        ]
        return np.concatenate([gyro, *arrived])

    def seen(self, spec: StarTrackerSpec) -> Array:
        if self.step % max(1, round(spec.period / STEP)) or any(
            window.begin <= self.step * STEP < window.end for window in spec.outages
        ):
            return np.full(3, np.nan)
        looking = np.array(spec.boresight) / np.linalg.norm(spec.boresight)
        noise = self.random.standard_normal(3)
        across = spec.cross_axis_noise * (noise - looking * (looking @ noise))
        error = across + spec.boresight_noise * looking * self.random.standard_normal()
        return mrp_of(self.body * Rotation.from_rotvec(error))

    def rate(self) -> Array:
        if self.acceleration:
            return self.turning
        if self.gyro_steps > 1:
            # The filter takes the rate for constant between two readings of the gyro.
            return RATE
        return np.asarray(RATE * (1.0 + 0.5 * np.cos(0.01 * self.step * np.array([1.0, 1.3, 0.7]))))

    def advance(self) -> None:
        mean = self.rate()
        if self.acceleration:
            # Rate and integrated rate have the covariance of white acceleration exactly.
            walk = math.sqrt(self.acceleration * STEP) * self.random.standard_normal(3)
            between = math.sqrt(self.acceleration * STEP / 12.0) * self.random.standard_normal(3)
            self.told = self.known * np.cos(0.2 * self.step * np.array([1.0, 1.3, 0.7]))
            change = walk + self.told * STEP
            mean, self.turning = self.turning + 0.5 * change + between, self.turning + change
        turn = Rotation.from_rotvec(mean * STEP)
        self.body, self.integrated = self.body * turn, self.integrated * turn
        self.step += 1

    def error(self, estimate: AttitudeEstimate) -> Array:
        """Rotation from estimated to true body axes, true less estimated bias, and rate where one is held."""
        off = Rotation.from_mrp(estimate.mrp).inv() * self.body
        rate = self.rate() - estimate.rate if estimate.holds_rate else np.empty(0)
        return np.concatenate((off.as_rotvec(), self.bias - estimate.bias, rate))

    def nees(self, estimate: AttitudeEstimate) -> float:
        error = self.error(estimate)
        return float(error @ np.linalg.solve(estimate.covariance, error))


def filter_of(truth: Truth, **fields: object) -> AttitudeFilter:
    own = gyro(period=truth.gyro_steps * STEP, latency=truth.gyro_latency * STEP)
    specs = [own, *truth.specs]
    if truth.acceleration:
        fields = {"angular_acceleration_density": truth.acceleration, **fields}
    spec = AttitudeFilterSpec.model_validate(fields)
    return spec.build(channels_of(*specs), STEP, mrp_of(truth.body), truth.random.standard_normal(3))


def flown(truths: list[Truth], own: AttitudeFilter, steps: int) -> tuple[Array, AttitudeMemory]:
    """NEES of each step and truth, and the memory at the end, of as many filters in one."""
    memory = own.first(np.stack([truth.values() for truth in truths]))
    nees = []
    for number in range(steps + 1):
        if number:
            for truth in truths:
                truth.advance()
            told = np.stack([truth.told for truth in truths])
            memory = own.observe(memory, np.stack([truth.values() for truth in truths]), told)
        nees.append([truth.nees(item(memory.now, row)) for row, truth in enumerate(truths)])
    return np.array(nees), memory


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


def test_a_late_gyro_ends_where_a_prompt_one_would() -> None:
    prompt = Truth(3, [tracker()], acceleration=1e-8)
    late = Truth(3, [tracker()], acceleration=1e-8, gyro_latency=4)
    own, own_late = filter_of(prompt), filter_of(late)
    memory, memory_late = own.first(prompt.values()), own_late.first(late.values())
    then: list[AttitudeEstimate] = []
    for _ in range(30):
        for truth in (prompt, late):
            truth.advance()
        memory = own.observe(memory, prompt.values())
        memory_late = own_late.observe(memory_late, late.values())
        then.append(memory.now)
    np.testing.assert_equal(asdict(memory_late.oldest), asdict(then[-1 - 4]))


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


def test_a_late_reading_ends_where_a_prompt_one_would() -> None:
    """What a late star tracker gives comes out as without latency, once all has arrived."""
    prompt, late = Truth(3, [tracker()]), Truth(3, [tracker(latency=4.0)])
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
