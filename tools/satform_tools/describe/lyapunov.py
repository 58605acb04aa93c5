# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Lyapunov functions of control laws at the start of a flight, for `show`."""

from typing import Any

import numpy as np

from satform.control.adaptive_tracking import AdaptiveTracking
from satform.control.artificial_potential import ArtificialPotential
from satform.control.lqi import Lqi, LqiSpec
from satform.control.lqr import Lqr, LqrSpec
from satform.control.mean_element_control import MeanElementControl
from satform.control.protocol import ControlStep, RelativeNeighbour
from satform.control.sliding_mode import SlidingMode
from satform.flight.compile_satellite import flight_plan, flight_setting
from satform.flight.plans import FlightPlan
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference
from satform.scenario import Scenario
from satform_tools import console, truncated
from satform_tools.console import Table

_KNOWN_PART = "s's/2, without the part of the estimates"


def lyapunov_of(scenario: Scenario, index: int, plan: FlightPlan, wanted: Reference) -> dict[str, Any] | None:
    """The Lyapunov function of a satellite's control law at the start.

    Args:
        scenario: to describe.
        index: of the satellite.
        plan: of the satellite.
        wanted: motion that the law follows in its first step.

    Returns:
        `value`, `unit` and `form`, in words; None for a law without one. Of adaptive laws it is the part that
        does not depend on the unknown force.
    """
    law, spec = plan.controller, scenario.satellite(index).controller
    step = ControlStep(0, plan.step)
    if isinstance(law, SlidingMode):
        sliding = law.act(plan.start, wanted, None, step).sliding_variable
        return _entry(0.5 * float(sliding @ sliding), "m²/s²", "s's/2")
    if isinstance(law, AdaptiveTracking):
        sliding = law.act(plan.start, wanted, law.start(plan.start), step).sliding_variable
        return _entry(0.5 * float(sliding @ sliding), "m²/s²", _KNOWN_PART)
    if isinstance(law, ArtificialPotential):
        sliding = _speed_error(scenario, index, plan, law)
        return _entry(0.5 * float(sliding @ sliding), "m²/s²", _KNOWN_PART)
    if isinstance(law, MeanElementControl):
        return _entry(law.lyapunov(plan.start, wanted, step), "m²", "half the squared errors of the elements")
    if isinstance(law, Lqr | Lqi) and isinstance(spec, LqrSpec | LqiSpec):
        error = _error(law, plan, wanted)
        cost = spec.cost_matrix(flight_setting(scenario, index))
        return _entry(float(error @ cost @ error), "s", "x'Px")
    return None


def _entry(value: float, unit: str, form: str) -> dict[str, Any]:
    return {"value": value, "unit": unit, "form": form}


def _speed_error(scenario: Scenario, index: int, plan: FlightPlan, law: ArtificialPotential) -> Array:
    """Velocity less the one that the artificial potential wants, m/s, shape (3,)."""
    (neighbour,) = scenario.communication_graph().neighbours(index)
    other = flight_plan(scenario, neighbour).start
    seen = RelativeNeighbour(plan.start.position - other.position, plan.start.velocity - other.velocity)
    _, surface, _ = law.evaluate(plan.start.velocity, seen, law.start(plan.start))
    return surface


def _error(law: Lqr | Lqi, plan: FlightPlan, wanted: Reference) -> Array:
    """Position and velocity error, and of `lqi` the integral less that with which it holds the reference."""
    position, velocity = plan.start.position - wanted.position, plan.start.velocity - wanted.velocity
    if isinstance(law, Lqi):
        integral = law.start(plan.start).integral - law.resting(wanted)
        return np.concatenate((position, velocity, integral))
    if law.velocity_reference == "zero":
        velocity = plan.start.velocity
    return np.concatenate((position, velocity))


def print_lyapunov(satellites: list[dict[str, Any]]) -> None:
    """Print what `lyapunov_of` has found, without sliding modes, whose function is beside their times."""
    rows = []
    for entry in satellites:
        found = entry["lyapunov"]
        if found is not None and entry["sliding"] is None:
            value = 0.0 if abs(found["value"]) < 1e-12 else found["value"]
            rows.append((entry["name"], f"{value:.6g}", found["unit"], found["form"]))
    if rows:
        truncated.table(Table(("satellite", "V(0)", "unit", "V"), rows, frozenset({1})))
        console.line()
