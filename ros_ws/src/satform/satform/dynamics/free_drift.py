# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How near two satellites come to each other if thrust stops: free relative motion over some orbits."""

import math
from collections.abc import Iterator

import numpy as np

from satform.dynamics.cw import FreeMotion, natural_acceleration
from satform.dynamics.yamanaka_ankersen import YamanakaAnkersenModel
from satform.numeric.elementwise import Array, dot, norm
from satform.orbits.chief import KeplerianChief

SAMPLES_PER_ORBIT = 120
"""Instants at which the motion is computed exactly; between two of them it is nearly uniform."""

_NEWTON_STEPS = 6


def least_free_distance(
    position: Array, velocity: Array, mean_motion: float | Array, orbits: float
) -> tuple[Array, Array]:
    """Least distance of two satellites over some orbits of free Clohessy-Wiltshire motion.

    Args:
        position: of one relative to the other, LVLH, m, shape (..., 3).
        velocity: likewise, in the rotating frame, m/s, shape (..., 3).
        mean_motion: of the chief, rad/s, shape (...) or broadcast against it.
        orbits: of free motion, not negative.

    Returns:
        The distance in m and the time after which it is reached in s, shape (...) each.

    Source: Clohessy & Wiltshire 1960. The nearest of the sampled instants, with uniform motion about each, is
    improved by Newton's method for the zero of position times velocity.
    """
    if position.ndim == 1:
        # A single state in an array, too: powers of arrays and of numbers differ in the last bit.
        least, at = least_free_distance(position[None], velocity[None], mean_motion, orbits)
        return least[0], at[0]
    # One map for all states of a chief, not one for each.
    rate = np.atleast_1d(np.asarray(mean_motion, dtype=np.float64))
    shape = np.broadcast_shapes(rate.shape, position.shape[:-1])
    count = max(1, math.ceil(orbits * SAMPLES_PER_ORBIT))
    spacing = math.tau * orbits / count / rate
    end = count * spacing
    least, at = np.full(shape, np.inf), np.zeros(shape)
    for index in range(count + 1):
        time = index * spacing
        apart, motion = FreeMotion.over(rate, time).advance(position, velocity)
        ahead = np.clip(_to_closest(apart, motion), -0.5 * spacing, 0.5 * spacing)
        ahead = np.clip(time + ahead, 0.0, end) - time
        nearest = apart + ahead[..., None] * motion
        squared = dot(nearest, nearest)
        at = np.where(squared < least, time + ahead, at)
        least = np.minimum(squared, least)
    return _refined(position, velocity, np.broadcast_to(rate, shape), at, spacing, end)


def _refined(
    position: Array, velocity: Array, rate: Array, at: Array, spacing: Array, end: Array
) -> tuple[Array, Array]:
    """The local minimum about an instant, no further from it than a sample."""
    natural = natural_acceleration(rate)
    earliest, latest = np.maximum(at - spacing, 0.0), np.minimum(at + spacing, end)
    best, best_at = np.full(rate.shape, np.inf), at
    for _ in range(_NEWTON_STEPS):
        apart, motion = FreeMotion.over(rate, at).advance(position, velocity)
        distance = norm(apart)
        best_at = np.where(distance < best, at, best_at)
        best = np.minimum(distance, best)
        slope, curvature = dot(apart, motion), dot(motion, motion) + dot(apart, natural.at(apart, motion))
        ahead = np.where(curvature > 0.0, -slope / np.where(curvature > 0.0, curvature, 1.0), 0.0)
        at = np.clip(at + ahead, earliest, latest)
    return best, best_at


def _to_closest(apart: Array, motion: Array) -> Array:
    """Time to the closest approach of uniform motion, s, shape (...); 0 without motion."""
    speed_squared = dot(motion, motion)
    found: Array = -dot(apart, motion) / np.where(speed_squared > 0.0, speed_squared, 1.0)
    return found


def least_free_distances(
    chief: KeplerianChief, times: Array, position: Array, velocity: Array, orbits: float
) -> Array:
    """Least distances of pairs of satellites over some orbits of free motion about an eccentric chief.

    Args:
        chief: its orbit.
        times: of the states, since time zero, s, ascending, shape (K,).
        position: of one of each pair relative to the other, LVLH, m, shape (K, P, 3).
        velocity: likewise, in the rotating frame, m/s, shape (K, P, 3).
        orbits: of free motion, not negative.

    Returns:
        m, shape (K, P).

    Source: Yamanaka & Ankersen 2002. Between sampled instants, which lie at equal eccentric anomalies, the
    relative acceleration is constant.
    """
    model, duration = YamanakaAnkersenModel(chief), orbits * chief.period
    states = np.concatenate((position, velocity), axis=-1)
    ends = times + duration
    at_zero, after = np.empty_like(states), np.empty_like(states)
    for row in range(len(times)):
        at_zero[row] = _product(_transition(model, times[row], 0.0), states[row])
        after[row] = _product(_transition(model, times[row], ends[row]), states[row])
    least = np.full(states.shape[:-1], np.inf)
    for row in range(len(times)):
        for time, own in ((times[row], states[row]), (ends[row], after[row])):
            found = _nearest(model, time, own, times[row] - time, ends[row] - time)
            least[row] = np.minimum(least[row], found)
    for time in _instants(chief, float(times[0]), float(ends[-1])) if len(times) else ():
        # States from whose free motion this instant is a part.
        begin, end = np.searchsorted(ends, time), np.searchsorted(times, time, side="right")
        if begin < end:
            rows = slice(begin, end)
            own = _product(_transition(model, 0.0, time), at_zero[rows])
            earliest, latest = (times[rows] - time)[:, None], (ends[rows] - time)[:, None]
            least[rows] = np.minimum(least[rows], _nearest(model, time, own, earliest, latest))
    return least


def _instants(chief: KeplerianChief, begin: float, end: float) -> Iterator[float]:
    """Times at multiples of a part of a revolution of the eccentric anomaly that lie in a stretch, s."""
    rate, part = chief.mean_motion, math.tau / SAMPLES_PER_ORBIT
    count = math.floor(chief.mean_anomaly_at(begin) / part) - 1 - SAMPLES_PER_ORBIT
    time = begin
    while time <= end:
        count += 1
        anomaly = count * part
        time = (anomaly - chief.eccentricity * math.sin(anomaly) - chief.mean_anomaly) / rate
        if begin <= time <= end:
            yield time


def _transition(model: YamanakaAnkersenModel, begin: float, end: float) -> Array:
    """State transition, shape (6, 6), from arrays of one: its bits depend on nothing beside it."""
    matrix: Array = model.transition(np.array([begin]), np.array([end]))[0]
    return matrix


def _product(matrix: Array, states: Array) -> Array:
    """Matrix times each of some states, shape (..., 6), with the same bits however many there are."""
    total = states[..., 0, None] * matrix[:, 0]
    for column in range(1, 6):
        total = total + states[..., column, None] * matrix[:, column]
    return total


def _nearest(
    model: YamanakaAnkersenModel, time: float, states: Array, earliest: Array, latest: Array
) -> Array:
    """Least distance about an instant, m, shape (...), between offsets in s, under constant acceleration."""
    chief = model.chief
    # Half of the way to the next instant, and a little more.
    half_width = 0.55 * chief.period / SAMPLES_PER_ORBIT * chief.radius(time) / chief.semi_major_axis
    apart, motion = states[..., :3], states[..., 3:]
    acceleration = _product(model.system_matrix(np.array([time]))[0], states)[..., 3:]
    ahead = np.zeros(states.shape[:-1])
    low, high = np.maximum(earliest, -half_width), np.minimum(latest, half_width)
    for _ in range(_NEWTON_STEPS):
        speed = motion + acceleration * ahead[..., None]
        offset = apart + (motion + 0.5 * acceleration * ahead[..., None]) * ahead[..., None]
        slope, curvature = dot(offset, speed), dot(speed, speed) + dot(offset, acceleration)
        change = np.where(curvature > 0.0, -slope / np.where(curvature > 0.0, curvature, 1.0), 0.0)
        ahead = np.clip(ahead + change, low, high)
    there = apart + (motion + 0.5 * acceleration * ahead[..., None]) * ahead[..., None]
    return np.minimum(norm(there), norm(apart))
