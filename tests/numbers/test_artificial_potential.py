# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A directed triangle that keeps its distances without collision, adapting to unknown dynamics.

The law follows the abstract of Zhu, Du & Wang; the set-up was chosen, and its figures come from an
independent computation.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from satform.control.artificial_potential import (
    Adaptation,
    ArtificialPotentialSpec,
    RelativeNeighbour,
    fuzzy_basis,
)
from satform.control.protocol import ControlStep, FlightSetting, Motion
from satform.numeric.stacking import stack

STEP = ControlStep(0, 1.0)
"""A step of which a law takes that its own command was applied before it."""

COMMON_VELOCITY = np.array([0.5, 0.2, 0.0])
SETTING = FlightSetting(mean_motion=1e-3, step=0.1)
FOLLOWED = [1, 2, 0]
NOMINAL = [[0.0, 0.0, 0.0], [45.0, 5.0, 4.0], [-20.0, 60.0, -6.0]]
CLOSE = [[0.0, 0.0, 0.0], [12.0, 1.0, 0.0], [4.0, 13.0, 2.0]]
CROSSING = [[0.0, 0.0, 0.0], [300.0, 0.0, 0.0], [150.0, 8.0, 0.0]]


def spec(**changes):
    return ArtificialPotentialSpec(common_velocity=tuple(COMMON_VELOCITY), **changes)


def unknown_acceleration(time, velocity):
    """Dynamics and disturbance that the law is not told."""
    phase = 0.7 * np.arange(3)[:, None] + 1.1 * np.arange(3)
    dynamics = -0.2 * velocity + 0.4 * np.sin(1.5 * velocity) + 0.05 * velocity * np.abs(velocity)
    return dynamics + 0.5 * np.sin(0.5 * time + phase)


def distances(position):
    return np.linalg.norm(position - position[..., FOLLOWED, :], axis=-1)


@dataclass(frozen=True)
class Histories:
    time: np.ndarray
    distance: np.ndarray
    velocity_error: np.ndarray
    command: np.ndarray


def fly(law, start, duration, step):
    """Triangles flown in continuous time by the classical Runge-Kutta method, one per leading row."""

    def rate(time, state):
        position, velocity, weights, disturbance = state
        seen = RelativeNeighbour(position - position[..., FOLLOWED, :], velocity - velocity[..., FOLLOWED, :])
        command, _, learning = law.evaluate(velocity, seen, Adaptation(weights, disturbance))
        acceleration = unknown_acceleration(time, velocity) + command
        return (velocity, acceleration, learning.weights, learning.disturbance), command

    def moved(state, slope, time):
        return tuple(value + time * change for value, change in zip(state, slope, strict=True))

    position = np.array(start, dtype=float)
    memory = law.start(Motion(position, np.zeros_like(position)))
    state = (position, np.zeros_like(position), memory.weights, memory.disturbance)
    time, rows = np.arange(round(duration / step)) * step, []
    for now in time:
        first, command = rate(now, state)
        rows.append((distances(state[0]), state[1] - COMMON_VELOCITY, command))
        second, _ = rate(now + step / 2, moved(state, first, step / 2))
        third, _ = rate(now + step / 2, moved(state, second, step / 2))
        fourth, _ = rate(now + step, moved(state, third, step))
        mean = [
            (a + 2.0 * (b + c) + d) / 6.0 for a, b, c, d in zip(first, second, third, fourth, strict=True)
        ]
        state = moved(state, mean, step)
    apart, velocity_error, command = (np.array(row) for row in zip(*rows, strict=True))
    norms = [np.linalg.norm(vectors, axis=-1) for vectors in (velocity_error, command)]
    return Histories(time, apart, *norms)


@pytest.fixture(scope="module")
def flown():
    """Four triangles at once: nominal, without adaptation, close together, crossing."""
    rates = np.array([[1.0], [0.0], [1.0], [1.0]])
    law = spec().build(SETTING)
    law = replace(law, weight_rate=2.0 * rates, disturbance_rate=0.5 * rates)
    return fly(law, [NOMINAL, NOMINAL, CLOSE, CROSSING], 200.0, 0.05)


def last_fifth(history):
    return history[-len(history) // 5 :]


def test_the_triangle_ends_at_its_distances(flown):
    assert flown.distance[-1, 0] == pytest.approx(np.array([100.0, 100.007, 100.052]), abs=0.1)


def test_adaptation_makes_the_distance_error_thirty_times_smaller(flown):
    error = np.abs(last_fifth(flown.distance) - 100.0).max(axis=(0, 2))
    assert error[0] == pytest.approx(0.059, rel=0.2)
    assert error[1] == pytest.approx(1.92, rel=0.2)


def test_adaptation_makes_the_velocity_error_thirty_times_smaller(flown):
    error = last_fifth(flown.velocity_error).max(axis=(0, 2))
    assert error[0] == pytest.approx(0.0282, rel=0.2)
    assert error[1] == pytest.approx(0.933, rel=0.2)


def test_distances_settle_to_a_percent_in_less_than_a_minute(flown):
    outside = np.abs(flown.distance[:, 0] - 100.0) > 1.0
    settled = [flown.time[np.nonzero(column)[0][-1] + 1] for column in outside.T]
    assert settled == pytest.approx([55.0, 43.1, 54.9], abs=2.0)


def test_peak_command_of_the_nominal_triangle(flown):
    assert flown.command[:, 0].max() == pytest.approx(2.853, rel=0.05)


def test_satellites_that_start_twelve_metres_apart_never_come_nearer(flown):
    assert flown.distance[:, 2].min() == pytest.approx(12.04, abs=0.01)


def test_satellites_that_cross_keep_apart_only_with_the_barrier(flown):
    unguarded = fly(spec(barrier=False).build(SETTING), CROSSING, 120.0, 0.1)
    assert flown.distance[:, 3].min() == pytest.approx(77.9, rel=0.05)
    assert unguarded.distance.min() == pytest.approx(26.2, rel=0.05)


@settings(max_examples=4, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_safe_distance_is_kept_from_every_legal_start(seed):
    random = np.random.default_rng(seed)
    starts = random.uniform(-60.0, 60.0, (200, 3, 3)) * random.uniform(0.2, 3.0, (200, 1, 1))
    legal = starts[distances(starts).min(axis=-1) > 11.0][:24]
    law = spec().build(SETTING)
    assert fly(law, legal, 40.0, 0.1).distance.min() > 10.0


places = st.tuples(*[st.floats(-200.0, 200.0)] * 3).map(np.array)


@given(places, st.tuples(*[st.floats(-5.0, 5.0)] * 3).map(np.array), st.booleans())
def test_wanted_acceleration_is_the_derivative_of_the_wanted_velocity(place, closing, barrier):
    if np.linalg.norm(place) < 15.0:
        return
    field = spec(barrier=barrier).build(SETTING).field
    step = 1e-4
    before, after = (field.guidance(RelativeNeighbour(place + t * closing, closing)) for t in (-step, step))
    slope = (after.velocity - before.velocity) / (2.0 * step)
    found = field.guidance(RelativeNeighbour(place, closing)).acceleration
    assert found == pytest.approx(slope, rel=1e-5, abs=1e-6)


@given(places, st.booleans())
def test_wanted_velocity_leads_down_the_potential_below_the_speed_limit(place, barrier):
    if np.linalg.norm(place) < 11.0:
        return
    field = spec(barrier=barrier).build(SETTING).field
    wanted = field.guidance(RelativeNeighbour(place, np.zeros(3))).velocity - COMMON_VELOCITY
    assert np.linalg.norm(wanted) < 3.0
    slope = np.array(
        [(field.potential(place + e) - field.potential(place - e)) / 2e-3 for e in 1e-3 * np.eye(3)]
    )
    raw = -0.01 * slope
    bounded = raw / np.sqrt(1.0 + raw @ raw / 9.0)
    assert wanted == pytest.approx(bounded, rel=1e-3, abs=1e-4)


def test_wanted_velocity_is_finite_and_outward_even_inside_the_safe_distance():
    field = spec().build(SETTING).field
    wanted = field.guidance(RelativeNeighbour(np.array([5.0, 0.0, 0.0]), np.zeros(3))).velocity
    assert (wanted - COMMON_VELOCITY)[0] == pytest.approx(3.0, rel=1e-2)


@given(st.tuples(*[st.floats(-1e3, 1e3)] * 3))
def test_fuzzy_sets_share_out_every_velocity_and_peak_at_their_centres(velocity):
    centres = np.arange(-3.0, 4.0)
    basis = fuzzy_basis(np.array(velocity), centres, np.asarray(1.0))
    assert basis.sum(axis=-1) == pytest.approx(np.ones(3), rel=1e-12)
    nearest = np.argmin(np.abs(np.array(velocity)[:, None] - centres), axis=-1)
    assert np.take_along_axis(basis, nearest[:, None], -1)[:, 0] == pytest.approx(
        basis.max(axis=-1), rel=1e-12
    )


def test_sampled_flight_with_held_commands_ends_at_the_same_distances():
    step = 0.02
    law = spec().build(FlightSetting(mean_motion=1e-3, step=step))
    position = np.array(NOMINAL)
    velocity = np.zeros_like(position)
    memory = law.start(Motion(position, velocity))
    for count in range(5000):
        seen = RelativeNeighbour(position - position[FOLLOWED], velocity - velocity[FOLLOWED])
        action = law.act(Motion(position, velocity), seen, memory, STEP)
        memory = action.memory
        push = action.acceleration + unknown_acceleration((count + 0.5) * step, velocity)
        position = position + step * velocity + 0.5 * step**2 * push
        velocity = velocity + step * push
    assert distances(position) == pytest.approx(np.full(3, 100.0), abs=0.5)


def test_one_satellite_and_a_stack_of_them_command_the_same_bits():
    laws = [spec(distance=d).build(SETTING) for d in (100.0, 50.0)]
    random = np.random.default_rng(8)
    velocity, place, closing = random.standard_normal((3, 2, 3)) * [[[1.0]], [[60.0]], [[1.0]]]
    learnt = Adaptation(random.standard_normal((2, 3, 7)), random.standard_normal((2, 3)))
    stacked = stack(laws).act(Motion(place, velocity), RelativeNeighbour(place, closing), learnt, STEP)
    for index, law in enumerate(laws):
        single = law.act(
            Motion(place[index], velocity[index]),
            RelativeNeighbour(place[index], closing[index]),
            Adaptation(learnt.weights[index], learnt.disturbance[index]),
            STEP,
        )
        assert np.array_equal(single.acceleration, stacked.acceleration[index])
        assert np.array_equal(single.memory.weights, stacked.memory.weights[index])


def test_a_safe_distance_beyond_the_distance_is_refused_in_words():
    with pytest.raises(ValidationError, match=r"safe_distance \(120 m\) has to be below distance \(100 m\)"):
        spec(safe_distance=120.0)


def test_a_step_too_long_for_the_gain_is_refused_in_words():
    with pytest.raises(ValueError, match="needs a step below 1 s, got 2 s"):
        spec().build(FlightSetting(1e-3, 2.0))
