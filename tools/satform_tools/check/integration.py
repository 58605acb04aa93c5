# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about integrators whose steps are too long for the orbit."""

import math

import numpy as np

from satform.dynamics.integration_error import IntegrationError, integration_error
from satform.dynamics.models import CwPerturbedDynamicsSpec, InertialDynamicsSpec
from satform.dynamics.specs import FixedStepSpec
from satform.flight.compile import motion_at_start
from satform.scenario import Scenario
from satform_tools.check.linearisation import chief_orbit

_INERTIAL, _RELATIVE = 1.0, 0.01
"""Errors in one revolution, m, from which on `check` warns."""

_SHORTEST = 1e-3
"""Sub-step in s below which none is proposed."""


def expected_integration_error(scenario: Scenario) -> IntegrationError | None:
    """Error in one revolution, for the satellite farthest from the chief; None if nothing is integrated."""
    spec = scenario.dynamics
    if not isinstance(spec, InertialDynamicsSpec | CwPerturbedDynamicsSpec) or _exact(spec):
        return None
    return _error(scenario, spec.integrator)


def _exact(spec: InertialDynamicsSpec | CwPerturbedDynamicsSpec) -> bool:
    return isinstance(spec, CwPerturbedDynamicsSpec) and spec.chief_motion == "circular"


def _error(scenario: Scenario, integrator: object) -> IntegrationError:
    positions = motion_at_start(scenario).position
    farthest = positions[int(np.argmax(np.linalg.norm(positions, axis=1)))]
    period = math.tau / scenario.orbit.rate
    built = integrator.build()  # type: ignore[attr-defined]
    return integration_error(built, scenario.timing.step, chief_orbit(scenario), farthest, period)


def integration_warnings(scenario: Scenario) -> list[str]:
    """A sentence where the integrator's error in one revolution is large."""
    found = expected_integration_error(scenario)
    if found is None or _small(found):
        return []
    spec = scenario.dynamics
    assert isinstance(spec, InertialDynamicsSpec | CwPerturbedDynamicsSpec)  # noqa: S101 - it has an error
    what = (
        f"has an error of up to {found.inertial:.3g} m in one revolution, {found.relative:.3g} m between "
        "satellite and chief"
    )
    method = spec.integrator
    if not isinstance(method, FixedStepSpec):
        return [f"dynamics.integrator: {method.kind} with these tolerances {what}; use smaller ones"]
    length = min(method.maximum_step, scenario.timing.step)
    better = length
    while better > _SHORTEST:
        better *= 0.5
        if _small(_error(scenario, method.model_copy(update={"maximum_step": better}))):
            break
    return [
        f"dynamics.integrator: {method.kind} with steps of {length:g} s {what}; a maximum_step of "
        f"{better:.4g} s is enough"
    ]


def _small(error: IntegrationError) -> bool:
    return error.inertial <= _INERTIAL and error.relative <= _RELATIVE
