# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about integrators whose steps are too long for the orbit."""

import math

import numpy as np

from satform.control.coast import CoastSpec
from satform.dynamics.collocation import NODES
from satform.dynamics.integration_error import IntegrationError, integration_error
from satform.dynamics.specs import AdaptiveSpec, CollocationSpec, FixedStepSpec
from satform.dynamics.truth_models import CwPerturbedDynamicsSpec, InertialDynamicsSpec
from satform.flight.compile_satellite import motion_at_start
from satform.scenario import Scenario
from satform_tools.check.linearisation import chief_orbit

_INERTIAL, _RELATIVE = 1.0, 0.01
"""Errors in one revolution, m, from which on `check` warns."""

_LEAST_WAVES, _NODES_OF_A_WAVE = 10, 3
"""Waves of the acceleration in a revolution, at least, and nodes that each needs; with two of them the error
is decimetres in a day of a low orbit, with three a tenth of a millimetre."""

_LONG = 86400.0
"""Duration in s from which on `check` proposes the integrator for coasts."""

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
    """A sentence where the integrator's error in one revolution is large, or another one is much faster."""
    return [*_error_warnings(scenario), *_node_warnings(scenario), *_coast_warnings(scenario)]


def _node_warnings(scenario: Scenario) -> list[str]:
    """A sentence where the nodes of collocation are too far apart for the harmonics of gravity."""
    spec = scenario.dynamics
    if not isinstance(spec, InertialDynamicsSpec) or not isinstance(spec.integrator, CollocationSpec):
        return []
    eccentricity = chief_orbit(scenario).eccentricity
    at_perigee = scenario.orbit.rate * (1.0 + eccentricity) ** 2 / (1.0 - eccentricity**2) ** 1.5
    waves = max(spec.gravity.degree, _LEAST_WAVES)
    enough = NODES * math.tau / at_perigee / (waves * _NODES_OF_A_WAVE)
    if spec.integrator.maximum_step <= enough:
        return []
    return [
        f"dynamics.integrator: collocation with steps of {spec.integrator.maximum_step:g} s has too few "
        f"nodes for gravity of degree {spec.gravity.degree} on this orbit; a maximum_step of {enough:.0f} is "
        "enough"
    ]


def _coast_warnings(scenario: Scenario) -> list[str]:
    """A sentence where everybody coasts for long and each control period is integrated by itself."""
    spec = scenario.dynamics
    if not isinstance(spec, InertialDynamicsSpec) or isinstance(spec.integrator, CollocationSpec):
        return []
    alone = spec.gravity.degree == 0 and not (spec.drag or spec.sun or spec.moon or spec.solar_pressure)
    coasts = all(
        isinstance(scenario.satellite(index).controller, CoastSpec)
        for index in range(len(scenario.satellites))
    )
    if alone or spec.perturbations or not coasts or scenario.timing.duration < _LONG:
        return []
    return [
        "dynamics.integrator: no satellite has a command, for "
        f"{scenario.timing.duration / 86400.0:.3g} days; collocation integrates many control periods at once "
        "and takes a small part of the time"
    ]


def _error_warnings(scenario: Scenario) -> list[str]:
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
    if isinstance(method, AdaptiveSpec):
        return [f"dynamics.integrator: {method.kind} with these tolerances {what}; use smaller ones"]
    length = method.maximum_step
    if isinstance(method, FixedStepSpec):
        length = min(length, scenario.timing.step)
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
