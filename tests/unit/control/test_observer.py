# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""State estimation from positions, alone and with a control law on top."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.linalg import expm

from control_laws import STEP, assert_a_stack_has_the_bits_of_each
from satform.control.feedback_linearisation import FeedbackLinearisationSpec
from satform.control.lqi import LqiSpec
from satform.control.lqr import LqrSpec
from satform.control.observer import ObserverSpec, observer_gain
from satform.control.protocol import ControlStep, FlightSetting, Gap, Motion
from satform.dynamics import cw
from satform.dynamics.relative_motion_models import input_matrix, relative_motion_model
from satform.orbits.chief import ChiefOrbitSpec
from satform.orbits.path_reference import Reference

MEAN_MOTION = 2.0 * math.pi / 86164.0
SETTING = FlightSetting(MEAN_MOTION, 1.0)
DECAY_RATES = (0.050, 0.052, 0.054, 0.056, 0.058, 0.060)
TARGET = Reference(np.array([2e3, -1e3, 500.0]), np.zeros(3), np.zeros(3))


def continuous_error_system():
    state, _ = cw.system_matrices(MEAN_MOTION)
    output = np.hstack((np.eye(3), np.zeros((3, 3))))
    return state - observer_gain(state, tuple(-rate for rate in DECAY_RATES)) @ output


def fly(law, start, steps, blind_to_velocity=False, setting=SETTING):
    """Flown positions and estimates of a law under observation on the exact plant."""
    plant = cw.HeldInputStep.over(setting.mean_motion, setting.step)
    position, velocity = start
    memory = law.start(Motion(position, velocity))
    flown, estimated = [np.concatenate(start)], [np.concatenate((memory.position, memory.velocity))]
    for _ in range(steps):
        seen = np.full(3, np.nan) if blind_to_velocity else velocity
        action = law.act(Motion(position, seen), TARGET, memory, STEP)
        memory = action.memory
        position, velocity = plant.advance(position, velocity, action.acceleration)
        flown.append(np.concatenate((position, velocity)))
        estimated.append(np.concatenate((memory.position, memory.velocity)))
    return np.array(flown), np.array(estimated)


START = (np.array([1e3, 2e3, -1e3]), np.array([1.0, -2.0, 0.5]))


def test_estimation_error_has_the_wanted_spectrum():
    found = np.sort(np.linalg.eigvals(continuous_error_system()).real)
    assert found == pytest.approx(-np.array(DECAY_RATES[::-1]), rel=1e-6)


@pytest.mark.parametrize(("time", "expected"), [(60.0, 157.1), (120.0, 16.27), (300.0, 0.0036)])
def test_estimation_error_from_a_kilometre_per_axis_shrinks_at_the_reference_rate(time, expected):
    start = np.array([1e3, 1e3, 1e3, 0.0, 0.0, 0.0])
    error = np.linalg.norm((expm(continuous_error_system() * time) @ start)[:3])
    assert expected / 3.0 < error < expected * 3.0


def test_flown_estimation_error_shrinks_at_the_reference_rate():
    spec = ObserverSpec(initial_position_error=(1e3, 1e3, 1e3))
    flown, estimated = fly(spec.build(SETTING), START, 300)
    error = np.linalg.norm((estimated - flown)[:, :3], axis=1)
    assert error[0] == pytest.approx(1e3 * math.sqrt(3.0))
    assert 157.1 / 3.0 < error[60] < 157.1 * 3.0
    assert 16.27 / 3.0 < error[120] < 16.27 * 3.0
    assert error[300] < 0.0036 * 3.0


def test_error_of_the_estimate_does_not_depend_on_what_is_commanded():
    errors = []
    for law in (LqrSpec(), LqiSpec(), FeedbackLinearisationSpec()):
        spec = ObserverSpec(law=law, initial_position_error=(10.0, -20.0, 30.0))
        flown, estimated = fly(spec.build(SETTING), START, 100)
        errors.append(estimated - flown)
    assert errors[1] == pytest.approx(errors[0], abs=1e-9)
    assert errors[2] == pytest.approx(errors[0], abs=1e-9)


def test_an_exact_first_estimate_stays_exact_and_flies_as_the_law_alone():
    flown, estimated = fly(ObserverSpec().build(SETTING), START, 500)
    assert estimated == pytest.approx(flown, abs=1e-8)
    law, plant = LqrSpec().build(SETTING), cw.HeldInputStep.over(MEAN_MOTION, 1.0)
    position, velocity = START
    for _ in range(500):
        push = law.act(Motion(position, velocity), TARGET, None, STEP).acceleration
        position, velocity = plant.advance(position, velocity, push)
    assert position == pytest.approx(flown[-1, :3], abs=1e-8)


def test_measured_velocity_is_not_used():
    flown, _ = fly(ObserverSpec().build(SETTING), START, 50, blind_to_velocity=True)
    assert np.all(np.isfinite(flown))


def test_observed_integral_law_reaches_the_target_without_offset():
    spec = ObserverSpec(law=LqiSpec(), initial_position_error=(100.0, 100.0, 100.0))
    flown, _ = fly(spec.build(SETTING), START, 3000)
    assert flown[-1, :3] == pytest.approx(TARGET.position, abs=1e-3)


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.integers(1, 60), min_size=6, max_size=6, unique=True),
    st.floats(6e-5, 1.2e-3),
    st.sampled_from([0.1, 1.0, 5.0]),
)
def test_any_distinct_decay_rates_are_met_in_flight(hundredths, mean_motion, step):
    rates = tuple(sorted(rate / 200.0 for rate in hundredths))
    law = ObserverSpec(decay_rates=rates, law=LqrSpec(command_weight=10.0)).build(
        FlightSetting(mean_motion, step)
    )
    output = np.hstack((np.eye(3), np.zeros((3, 3))))
    transition = cw.transition_matrix(mean_motion, step)
    found = np.sort(
        np.linalg.eigvals(transition - np.vstack((law.position_gain, law.velocity_gain)) @ output).real
    )
    assert -np.log(found[::-1]) / step == pytest.approx(np.array(rates), rel=1e-3)


def test_equal_decay_rates_are_refused_in_words():
    with pytest.raises(ValueError, match="decay_rates have to differ"):
        ObserverSpec(decay_rates=(0.05,) * 6).build(SETTING)


def test_a_decay_rate_of_zero_is_refused():
    with pytest.raises(ValidationError, match="decay_rates"):
        ObserverSpec(decay_rates=(0.0, 0.05, 0.06, 0.07, 0.08, 0.09))


def test_one_observer_and_a_stack_of_them_command_the_same_bits():
    specs = [ObserverSpec(law=LqiSpec(), initial_position_error=(e, 0.0, 0.0)) for e in (1.0, 50.0)]
    assert_a_stack_has_the_bits_of_each([spec.build(SETTING) for spec in specs], steps=5)


def worst_estimate(model, truth, chief):
    """Largest error, m, of an estimate that starts exact, over a loss in between; truth is a linear model."""
    law = ObserverSpec(model=model).build(FlightSetting(chief.mean_motion, 5.0, chief=chief))
    state, applied = np.array([300.0, -500.0, 200.0, 0.1, 0.2, -0.1]), np.zeros(3)
    memory, worst = law.start(Motion(state[:3], state[3:])), 0.0
    for number in range(40):
        seen = Motion(state[:3], np.full(3, np.nan))
        if number == 25:
            memory = law.resume(memory, Gap(20, 5, 5.0, applied, seen))
        if not 20 <= number < 25:
            worst = max(worst, float(np.linalg.norm(memory.position - state[:3])) if number != 20 else 0.0)
            memory = law.act(seen, TARGET, memory, ControlStep(number, 5.0, applied, applied)).memory
            applied = memory.commanded
        else:
            applied = np.zeros(3)
        begin, end = 5.0 * number, 5.0 * (number + 1)
        held = input_matrix(truth, begin, end) @ applied
        state = truth.transition(begin, end) @ state + held
    return worst


@pytest.mark.parametrize("name", ["yamanaka_ankersen", "j2_elements"])
def test_by_the_model_of_its_chief_an_exact_estimate_stays_exact(name):
    chief = ChiefOrbitSpec(eccentricity=0.6, argument_of_latitude=0.5).keplerian(4e-4)
    truth = relative_motion_model(name, chief)
    # The effect of J2 on what a command does within a step is left out, of commands of 1 m/s^2.
    assert worst_estimate(name, truth, chief) < (1e-3 if name == "j2_elements" else 1e-9)
    assert worst_estimate("cw", truth, chief) > 1.0


def test_on_yamanaka_and_ankersen_s_model_a_stack_has_the_bits_of_each():
    chief = ChiefOrbitSpec(eccentricity=0.6, argument_of_latitude=0.5).keplerian(4e-4)
    setting = FlightSetting(4e-4, 5.0, chief=chief)
    specs = [
        ObserverSpec(model="yamanaka_ankersen", initial_position_error=(e, 0.0, 0.0)) for e in (1.0, 50.0)
    ]
    assert_a_stack_has_the_bits_of_each([spec.build(setting) for spec in specs])
