# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest

from satform.control.protocol import Motion
from satform.dynamics.cw_error import two_body
from satform.dynamics.relative_motion_models import relative_motion_model
from satform.orbits.chief import ChiefOrbitSpec
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.frames import lvlh_frame
from satform.planning.transfers import two_impulse_transfer, two_impulse_transfer_by_model

MOTION = 1e-4
SHORTEST = 0.15 * math.tau / MOTION


def at_rest(*position: float) -> Motion:
    return Motion(np.array(position), np.zeros(3))


def test_by_the_cw_model_it_is_the_transfer_about_a_circular_orbit() -> None:
    start, target = at_rest(0.0, -1000.0, 50.0), at_rest(100.0, -200.0, 0.0)
    expected = two_impulse_transfer(start, target, MOTION, 15e3)
    for name in ("cw", "yamanaka_ankersen"):
        model = relative_motion_model(name, ChiefOrbitSpec(argument_of_latitude=1.0).keplerian(MOTION))
        found = two_impulse_transfer_by_model(start, target, model, 777.0, 15e3)
        np.testing.assert_allclose(found.first_impulse, expected.first_impulse, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found.second_impulse, expected.second_impulse, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("anomaly", [0.0, 2.0, 3.1])
@pytest.mark.parametrize("eccentricity", [0.3, 0.7])
def test_the_impulses_reach_the_target_in_two_body_motion(eccentricity: float, anomaly: float) -> None:
    """Missed by the second order in the distance alone, and by far more with the circular model."""
    spec = ChiefOrbitSpec(eccentricity=eccentricity, argument_of_latitude=anomaly)
    position, velocity = spec.state(MOTION, GRAVITATIONAL_PARAMETER)
    start, target, misses = at_rest(3.0, -100.0, 5.0), at_rest(10.0, -20.0, 0.0), {}
    for name in ("yamanaka_ankersen", "cw"):
        model = relative_motion_model(name, spec.keplerian(MOTION))
        plan = two_impulse_transfer_by_model(start, target, model, 0.0, SHORTEST)
        frame = lvlh_frame(position, velocity)
        moved = two_body(*frame.to_inertial(start.position, plan.first_impulse), np.array([SHORTEST]))
        chief = two_body(position, velocity, np.array([SHORTEST]))
        assert moved is not None
        assert chief is not None
        reached, speed = lvlh_frame(*chief).to_lvlh(*moved)
        misses[name] = float(np.linalg.norm(reached[0] - target.position))
        if name == "yamanaka_ankersen":
            left = np.linalg.norm(speed[0] + plan.second_impulse)
            assert left < 1e-3 * np.linalg.norm(plan.second_impulse)
    assert misses["yamanaka_ankersen"] < 0.05
    assert misses["cw"] > 20.0 * misses["yamanaka_ankersen"]


def test_a_time_without_a_solution_is_refused() -> None:
    model = relative_motion_model("yamanaka_ankersen", ChiefOrbitSpec(eccentricity=0.3).keplerian(MOTION))
    place = at_rest(0.0, 10.0, 0.0)
    with pytest.raises(ValueError, match="a transfer takes a positive time, got -5 s"):
        two_impulse_transfer_by_model(place, place, model, 0.0, -5.0)
    with pytest.raises(ValueError, match="has no two-impulse solution; choose another time"):
        two_impulse_transfer_by_model(place, place, model, 0.0, math.tau / MOTION)
