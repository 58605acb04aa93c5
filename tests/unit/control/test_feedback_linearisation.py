# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Proportional-derivative control about cancelled Hill dynamics."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from control_laws import NOWHERE, STEP, assert_a_stack_has_the_bits_of_each, held_spectral_radius
from satform.control.feedback_linearisation import FeedbackLinearisationSpec
from satform.control.protocol import FlightSetting, Motion
from satform.dynamics import cw
from satform.orbits.path_reference import Reference

MEAN_MOTION = 1.1e-3
SETTING = FlightSetting(MEAN_MOTION, 1.0)


def test_error_decays_as_the_critically_damped_oscillator_in_closed_form():
    law = FeedbackLinearisationSpec(natural_frequency=(0.01, 0.01, 0.01)).build(SETTING)
    start = np.array([100.0, -40.0, 20.0, 0.0, 0.0, 0.0])

    def rate(_time, state):
        motion = Motion(state[:3], state[3:])
        push = law.act(motion, NOWHERE, None, STEP).acceleration
        return np.concatenate((state[3:], cw.acceleration(state[:3], state[3:], MEAN_MOTION) + push))

    times = np.linspace(0.0, 800.0, 9)
    flown = solve_ivp(rate, (0.0, 800.0), start, t_eval=times, rtol=1e-10, atol=1e-10).y[:3].T
    expected = ((1.0 + 0.01 * times) * np.exp(-0.01 * times))[:, None] * start[:3]
    assert flown == pytest.approx(expected, abs=1e-6)


def test_satellite_on_a_free_orbit_that_is_its_reference_gets_no_command():
    law = FeedbackLinearisationSpec().build(SETTING)
    position, velocity = np.array([100.0, 0.0, 50.0]), np.array([0.0, -200.0 * MEAN_MOTION, 0.0])
    acceleration = -(MEAN_MOTION**2) * position
    action = law.act(Motion(position, velocity), Reference(position, velocity, acceleration), None, STEP)
    assert np.abs(action.acceleration).max() < 1e-15


@settings(max_examples=50, deadline=None)
@given(
    st.tuples(*[st.floats(1e-4, 0.2)] * 3),
    st.tuples(*[st.floats(0.2, 2.0)] * 3),
    st.floats(1e-4, 1.2e-3),
)
def test_sampled_loop_decays_for_every_gain_that_is_accepted(frequency, damping, mean_motion):
    setting = FlightSetting(mean_motion, 1.0)
    law = FeedbackLinearisationSpec(natural_frequency=frequency, damping_ratio=damping).build(setting)
    assert held_spectral_radius(law, mean_motion, 1.0) < 1.0


def test_a_frequency_beyond_what_the_step_allows_is_refused_in_words():
    with pytest.raises(ValueError, match="feedback_linearisation: with the command held for 1 s"):
        FeedbackLinearisationSpec(natural_frequency=(3.0, 3.0, 3.0)).build(SETTING)


def test_one_law_and_a_stack_of_them_command_the_same_bits():
    assert_a_stack_has_the_bits_of_each(
        [FeedbackLinearisationSpec(natural_frequency=f).build(SETTING) for f in (0.01, 0.02)]
    )
