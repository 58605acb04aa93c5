# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Lyapunov control of mean relative elements: convergence, delta-v, and no thrust against the periodic J2."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from control_laws import NOWHERE, assert_a_stack_has_the_bits_of_each
from satform.control.mean_element_control import MeanElementControlSpec
from satform.control.protocol import ControlStep, FlightSetting, Motion
from satform.control.relative_elements import (
    ElementControlSpec,
    RelativeElements,
    elements_from_motion,
    motion_from_elements,
)
from satform.dynamics import cw
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.truth_models import InertialDynamicsSpec
from satform.flight.simulate import simulate
from satform.numeric import stacking
from satform.orbits.chief import KeplerianChief
from satform.orbits.inertial_motion import NodalElements
from satform.orbits.path_reference import Reference
from satform.orbits.predicted_chief import PredictedChief, moved, short_period_of, state_of
from satform.scenario import load_scenario

PERIOD = 6000.0
MEAN_MOTION = math.tau / PERIOD
STEP = 30.0
SETTING = FlightSetting(MEAN_MOTION, STEP)
NOWHERE_TWICE = stacking.stack([NOWHERE, NOWHERE])
REST = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

lengths = st.floats(-300.0, 300.0)
errors = st.tuples(st.floats(-30.0, 30.0), lengths, lengths, lengths, lengths, lengths)


def flown(law, error, orbits):
    """Elements of free motion at each step under a law that wants zero, and the delta-v."""
    start = motion_from_elements(
        RelativeElements.from_array(np.array(error)), np.asarray(MEAN_MOTION), np.asarray(0.0)
    )
    plant, position, velocity = cw.HeldInputStep.over(MEAN_MOTION, STEP), start.position, start.velocity
    elements, spent = [], 0.0
    for number in range(round(orbits * PERIOD / STEP)):
        motion, argument = Motion(position, velocity), MEAN_MOTION * STEP * number
        elements.append(
            elements_from_motion(motion, np.asarray(MEAN_MOTION), np.asarray(argument)).as_array()
        )
        command = law.act(motion, NOWHERE, None, ControlStep(number, STEP)).acceleration
        spent += float(np.abs(command).sum()) * STEP
        position, velocity = plant.advance(position, velocity, command)
    return np.array(elements), spent


@pytest.mark.unmeasured
@settings(max_examples=4, deadline=None)
@given(errors, st.sampled_from([0, 2, 4]))
def test_errors_of_all_elements_die_out(error, exponent):
    law = MeanElementControlSpec(gain=2.0, longitude_orbits=2.0, exponent=exponent, elements=REST).build(
        SETTING
    )
    elements, _ = flown(law, error, 14.0)
    assert np.abs(elements[-1]).max() < 0.03 * max(1.0, *map(abs, error))


@settings(max_examples=4, deadline=None)
@given(errors)
def test_the_lyapunov_function_never_grows(error):
    law = MeanElementControlSpec(gain=2.0, longitude_orbits=1e9, elements=REST).build(SETTING)
    elements, _ = flown(law, error, 3.0)
    value = 0.5 * np.sum(elements[:, [0, 2, 3, 4, 5]] ** 2, axis=1)
    assert np.all(np.diff(value) <= 1e-9 * (1.0 + value[0]))
    assert value[-1] <= 0.3 * value[0] + 1e-9


def test_thrust_where_it_is_effective_costs_little_more_than_impulses():
    """An eccentricity vector and an inclination vector of 100 m: n/2 and n times that at least."""
    error, least = (0.0, 0.0, 0.0, 100.0, 0.0, 100.0), 1.5 * MEAN_MOTION * 100.0
    costs = [
        flown(MeanElementControlSpec(exponent=exponent, elements=REST).build(SETTING), error, 10.0)[1]
        for exponent in (0, 4, 12)
    ]
    assert least < costs[2] < costs[1] < costs[0]
    assert costs[1] < 1.15 * least
    assert costs[2] < 1.08 * least


def test_the_reference_says_what_is_wanted_where_no_elements_are_given():
    wanted = RelativeElements.from_array(np.array([0.0, 100.0, 50.0, -80.0, 20.0, 150.0]))
    motion = motion_from_elements(wanted, np.asarray(MEAN_MOTION), np.asarray(MEAN_MOTION * 65 * STEP))
    reference = Reference(motion.position, motion.velocity, np.zeros(3))
    law = MeanElementControlSpec().build(SETTING)
    command = law.act(motion, reference, None, ControlStep(65, STEP)).acceleration
    assert command == pytest.approx(np.zeros(3), abs=1e-15)
    given = MeanElementControlSpec(elements=tuple(wanted.as_array().tolist())).build(SETTING)
    moved = Motion(motion.position + 10.0, motion.velocity + 0.01)
    by_elements = given.act(moved, NOWHERE, None, ControlStep(65, STEP)).acceleration
    by_reference = law.act(moved, reference, None, ControlStep(65, STEP)).acceleration
    assert by_elements == pytest.approx(by_reference, rel=1e-9)
    assert np.abs(by_elements[1:]).min() > 1e-7


CHIEF = KeplerianChief(7.1e6, 0.0, math.acos(math.sqrt(0.2)), 0.5, 0.0, 0.3)
"""On an osculating circle; at this inclination J2 does not turn the eccentricity vector."""


@pytest.mark.unmeasured
def test_at_rest_on_mean_elements_under_j2_it_spends_far_less_than_the_law_of_osculating_elements():
    """Both start on the same mean elements; the reference of the other law turns at the chief's mean rate."""
    wanted = np.array([0.0, 0.0, 0.0, 300.0, 0.0, 300.0])
    setting = FlightSetting(CHIEF.mean_motion, STEP, chief=CHIEF)
    predicted = PredictedChief.of(CHIEF, oblate=True)
    mean = predicted.at(0.0).mean
    offset = wanted / float(mean.semi_major_axis)
    deputy = NodalElements(
        mean.semi_major_axis,
        mean.inclination,
        mean.right_ascension + offset[5] / math.sin(mean.inclination),
        mean.eccentricity + offset[2:4],
        mean.mean_argument - offset[5] / math.tan(mean.inclination),
    )
    position, velocity = predicted.at(0.0).frame.to_lvlh(*state_of(moved(deputy, short_period_of(deputy))))

    def reference(time):
        argument = predicted.at(time).mean.mean_argument
        elements = RelativeElements.from_array(wanted)
        motion = motion_from_elements(elements, np.asarray(CHIEF.mean_motion), argument)
        return Reference(motion.position, motion.velocity, np.zeros(3))

    laws = (
        MeanElementControlSpec(elements=tuple(wanted.tolist())).build(setting),
        ElementControlSpec().build(setting),
    )
    of_mean, of_osculating = under_j2(laws, position, velocity, reference, 2.0)
    assert of_mean < 3e-5
    assert of_osculating > 3e-3
    assert of_mean < 0.01 * of_osculating


def under_j2(laws, position, velocity, reference, orbits):
    """Delta-v per orbit (m/s) of satellites that start from one motion under two-body gravity and J2."""
    spec = InertialDynamicsSpec.model_validate(
        {
            "chief": {
                "inclination": CHIEF.inclination,
                "right_ascension": CHIEF.right_ascension,
                "argument_of_latitude": CHIEF.mean_anomaly,
            },
            "gravity": {"degree": 2, "order": 0, "earth_angle": 0.0},
            "integrator": {"kind": "rk4", "maximum_step": 30.0},
        }
    )
    truth = spec.build(DynamicsSetting(CHIEF.mean_motion, STEP, len(laws)))
    state = truth.start(np.stack([position] * len(laws)), np.stack([velocity] * len(laws)))
    spent = np.zeros(len(laws))
    for number in range(round(orbits * CHIEF.period / STEP)):
        motions, step = truth.lvlh(state), ControlStep(number, STEP)
        desired = reference(step.time)
        commands = np.array(
            [
                law.act(Motion(motions[0][row], motions[1][row]), desired, None, step).acceleration
                for row, law in enumerate(laws)
            ]
        )
        spent += np.abs(commands).sum(axis=1) * STEP
        state = truth.advance(state, commands, number)
    return spent / orbits


def test_one_law_and_a_stack_of_them_command_the_same_bits():
    setting = FlightSetting(CHIEF.mean_motion, STEP, chief=CHIEF)
    specs = [
        MeanElementControlSpec(gain=0.5, elements=(0.0, 10.0, 20.0, 30.0, 40.0, 50.0)),
        MeanElementControlSpec(gain=1.0, exponent=2),
        MeanElementControlSpec(gain=2.0, longitude_orbits=1.5),
    ]
    assert_a_stack_has_the_bits_of_each([spec.build(setting) for spec in specs])
    assert_a_stack_has_the_bits_of_each([spec.build(SETTING) for spec in specs])


def test_without_oblateness_the_elements_are_those_of_two_bodies():
    """To first order in the distance they are those of free motion at the chief's argument of latitude."""
    setting = FlightSetting(CHIEF.mean_motion, STEP, chief=CHIEF)
    law = MeanElementControlSpec(elements=REST, oblateness=False).build(setting)
    moved = Motion(np.array([3.0, -20.0, 5.0]), np.array([2e-3, -3e-3, -1e-2]))
    found = law.act(moved, NOWHERE, None, ControlStep(0, STEP)).acceleration
    free = MeanElementControlSpec(elements=REST).build(FlightSetting(CHIEF.mean_motion, STEP))
    there = ControlStep(1, CHIEF.mean_anomaly / CHIEF.mean_motion)
    assert found == pytest.approx(free.act(moved, NOWHERE, None, there).acceleration, rel=1e-4)
    assert np.abs(found[1:]).min() > 1e-7


@pytest.mark.parametrize("oblateness", [True, False])
@pytest.mark.parametrize("speed", [5000.0, math.nan])
def test_a_satellite_on_no_ellipse_has_no_finite_command_and_those_beside_it_have_theirs(speed, oblateness):
    setting = FlightSetting(CHIEF.mean_motion, STEP, chief=CHIEF)
    spec = MeanElementControlSpec(elements=REST, oblateness=oblateness)
    law, step = spec.build(setting), ControlStep(0, STEP)
    positions, velocities = np.array([[3.0, -20.0, 5.0]] * 2), np.array([[0.0, speed, 0.0], [0.0, 2e-3, 0.0]])
    both = stacking.stack([law, law]).act(Motion(positions, velocities), NOWHERE_TWICE, None, step)
    alone = law.act(Motion(positions[1], velocities[1]), NOWHERE, None, step).acceleration
    assert math.isnan(both.acceleration[0, 1])
    assert both.acceleration[1].tobytes() == alone.tobytes()
    assert np.abs(alone[1:]).min() > 0.0


@pytest.mark.parametrize("below", [1e-3, 1.0, 10.0, 1000.0])
def test_on_any_ellipse_a_command_is_computed_or_is_not_a_number(below):
    """Up to the parabola, close to which Kepler's equation has no solution in double precision."""
    law = MeanElementControlSpec(elements=REST).build(FlightSetting(CHIEF.mean_motion, STEP, chief=CHIEF))
    circular = CHIEF.mean_motion * CHIEF.semi_major_axis
    motion = Motion(np.zeros(3), np.array([0.0, (math.sqrt(2.0) - 1.0) * circular - below, 0.0]))
    command = law.act(motion, NOWHERE, None, ControlStep(0, STEP)).acceleration
    assert command[1] < 0.0 or math.isnan(command[1])
    assert below < 1000.0 or np.isfinite(command).all()


def test_a_flight_of_a_satellite_on_no_ellipse_ends_with_a_sentence():
    path = Path(__file__).parents[3] / "scenarios" / "mean_elements.yaml"
    changes = {"timing.duration": 600.0, "satellites[moved].velocity_error": (0.0, 5000.0, 0.0)}
    end = simulate(load_scenario(path).with_(changes)).early_end
    assert end is not None
    assert (end.satellite, end.quantity, end.step) == ("moved", "commanded acceleration", 0)
    assert math.isnan(end.value)


def test_a_gain_that_overshoots_in_a_step_is_refused_in_words():
    with pytest.raises(ValueError, match=r"gain 40 with steps of 30 s corrects more .* at most 31\.83"):
        MeanElementControlSpec(gain=40.0).build(SETTING)


def test_a_chief_over_the_equator_is_refused_in_words():
    flat = KeplerianChief(7.1e6, 0.0, 0.0, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="inclination 0 rad leaves its orbit without a node"):
        MeanElementControlSpec().build(FlightSetting(MEAN_MOTION, STEP, chief=flat))
