# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Gains and poles of control laws, against closed forms and against other computations."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from satform.control.feedback_gains import feedback, sampled_poles, state_gain
from satform.control.feedback_linearisation import FeedbackLinearisationSpec
from satform.control.integral_action import IntegralSpec
from satform.control.lqi import LqiSpec, design_lqi
from satform.control.lqr import LqrSpec, design_lqr
from satform.control.observer import ObserverSpec
from satform.control.protocol import FlightSetting
from satform.control.sampled_stability import closed_loop, spectral_radius
from satform.control.sliding_mode import SlidingModeSpec

MOTION = 1.1e-3
SETTING = FlightSetting(MOTION, 2.0)


def found(spec, setting=SETTING):
    result = feedback(spec.build(setting), setting)
    assert result is not None
    return result


def held(state, command, step):
    """Transition and input matrix over a held command, by the exponential of both together."""
    size = len(state)
    both = np.zeros((size + command.shape[1],) * 2)
    both[:size, :size], both[:size, size:] = state, command
    moved = expm(both * step)
    return moved[:size, :size], moved[:size, size:]


def test_the_gain_of_a_regulator_across_the_orbit_is_the_closed_form_s():
    # z'' = -n^2 z + u with cost q z^2 + v z'^2 + r u^2: its Riccati equation is solved by hand.
    position, velocity, effort = 0.5, 0.05, 0.5 / MOTION**2
    stiffness = -(MOTION**2) + math.sqrt(MOTION**4 + position / effort)
    damping = math.sqrt(2.0 * stiffness + velocity / effort)
    result = found(LqrSpec())
    assert result.gain[2] == pytest.approx([0.0, 0.0, stiffness, 0.0, 0.0, damping], rel=1e-9, abs=1e-15)
    state = np.array([[0.0, 1.0], [-(MOTION**2), 0.0]])
    transition, command = held(state, np.array([[0.0], [1.0]]), SETTING.step)
    loop = transition - command @ np.array([[stiffness, damping]])
    for pole in np.log(np.linalg.eigvals(loop).astype(complex)) / SETTING.step:
        assert min(abs(other - pole) for other in result.poles) < 1e-9
    # With a shorter step they come to those of continuous time.
    short = FlightSetting(MOTION, 1e-3)
    continuous = np.roots([1.0, damping, MOTION**2 + stiffness])
    for pole in continuous:
        assert min(abs(other - pole) for other in found(LqrSpec(), short).poles) < 1e-6


@pytest.mark.parametrize(("spec", "gain"), [(LqrSpec(), design_lqr(MOTION)), (LqiSpec(), design_lqi(MOTION))])
def test_the_gain_of_a_regulator_is_the_designed_one(spec, gain):
    result = found(spec)
    assert result.gain == pytest.approx(gain, rel=1e-9, abs=1e-15)
    assert len(result.poles) == gain.shape[1]
    assert all(pole.real < 0.0 for pole in result.poles)


def test_the_poles_of_feedback_linearisation_are_those_of_its_oscillators():
    spec = FeedbackLinearisationSpec(natural_frequency=(0.01, 0.02, 0.04), damping_ratio=(1.5, 0.5, 0.2))
    result = found(spec, FlightSetting(MOTION, 1e-3))
    wanted = [
        root
        for w, d in ((0.01, 1.5), (0.02, 0.5), (0.04, 0.2))
        for root in np.roots([1.0, 2.0 * d * w, w * w])
    ]
    assert len(result.poles) == 6
    for pole in wanted:
        assert min(abs(other - pole) for other in result.poles) < 1e-5
    assert [pole.real for pole in result.poles] == sorted((pole.real for pole in result.poles), reverse=True)
    # The natural acceleration is cancelled: 3 n^2 in x is on top of the stiffness.
    assert result.gain[0, 0] == pytest.approx(1e-4 + 3.0 * MOTION**2, rel=1e-9)
    assert result.gain[0, 4] == pytest.approx(2.0 * MOTION, rel=1e-9)


def test_an_observer_and_the_law_on_it_keep_their_own_poles():
    rates = (0.02, 0.025, 0.03, 0.035, 0.04, 0.045)
    spec = ObserverSpec(law=LqrSpec(), decay_rates=rates)
    result, alone = found(spec), found(LqrSpec())
    assert result.observer_poles == pytest.approx([-rate for rate in rates], rel=1e-6)
    assert result.gain == pytest.approx(alone.gain)
    assert result.poles == pytest.approx(alone.poles, rel=1e-9)
    whole = closed_loop(spec.build(SETTING), SETTING)
    assert whole is not None
    both = sampled_poles(whole, SETTING.step)
    assert len(both) == 12
    for pole in (*result.poles, *result.observer_poles):
        assert min(abs(other - pole) for other in both) < 1e-5 * abs(pole)


def test_a_sliding_mode_law_has_a_gain_within_its_boundary_layer_alone():
    assert feedback(SlidingModeSpec().build(SETTING), SETTING) is None
    spec = SlidingModeSpec(
        proportional_gain=(0.01,) * 3,
        switching_gain=(0.1,) * 3,
        reaching_gain=(0.1,) * 3,
        boundary_layer=(0.5,) * 3,
    )
    slope = 0.1 + 0.1 / 0.5
    result = found(spec)
    assert result.gain[2, 5] == pytest.approx(0.01 + slope, rel=1e-6)
    assert result.gain[2, 2] == pytest.approx(0.01 * slope - MOTION**2, rel=1e-6)
    assert result.poles[0] == pytest.approx(-0.01, rel=1e-2)


def test_integral_action_adds_a_pole_to_each_axis_with_a_gain():
    spec = IntegralSpec(law=FeedbackLinearisationSpec(), gain=(1e-8, 0.0, 1e-8))
    law = spec.build(SETTING)
    result = found(spec)
    assert len(result.poles) == 8
    assert result.gain == pytest.approx(state_gain(law.law, SETTING))
    on_observer = feedback(IntegralSpec(law=ObserverSpec(), gain=(0.0, 0.0, 1e-8)).build(SETTING), SETTING)
    assert on_observer is not None
    assert (len(on_observer.poles), on_observer.observer_poles) == (13, ())
    assert on_observer.gain == pytest.approx(found(LqrSpec()).gain)


def test_the_slowest_pole_is_that_of_the_spectral_radius():
    loop = closed_loop(LqiSpec().build(SETTING), SETTING)
    assert loop is not None
    slowest = sampled_poles(loop, SETTING.step)[0]
    assert math.exp(slowest.real * SETTING.step) == pytest.approx(spectral_radius(loop), rel=1e-12)


def test_poles_of_a_known_transition():
    # An oscillation, a decay, something that never changes, and something that is gone at once.
    angle, step = 0.3, 0.5
    turn = 0.9 * np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    transition = np.zeros((5, 5))
    transition[:2, :2], transition[2, 2], transition[3, 3], transition[4, 0] = turn, 0.5, 1.0, 7.0
    poles = sampled_poles(transition, step)
    decay = math.log(0.9) / step
    assert poles == pytest.approx(
        [complex(decay, -angle / step), complex(decay, angle / step), math.log(0.5) / step]
    )
