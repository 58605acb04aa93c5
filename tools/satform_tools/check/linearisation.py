# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about the CW equations far from two-body motion: wide formations, eccentric chiefs."""

import math
from dataclasses import dataclass

import numpy as np

from satform.dynamics.cw_error import ChiefOrbit, cw_error, free_motion
from satform.dynamics.models import CwDynamicsSpec, CwPerturbedDynamicsSpec, LinearJ2DynamicsSpec
from satform.dynamics.velocity_dependent import VelocityDependentDynamicsSpec
from satform.flight.compile import flight_plan
from satform.scenario import Scenario

_NOTEWORTHY = 0.01
"""Error in one revolution, relative to the distance from the chief, from which on `check` warns."""


@dataclass(frozen=True)
class ExpectedError:
    """What CW is expected to err by for one satellite without control.

    Attributes:
        name: of the satellite.
        distance: from the chief, where its planned motion begins, m.
        error: largest within one revolution of the chief, m; infinite where it is on no ellipse.
    """

    name: str
    distance: float
    error: float


def expected_errors(scenario: Scenario) -> list[ExpectedError]:
    """Expected error of CW for each satellite; empty where the truth is about no orbit.

    Each begins where its plan begins, at the planned velocity where that is free motion and else on the
    closed ellipse through that place.
    """
    if isinstance(scenario.dynamics, VelocityDependentDynamicsSpec):
        return []
    chief = chief_orbit(scenario)
    known: dict[bytes, float] = {}
    found = []
    for index, satellite in enumerate(scenario.satellites):
        spec, start = scenario.satellite(index), flight_plan(scenario, index).start
        position = start.position - np.asarray(spec.position_error)
        planned = start.velocity - np.asarray(spec.velocity_error)
        velocity = free_motion(position, planned, chief.mean_motion)
        key = position.tobytes() + velocity.tobytes()
        if key not in known:
            known[key] = cw_error(position, velocity, chief, math.tau / chief.mean_motion)
        found.append(ExpectedError(satellite.name, float(np.linalg.norm(position)), known[key]))
    return found


def chief_orbit(scenario: Scenario) -> ChiefOrbit:
    """The chief's two-body orbit; circular where the truth model knows no other."""
    orbit = getattr(scenario.dynamics, "chief", None)
    if orbit is None:
        return ChiefOrbit(scenario.orbit.rate)
    anomaly = orbit.argument_of_latitude - orbit.argument_of_perigee
    return ChiefOrbit(scenario.orbit.rate, orbit.eccentricity, anomaly)


def linearisation_warnings(scenario: Scenario) -> list[str]:
    """Sentences about satellites for which CW errs by much of their distance from the chief."""
    far = [
        entry for entry in expected_errors(scenario) if entry.error > max(1e-3, _NOTEWORTHY * entry.distance)
    ]
    if not far:
        return []
    worst = max(far, key=lambda entry: entry.error / max(entry.distance, 1.0))
    orbit = chief_orbit(scenario)
    size = f"{worst.error:.3g} m in one revolution" if math.isfinite(worst.error) else "more than any bound"
    who = (
        f"{worst.name}, {worst.distance:.6g} m from the chief, has, without control, an error of up to {size}"
    )
    more = f" ({len(far) - 1} more likewise)" if len(far) > 1 else ""
    if orbit.eccentricity > 0.0:
        return [
            "dynamics.chief.eccentricity: control laws and plans use the CW equations about a circular chief "
            f"orbit; with this eccentricity of {orbit.eccentricity:g} the CW motion of {who}{more}"
        ]
    if not _linear(scenario):
        return []
    kind = getattr(scenario.dynamics, "kind", "")
    return [
        f"dynamics: {kind} is of first order in the distance; its motion of {who}{more}; cw_perturbed and "
        "inertial contain the higher orders"
    ]


def _linear(scenario: Scenario) -> bool:
    """Whether the truth itself is linear in the distance."""
    truth = scenario.dynamics
    ideal = isinstance(truth, CwPerturbedDynamicsSpec) and truth.chief_motion == "circular"
    return ideal or isinstance(truth, CwDynamicsSpec | LinearJ2DynamicsSpec)
