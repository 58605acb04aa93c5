# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A scenario is compiled into plans: frozen, only those that are asked for, and flown as often as wanted."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest

from flights import SCENARIOS, shipped, shortened
from satform.flight.compile import FormationPlan, compile_scenario
from satform.flight.plant import Plant


@pytest.fixture
def plan() -> FormationPlan:
    return compile_scenario(shipped("noisy_navigation"))


def test_a_plan_cannot_be_changed(plan: FormationPlan) -> None:
    parts = [plan.timing, plan.membership, plan.faults, plan.links, plan.topics, plan.limits, plan.plant]
    for part in [*parts, plan.scene, plan.satellite(0), plan.parameters(0)]:
        field = dataclasses.fields(part)[0].name
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(part, field, None)


def test_a_satellites_process_does_not_compile_the_plant() -> None:
    # The forces of an inertial plant are brahe's, which is slow to import.
    code = (
        "import sys; from satform.flight.compile import compile_scenario; "
        "from satform.scenario import load_scenario; "
        f"plan = compile_scenario(load_scenario({str(SCENARIOS / 'triangle_inertial.yaml')!r})); "
        "plan.satellite(0), plan.membership, plan.links, plan.topics, plan.limits; "
        "before = 'brahe' in sys.modules; plan.plant; print(before, 'brahe' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True"]


def test_a_plan_is_flown_twice_with_the_same_numbers() -> None:
    # What a frozen sensor repeats is the plant's, not the plan's.
    frozen = "faults=[{kind: frozen_sensor, satellite: raw, at: 2.0, until: 6.0}]"
    compiled = compile_scenario(shortened("noisy_navigation", 10.0, frozen)).plant
    first, second = Plant(compiled), Plant(compiled)
    told = {id(plant): [] for plant in (first, second)}
    for plant in (first, second):
        for _ in range(20):
            plant.advance(np.zeros_like(plant.applied))
            told[id(plant)].append(plant.measured().position)
    np.testing.assert_array_equal(told[id(first)], told[id(second)])


def test_every_part_gets_its_satellites_in_the_order_of_the_scenario(plan: FormationPlan) -> None:
    names = tuple(satellite.name for satellite in shipped("noisy_navigation").satellites)
    assert plan.names == plan.membership.names == plan.links.names == plan.limits.names == plan.scene.names
    assert names == plan.names == tuple(equipment.name for equipment in plan.topics.satellites)
