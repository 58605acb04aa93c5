# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about filters whose model lacks an acceleration of the true motion."""

import numpy as np

from satform.control.protocol import Motion
from satform.dynamics import cw
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

_STILL = 1e-9
"""Relative change of the covariance with which it has become steady."""

_MOST_UPDATES = 20_000
"""Measurements after which it is taken as it is."""


def filter_warnings(scenario: Scenario) -> list[str]:
    """A sentence for each filter that an acceleration unknown to its model makes inconsistent."""
    plans = [flight_plan(scenario, index) for index in range(len(scenario.satellites))]
    filtering = [index for index, plan in enumerate(plans) if plan.estimator is not None]
    if not filtering:
        return []
    unknown = unmodelled_acceleration(scenario)
    found = []
    for index in filtering:
        estimator = plans[index].estimator
        assert estimator is not None  # noqa: S101 - chosen so
        pushes = unknown[:, index]
        expected = max(expected_error_squared(estimator, push) for push in pushes)
        if expected > _CONSISTENT:
            strength = float(np.max(np.linalg.norm(pushes, axis=-1)))
            found.append(
                f"filter of {scenario.satellites[index].name}: up to {strength:.3g} m/s^2 act along its "
                "orbit that its model, the Clohessy-Wiltshire equations, does not have; the estimate will be "
                f"biased and the filter overconfident, normalised estimation error squared about "
                f"{_CONSISTENT + expected:.2g} where {_CONSISTENT:g} is consistent. Give it a larger "
                "acceleration_density"
            )
    return found


def unmodelled_acceleration(scenario: Scenario) -> Array:
    """Mean acceleration of the truth model beyond the Clohessy-Wiltshire equations, along each path.

    Args:
        scenario: what is flown.

    Returns:
        m/s^2, LVLH, shape (samples, N, 3); zero where it is not distinct from noise.
    """
    plans = [flight_plan(scenario, index) for index in range(len(scenario.satellites))]
    timing = scenario.timing
    model = cw.HeldInputStep.over(scenario.orbit.rate, timing.step)
    still = np.zeros((len(plans), 3))
    means = []
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
        pushes = []
        for step in range(_STEPS):
            before = dynamics.lvlh(state)
            state = dynamics.advance(state, still, step)
            pushes.append((dynamics.lvlh(state)[1] - model.advance(*before, still)[1]) / timing.step)
        mean, spread = np.mean(pushes, axis=0), np.std(pushes, axis=0) / np.sqrt(_STEPS)
        means.append(np.where(np.abs(mean) > _NOISE * spread, mean, 0.0))
    return np.array(means)


def expected_error_squared(estimator: Estimator, push: Array) -> float:
    """Normalised squared bias that a steady unknown acceleration gives a steady filter.

    Args:
        estimator: of one satellite.
        push: m/s^2, LVLH, shape (3,).

    Returns:
        What the bias adds to the 6 of a consistent filter.

    Source: Bar-Shalom, Li & Kirubarajan, ch. 5.4-5.5: a filter whose model lacks an input.
    """
    own = estimator.filter
    transition, response = np.eye(6), np.zeros((6, 3))
    noise, step_noise = np.zeros((6, 6)), own.process
    for _ in range(estimator.update):
        transition, response = own.transition @ transition, own.transition @ response + own.response
        noise = own.transition @ noise @ own.transition.T + step_noise
    measured = np.diag(np.broadcast_to(own.variance, (6,)))
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
    bias = np.linalg.solve(np.eye(6) - left @ transition, left @ response @ push)
    return float(bias @ np.linalg.solve(covariance, bias))
