# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Unobservable directions of formations where they are known in closed form."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from satform.consensus.graph import Graph, LineSpec, NoneSpec
from satform.dynamics.cw import transition_matrix
from satform.navigation.observability import Observability, PlannedFlight, Sight, observability, sources
from satform.numeric.elementwise import Array

RATE = 1.1e-3
WHOLE = "position and velocity of the whole formation"


@dataclass(frozen=True)
class Range:
    """Distance between two satellites."""

    observer: int
    target: int | None
    variance: Array

    def jacobian(self, own: Array, other: Array) -> tuple[Array, Array]:
        away = other[..., :3] - own[..., :3]
        unit = away / np.linalg.norm(away, axis=-1, keepdims=True)
        by_other = np.concatenate((unit, np.zeros_like(unit)), axis=-1)[..., None, :]
        return -by_other, by_other


@dataclass(frozen=True)
class Bearing(Range):
    """Direction of a target, as the components of its unit vector."""

    def jacobian(self, own: Array, other: Array) -> tuple[Array, Array]:
        away = other[..., :3] - own[..., :3]
        distance = np.linalg.norm(away, axis=-1)[..., None, None]
        unit = away / distance[..., 0]
        across = (np.eye(3) - unit[..., :, None] * unit[..., None, :]) / distance
        by_other = np.concatenate((across, np.zeros_like(across)), axis=-1)
        return -by_other, by_other


@dataclass(frozen=True)
class Position(Range):
    """Own position."""

    def jacobian(self, own: Array, other: Array) -> tuple[Array, Array]:
        by_own = np.broadcast_to(np.eye(3, 6), (*own.shape[:-1], 3, 6))
        return by_own, np.zeros_like(by_own)


@dataclass(frozen=True)
class Height(Range):
    """Own radial position."""

    def jacobian(self, own: Array, other: Array) -> tuple[Array, Array]:
        by_own = np.broadcast_to(np.eye(1, 6), (*own.shape[:-1], 1, 6))
        return by_own, np.zeros_like(by_own)


def free(rate: float, count: int, seed: int = 0, forced: float = 0.0) -> PlannedFlight:
    """Free motion over a revolution at 1.1e-3 rad/s; on straight lines where the rate is next to 0."""
    random = np.random.default_rng(seed)
    times = np.linspace(0.0, 2.0 * np.pi / RATE, 50)
    transitions = np.stack([transition_matrix(rate, time) for time in times])
    start = random.normal(size=(count, 6)) * np.repeat([100.0, 100.0 * RATE], 3)
    states = np.einsum("kab,nb->kna", transitions, start)
    states[:, -1, 0] += forced * times**2
    return PlannedFlight(states, transitions, RATE, tuple(f"sat{index + 1}" for index in range(count)))


def seen(flight: PlannedFlight, *models: Range) -> Observability:
    return observability(flight, [Sight(model, np.ones(len(flight.states))) for model in models])


MILLIMETRE, DEGREE = np.array([1e-6]), np.full(3, 1e-4)
METRE = np.ones(3)


def test_ranges_on_straight_lines_leave_translation_and_rotation() -> None:
    pairs = [(first, second) for first in range(4) for second in range(first)]
    found = seen(free(1e-12, 4), *(Range(*pair, MILLIMETRE) for pair in pairs))
    axes = ("radial", "along-track", "cross-track")
    rotations = [f"rotation of the whole formation about the {axis} axis" for axis in axes]
    assert found.words == (WHOLE, *rotations)
    assert found.unobservable.shape == (24, 9)


def test_ranges_about_an_orbit_show_the_attitude_of_the_formation() -> None:
    # The Clohessy-Wiltshire equations are not the same in turned axes.
    pairs = [(first, second) for first in range(4) for second in range(first)]
    assert seen(free(RATE, 4), *(Range(*pair, MILLIMETRE) for pair in pairs)).words == (WHOLE,)


def test_ranges_that_do_not_change_leave_the_phase_of_a_triangle() -> None:
    # General circular orbit of 1 km: the triangle turns like a rigid body.
    flight, phases = free(RATE, 3), 2.0 * np.pi * np.arange(3) / 3.0
    sine, cosine = 1e3 * np.sin(phases), 1e3 * np.cos(phases)
    position = np.stack((0.5 * sine, cosine, np.sqrt(0.75) * sine), axis=-1)
    velocity = RATE * np.stack((0.5 * cosine, -sine, np.sqrt(0.75) * cosine), axis=-1)
    start = np.concatenate((position, velocity), axis=-1)
    turning = replace(flight, states=np.einsum("kab,nb->kna", flight.transitions, start))
    ranges = [Range(first, second, MILLIMETRE) for first, second in ((0, 1), (0, 2), (1, 2))]
    found = seen(turning, *ranges, Position(0, None, METRE))
    assert "the phase of the whole formation on its relative orbits" in found.words


def test_bearings_of_free_motion_leave_the_scale() -> None:
    found = seen(free(RATE, 2), Bearing(0, 1, DEGREE), Position(0, None, METRE))
    assert found.words == ("the distance of sat2 from sat1",)
    # Woffinden and Geller: the relative state itself, at any rate of bearings.
    start = free(RATE, 2).states[0] / np.repeat([1.0, RATE], 3)
    ray = np.concatenate((np.zeros(6), start[1] - start[0]))
    assert abs(ray @ found.unobservable[:, 0]) == pytest.approx(np.linalg.norm(ray), rel=1e-9)


def test_each_target_of_one_camera_has_a_scale_of_its_own() -> None:
    found = seen(free(RATE, 3), Bearing(0, 1, DEGREE), Bearing(0, 2, DEGREE), Position(0, None, METRE))
    assert found.words == ("the distance of sat2 from sat1", "the distance of sat3 from sat1")


def test_cameras_on_two_satellites_leave_one_scale_for_all() -> None:
    bearings = [Bearing(0, 1, DEGREE), Bearing(0, 2, DEGREE), Bearing(1, 2, DEGREE)]
    assert seen(free(RATE, 3), *bearings).words == (
        WHOLE,
        "the size of the whole formation, with all distances in the same ratio",
    )


def test_with_the_motion_of_one_known_the_scale_of_all_is_left() -> None:
    bearings = [Bearing(0, 1, DEGREE), Bearing(0, 2, DEGREE), Bearing(1, 2, DEGREE)]
    found = seen(free(RATE, 3), *bearings, Position(0, None, METRE))
    assert found.words == ("the size of the whole formation, with all distances in the same ratio",)


def test_absolute_positions_of_two_observers_give_the_scale() -> None:
    bearings = [Bearing(0, 2, DEGREE), Bearing(1, 2, DEGREE)]
    positions = [Position(0, None, METRE), Position(1, None, METRE)]
    found = seen(free(RATE, 3), *bearings, *positions)
    assert found.words == ()
    assert found.unobservable.shape == (18, 0)


def test_a_manoeuvre_gives_the_scale() -> None:
    manoeuvred = free(RATE, 2, forced=1e-4)
    assert seen(manoeuvred, Bearing(0, 1, DEGREE), Position(0, None, METRE)).words == ()


def test_a_satellite_that_nobody_measures_is_named() -> None:
    found = seen(free(RATE, 3), Position(0, None, METRE), Range(0, 1, MILLIMETRE))
    assert found.words == ("position and velocity of sat3",)


def test_without_readings_all_is_unobservable() -> None:
    flight = free(RATE, 2)
    found = observability(flight, [Sight(Range(0, 1, MILLIMETRE), np.zeros(50))])
    assert found.words == ("position and velocity of sat1", "position and velocity of sat2")
    assert found.unobservable.shape == (12, 12)


def test_pairs_that_do_not_see_each_other_are_named() -> None:
    found = seen(free(RATE, 4), Range(0, 1, MILLIMETRE), Range(2, 3, MILLIMETRE))
    assert found.words == (
        "position and velocity of sat1, sat2 together",
        "position and velocity of sat3, sat4 together",
    )


def test_motion_out_of_the_plane_is_apart_from_that_in_it() -> None:
    # The cross-track oscillation is not coupled with the orbital plane.
    assert seen(free(RATE, 1), Height(0, None, np.ones(1))).words == (
        "cross-track position and velocity of sat1",
        "a combined motion of sat1",
    )


def test_a_known_target_leaves_the_distance_from_it() -> None:
    flight = free(RATE, 2)
    sights = [Sight(Bearing(0, 1, DEGREE), np.ones(len(flight.states)))]
    known = observability(flight, sights, estimated=[0])
    assert known.words == ("the distance of sat1 from sat2",)
    assert known.singular_values.shape == (6,)
    # With both unknown: six of the pair, and its scale.
    assert observability(flight, sights).unobservable.shape == (12, 7)


def test_singular_values_are_those_of_the_gramian() -> None:
    # Own position measured at rest: of each axis the double integrator's sum of 1, t and t^2.
    flight = free(1e-12, 1)
    found = seen(flight, Position(0, None, np.full(3, 4.0)))
    times = RATE * np.linspace(0.0, 2.0 * np.pi / RATE, 50)
    gramian = np.array([[50.0, times.sum()], [times.sum(), (times**2).sum()]]) / 4.0
    expected = np.repeat(np.sqrt(np.linalg.eigvalsh(gramian)[::-1]), 3)
    assert found.singular_values == pytest.approx(expected, rel=1e-6)


def test_readings_count_as_often_as_they_are_taken() -> None:
    flight = free(RATE, 1)
    once, often = (
        observability(flight, [Sight(Position(0, None, METRE), np.full(50, readings))]).singular_values
        for readings in (1.0, 9.0)
    )
    assert often == pytest.approx(3.0 * once, rel=1e-12)


def test_measurements_reach_along_directed_edges() -> None:
    graph = Graph.of_edges(4, receivers=[1, 2], senders=[0, 1])
    assert sources(graph) == ({0}, {0, 1}, {0, 1, 2}, {3})
    assert sources(LineSpec().build(3)) == ({0, 1, 2},) * 3
    assert sources(NoneSpec().build(2)) == ({0}, {1})
