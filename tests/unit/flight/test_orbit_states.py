# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Inertial states step by step are those that a record has of a whole flight, for every kind of chief."""

from typing import Any

import numpy as np
import pytest

from formations import formation
from satform.flight.compile import compile_scenario
from satform.flight.plant import Plant
from satform.flight.simulate import simulate
from satform.scenario import ScenarioError, parse_scenario

INERTIAL = {"kind": "inertial", "chief": {"inclination": 1.2}, "gravity": {"degree": 2}}
KEPLERIAN = {
    "kind": "keplerian",
    "epoch": "2026-03-20T12:00:00Z",
    "semi_major_axis": 8.0e6,
    "eccentricity": 0.1,
    "inclination": 1.0,
    "true_anomaly": 0.3,
}
CHIEFS: dict[str, dict[str, Any]] = {
    "inertial": {"dynamics": INERTIAL},
    "held": {"dynamics": {**INERTIAL, "integrator": {"kind": "rk4"}}},
    "cw_perturbed": {"dynamics": {"kind": "cw_perturbed", "chief": {"inclination": 1.2}}},
    "unperturbed": {"orbit": {"chief": KEPLERIAN}},
}


@pytest.mark.parametrize("name", CHIEFS)
def test_each_step_has_the_states_of_the_record(name: str) -> None:
    satellites = [{}, {"position_error": [10.0, -20.0, 30.0]}]
    scenario = formation(satellites, 5.0, publish_orbits=True, controller={}, **CHIEFS[name])
    record = simulate(scenario)
    plan = compile_scenario(scenario)
    plant, states = Plant(plan.plant), plan.orbit_states
    assert states is not None
    for step in range(record.steps + 1):
        position, velocity, elements = states.at(plant)
        np.testing.assert_array_equal(position, record.inertial_position[step])
        np.testing.assert_array_equal(velocity, record.inertial_velocity[step])
        np.testing.assert_array_equal(elements, record.relative_elements[step])
        if step < record.steps:
            plant.advance(record.acceleration[step])
    assert not np.array_equal(elements[0], elements[1])
    assert compile_scenario(scenario.with_({"publish_orbits": False})).orbit_states is None


def test_without_a_date_there_are_no_inertial_states() -> None:
    text = formation([{}], 5.0).to_json().rstrip().removesuffix("}") + ', "publish_orbits": true}'
    with pytest.raises(ScenarioError) as refused:
        parse_scenario(text, "test.yaml")
    (problem,) = refused.value.problems
    assert problem.field == "publish_orbits"
    assert "need a truth model with a date" in problem.sentence
