# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Integral action beside any law: what it removes, how far it goes, which gains it refuses."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.linalg import expm

from control_laws import NOWHERE, STEP, assert_a_stack_has_the_bits_of_each
from satform.control.feedback_linearisation import FeedbackLinearisationSpec
from satform.control.integral_action import IntegralSpec
from satform.control.lqr import LqrSpec, design_lqr
from satform.control.observer import ObserverSpec
from satform.control.protocol import FlightSetting, Motion
from satform.control.relative_elements import ElementControlSpec
from satform.control.sampled_stability import closed_loop
from satform.control.sliding_mode import SlidingModeSpec
from satform.dynamics import cw
from satform.orbits.path_reference import Reference

GEO = FlightSetting(2.0 * math.pi / 86164.0, 10.0)
LEO = FlightSetting(2.0 * math.pi / 6000.0, 5.0)
LAYERED = SlidingModeSpec(switching_gain=1e-3, reaching_gain=0.01, boundary_layer=0.1)
"""Keeps an error of 0.1 D / (1e-3 + 0.01 * 0.1) / 0.01 = 5000 D under a constant disturbance D."""

PARALLEL = Reference(np.array([200e3, 0.0, 0.0]), np.zeros(3), np.zeros(3))
BESIDE = {
    "lqr": (LqrSpec(), GEO, 1e-7),
    "lqr on positions": (ObserverSpec(law=LqrSpec()), GEO, 1e-7),
    "feedback_linearisation": (FeedbackLinearisationSpec(natural_frequency=0.01), LEO, 2e-7),
    "hill_pd on positions": (ObserverSpec(law=FeedbackLinearisationSpec()), LEO, 2e-7),
    "sliding_mode": (LAYERED, LEO, 6e-7),
}


def fly(law, setting, reference, disturbance, seconds, position=None):
    """Position, velocity and last action of a law on the exact plant under a constant acceleration."""
    plant = cw.HeldInputStep.over(setting.mean_motion, setting.step)
    place = reference.position if position is None else position
    moving = np.zeros(3)
    memory = law.start(Motion(place, moving))
    for _ in range(round(seconds / setting.step)):
        action = law.act(Motion(place, moving), reference, memory, STEP)
        memory = action.memory
        place, moving = plant.advance(place, moving, action.acceleration + disturbance)
    return place, moving, memory


def test_it_removes_the_offset_that_the_regulator_leaves_on_a_parallel_orbit():
    bare, _, _ = fly(LqrSpec().build(GEO), GEO, PARALLEL, np.zeros(3), 12000.0)
    assert (bare - PARALLEL.position)[:2] == pytest.approx([43.7495, -0.5284], rel=1e-3)
    joined, _, memory = fly(IntegralSpec().build(GEO), GEO, PARALLEL, np.zeros(3), 12000.0)
    assert joined == pytest.approx(PARALLEL.position, abs=1e-5)
    # What is left to command there is the thrust that holds a place 200 km further out.
    assert memory.acceleration == pytest.approx([-3.190504e-3, 0.0, 0.0], rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("name", sorted(BESIDE))
@settings(max_examples=3, deadline=None)
@given(st.tuples(*[st.floats(-1e-4, 1e-4)] * 3).map(np.array))
def test_beside_any_law_it_comes_to_cancel_any_constant_disturbance(name, disturbance):
    law, setting, gain = BESIDE[name]
    spec = IntegralSpec(law=law, gain=gain, limit=1e-3)
    place, _, memory = fly(spec.build(setting), setting, NOWHERE, disturbance, 12000.0)
    assert place == pytest.approx(0.0, abs=1e-5)
    assert memory.acceleration == pytest.approx(-disturbance, abs=1e-9)


def test_sliding_mode_in_its_boundary_layer_and_hill_pd_leave_without_it_what_theory_says():
    disturbance = np.array([1e-4, -5e-5, 2e-5])
    layered, _, _ = fly(LAYERED.build(LEO), LEO, NOWHERE, disturbance, 4000.0)
    assert layered == pytest.approx(5000.0 * disturbance, rel=1e-3)
    spring, _, _ = fly(
        FeedbackLinearisationSpec(natural_frequency=0.01).build(LEO), LEO, NOWHERE, disturbance, 4000.0
    )
    assert spring == pytest.approx(disturbance / 0.01**2, rel=1e-3)


def test_a_disturbance_beyond_the_limit_leaves_the_offset_of_what_exceeds_it():
    spec = IntegralSpec(law=FeedbackLinearisationSpec(natural_frequency=0.01), gain=2e-7, limit=6e-5)
    push = np.array([1e-4, -1e-4, 3e-5])
    place, _, memory = fly(spec.build(LEO), LEO, NOWHERE, push, 8000.0)
    assert memory.acceleration == pytest.approx([-6e-5, 6e-5, -3e-5], abs=1e-10)
    assert place == pytest.approx(np.array([4e-5, -4e-5, 0.0]) / 0.01**2, abs=1e-4)


def test_at_its_limit_nothing_winds_up():
    law = IntegralSpec(law=FeedbackLinearisationSpec(natural_frequency=0.01), gain=2e-7, limit=1e-5).build(
        LEO
    )
    long, _, stuck = fly(law, LEO, NOWHERE, np.array([1e-3, 0.0, 0.0]), 8000.0)
    _, _, sooner = fly(law, LEO, NOWHERE, np.array([1e-3, 0.0, 0.0]), 4000.0)
    assert stuck.acceleration[0] == sooner.acceleration[0] == -1e-5
    assert long == pytest.approx([(1e-3 - 1e-5) / 1e-4, 0.0, 0.0], abs=1e-3)


def test_on_the_way_from_afar_an_axis_out_of_reach_is_not_integrated():
    law = IntegralSpec(
        law=FeedbackLinearisationSpec(natural_frequency=0.01), gain=2e-7, integration_band=(10.0, 10.0, 30.0)
    ).build(LEO)
    start = law.start(Motion(np.zeros(3), np.zeros(3)))
    far = Motion(np.array([11.0, -9.0, 20.0]), np.zeros(3))
    grown = law.act(far, NOWHERE, start, STEP).memory.acceleration
    assert grown == pytest.approx([0.0, 2e-7 * 5.0 * 9.0, -2e-7 * 5.0 * 20.0], rel=1e-12)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.003, 0.03), st.floats(0.3, 2.0), st.sampled_from([0.9, 1.1]))
def test_a_gain_is_refused_from_the_product_of_stiffness_and_damping_on(frequency, damping_ratio, share):
    # Routh: s^3 + damping s^2 + stiffness s + gain is stable up to gain = damping stiffness.
    largest = 2.0 * damping_ratio * frequency * frequency**2
    spec = IntegralSpec(
        law=FeedbackLinearisationSpec(natural_frequency=frequency, damping_ratio=damping_ratio),
        gain=share * largest,
    )
    setting = FlightSetting(LEO.mean_motion, 1e-3 / frequency)
    if share < 1.0:
        spec.build(setting)
    else:
        with pytest.raises(ValueError, match=r"integral beside feedback_linearisation: .* does not decay"):
            spec.build(setting)


def test_the_loop_found_by_trying_the_regulator_is_that_of_its_matrices():
    gain, state, held = design_lqr(GEO.mean_motion), *cw.system_matrices(GEO.mean_motion)
    augmented = np.block([[state, held], [np.zeros((3, 9))]])
    over_step = expm(augmented * GEO.step)
    expected = over_step[:6, :6] - over_step[:6, 6:] @ gain
    found = closed_loop(LqrSpec().build(GEO), GEO)
    # Beside it the last command, which this law has no use for.
    assert found[:6, :6] == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert found[6:, :6] == pytest.approx(-gain, rel=1e-6)
    assert not found[:, 6:].any()


def test_a_law_that_switches_is_not_taken_for_a_linear_one():
    assert closed_loop(SlidingModeSpec().build(LEO), LEO) is None
    IntegralSpec(law=SlidingModeSpec()).build(LEO)


def test_element_control_takes_integral_action_across_the_orbital_plane_and_refuses_it_within():
    push = np.array([0.0, 0.0, 1e-6])
    law, slow = ElementControlSpec(), FlightSetting(LEO.mean_motion, 60.0)
    bare, _, _ = fly(law.build(slow), slow, NOWHERE, push, 60000.0)
    assert bare[2] == pytest.approx(1e-6 / LEO.mean_motion**2, rel=1e-3)
    joined = IntegralSpec(law=law, gain=(0.0, 0.0, 1e-10)).build(slow)
    place, _, memory = fly(joined, slow, NOWHERE, push, 120000.0)
    assert memory.acceleration == pytest.approx(-push, abs=1e-10)
    assert place == pytest.approx(0.0, abs=1e-3)
    for gain in ((1e-13, 0.0, 1e-10), (0.0, 1e-13, 0.0)):
        with pytest.raises(ValueError, match="integral beside relative_elements"):
            IntegralSpec(law=law, gain=gain).build(slow)


def test_an_axis_without_gain_is_left_to_the_law_alone():
    spec = IntegralSpec(law=FeedbackLinearisationSpec(natural_frequency=0.01), gain=(2e-7, 0.0, 2e-7))
    place, _, memory = fly(spec.build(LEO), LEO, NOWHERE, np.full(3, 1e-4), 8000.0)
    assert place == pytest.approx([0.0, 1.0, 0.0], abs=1e-3)
    assert memory.acceleration[1] == 0.0


@pytest.mark.parametrize(("field", "lowest"), [("gain", -1e-9), ("limit", 0.0), ("integration_band", 0.0)])
def test_a_negative_gain_and_a_limit_or_reach_of_nothing_are_refused(field, lowest):
    with pytest.raises(ValidationError, match=field):
        IntegralSpec(**{field: (1.0, lowest, 1.0)})


def test_one_alone_and_a_stack_of_them_command_the_same_bits():
    specs = [
        IntegralSpec(law=ObserverSpec(initial_position_error=(e, 0.0, 0.0)), gain=e * 1e-8)
        for e in (1.0, 7.0)
    ]
    assert_a_stack_has_the_bits_of_each([spec.build(GEO) for spec in specs], steps=5)
