# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Spectral radius of loops that are closed once a step, against closed forms and flights that diverge."""

import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest

from flights import shipped, shortened
from satform.attitude.mrp_tracking import AttitudeTrackingSpec, attitude_transition
from satform.control.artificial_potential import ArtificialPotentialSpec
from satform.control.feedback_linearisation import FeedbackLinearisationSpec
from satform.control.protocol import ControllerSpec, ControlStep, FlightSetting, Motion, RelativeNeighbour
from satform.control.sampled_stability import closed_loop, spectral_radius
from satform.control.sliding_mode import SlidingModeSpec
from satform.equipment.sensors.relative_motion import Measurement, NavigationSpec
from satform.evaluation.evaluate import judge
from satform.evaluation.loops import SpectralRadius
from satform.evaluation.sampled_loops import sampled_loops
from satform.flight.simulate import simulate
from satform.navigation.relative_state_filter import FilterSpec, estimation_transition
from satform.numeric.elementwise import Array
from satform.scenario import Scenario, parse_scenario
from satform_tools.check.consensus import margin
from satform_tools.check.sampling import sampling_warnings

MOTION = 1e-3


def radius(scenario: Scenario, kind: str) -> float:
    found = [loop.radius for loop in sampled_loops(scenario) if loop.kind == kind]
    assert all(value is not None for value in found)
    return max(value for value in found if value is not None)


def onset(grows: Callable[[float], bool], low: float, high: float) -> float:
    """The step at which a flight begins to diverge, by halving."""
    assert not grows(low)
    assert grows(high)
    for _ in range(7):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    return 0.5 * (low + high)


def single(step: float, steps: int, controller: str, *extra: str) -> Scenario:
    """One satellite a hundredth of a millimetre off the place at which it is to stay."""
    return parse_scenario(
        f"""
name: alone
title: alone
text: alone
orbit: {{mean_motion: {MOTION}}}
timing: {{step: {step}, duration: {step * steps}}}
dynamics: {{kind: cw}}
graph: {{kind: none}}
consensus: {{kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}}
nominal_motion: {{rate: 0.0}}
satellites:
  - name: a
    curve: {{kind: fixed_point, position: [0.0, 0.0, 0.0]}}
    position_error: [1.0e-5, 1.0e-5, 1.0e-5]
    controller: {controller}
"""
        + "\n".join(f"    {line}" for line in extra)
    )


SLIDING = "{kind: sliding_mode, switching_gain: 0.1, reaching_gain: 0.1, boundary_layer: 0.1}"


def grows(series: Array, window: int = 10) -> bool:
    """Whether the last of a series is larger than its middle."""
    sizes = np.abs(series).reshape(len(series), -1).max(axis=1)
    return bool(sizes[-window:].max() > sizes[len(sizes) // 2 : len(sizes) // 2 + window].max())


def layer(step: float) -> float:
    """Radius of error and its rate on one axis under a = -0.01 v - 1.1 (v + 0.01 e), held over a step."""
    slope, surface = 0.1 / 0.1 + 0.1, 0.01
    gains = np.array([slope * surface, slope + surface])
    held = np.array([[0.5 * step * step], [step]])
    return float(np.abs(np.linalg.eigvals(np.array([[1.0, step], [0.0, 1.0]]) - held * gains)).max())


def test_a_boundary_layer_diverges_from_the_step_at_which_its_slope_over_a_step_is_two() -> None:
    def diverges(step: float) -> bool:
        surface = np.abs(simulate(single(step, 80, SLIDING)).sliding_variable)
        return bool(surface[-10:].max() > 2.0 * surface[0].max())

    flown = onset(diverges, 1.0, 3.0)
    # The surface's own factor is 1 - 1.1 h; what is held moves it by a hundredth of a step besides.
    assert flown == pytest.approx(2.0 / 1.1, rel=0.02)
    assert layer(0.99 * flown) < 1.0 < layer(1.01 * flown)
    for step in (0.5, 1.9, 2.0, 4.0):
        assert radius(single(step, 1, SLIDING), "tracking") == pytest.approx(layer(step), rel=1e-5)


def test_check_warns_of_the_boundary_layer_that_is_dead() -> None:
    assert not sampling_warnings(shipped("triangle", "timing.step=1.0", "expect=[]"))
    (found,) = sampling_warnings(shipped("triangle", "timing.step=2.0", "expect=[]"))
    assert found.startswith(
        "controller of sat1, sat2, sat3: with a control period of 2 s, sliding_mode multiplies"
    )
    assert float(found.split(" by ")[1].split(" ")[0]) == pytest.approx(layer(2.0), rel=1e-4)


def test_a_regulator_on_late_measurements_diverges_from_the_latency_at_which_its_loop_does() -> None:
    law = "{kind: feedback_linearisation, natural_frequency: 0.05, damping_ratio: 1.0}"

    def late(latency: float) -> Scenario:
        return single(1.0, 400, law, f"sensor: {{latency: {latency}}}")

    radii = {latency: radius(late(latency), "tracking") for latency in range(1, 20)}
    first = min(latency for latency, value in radii.items() if value >= 1.0)
    for latency in (first - 1, first):
        record = simulate(late(latency))
        assert grows(record.position, 60) == (radii[latency] >= 1.0)
        # How fast: by the last 200 steps of the flight.
        sizes = np.linalg.norm(record.position[:, 0], axis=-1)
        envelope = sizes[340:400].max() / sizes[240:300].max()
        assert envelope == pytest.approx(radii[latency] ** 100, rel=0.1)


def test_rare_measurements_count_a_period_and_not_a_step() -> None:
    law = FeedbackLinearisationSpec(natural_frequency=(0.05,) * 3).build(FlightSetting(MOTION, 1.0))
    every = closed_loop(law, FlightSetting(MOTION, 1.0))
    rare = closed_loop(law, FlightSetting(MOTION, 1.0), update=4)
    assert every is not None
    assert rare is not None
    assert 0.9 < spectral_radius(every) < spectral_radius(rare, 4) < 1.0


def test_attitude_at_long_steps_is_unstable_from_the_step_of_the_closed_form() -> None:
    # About one axis of platform inertia J: z^2 - (2 - b) z + ... with a = k1 h^2 / (8 J), b = k2 h / J.
    law = AttitudeTrackingSpec(inertia=(86.0, 86.0, 86.0)).build()
    for step in (1.0, 3.0, 4.2, 6.0):
        stiff, damped = 14.0 * step * step / (8.0 * 85.5), 40.0 * step / 85.5
        roots = np.roots([1.0, stiff + damped - 2.0, 1.0 + stiff - damped])
        assert spectral_radius(attitude_transition(law, step)) == pytest.approx(np.abs(roots).max(), rel=1e-9)


def test_attitude_diverges_in_flight_from_the_step_at_which_check_warns() -> None:
    def flown(step: float) -> Scenario:
        own = "satellites.0.attitude"
        changes = (f"{own}.maximum_step=1.0", f"{own}.mrp=null", f"{own}.angular_velocity=null")
        return shortened("attitude_cape_canaveral", 100.0 * step, f"timing.step={step}", *changes)

    steps = np.arange(3.0, 5.0, 0.05)
    first = float(steps[np.array([radius(flown(step), "attitude") for step in steps]) >= 1.0][0])
    assert not sampling_warnings(flown(first - 0.05))
    (found,) = sampling_warnings(flown(first))
    assert found.startswith("attitude of sat1: with a control period of ")
    for step in (first - 0.4, first + 0.4):
        rate = np.nan_to_num(simulate(flown(step)).attitude_rate_error[:, 0], nan=1e9)
        assert (rate[-20:].max() > 10.0 * rate[:30].max()) == (step > first)


def test_a_consensus_whose_rate_diverges_is_warned_of() -> None:
    changes = ("timing.step=1.0", "expect=[]", "consensus.tracking_gain=2.5")
    (found,) = [line for line in sampling_warnings(shipped("triangle", *changes)) if "consensus" in line]
    # Without coupling the factor is 1 - 2.5; three satellites that hear each other add 3 * 1e-3.
    assert float(found.split(" by ")[1].split(" ")[0]) == pytest.approx(1.503, abs=1e-4)


def test_a_filter_s_radius_is_that_of_its_own_covariance_once_it_is_steady() -> None:
    sensor = NavigationSpec(position_noise=5.0, velocity_noise=0.01, update_period=6.0)
    estimator = FilterSpec(acceleration_density=1e-8).build(MOTION, 2.0, sensor)
    model, own = estimator.filter, estimator.filter.model.over(0)
    estimate = model.start(Measurement(np.zeros(3), np.zeros(3), 0))
    between = np.linalg.matrix_power(own.transition, 3)
    for number in range(3000):
        estimate = model.predict(estimate, np.zeros(3), number)
        if number % 3 == 2:
            estimate, _ = model.update(estimate, Measurement(np.zeros(3), np.zeros(3), number))
    gain = estimate.covariance / model.variance
    expected = np.abs(np.linalg.eigvals((np.eye(6) - gain) @ between)).max()
    assert spectral_radius(estimation_transition(estimator)) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("slope", [0.01, 0.9, 2.4])
def test_a_law_on_the_distance_grows_in_flight_as_its_loop_does(slope: float) -> None:
    setting = FlightSetting(MOTION, 0.5)
    spec = ArtificialPotentialSpec(slope=slope, barrier=False, weight_rate=0.0, disturbance_rate=0.0)
    law, place, velocity = spec.build(setting), np.array([100.0 + 1e-4, 0.0, 0.0]), np.zeros(3)
    memory, sizes = law.start(Motion(place, velocity)), []
    for number in range(120):
        step = ControlStep(number, 0.5, np.zeros(3), np.zeros(3))
        action = law.act(Motion(place, velocity), RelativeNeighbour(place, velocity), memory, step)
        place = place + 0.5 * velocity + 0.125 * action.acceleration
        velocity = velocity + 0.5 * action.acceleration
        sizes.append(abs(place[0] - 100.0) + abs(velocity[0]))
    loop = spectral_radius(spec.linearisation(setting))
    if slope == 0.01:
        # Fed back as a velocity of 2 slope / wanted * 2 * 100^2 / ..., it decays slowly.
        assert loop == pytest.approx((sizes[100] / sizes[60]) ** (1.0 / 40.0), rel=1e-3)
    elif loop > 1.0:
        assert max(sizes[60:]) > 10.0 * sizes[0]
    else:
        assert sizes[-1] < sizes[0]


class Own(ControllerSpec):
    """A law of somebody else's, which says for itself what its loop is."""

    kind: Literal["own"] = "own"
    factor: float = 1.7

    def build(self, setting: FlightSetting) -> Any:
        return SlidingModeSpec().build(setting)

    def linearisation(self, setting: FlightSetting) -> Array | str:
        return "which nobody has worked out" if self.factor == 0.0 else np.diag([0.5, self.factor])


def test_a_law_of_one_s_own_says_what_its_loop_is_or_that_it_is_not_analysed() -> None:
    scenario = single(1.0, 1, SLIDING)
    for factor, found in ((1.7, 1.7), (0.0, None)):
        own = scenario.satellites[0].model_copy(update={"controller": Own(factor=factor)})
        loop = sampled_loops(scenario.model_copy(update={"satellites": (own,)}))[0]
        assert loop.radius == found
        assert loop.words.startswith("own")


def test_laws_without_feedback_and_switching_laws_are_said_not_to_be_analysed() -> None:
    for law, words in (
        ("{kind: coast}", "coast, which commands nothing"),
        ("{kind: sliding_mode}", "sliding_mode, which is not linear close to its reference"),
    ):
        loop = sampled_loops(single(1.0, 1, law))[0]
        assert (loop.radius, loop.words) == (None, words)


def test_a_consensus_on_projected_arc_lengths_is_said_not_to_be_analysed() -> None:
    # Of these gains the consensus on the reference's own arc length would multiply errors by 1.5.
    changes = ("timing.step=1.0", "expect=[]", "consensus.tracking_gain=2.5")
    scenario = shipped("triangle", *changes, "consensus.arc_length_source=projected")
    (loop,) = [loop for loop in sampled_loops(scenario) if loop.kind == "consensus"]
    assert loop.radius is None
    assert loop.words.startswith("arc_length on projected arc lengths")
    assert margin(scenario) is None


def test_an_axis_without_integral_gain_is_no_part_of_the_loop() -> None:
    law = "{kind: integral, law: {kind: relative_elements}, gain: [0.0, 0.0, 1.0e-10]}"
    assert radius(single(10.0, 1, law), "tracking") < 1.0


def test_a_scenario_can_expect_its_loops_to_decay() -> None:
    scenario = single(2.0, 2, SLIDING)
    record = simulate(scenario)
    expectations = (SpectralRadius(below=1.0), SpectralRadius(loop="consensus", below=1.0))
    tracking, consensus = judge(expectations, record, lambda: sampled_loops(scenario))
    assert tracking.figure == pytest.approx(layer(2.0), rel=1e-5)
    assert not tracking.met
    assert consensus.met
    assert math.isnan(judge(expectations, record)[0].figure)
