# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How near two satellites come to each other if thrust stops: free relative motion over some orbits."""

import math

import numpy as np

from satform.dynamics.cw import FreeMotion, natural_acceleration
from satform.numeric.elementwise import Array, dot, norm

_SAMPLES_PER_ORBIT = 120
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
    count = max(1, math.ceil(orbits * _SAMPLES_PER_ORBIT))
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
