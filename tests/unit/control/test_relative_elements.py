# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Relative orbit elements: conversion, drift under oblateness, and control."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from control_laws import STEP, assert_a_stack_has_the_bits_of_each, held_spectral_radius
from satform.control.protocol import FlightSetting, Motion
from satform.control.relative_elements import (
    ElementControlSpec,
    elements_from_motion,
    motion_from_elements,
)
from satform.dynamics import cw
from satform.orbits.chief import KeplerianChief
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER, OBLATENESS
from satform.orbits.j2_elements import element_transition
from satform.orbits.path_reference import Reference

MEAN_MOTION = 1.08e-3
SETTING = FlightSetting(MEAN_MOTION, 10.0)

vectors = st.tuples(*[st.floats(-1e3, 1e3)] * 3).map(np.array)
angles = st.floats(-math.pi, math.pi)


def mean_rates(axis, eccentricity, inclination):
    """Secular rates of mean anomaly, argument of perigee and node, from the textbook."""
    motion = math.sqrt(GRAVITATIONAL_PARAMETER / axis**3)
    squeeze = math.sqrt(1.0 - eccentricity**2)
    factor = 1.5 * OBLATENESS * (EQUATORIAL_RADIUS / (axis * squeeze**2)) ** 2 * motion
    return np.array(
        [
            motion + factor * squeeze * (1.0 - 1.5 * math.sin(inclination) ** 2),
            factor * (2.0 - 2.5 * math.sin(inclination) ** 2),
            -factor * math.cos(inclination),
        ]
    )


@given(vectors, vectors, angles)
def test_motion_returns_from_its_elements(position, velocity, argument):
    motion = Motion(position, MEAN_MOTION * velocity)
    elements = elements_from_motion(motion, np.asarray(MEAN_MOTION), np.asarray(argument))
    back = motion_from_elements(elements, np.asarray(MEAN_MOTION), np.asarray(argument))
    assert back.position == pytest.approx(position, abs=1e-9)
    assert back.velocity == pytest.approx(motion.velocity, abs=1e-12)


@given(vectors, vectors, angles, st.floats(0.0, 2e4))
def test_free_motion_changes_no_element_but_the_longitude(position, velocity, argument, duration):
    motion, rate = Motion(position, MEAN_MOTION * velocity), np.asarray(MEAN_MOTION)
    before = elements_from_motion(motion, rate, np.asarray(argument))
    moved = Motion(*cw.propagate(motion.position, motion.velocity, MEAN_MOTION, duration))
    after = elements_from_motion(moved, rate, np.asarray(argument + MEAN_MOTION * duration))
    expected = before.as_array()
    expected[1] -= 1.5 * MEAN_MOTION * duration * expected[0]
    assert after.as_array() == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("inclination", [0.3, 0.9, 1.7])
def test_drift_is_the_difference_of_the_textbook_s_secular_rates(inclination):
    axis, duration, size = 7.1e6, 1000.0, 1e-6
    chief = mean_rates(axis, 0.0, inclination)
    transition = element_transition(KeplerianChief(axis, 0.0, inclination, 0.0, 0.0, 0.0), duration)

    def grown(axis_offset, tilt):
        deputy = mean_rates(axis * (1.0 + axis_offset), 0.0, inclination + tilt)
        anomaly, perigee, node = (deputy - chief) * duration
        return np.array(
            [
                anomaly + perigee + node * math.cos(inclination),
                node * math.sin(inclination),
            ]
        )

    for column, changes in ((0, (size, 0.0)), (4, (0.0, size))):
        found = transition[[1, 5], column] * size
        assert found == pytest.approx(grown(*changes), rel=2e-3)


def test_relative_eccentricity_turns_with_the_perigee_and_keeps_its_length():
    inclination = 1.0
    transition = element_transition(KeplerianChief(7.1e6, 0.0, inclination, 0.0, 0.0, 0.0), 86400.0)
    later = (transition @ np.array([0.0, 0.0, 300.0, 0.0, 0.0, 0.0]))[2:4]
    turn = mean_rates(7.1e6, 0.0, inclination)[1] * 86400.0
    assert later == pytest.approx(300.0 * np.array([math.cos(turn), math.sin(turn)]), abs=1e-6)


def fly(law, motion, reference_at, steps):
    plant = cw.HeldInputStep.over(MEAN_MOTION, SETTING.step)
    position, velocity = motion.position, motion.velocity
    spent = 0.0
    for step in range(steps):
        action = law.act(Motion(position, velocity), reference_at(step), None, STEP)
        spent += float(np.linalg.norm(action.acceleration)) * SETTING.step
        position, velocity = plant.advance(position, velocity, action.acceleration)
    return position, velocity, spent


def free_ellipse(step):
    angle = MEAN_MOTION * SETTING.step * step
    position = 500.0 * np.array([math.sin(angle), 2.0 * math.cos(angle), math.sin(angle)])
    velocity = 500.0 * MEAN_MOTION * np.array([math.cos(angle), -2.0 * math.sin(angle), math.cos(angle)])
    return Reference(position, velocity, np.zeros(3))


def test_every_free_ellipse_is_followed_without_any_command():
    start = free_ellipse(0)
    position, _, spent = fly(
        ElementControlSpec().build(SETTING), Motion(start.position, start.velocity), free_ellipse, 3000
    )
    assert position == pytest.approx(free_ellipse(3000).position, abs=1e-6)
    assert spent < 1e-9


def test_errors_of_all_elements_die_out_within_ten_orbits():
    start = free_ellipse(0)
    motion = Motion(
        start.position + np.array([100.0, -200.0, 50.0]), start.velocity + np.array([0.1, -0.1, 0.05])
    )
    position, velocity, _ = fly(ElementControlSpec().build(SETTING), motion, free_ellipse, 5818)
    assert position == pytest.approx(free_ellipse(5818).position, abs=1.0)
    assert velocity == pytest.approx(free_ellipse(5818).velocity, abs=1e-3)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.02, 1.0), st.floats(0.5, 5.0))
def test_loop_decays_for_every_gain_that_is_accepted(gain, orbits):
    law = ElementControlSpec(gain=gain, longitude_orbits=orbits).build(SETTING)
    assert held_spectral_radius(law, MEAN_MOTION, SETTING.step) < 1.0


def test_a_longitude_that_should_drift_home_too_fast_is_refused_in_words():
    with pytest.raises(ValueError, match=r"relative_elements: .* does not decay"):
        ElementControlSpec(gain=0.3, longitude_orbits=0.1).build(SETTING)


def test_one_law_and_a_stack_of_them_command_the_same_bits():
    assert_a_stack_has_the_bits_of_each(
        [ElementControlSpec(gain=gain, feedforward=True).build(SETTING) for gain in (0.1, 0.3)]
    )
