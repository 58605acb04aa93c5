# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Extremes of the steady motion of each satellite along its path."""

from satform.flight.compile_satellite import flight_plan
from satform.orbits.path_reference import SteadyMotion, steady_motion
from satform.scenario import Scenario


def steady_motions(scenario: Scenario) -> list[SteadyMotion]:
    """Extremes of each satellite's motion once all agree, worked out once for those on the same path."""
    known: dict[tuple[object, ...], SteadyMotion] = {}
    found = []
    for index in range(len(scenario.satellites)):
        spec, plan = scenario.satellite(index), flight_plan(scenario, index)
        rate = float(plan.nominal_rate)
        path = (repr(spec.curve), spec.scale, spec.path_parameter, spec.feedforward_sample, rate)
        if path not in known:
            known[path] = steady_motion(plan.path, rate)
        found.append(known[path])
    return found
