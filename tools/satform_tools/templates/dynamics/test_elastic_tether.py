# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The model oscillates with the frequency of orbit and tether, and the scenario flies as it expects."""

import math
from pathlib import Path

import numpy as np
from elastic_tether import ElasticTetherSpec

from satform import evaluate, load_scenario, simulate
from satform.dynamics.protocol import DynamicsSetting

SCENARIO = Path(__file__).with_name("elastic_tether.yaml")


def test_across_the_orbit_the_motion_is_that_of_an_oscillator() -> None:
    setting = DynamicsSetting(mean_motion=1e-3, step=10.0, satellite_count=1)
    model = ElasticTetherSpec(stiffness=3e-6).build(setting)
    state = model.start(np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3)))
    for step in range(50):
        state = model.advance(state, np.zeros((1, 3)), step)
    position, _ = model.lvlh(state)
    assert math.isclose(position[0, 2], math.cos(2e-3 * 500.0), abs_tol=1e-8)


def test_the_scenario_meets_its_expectations() -> None:
    scenario = load_scenario(SCENARIO)
    assert [verdict for verdict in evaluate(scenario, simulate(scenario)) if not verdict.met] == []
