# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A filter between sensor and controller over a gap: the numbers of step after step, at once."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from satform.equipment.sensors.relative_motion import Measurement
from satform.navigation.kalman_filter import KalmanFilter, ProcessStep, process_model
from satform.navigation.relative_state_filter import Estimator, EstimatorMemory
from satform.numeric.elementwise import Array

MEAN_MOTION, STEP = 2.0 * math.pi / 6000.0, 10.0
VARIANCE = np.repeat([25.0, 0.0025], 3)
COMMANDED, APPLIED = np.array([1e-3, -2e-3, 5e-4]), np.array([2e-4, 1e-4, -3e-4])


class Counted:
    """A model that counts how often it is asked."""

    def __init__(self) -> None:
        self.model = process_model("cw", MEAN_MOTION, STEP, np.array([1e-8, 2e-8, 5e-9]))
        self.asked = 0

    def over(self, number: int) -> ProcessStep:
        self.asked += 1
        return self.model.over(number)

    def across(self, first: int, count: int) -> ProcessStep:
        self.asked += 1
        return self.model.across(first, count)


def begun(model: Any, update: int, latency: int) -> tuple[Estimator, EstimatorMemory]:
    """An estimator, and its memory two steps after its first measurement."""
    estimator = Estimator(KalmanFilter(model, VARIANCE), update, latency)
    first = Measurement(np.array([100.0, 200.0, -300.0]), np.array([0.1, -0.2, 0.3]), 0)
    memory = estimator.start(first)
    for _ in range(2):
        memory = estimator.observe(memory, first, COMMANDED)
    return estimator, memory


def step_by_step(estimator: Estimator, memory: EstimatorMemory, missed: int) -> EstimatorMemory:
    """What is known after a gap when a measurement of any step of it may still come."""
    nothing = Measurement(np.zeros(3), np.zeros(3), -1)
    for step in range(missed):
        memory = estimator.observe(memory, nothing, APPLIED if step else COMMANDED)
    last = np.asarray(estimator.max_consecutive_rejections - 1.0)
    return replace(memory, in_a_row=last)


def same_bits(one: Array, other: Array) -> bool:
    return bool(np.array_equal(one, other))


@pytest.mark.parametrize(("update", "latency"), [(1, 0), (1, 3), (3, 5)])
def test_a_gap_no_longer_than_a_measurement_is_late_has_the_bits_of_step_by_step(
    update: int, latency: int
) -> None:
    estimator, memory = begun(Counted(), update, latency)
    for missed in range(1, update + latency + 2):
        found = estimator.resume(memory, missed, COMMANDED, APPLIED)
        expected = step_by_step(estimator, memory, missed)
        assert same_bits(found.state, expected.state)
        assert same_bits(found.covariance, expected.covariance)


@pytest.mark.parametrize(("update", "latency"), [(1, 0), (3, 5)])
def test_the_work_and_the_memory_of_a_long_gap_do_not_grow_with_it(update: int, latency: int) -> None:
    model = Counted()
    estimator, memory = begun(model, update, latency)
    model.asked = 0
    found = estimator.resume(memory, 5000, COMMANDED, APPLIED)
    assert model.asked <= update + latency + 2
    assert len(found.commands) <= update + latency
    # By numpy: the powers of the transition.
    each = model.model.over(0)
    state = each.transition @ memory.state + each.response @ COMMANDED
    covariance = each.transition @ memory.covariance @ each.transition.T + each.process
    for _ in range(4999):
        state = each.transition @ state + each.response @ APPLIED
        covariance = each.transition @ covariance @ each.transition.T + each.process
    np.testing.assert_allclose(found.state, state, rtol=1e-9)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-8, atol=1e-9 * np.abs(covariance).max())


@pytest.mark.parametrize("late", range(3))
def test_the_first_measurement_after_a_long_gap_is_fused_at_the_step_at_which_it_was_taken(late: int) -> None:
    update, latency, missed = 2, 1, 300
    estimator, memory = begun(Counted(), update, latency)
    whole = step_by_step(estimator, memory, missed)
    short = estimator.resume(memory, missed, COMMANDED, APPLIED)
    # In the first step after the gap, the newest one that has arrived may be of so many steps before.
    taken = 2 + missed + 1 - latency - late * (update - 1) // 2
    measured = Measurement(whole.state[:3] + 3.0, whole.state[3:], taken)
    found, expected = (estimator.observe(own, measured, APPLIED) for own in (short, whole))
    assert found.step == expected.step == taken
    np.testing.assert_allclose(found.state, expected.state, rtol=1e-9)
    np.testing.assert_allclose(found.covariance, expected.covariance, rtol=1e-7, atol=1e-9)
