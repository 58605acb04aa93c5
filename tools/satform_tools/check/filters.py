# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about filters whose model lacks an acceleration of the true motion."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from satform.control.protocol import Motion
from satform.dynamics.cw_error import free_motion
from satform.dynamics.linear import multiply
from satform.dynamics.protocol import Dynamics
from satform.dynamics.relative_motion_models import ModelName
from satform.flight.compile_satellite import flight_plan
from satform.navigation.relative_state_filter import Estimator
from satform.numeric.elementwise import Array
from satform.scenario import Scenario

_SAMPLES = 24
"""Times of a revolution at which the model is compared with the true motion."""

_COARSE_STEPS = 512
"""Steps of a revolution by which the free motion is followed from one sample to the next, at least."""

_STEPS = 16
"""Steps from each point: what alternates between them is noise, for which the filter has a density."""

_NOISE = 4.0
"""Standard deviations of its mean by which an acceleration has to stand out to be no noise."""

_CONSISTENT = 6.0
"""Normalised squared error of a consistent filter on average."""

_MODELS: dict[ModelName, str] = {
    "cw": "the Clohessy-Wiltshire equations",
    "yamanaka_ankersen": "yamanaka_ankersen",
    "j2_elements": "j2_elements",
}
"""Models in words."""

_MOST_UPDATES = 5000
"""Measurements over which the bias is followed."""


@dataclass(frozen=True)
class Disturbance:
    """Mean acceleration that a filter's model lacks, along a satellite's path.

    Attributes:
        times: of the samples, s, shape (samples,), from 0 up to a revolution or the end of the flight.
        acceleration: at these times, LVLH, m/s^2, shape (samples, 3); zero where it is not distinct from
            noise.
        period: after which it is taken to repeat, s.
    """

    times: Array
    acceleration: Array
    period: float

    def at(self, time: Array) -> Array:
        """Interpolated to times in s of shape (T,), shape (T, 3)."""
        axes = self.acceleration.T
        return np.stack([np.interp(time % self.period, self.times, axis) for axis in axes], axis=-1)


def filter_warnings(scenario: Scenario) -> list[str]:
    """A sentence for each filter that an acceleration unknown to its model makes inconsistent."""
    plans = [flight_plan(scenario, index) for index in range(len(scenario.satellites))]
    estimators = {index: plan.estimator for index, plan in enumerate(plans) if plan.estimator is not None}
    if not estimators:
        return []
    unknown = unmodelled_acceleration(scenario, estimators)
    found = []
    for index, estimator in estimators.items():
        disturbance, spec = unknown[index], scenario.satellite(index).filter
        assert spec is not None  # noqa: S101 - an estimator is built from it
        expected = expected_error_squared(estimator, disturbance, scenario.timing.step, scenario.timing.steps)
        if expected > _CONSISTENT:
            strength = float(np.max(np.linalg.norm(disturbance.acceleration, axis=-1)))
            found.append(
                f"filter of {scenario.satellites[index].name}: up to {strength:.3g} m/s^2 act along its "
                f"orbit that its model, {_MODELS[spec.model]}, does not have; the estimate will be "
                "biased and the filter overconfident, normalised estimation error squared up to about "
                f"{_CONSISTENT + expected:.2g} where {_CONSISTENT:g} is consistent. Give it a larger "
                "acceleration_density"
            )
    return found


def unmodelled_acceleration(
    scenario: Scenario, estimators: Mapping[int, Estimator]
) -> dict[int, Disturbance]:
    """Mean acceleration of the truth model beyond the model of each filter, along each path.

    Each path is the free motion from the satellite's start over a revolution, or over the flight if that is
    shorter. Without a `start` it begins where the plan begins, at the planned velocity where that is free
    motion and else on the closed ellipse through that position.

    Args:
        scenario: what is flown.
        estimators: of the satellites that have one, by index.

    Returns:
        By index.
    """
    timing, setting = scenario.timing, scenario.dynamics_setting
    period = 2.0 * np.pi / scenario.orbit.rate
    stride = max(1, int(period / (_COARSE_STEPS * timing.step)))
    dynamics = scenario.dynamics.build(setting)
    # Noise held over longer steps would carry the satellites off.
    quiet = scenario.dynamics
    if getattr(quiet, "perturbations", ()):
        quiet = quiet.model_copy(update={"perturbations": ()})
    coarse = quiet.build(replace(setting, step=stride * timing.step))
    starts = [_start(scenario, index) for index in range(len(scenario.satellites))]
    state = dynamics.start(
        np.stack([start.position for start in starts]), np.stack([start.velocity for start in starts])
    )
    span = min(period, timing.step * timing.steps) / (stride * timing.step)
    sampled = np.unique(np.linspace(0.0, span, _SAMPLES).astype(np.int64))
    means: dict[int, list[Array]] = {index: [] for index in estimators}
    reached = 0
    for number in sampled.tolist():
        for step in range(reached, number):
            state = coarse.advance(state, np.zeros((len(starts), 3)), step)
        reached = number
        for index, mean in _mean_acceleration(dynamics, state, number * stride, timing.step, estimators):
            means[index].append(mean)
    times = sampled.astype(np.float64) * (stride * timing.step)
    return {index: Disturbance(times, np.array(found), period) for index, found in means.items()}


def _start(scenario: Scenario, index: int) -> Motion:
    """Where and how the free motion of a satellite begins."""
    given = scenario.start_of(index)
    if given is not None:
        return given
    spec, start = scenario.satellite(index), flight_plan(scenario, index).start
    position = start.position - np.asarray(spec.position_error)
    planned = start.velocity - np.asarray(spec.velocity_error)
    return Motion(position, free_motion(position, planned, scenario.orbit.rate))


def _mean_acceleration(
    dynamics: Dynamics, state: Any, first: int, length: float, estimators: Mapping[int, Estimator]
) -> Iterator[tuple[int, Array]]:
    """Index of each estimator with the mean of what its model lacks over `_STEPS` steps, m/s^2, shape (3,).

    Args:
        dynamics: the truth model.
        state: of it at the beginning of the first step.
        first: number of that step.
        length: of a step, s.
        estimators: by index.
    """
    lacking: dict[int, list[Array]] = {index: [] for index in estimators}
    before = np.concatenate(dynamics.lvlh(state), axis=-1)
    for step in range(first, first + _STEPS):
        state = dynamics.advance(state, np.zeros((len(before), 3)), step)
        after = np.concatenate(dynamics.lvlh(state), axis=-1)
        for index, estimator in estimators.items():
            predicted = multiply(estimator.filter.model.over(step).transition, before[index])
            lacking[index].append((after[index] - predicted)[3:] / length)
        before = after
    for index, found in lacking.items():
        mean, spread = np.mean(found, axis=0), np.std(found, axis=0) / np.sqrt(_STEPS)
        yield index, np.where(np.abs(mean) > _NOISE * spread, mean, 0.0)


def expected_error_squared(
    estimator: Estimator, disturbance: Disturbance, length: float, steps: int
) -> float:
    """Largest normalised squared bias that an unknown acceleration gives a filter in a flight.

    Args:
        estimator: of one satellite.
        disturbance: along its path.
        length: of a control period, s.
        steps: of the flight.

    Returns:
        What the bias adds to the 6 of a consistent filter.

    Source: Bar-Shalom, Li & Kirubarajan, ch. 5.4-5.5: a filter whose model lacks an input.
    """
    measured = np.diag(np.broadcast_to(estimator.filter.variance, (6,)))
    covariance, bias, largest = measured, np.zeros(6), 0.0
    every = estimator.update
    last = min(steps, every * _MOST_UPDATES)
    pushes = disturbance.at(length * np.arange(last, dtype=np.float64))
    for step in range(last):
        own = estimator.filter.model.over(step)
        covariance = own.transition @ covariance @ own.transition.T + own.process
        bias = own.transition @ bias + own.response @ pushes[step]
        if (step + 1) % every == 0:
            gain = covariance @ np.linalg.inv(covariance + measured)
            left = np.eye(6) - gain
            covariance = left @ covariance @ left.T + gain @ measured @ gain.T
            bias = left @ bias
            largest = max(largest, float(bias @ np.linalg.solve(covariance, bias)))
    return largest
