# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Adaptive tracking: the partition of unity, the sampled loop, saturation, gaps, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from control_laws import NOWHERE, assert_a_stack_has_the_bits_of_each
from satform.control.adaptive_approximation import FuzzySetsSpec, PartitionOfUnitySpec
from satform.control.adaptive_tracking import AdaptiveTrackingSpec, decay_margin, ultimate_bounds
from satform.control.protocol import ControlStep, FlightSetting, Gap, Motion

SETTING = FlightSetting(mean_motion=1e-3, step=0.1)
velocities = st.floats(-6.0, 6.0)
phases = st.floats(0.0, 50.0)


def values(spec, velocity, phase, filtered=0.0, rate=1.0):
    return spec.build(rate).values(np.full(3, velocity), np.asarray(phase), np.full(3, filtered))[1]


@given(velocities, phases, st.integers(2, 9), st.integers(3, 9))
@settings(max_examples=60, deadline=None)
def test_patches_sum_to_one_and_at_most_two_of_each_partition_overlap(velocity, phase, many, turns):
    spec = PartitionOfUnitySpec(velocity_patches=many, phase_patches=turns)
    found = values(spec, velocity, phase)
    of_velocity, of_phase = found[:many], found[2 * many : 2 * many + turns]
    for weights in (of_velocity, of_phase):
        assert weights.sum() == pytest.approx(1.0, abs=1e-12)
        assert np.all(weights >= 0.0)
        assert np.count_nonzero(weights > 1e-12) <= 2
    assert (found**2).sum() <= spec.build(1.0).largest_square() + 1e-12


@given(velocities, st.floats(-5.0, 5.0), st.floats(-3.0, 3.0))
@settings(max_examples=40, deadline=None)
def test_affine_patches_reproduce_affine_forces_within_their_range(velocity, constant, slope):
    spec = PartitionOfUnitySpec(velocity_patches=4, velocity_limit=3.0, phase_patches=0)
    centres = np.linspace(-3.0, 3.0, 4)
    weights = np.concatenate((constant + slope * centres, np.full(4, slope * (centres[1] - centres[0]))))
    wanted = constant + slope * min(max(velocity, -3.0), 3.0)
    assert weights @ values(spec, velocity, 0.0) == pytest.approx(wanted, abs=1e-10)


@given(velocities, phases, st.floats(-2.0, 2.0), st.integers(0, 8))
@settings(max_examples=40, deadline=None)
def test_fuzzy_sets_sum_to_one_within_their_bound(velocity, phase, filtered, turns):
    spec = FuzzySetsSpec(phase_sets=turns, disturbance_rate=0.25)
    found = values(spec, velocity, phase, filtered)
    assert found[:-1].sum() == pytest.approx(1.0, abs=1e-12)
    assert len(found) == 7 * max(1, turns) + 1
    law = spec.build(4.0)
    assert (law.rates * found**2).sum() <= law.largest_rate() + 1e-12


def test_the_linearised_loop_is_the_law_at_rest():
    spec = AdaptiveTrackingSpec(approximation=PartitionOfUnitySpec(phase_patches=0), natural_motion="none")
    law, transition = spec.build(SETTING), spec.linearisation(SETTING)
    position, velocity = np.array([1e-4, 0.0, 0.0]), np.array([2e-5, 0.0, 0.0])
    state = np.array([1e-4, 2e-5, 0.0, 0.0])
    memory = law.start(Motion(position, velocity))
    # The functions of the step before, as in a flight that has gone on for long.
    rest = law.approximator.values(np.zeros(3), np.zeros(()), np.zeros(3))
    memory = replace(memory, values=rest)
    for number in range(200):
        action = law.act(Motion(position, velocity), NOWHERE, memory, ControlStep(number, 0.1))
        memory = action.memory
        position = position + 0.1 * velocity + 0.005 * action.acceleration
        velocity = velocity + 0.1 * action.acceleration
        state = transition @ state
        assert position[0] == pytest.approx(state[0], abs=1e-9)
    assert np.abs(np.linalg.eigvals(transition)).max() < 1.0


def test_a_satellite_in_a_stack_has_the_bits_that_it_has_alone():
    for kind in ({"kind": "partition_of_unity"}, {"kind": "fuzzy_sets", "phase_sets": 3}):
        specs = [AdaptiveTrackingSpec(approximation=kind, weight_rate=rate) for rate in (1.0, 2.0, 5.0)]
        assert_a_stack_has_the_bits_of_each([spec.build(SETTING) for spec in specs], steps=4)


def step_of(number, commanded, applied):
    return ControlStep(number, 0.1, applied, commanded)


def test_a_saturated_axis_is_neither_adapted_nor_integrated():
    law = AdaptiveTrackingSpec().build(SETTING)
    motion = Motion(np.array([3.0, 2.0, 1.0]), np.array([0.2, 0.1, -0.3]))
    first = law.act(motion, NOWHERE, law.start(motion), ControlStep(0, 0.1))
    applied = first.acceleration * np.array([0.5, 1.0, 1.0])
    second = law.act(motion, NOWHERE, first.memory, step_of(1, first.acceleration, applied)).memory
    moved = np.any(second.weights != first.memory.weights, axis=-1)
    assert moved.tolist() == [False, True, True]
    assert (second.integral != first.memory.integral).tolist() == [False, True, True]


def test_weights_are_kept_over_a_gap_and_not_adapted_by_the_step_before_it():
    law = AdaptiveTrackingSpec(leakage_rate=0.0).build(SETTING)
    motion = Motion(np.array([3.0, 2.0, 1.0]), np.zeros(3))
    memory = law.start(motion)
    for number in range(3):
        memory = law.act(motion, NOWHERE, memory, ControlStep(number, 0.1)).memory
    resumed = law.resume(memory, Gap(3, 5, 0.1, np.zeros(3), motion))
    after = law.act(motion, NOWHERE, resumed, ControlStep(8, 0.1)).memory
    assert np.any(memory.weights)
    assert np.array_equal(after.weights, memory.weights)
    assert np.array_equal(resumed.integral, memory.integral)


@pytest.mark.parametrize(
    ("changed", "count"),
    [
        ({"velocity_patches": 5}, 16),
        # As many weights, of other functions.
        ({"velocity_patches": 6, "phase_patches": 6, "local_model": "constant"}, 12),
        ({"velocity_limit": 2.0}, 12),
    ],
)
def test_another_approximation_in_flight_begins_with_weights_of_zero(changed, count):
    motion = Motion(np.array([3.0, 2.0, 1.0]), np.zeros(3))
    law = AdaptiveTrackingSpec().build(SETTING)
    memory = law.start(motion)
    for number in range(2):
        memory = law.act(motion, NOWHERE, memory, ControlStep(number, 0.1)).memory
    assert np.any(memory.weights)
    other = AdaptiveTrackingSpec(approximation=PartitionOfUnitySpec(**changed)).build(SETTING)
    after = other.act(motion, NOWHERE, memory, ControlStep(2, 0.1)).memory
    assert after.weights.shape == (3, count)
    assert not np.any(after.weights)
    assert np.all(after.integral == memory.integral + 0.1 * motion.position)
    # From then on the weights are its own, and kept.
    again = other.act(motion, NOWHERE, after, ControlStep(3, 0.1)).memory
    assert np.any(again.weights)


def test_other_gains_in_flight_keep_the_weights():
    motion = Motion(np.array([3.0, 2.0, 1.0]), np.zeros(3))
    law, other = (
        AdaptiveTrackingSpec(weight_rate=rate, surface_gain=1.0).build(SETTING) for rate in (5.0, 4.0)
    )
    memory = law.start(motion)
    for number in range(2):
        memory = law.act(motion, NOWHERE, memory, ControlStep(number, 0.1)).memory
    kept = other.act(
        motion, NOWHERE, replace(memory, values=np.zeros_like(memory.values)), ControlStep(2, 0.1)
    )
    leaked = memory.weights * (1.0 - 0.1 * 0.01)
    np.testing.assert_allclose(kept.memory.weights, leaked, rtol=1e-12)


def test_weights_stay_within_their_limit():
    law = AdaptiveTrackingSpec(weight_limit=0.05).build(SETTING)
    motion = Motion(np.array([30.0, -20.0, 10.0]), np.zeros(3))
    memory = law.start(motion)
    for number in range(20):
        memory = law.act(motion, NOWHERE, memory, ControlStep(number, 0.1)).memory
    assert np.abs(memory.weights).max() == 0.05


def test_gains_that_the_step_is_too_long_for_are_refused():
    for fields, words in (
        ({"weight_rate": 9.6}, "step times adaptation rates, 1.92 1/s, has to be below"),
        ({"error_rate": 10.0}, "error_rate 10 1/s needs a step below 0.1 s"),
        ({"leakage_rate": 10.0, "weight_rate": 0.0}, "leakage_rate 10 1/s needs a step below 0.1 s"),
        ({"surface_gain": 20.0, "weight_rate": 0.0}, "does not decay for certain"),
    ):
        with pytest.raises(ValueError, match=words):
            AdaptiveTrackingSpec(**fields).build(SETTING)
    assert decay_margin(AdaptiveTrackingSpec(weight_rate=9.4).build(SETTING)) == pytest.approx(0.01)
    with pytest.raises(ValidationError, match="0 or at least 3"):
        PartitionOfUnitySpec(phase_patches=2)


def test_bounds_without_leakage_are_those_of_the_projection():
    law = AdaptiveTrackingSpec(leakage_rate=0.0, weight_limit=1.0, weight_rate=4.0).build(SETTING)
    weights = np.full(12, 0.5)
    margin = 1.0 - 0.05 - 0.5 * 0.1 * 4.0 * 2.0
    found = ultimate_bounds(law, 0.1, weights)
    growth, furthest = 0.01 / (2.0 * margin), 12 * 1.5**2 / 4.0
    largest = math.sqrt(2.0 * growth / margin + furthest / (1.0 + 0.1 * margin))
    assert found.filtered_error == pytest.approx(largest, rel=1e-12)
    assert found.mean_filtered_error == pytest.approx(0.1 / margin, rel=1e-12)
    with pytest.raises(ValueError, match=r"a weight of 1.5 m/s\^2 exceeds the limit of 1"):
        ultimate_bounds(law, 0.1, 3.0 * weights)
    idle = AdaptiveTrackingSpec(weight_rate=0.0).build(SETTING)
    with pytest.raises(ValueError, match="not adapted have to be zero"):
        ultimate_bounds(idle, 0.1, weights)
