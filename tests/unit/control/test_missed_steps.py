# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Time and memory of a control law when a satellite misses steps: lost and rejoined, or skipped."""

import math
from importlib.metadata import entry_points
from typing import Any

import numpy as np
import pytest

from flights import satellite_of
from satform.communication.neighbour_buffer import Received
from satform.control.integral_action import IntegralSpec
from satform.control.observer import ObserverSpec
from satform.control.protocol import ControlStep, FlightSetting, Gap, Motion, require_protocol
from satform.dynamics import cw
from satform.equipment.sensors.relative_motion import Measurement, NavigationSpec
from satform.flight.simulate import simulate
from satform.navigation.kalman_filter import process_covariance
from satform.navigation.relative_state_filter import FilterSpec
from satform.orbits.path_reference import Reference
from satform.planning.impulsive_guidance import TimedBurnsSpec
from satform.record.flight_record import FlightRecord
from satform.scenario import parse_scenario

NOBODY = Received.whole(np.zeros((0, 2)), np.zeros(0))
SETTING = FlightSetting(2.0 * math.pi / 6000.0, 1.0)

ALONE = """
name: alone
title: alone
text: alone
orbit: {mean_motion: 7.292115865e-5}
timing: {step: 1.0, duration: 4000.0}
dynamics: {kind: cw}
graph: {kind: none}
consensus: {kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}
nominal_motion: {rate: 0.0}
"""
BURNS = """
satellite_defaults:
  curve: {kind: fixed_point, position: [0.0, -100.0e3, 0.0]}
satellites:
  - name: tour
    controller: {kind: impulsive_guidance, waypoints: [{position: [0.0, -50000.0, 0.0], duration: 1800.0}]}
  - name: burns
    controller:
      kind: timed_burns
      burns:
        - {time: 500.0, velocity_change: [0, 1, 0]}
        - {time: 1200.0, velocity_change: [0, 0, 1]}
        - {time: 3000.0, velocity_change: [0, -1, 0]}
"""
LOSSES = """
faults:
  - {kind: satellite_lost, satellite: tour, at: 1000.0, rejoin_at: 1500.0, memory: MEMORY}
  - {kind: satellite_lost, satellite: burns, at: 1000.0, rejoin_at: 1500.0, memory: MEMORY}
"""


def burn_steps(record: FlightRecord, satellite: str) -> list[int]:
    column = record.satellites.index(satellite)
    return np.flatnonzero(np.linalg.norm(record.acceleration[:, column], axis=-1) > 1e-6).tolist()


@pytest.mark.parametrize("memory", ["plan", "checkpoint"])
def test_burns_by_the_clock_are_flown_at_their_times_after_a_loss(memory: str) -> None:
    kept = "checkpoint_period: 100.0\n" if memory == "checkpoint" else ""
    record = simulate(parse_scenario(ALONE + kept + LOSSES.replace("MEMORY", memory) + BURNS))
    # The one at 1200 s fell due while the satellite was lost, and is not made up for.
    assert burn_steps(record, "burns") == [500, 3000]
    assert burn_steps(record, "tour") == [0, 1800]
    tour = record.satellites.index("tour")
    assert record.position[1800, tour] == pytest.approx([0.0, -50e3, 0.0], abs=0.5)
    assert np.abs(record.velocity[-1, tour]).max() < 1e-3


def skipping(scenario_text: str, index: int, period: int, steps: int) -> list[int]:
    """Steps at which a satellite burns that gets only each n-th state, as on a wall clock."""
    satellite = satellite_of(parse_scenario(scenario_text), index)
    motion, flown = Motion(np.array([0.0, -100e3, 0.0]), np.zeros(3)), []
    for step in range(0, steps, period):
        satellite.join(step, skipped=True)
        decision = satellite.act(motion, NOBODY, applied_acceleration=np.zeros(3))
        if np.any(decision.acceleration):
            flown.append(step)
    return flown


def test_skipped_states_do_not_shift_burns_and_a_burn_of_a_skipped_step_is_flown_at_the_next_one() -> None:
    assert skipping(ALONE + BURNS, 1, 2, 4000) == [500, 1200, 3000]
    assert skipping(ALONE + BURNS, 1, 7, 4000) == [504, 1204, 3003]


def numbers(memory: Any) -> list[float]:
    """All numbers of a memory."""
    if memory is None:
        return []
    if hasattr(memory, "__dataclass_fields__"):
        return [number for name in memory.__dataclass_fields__ for number in numbers(getattr(memory, name))]
    return np.ravel(memory).tolist()


def registered() -> list[tuple[str, Any]]:
    """Every control law that is installed, with gains that can be built without more ado."""
    found: list[tuple[str, Any]] = []
    for entry in entry_points(group="satform.controllers"):
        spec = entry.load()
        found.append(
            (
                entry.name,
                spec(waypoints=[{"position": (0.0, 1e3, 0.0), "duration": 1e3}])
                if entry.name == "impulsive_guidance"
                else spec(),
            )
        )
    return [*found, ("integral beside an observer", IntegralSpec(law=ObserverSpec()))]


@pytest.mark.parametrize(("name", "spec"), registered(), ids=[name for name, _ in registered()])
def test_every_law_with_a_memory_carries_it_over_a_gap(name: str, spec: Any) -> None:
    law = spec.build(FlightSetting(SETTING.mean_motion, 0.1))
    motion = Motion(np.array([50.0, 1000.0, 20.0]), np.array([0.1, -0.2, 0.3]))
    seen: Any = Reference(np.zeros(3), np.zeros(3), np.zeros(3))
    memory = law.start(motion)
    for step in range(5):
        memory = law.act(motion, seen, memory, ControlStep(step, 0.1)).memory
    if memory is None:
        return
    gap = Gap(5, 3, 0.1, np.array([1e-3, 0.0, 0.0]), motion)
    resumed = law.resume(memory, gap)
    assert type(resumed) is type(memory)
    assert np.isfinite(numbers(resumed)).all()
    assert len(numbers(resumed)) == len(numbers(memory))
    # Each law says in words what it does with its memory.
    words = type(law).resume.__doc__ or ""
    assert any(word in words for word in ("kept", "propagated", "dropped")), name


def observed(miss: float = 0.0) -> tuple[Any, Any]:
    """An observer after five steps at rest in the origin, with an estimate that is off by metres."""
    law = ObserverSpec(initial_position_error=(miss, 0.0, 0.0)).build(SETTING)
    return law, law.start(Motion(np.zeros(3), np.zeros(3)))


def test_an_observer_is_propagated_over_a_gap_with_what_was_applied_in_it() -> None:
    law, memory = observed()
    push = np.array([1e-3, -2e-3, 5e-4])
    # Closed form over the whole gap at once: Clohessy & Wiltshire 1960.
    place, moving = cw.HeldInputStep.over(SETTING.mean_motion, 40.0).advance(np.zeros(3), np.zeros(3), push)
    resumed = law.resume(memory, Gap(0, 40, 1.0, push, Motion(place, moving)))
    assert resumed.position == pytest.approx(place, rel=1e-9)
    assert resumed.velocity == pytest.approx(moving, rel=1e-9)


def test_an_observer_takes_what_is_measured_after_a_long_gap_for_a_drift_and_not_for_a_kick() -> None:
    law, memory = observed()
    drifted = Motion(np.array([0.0, 50.0, 0.0]), np.zeros(3))
    resumed = law.resume(memory, Gap(0, 999, 1.0, np.zeros(3), drifted))
    assert resumed.position == pytest.approx(drifted.position, abs=1e-9)
    # 50 m in 1000 s.
    assert resumed.velocity == pytest.approx(np.array([0.0, 0.05, 0.0]), abs=1e-9)


def test_an_observer_of_which_each_second_state_is_skipped_still_finds_the_velocity() -> None:
    law, memory = observed()
    plant = cw.HeldInputStep.over(SETTING.mean_motion, 1.0)
    position, velocity, push = np.zeros(3), np.array([0.0, 0.3, -0.1]), np.zeros(3)
    seen = Reference(np.zeros(3), np.zeros(3), np.zeros(3))
    for step in range(0, 400, 2):
        if step:
            memory = law.resume(memory, Gap(step - 1, 1, 1.0, push, Motion(position, velocity)))
        moment = ControlStep(step, 1.0, push if step else None, push, 1)
        action = law.act(Motion(position, velocity), seen, memory, moment)
        memory, push = action.memory, action.acceleration
        for _ in range(2):
            position, velocity = plant.advance(position, velocity, push)
    assert memory.velocity - velocity == pytest.approx(np.zeros(3), abs=2e-3)


def test_after_a_gap_under_an_unknown_push_the_observer_commands_no_more_than_the_law_that_sees_everything():
    law = "{kind: lqr, position_weight: 0.0091, velocity_weight: 0.0}"
    text = ALONE.replace("mean_motion: 7.292115865e-5", "period: 6000.0").replace("4000.0", "3000.0")
    text = text.replace(
        "{kind: cw}", "{kind: cw, perturbations: [{kind: constant, acceleration: [0.0, 1.0e-4, 0.0]}]}"
    )
    record = simulate(
        parse_scenario(
            f"""{text}
checkpoint_period: 100.0
faults:
  - {{kind: satellite_lost, satellite: a, at: 1050.0, rejoin_at: 2050.0}}
  - {{kind: satellite_lost, satellite: b, at: 1050.0, rejoin_at: 2050.0}}
satellite_defaults:
  curve: {{kind: fixed_point, position: [0.0, 100.0, 0.0]}}
satellites:
  - {{name: a, controller: {law}}}
  - {{name: b, controller: {{kind: observer, law: {law}}}}}
"""
        )
    )
    full, seen = np.abs(record.acceleration[2050:2300]).max(axis=(0, 2))
    assert seen < 1.2 * full


def test_a_filter_is_propagated_over_a_gap_and_does_not_begin_again() -> None:
    scenario = parse_scenario(
        ALONE.replace("mean_motion: 7.292115865e-5", "period: 6000.0")
        + """
satellite_defaults:
  curve: {kind: fixed_point, position: [0.0, 100.0, 0.0]}
  sensor: {position_noise: 1.0, velocity_noise: 0.01}
  filter: {acceleration_density: 1.0e-12}
satellites: [{name: a, controller: {kind: coast}}]
"""
    )
    satellite, plant = satellite_of(scenario, 0), cw.HeldInputStep.over(scenario.orbit.rate, 1.0)
    motion = Motion(np.array([0.0, 100.0, 0.0]), np.array([0.01, 0.0, 0.0]))
    for step in range(401):
        # Away for 200 s after 200 measurements.
        if not 200 <= step < 400:
            satellite.join(step)
            satellite.act(motion, NOBODY, applied_acceleration=np.zeros(3))
        motion = Motion(*plant.advance(motion.position, motion.velocity, np.zeros(3)))
    estimate = satellite.state.estimate
    assert estimate is not None
    # A filter that had begun anew would be as uncertain as its one measurement since, 1 m^2.
    assert estimate.anchor.covariance[0, 0] < 0.1


def test_the_covariance_of_a_filter_grows_over_a_gap_as_that_of_free_motion() -> None:
    density = 1e-8
    estimator = FilterSpec(acceleration_density=density).build(
        SETTING.mean_motion, 1.0, NavigationSpec(position_noise=1.0, velocity_noise=0.01)
    )
    first = Measurement(np.zeros(3), np.zeros(3), 0)
    memory = estimator.resume(estimator.start(first), 50, np.zeros(3), np.zeros(3))
    after = estimator.observe(
        memory, Measurement(np.zeros(3), np.zeros(3), 51), np.zeros(3)
    ).anchor.covariance
    # All at once: transition and process noise over 51 s, then one measurement by the textbook's formula.
    transition, noise = cw.transition_matrix(SETTING.mean_motion, 51.0), np.diag([1.0] * 3 + [1e-4] * 3)
    grown = transition @ noise @ transition.T + process_covariance(
        SETTING.mean_motion, 51.0, np.full(3, density)
    )
    expected = np.linalg.inv(np.linalg.inv(grown) + np.linalg.inv(noise))
    assert after == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_a_filter_from_an_old_checkpoint_does_not_trust_what_it_commanded_since_then() -> None:
    record = simulate(
        parse_scenario(
            ALONE.replace("mean_motion: 7.292115865e-5", "period: 6000.0").replace("4000.0", "600.0")
            + """
checkpoint_period: 100.0
faults: [{kind: satellite_lost, satellite: a, at: 120.0, rejoin_at: 220.0}]
satellite_defaults:
  curve: {kind: fixed_point, position: [0.0, 100.0, 0.0]}
  sensor: {position_noise: 1.0, velocity_noise: 0.01}
  filter: {acceleration_density: 1.0e-8}
  thruster: {dry_mass: 50.0, maximum_thrust: 0.5}
satellites:
  - {name: a, position_error: [0.0, -200.0, 0.0], controller: {kind: feedback_linearisation}}
"""
        )
    )
    # Between checkpoint and loss it had accelerated. 22.5 and 38.3 are 99.9 and 99.9999 % of
    # the chi-square distribution of 6 degrees, which a consistent filter's errors follow.
    squared = record.estimation_error_squared[220:, 0]
    assert np.max(squared) < 38.3
    assert np.mean(squared > 22.5) < 0.01


def test_timed_burns_have_no_memory_that_a_loss_could_make_wrong() -> None:
    law = TimedBurnsSpec(burns=[{"time": 10.0, "velocity_change": (1.0, 0.0, 0.0)}]).build(SETTING)
    assert law.start(Motion(np.zeros(3), np.zeros(3))) is None


class Counting:
    """A law with a memory that says nothing of gaps, as written for an earlier protocol."""

    def start(self, motion: Motion) -> int:
        return 0

    def act(self, motion: Motion, reference: Reference, memory: int) -> None:
        raise AssertionError("it is refused before it acts")


def test_a_law_that_does_not_say_what_becomes_of_its_memory_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match=r"Counting\) has no method resume; .* over steps that it missed"):
        require_protocol(Counting(), TimedBurnsSpec())


def test_a_law_that_does_not_take_the_step_is_refused_in_words() -> None:
    law = Counting()
    law.resume = lambda memory, gap: memory  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match=r"act takes \(motion: .*\) -> None, and has to take .* the step"):
        require_protocol(law, TimedBurnsSpec())
