# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about model-predictive laws: a first plan that cannot do what is wanted, limits, rounded times."""

from collections.abc import Iterator

import numpy as np

from satform.control.fuel_optimal_plan import FuelPlan
from satform.control.model_predictive import ModelPredictive, ModelPredictiveSpec
from satform.control.protocol import ControlStep
from satform.flight.compile_satellite import flight_plan
from satform.flight.plans import FlightPlan
from satform.scenario import Scenario

_CLOSE = 1e-3
"""Length, m, by which a plan may miss a bound: the solver's tolerance."""

_SLACK = 1e-6
"""Part of a step by which a time may differ from it and still counts as on it."""


def predictive_plan_warnings(scenario: Scenario) -> list[str]:
    """Sentences about plans that the start makes impossible, and about times that are rounded."""
    found = []
    for index, satellite in enumerate(scenario.satellites):
        spec = scenario.satellite(index).controller
        if not isinstance(spec, ModelPredictiveSpec):
            continue
        flown = flight_plan(scenario, index)
        sentences = [
            *_rounded(spec, scenario.timing.step),
            *_beyond_thrust(scenario, index, spec),
            *_first_plan(spec, flown),
        ]
        found += [f"controller of {satellite.name}: {sentence}" for sentence in sentences]
    return found


def _rounded(spec: ModelPredictiveSpec, step: float) -> Iterator[str]:
    interval = max(1, round(spec.interval / step)) * step
    if abs(interval - spec.interval) > _SLACK * step:
        yield f"its interval of {spec.interval:.10g} s is rounded to {interval:.10g} s, whole steps"
    horizon = round(spec.horizon / interval) * interval
    if abs(horizon - spec.horizon) > _SLACK * step:
        yield f"its horizon of {spec.horizon:.10g} s is rounded to {horizon:.10g} s, whole intervals"
    if spec.arrival_time > horizon * (1.0 + _SLACK):
        yield (
            f"its arrival_time of {spec.arrival_time:g} s is after its first horizon of {horizon:g} s; it "
            f"commands nothing before {spec.arrival_time - horizon:g} s"
        )


def _beyond_thrust(scenario: Scenario, index: int, spec: ModelPredictiveSpec) -> Iterator[str]:
    thruster = scenario.satellite(index).thruster
    if thruster is None or thruster.maximum_thrust is None:
        return
    most = thruster.maximum_thrust / (thruster.dry_mass + thruster.propellant)
    per_axis = thruster.arrangement == "per_axis"
    limit = np.array(spec.maximum_acceleration)
    asked = float(np.max(limit) if per_axis else np.linalg.norm(limit))
    if asked > most * (1.0 + 1e-9):
        yield (
            f"its plans use up to {asked:.3g} m/s^2 (maximum_acceleration), {asked / most:.3g} times what "
            f"its thrusters can apply with a full tank, {most:.3g} m/s^2"
        )


def _first_plan(spec: ModelPredictiveSpec, flown: FlightPlan) -> Iterator[str]:
    law = flown.controller
    assert isinstance(law, ModelPredictive)  # noqa: S101 - built by its specification
    still = np.zeros_like(flown.rate)
    wanted = flown.path.at_step(flown.arc_length, flown.rate, still, flown.step)
    for name, position in (("it starts", flown.start.position), ("its reference is", wanted.position)):
        for region, depth in enumerate(law.keep_out.depth(position).tolist()):
            if depth > 0.0:
                yield f"{name} {depth:.4g} m inside keep_out[{region}], {spec.keep_out[region].kind}"
    plan = law.plan(flown.start, wanted, law.start(flown.start), ControlStep(0, flown.step))
    if plan is None:
        yield f"its first plan is not solved in {spec.iterations} iterations, so that nothing is commanded"
    else:
        yield from _missed(spec, plan)


def _missed(spec: ModelPredictiveSpec, plan: FuelPlan) -> Iterator[str]:
    if plan.inside > _CLOSE:
        yield (
            f"its first plan is up to {plan.inside:.4g} m within a keep_out with its margin for motion "
            "between the ends of intervals; start further away, arrive later, allow more thrust or shorten "
            "the interval"
        )
    if plan.outside > _CLOSE:
        yield (
            f"its first plan is up to {plan.outside:.4g} m outside of its box at or after "
            f"{spec.arrival_time:g} s; arrive later, allow more thrust or a larger position_tolerance"
        )
