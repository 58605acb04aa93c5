# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about filters whose model lacks an acceleration of the true motion."""

from collections.abc import Mapping

import numpy as np

from satform.control.protocol import Motion
from satform.dynamics.linear import multiply
from satform.dynamics.relative_motion_models import ModelName
from satform.equipment.navigation_filter import Estimator
from satform.flight.compile import flight_plan
from satform.numeric.elementwise import Array
from satform.scenario import Scenario

_SAMPLES = 8
"""Points along a satellite's path at which the model is compared with the true motion."""

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

_STILL = 1e-9
"""Relative change of the covariance with which it has become steady."""

_MOST_UPDATES = 20_000
"""Measurements after which it is taken as it is."""


def filter_warnings(scenario: Scenario) -> list[str]:
    """A sentence for each filter that an acceleration unknown to its model makes inconsistent."""
    plans = [flight_plan(scenario, index) for index in range(len(scenario.satellites))]
    estimators = {index: plan.estimator for index, plan in enumerate(plans) if plan.estimator is not None}
    if not estimators:
        return []
    unknown = unmodelled_acceleration(scenario, estimators)
    found = []
    for index, estimator in estimators.items():
        disturbances, spec = unknown[index], scenario.satellite(index).filter
        assert spec is not None  # noqa: S101 - an estimator is built from it
        expected = max(expected_error_squared(estimator, disturbance) for disturbance in disturbances)
        if expected > _CONSISTENT:
            strength = float(np.max(np.linalg.norm(disturbances, axis=-1)))
            found.append(
                f"filter of {scenario.satellites[index].name}: up to {strength:.3g} m/s^2 act along its "
                f"orbit that its model, {_MODELS[spec.model]}, does not have; the estimate will be "
                "biased and the filter overconfident, normalised estimation error squared about "
                f"{_CONSISTENT + expected:.2g} where {_CONSISTENT:g} is consistent. Give it a larger "
                "acceleration_density"
            )
    return found


def unmodelled_acceleration(scenario: Scenario, estimators: Mapping[int, Estimator]) -> dict[int, Array]:
    """Mean acceleration of the truth model beyond the model of each filter, along each path.

    Args:
        scenario: what is flown.
        estimators: of the satellites that have one, by index.

    Returns:
        m/s^2, LVLH, by index, shape (samples, 3); zero where it is not distinct from noise.
    """
    plans = [flight_plan(scenario, index) for index in range(len(scenario.satellites))]
    timing = scenario.timing
    still = np.zeros((len(plans), 3))
    means: dict[int, list[Array]] = {index: [] for index in estimators}
    for sample in range(_SAMPLES):
        starts = []
        for plan in plans:
            along = plan.arc_length + sample / _SAMPLES * plan.path.period
            desired = plan.path.reference(along, plan.rate, np.zeros_like(plan.rate))
            starts.append(Motion(desired.position, desired.velocity))
        dynamics = scenario.dynamics.build(scenario.dynamics_setting)
        state = dynamics.start(
            np.stack([start.position for start in starts]), np.stack([start.velocity for start in starts])
        )
        disturbances: dict[int, list[Array]] = {index: [] for index in estimators}
        for step in range(_STEPS):
            before = np.concatenate(dynamics.lvlh(state), axis=-1)
            state = dynamics.advance(state, still, step)
            after = dynamics.lvlh(state)[1]
            for index, estimator in estimators.items():
                predicted = multiply(estimator.filter.model.over(step).transition, before[index])
                disturbances[index].append((after[index] - predicted[3:]) / timing.step)
        for index, found in disturbances.items():
            mean, spread = np.mean(found, axis=0), np.std(found, axis=0) / np.sqrt(_STEPS)
            means[index].append(np.where(np.abs(mean) > _NOISE * spread, mean, 0.0))
    return {index: np.array(found) for index, found in means.items()}


def expected_error_squared(estimator: Estimator, disturbance: Array) -> float:
    """Normalised squared bias that a steady unknown acceleration gives a steady filter.

    Args:
        estimator: of one satellite; a model that changes along the chief's orbit is taken as it is at the
            start.
        disturbance: m/s^2, LVLH, shape (3,).

    Returns:
        What the bias adds to the 6 of a consistent filter.

    Source: Bar-Shalom, Li & Kirubarajan, ch. 5.4-5.5: a filter whose model lacks an input.
    """
    own = estimator.filter.model.over(0)
    transition, response = np.eye(6), np.zeros((6, 3))
    noise, step_noise = np.zeros((6, 6)), own.process
    for _ in range(estimator.update):
        transition, response = own.transition @ transition, own.transition @ response + own.response
        noise = own.transition @ noise @ own.transition.T + step_noise
    measured = np.diag(np.broadcast_to(estimator.filter.variance, (6,)))
    covariance = measured
    for _ in range(_MOST_UPDATES):
        predicted = transition @ covariance @ transition.T + noise
        gain = predicted @ np.linalg.inv(predicted + measured)
        left = np.eye(6) - gain
        updated = left @ predicted @ left.T + gain @ measured @ gain.T
        change = np.max(np.abs(updated - covariance) / np.sqrt(np.outer(np.diag(updated), np.diag(updated))))
        covariance = updated
        if change < _STILL:
            break
    bias = np.linalg.solve(np.eye(6) - left @ transition, left @ response @ disturbance)
    return float(bias @ np.linalg.solve(covariance, bias))
