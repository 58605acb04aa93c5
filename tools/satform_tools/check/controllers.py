# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about control laws: gains against the declared disturbances, steps against gains."""

import numpy as np

from satform.control.sliding_mode import SlidingModeSpec, gain_warnings, sampling_warnings
from satform.dynamics.specs import PerturbedDynamicsSpec
from satform.numeric.elementwise import Array
from satform.scenario import Scenario
from satform_tools.check.reference_motion import steady_motions


def controller_warnings(scenario: Scenario) -> list[str]:
    """Sentences about gains below the disturbance bound and steps too long for the gains."""
    found: dict[str, list[str]] = {}
    bound, centre = declared_disturbance(scenario)
    steady = steady_motions(scenario)
    for index, satellite in enumerate(scenario.satellites):
        spec = scenario.satellite(index)
        if not isinstance(spec.controller, SlidingModeSpec):
            continue
        jerk = steady[index].jerk_max
        sentences = gain_warnings(spec.controller, bound[index], centre[index])
        sentences += sampling_warnings(spec.controller, scenario.timing.step, jerk, spec.feedforward_sample)
        for sentence in sentences:
            found.setdefault(sentence, []).append(satellite.name)
    return [f"controller of {', '.join(names)}: {sentence}" for sentence, names in found.items()]


def declared_disturbance(scenario: Scenario) -> tuple[Array, Array]:
    """Bound and centre of the declared disturbances, m/s^2, shapes (N, 3)."""
    count = len(scenario.satellites)
    bound, centre = np.zeros((count, 3)), np.zeros((count, 3))
    if isinstance(scenario.dynamics, PerturbedDynamicsSpec):
        for perturbation in scenario.dynamics.build_perturbations(scenario.dynamics_setting):
            bound = bound + perturbation.bound()
            centre = centre + perturbation.centre()
    return bound, centre
