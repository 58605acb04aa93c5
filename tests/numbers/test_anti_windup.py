# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Laws and limits: no wind-up while thrusters are saturated, bounded adaptation, and users who are warned."""

import math

import numpy as np
import pytest

from satform.control.anti_windup import Saturation
from satform.control.artificial_potential import ArtificialPotentialSpec
from satform.control.integral_action import IntegralSpec
from satform.control.lqi import LqiSpec
from satform.control.lqr import LqrSpec
from satform.control.protocol import ControlStep, FlightSetting, Motion, RelativeNeighbour
from satform.dynamics import cw
from satform.equipment.thruster import ThrusterSpec
from satform.evaluation.findings import findings
from satform.flight.simulate import simulate
from satform.orbits.path_reference import Reference
from satform.scenario import parse_scenario
from satform_tools.check.filters import filter_warnings
from satform_tools.check.thrust import thrust_warnings

SETTING = FlightSetting(2.0 * math.pi / 6000.0, 5.0)
NOWHERE = Reference(np.zeros(3), np.zeros(3), np.zeros(3))

FLIGHT = """
name: windup
title: windup
text: windup
orbit: {period: 6000.0}
timing: {step: 5.0, duration: 4000.0}
dynamics: {kind: cw}
graph: {kind: none}
consensus: {kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}
nominal_motion: {rate: 0.0}
satellite_defaults:
  curve: {kind: fixed_point, position: [0.0, 0.0, 0.0]}
  position_error: [0.0, 1000.0, 0.0]
"""


def flown(law, limit, steps=800, setting=SETTING, start=1000.0):
    """Positions under a law whose command is limited on each axis, on the exact plant."""
    plant = cw.HeldInputStep.over(setting.mean_motion, setting.step)
    position, velocity = np.array([0.0, start, 0.0]), np.zeros(3)
    memory, applied, commanded, track = law.start(Motion(position, velocity)), None, None, [position]
    for number in range(steps):
        step = ControlStep(number, setting.step, applied, commanded)
        action = law.act(Motion(position, velocity), NOWHERE, memory, step)
        memory, commanded = action.memory, action.acceleration
        applied = np.clip(commanded, -limit, limit)
        position, velocity = plant.advance(position, velocity, applied)
        track.append(position)
    return np.array(track)


INTEGRATING = {
    "lqi": LqiSpec(),
    "lqi on errors": LqiSpec(command_path="error"),
    "integral": IntegralSpec(law=LqrSpec(), gain=1e-6, limit=1.0, integration_band=1e6),
}


@pytest.mark.parametrize("name", INTEGRATING)
def test_a_saturated_law_with_integral_action_arrives_and_does_not_wind_up(name):
    law = INTEGRATING[name].build(SETTING)
    track = np.linalg.norm(flown(law, 0.05), axis=-1)
    assert track[-1] < 1.0
    # A double integrator that is driven to and fro at its limit does not overshoot by more than it came.
    assert track.max() < 1.05e3
    unlimited = flown(law, np.inf)
    assert np.linalg.norm(unlimited[-1]) < 1.0


@pytest.mark.parametrize("name", ["lqi"])
def test_without_anti_windup_the_same_law_flies_away(name):
    law = INTEGRATING[name].model_copy(update={"anti_windup": "none"}).build(SETTING)
    assert np.linalg.norm(flown(law, 0.05), axis=-1).max() > 5e3


def test_back_calculation_makes_the_integral_the_one_that_would_have_commanded_what_was_applied():
    law = LqiSpec(command_path="error").build(SETTING)
    motion = Motion(np.array([10.0, -20.0, 5.0]), np.array([0.1, 0.0, -0.2]))
    start = law.start(motion)
    first = law.act(motion, NOWHERE, start, ControlStep(0, 5.0))
    applied = 0.3 * first.acceleration
    # Hanus, Kinnaert & Henrotte 1987: with the same errors the conditioned law commands what was applied,
    # but for what the integral grew by in the step between.
    grown = law.integral_gain(motion.position * 5.0)
    second = law.act(motion, NOWHERE, first.memory, ControlStep(1, 5.0, applied, first.acceleration))
    assert second.acceleration == pytest.approx(applied - grown, rel=1e-9)


def test_a_law_that_is_not_saturated_commands_the_same_bits_whether_or_not_it_is_guarded():
    for guarded in (LqiSpec(), IntegralSpec(gain=1e-6)):
        free = guarded.model_copy(update={"anti_windup": "none"})
        assert np.array_equal(flown(guarded.build(SETTING), np.inf), flown(free.build(SETTING), np.inf))


def test_what_smallest_impulse_and_noise_take_away_is_no_saturation():
    spec = ThrusterSpec(dry_mass=50.0, minimum_impulse=0.5, maximum_thrust=1.0, magnitude_error=0.01)
    setting = FlightSetting(1e-3, 2.0, spec.resolution(2.0), spec.largest_error)
    assert setting.thrust_resolution == pytest.approx(0.005)
    assert setting.thrust_error == pytest.approx(0.04)
    saturation, motion = Saturation.of(setting), Motion(np.zeros(3), np.zeros(3))
    commanded = np.array([0.004, 0.03, 0.1])
    applied = np.array([0.0, 0.03 * 1.01, 0.02])
    found = saturation.shortfall(motion, ControlStep(1, 2.0, applied, commanded))
    assert found == pytest.approx(np.array([0.0, 0.0, 0.08]))


def test_every_integrating_law_flies_home_from_a_kilometre_with_five_newtons_on_a_hundred_kilogrammes():
    record = simulate(
        parse_scenario(
            f"""{FLIGHT}
  thruster: {{dry_mass: 100.0, maximum_thrust: 5.0}}
satellites:
  - {{name: lqi, controller: {{kind: lqi}}}}
  - {{name: both, controller: {{kind: observer, law: {{kind: lqi}}}}}}
  - {{name: integral, controller: {{kind: integral, integration_band: 1.0e+6, gain: 2.0e-7}}}}
"""
        )
    )
    assert np.linalg.norm(record.position[-1], axis=-1).max() < 1.0
    assert record.saturated_steps[-1].max() < 0.5 * record.steps
    assert findings(record) == ()


def test_a_flight_that_was_saturated_most_of_the_time_says_so():
    record = simulate(
        parse_scenario(
            f"""{FLIGHT}
  thruster: {{dry_mass: 100.0, maximum_thrust: 5.0}}
satellites:
  - {{name: wound_up, controller: {{kind: lqi, anti_windup: none}}}}
"""
        )
    )
    saturated_steps = int(record.saturated_steps[-1, 0])
    assert findings(record) == (
        f"wound_up: commands saturated at the thrust limit in {saturated_steps} of 800 steps",
    )
    assert saturated_steps > 400


def neighbours(leakage, rate=0.01, limit=np.inf, noise=0.0, steps=2000):
    """Largest estimate of the disturbance of a satellite that holds its distance under noise."""
    setting = FlightSetting(1e-3, 0.1)
    law = ArtificialPotentialSpec(leakage=leakage, leakage_rate=rate).build(setting)
    generator = np.random.default_rng(5)
    motion, apart = Motion(np.zeros(3), np.zeros(3)), np.array([100.0, 0.0, 0.0])
    memory, applied, commanded, largest = law.start(motion), None, None, []
    for number in range(steps):
        seen = RelativeNeighbour(apart, np.zeros(3))
        measured = Motion(np.zeros(3), generator.normal(scale=noise, size=3) if noise else np.full(3, 0.1))
        action = law.act(measured, seen, memory, ControlStep(number, 0.1, applied, commanded))
        memory, commanded = action.memory, action.acceleration
        applied = np.clip(commanded, -limit, limit)
        largest.append(float(np.max(memory.disturbance)))
    return np.array(largest)


def test_noise_drives_the_disturbance_estimate_up_for_ever_unless_it_leaks():
    plain = neighbours("none", noise=0.1)
    assert plain[-1] - plain[1000] == pytest.approx(plain[1000], rel=0.1)
    # It settles where growth and leakage balance: rate times the mean of |s tanh(s / boundary)| over sigma.
    leaking = neighbours("sigma_modification", rate=0.05, noise=0.1)
    samples = np.random.default_rng(1).normal(scale=0.1, size=100_000)
    balance = 0.5 * np.mean(samples * np.tanh(samples / 0.05)) / 0.05
    assert leaking[1000:].mean() == pytest.approx(balance, rel=0.1)


def test_e_modification_leaks_with_the_size_of_the_error():
    # A steady error s: the estimate goes to rate tanh(s / boundary) / nu, whatever s is.
    found = neighbours("e_modification", rate=1.0, steps=1500)
    assert found[-1] == pytest.approx(0.5 * math.tanh(0.1 / 0.05) / 1.0, rel=0.01)


def test_nothing_is_learnt_while_the_thrusters_are_saturated():
    assert neighbours("none", limit=1e-6, steps=200)[-1] == neighbours("none", limit=1e-6, steps=1)[-1]


def warned(satellite, more=""):
    return thrust_warnings(parse_scenario(f"{FLIGHT}{more}\nsatellites:\n  - {satellite}\n"))


def test_check_warns_of_commands_beyond_the_thrust_at_the_start_and_of_laws_that_wind_up():
    limited = "thruster: {dry_mass: 100.0, maximum_thrust: 5.0}"
    found = warned(f"{{name: a, {limited}, controller: {{kind: lqr}}}}")
    assert len(found) == 1
    assert found[0].startswith(
        "satellite a: its first command is 1.05 m/s^2, 20.9 times what its thrusters can apply"
    )
    assert warned("{name: a, controller: {kind: lqr}}") == []
    unguarded = "controller: {kind: observer, law: {kind: lqi, anti_windup: none}}"
    assert any("anti_windup: none" in one for one in warned(f"{{name: a, {limited}, {unguarded}}}"))


def test_check_warns_of_a_burn_in_flight_that_is_beyond_the_thrust():
    limited = "thruster: {dry_mass: 100.0, maximum_thrust: 5.0}"

    def burning(change):
        burns = f"[{{time: 502.5, velocity_change: [0.0, {change}, 0.0]}}]"
        return warned(f"{{name: a, {limited}, controller: {{kind: timed_burns, burns: {burns}}}}}")

    # 5 N on 100 kg over a step of 5 s are 0.25 m/s.
    assert burning(0.25) == []
    (found,) = burning(0.5)
    assert found.startswith("satellite a: its burn at 500 s is 0.1 m/s^2 over a step, 2 times what")


def filtering(size, dynamics, density):
    """A satellite with a filter, without a gate, on an ellipse of a size in m."""
    return parse_scenario(
        f"""
name: e
title: e
text: e
orbit: {{period: 6000.0}}
timing: {{step: 10.0, duration: 3000.0}}
dynamics: {dynamics}
graph: {{kind: none}}
consensus: {{kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}}
nominal_motion: {{period: 6000.0}}
satellite_defaults:
  curve: {{kind: ellipse, first_axis: [0.0, {2 * size}, 0.0], second_axis: [{size}, 0.0, 0.0]}}
  path_parameter: angle
  controller: {{kind: coast}}
  sensor: {{position_noise: 1.0, velocity_noise: 0.05}}
  filter: {{acceleration_density: {density}, innovation_gate: null}}
satellites: [{{name: a}}]
"""
    )


def test_a_filter_whose_model_is_not_the_truth_is_warned_of_and_found_in_the_flight():
    wrong = filtering(100e3, "{kind: inertial}", 1e-10)
    assert len(filter_warnings(wrong)) == 1
    record = simulate(wrong)
    assert len(findings(record)) == 1
    assert np.nanmean(record.estimation_error_squared[100:]) > 1e3


def test_a_filter_whose_model_is_the_truth_is_consistent_and_nobody_is_warned():
    # Held noise within a bound has a third of its square as variance: times the step that is its density.
    noise = "{kind: cw, perturbations: [{kind: bounded_noise, bound: 0.01}]}"
    right = filtering(10.0, noise, 10.0 * 0.01**2 / 3.0)
    assert filter_warnings(right) == []
    record = simulate(right)
    assert findings(record) == ()
    # Chi-square of 6 degrees of freedom.
    assert np.nanmean(record.estimation_error_squared[100:]) == pytest.approx(6.0, rel=0.15)
    assert np.nanmean(record.innovation[100:]) == pytest.approx(6.0, rel=0.1)
