# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What `check` says of model-predictive laws before a flight."""

import pytest

from flights import shipped
from satform_tools.check.predictive_plans import predictive_plan_warnings

AROUND = "satellites.1.controller"


def said(*overrides: str) -> list[str]:
    return predictive_plan_warnings(shipped("keep_out_transfer", *overrides))


def test_the_shipped_scenario_can_do_what_it_wants() -> None:
    assert said() == []


def test_a_start_from_which_the_box_cannot_be_reached_in_time_is_said() -> None:
    # 300 m from rest to rest in 400 s takes 4 x 300 / 400^2 = 7.5 mm/s^2.
    (sentence,) = said(f"{AROUND}.arrival_time=400.0", f"{AROUND}.keep_out=[]")
    assert sentence.startswith("controller of around: its first plan is up to ")
    assert "m outside of its box at or after 400 s; arrive later, allow more thrust" in sentence


def test_a_start_within_a_region_is_said() -> None:
    inside, plan = said("satellites.1.position_error=[0.0, -120.0, 0.0]")
    assert inside == "controller of around: it starts 30 m inside keep_out[0], sphere"
    assert plan.startswith("controller of around: its first plan is up to ")
    assert "m within a keep_out" in plan


def test_a_reference_within_a_region_is_said() -> None:
    keep_out = f"{AROUND}.keep_out=[{{kind: half_space, normal: [0.0, -1.0, 0.0], offset: -90.0}}]"
    assert said(keep_out)[0] == "controller of around: its reference is 10 m inside keep_out[0], half_space"


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        (
            f"{AROUND}.iterations=3",
            "its first plan is not solved in 3 iterations, so that nothing is commanded",
        ),
        (f"{AROUND}.interval=62.0", "its interval of 62 s is rounded to 60 s, whole steps"),
        (f"{AROUND}.horizon=3010.0", "its horizon of 3010 s is rounded to 3000 s, whole intervals"),
        (
            f"{AROUND}.arrival_time=3600.0",
            "its arrival_time of 3600 s is after its first horizon of 3000 s; it commands nothing "
            "before 600 s",
        ),
        (
            "satellites.1.thruster={dry_mass: 40.0, propellant: 10.0, maximum_thrust: 0.025,"
            " specific_impulse: 60}",
            "its plans use up to 0.001 m/s^2 (maximum_acceleration), 2 times what its thrusters can "
            "apply with a full tank, 0.0005 m/s^2",
        ),
    ],
)
def test_what_is_not_flown_as_it_is_written_is_said(override: str, sentence: str) -> None:
    assert f"controller of around: {sentence}" in said(override)
