# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The law has the force of its spring and its damper, and the scenario flies as it expects."""

from pathlib import Path

import numpy as np
from spring_damper import SpringDamperSpec

from satform import evaluate, load_scenario, simulate
from satform.control.protocol import ControlStep, FlightSetting, Motion
from satform.orbits.path_reference import Reference

SCENARIO = Path(__file__).with_name("spring_damper.yaml")


def test_spring_and_damper_accelerate_towards_the_reference() -> None:
    law = SpringDamperSpec(stiffness=0.5, damping=2.0).build(FlightSetting(mean_motion=1e-3, step=1.0))
    zero, one = np.zeros(3), np.array([1.0, 0.0, 0.0])
    reference = Reference(position=zero, velocity=zero, acceleration=zero)
    action = law.act(Motion(position=one, velocity=one), reference, None, ControlStep(number=0, length=1.0))
    assert action.acceleration.tolist() == [-2.5, 0.0, 0.0]


def test_the_scenario_meets_its_expectations() -> None:
    scenario = load_scenario(SCENARIO)
    assert [verdict for verdict in evaluate(scenario, simulate(scenario)) if not verdict.met] == []
