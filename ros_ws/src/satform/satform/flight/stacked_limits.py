# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The check of every step of many runs flown as one: which runs computed or reached something beyond a limit.

A run is found here in the step in which `satform.flight.limits` would end it if it flew alone.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from satform.flight.limits import LARGEST
from satform.flight.plans import LimitPlan
from satform.flight.plant import Plant
from satform.flight.satellite import Decision
from satform.numeric.elementwise import Array
from satform.orbits.earth import EQUATORIAL_RADIUS

Rows = NDArray[np.int64]

_NONE = np.empty(0, dtype=np.int64)
_DIAGONAL = 1.7320509
"""At least the length of a vector with components of 1."""
_SLACK = 1e-9
"""Relative: squared lengths so close to a limit are computed anew as a single flight computes them."""


class StackedLimitCheck:
    """Checks many runs, whose limits are the same."""

    def __init__(self, plans: Sequence[LimitPlan], count: int) -> None:
        """Take the limits.

        Args:
            plans: of each run.
            count: satellites of a run.
        """
        self._limits = limits = plans[0].limits
        self._lowest = EQUATORIAL_RADIUS + limits.altitude
        radius = np.repeat(np.array([plan.chief_radius for plan in plans]), count)
        self._radius = np.where(radius > max(self._lowest, EQUATORIAL_RADIUS), radius, np.inf)
        self._least_radius = float(self._radius.min())
        self._has_ground = bool(np.isfinite(self._radius).any())

    def keep(self, rows: Rows) -> None:
        """Go on with some of the satellites alone."""
        self._radius = self._radius[rows]

    def of_decision(self, decision: Decision, announced: Sequence[Array]) -> Rows:
        """Satellites that computed in a step what is not finite or beyond its limit, by their rows.

        Args:
            decision: of all of them.
            announced: what they announce for the next step, arrays of shape (M, ...).
        """
        limits, motion, reference = self._limits, decision.motion, decision.reference
        computed = [
            (motion.position, limits.distance),
            (motion.velocity, limits.speed),
            (reference.position, limits.distance),
            (reference.velocity, limits.speed),
            (reference.acceleration, limits.acceleration),
            (decision.sliding_variable, LARGEST),
            (decision.acceleration, limits.acceleration),
        ]
        if decision.wheel_torque is not None:
            computed.append((decision.wheel_torque, LARGEST))
        return _any_beyond([*computed, (encode_alike(announced), LARGEST)])

    def of_plant(self, plant: Plant) -> Rows:
        """Satellites whose true states are not finite or beyond a limit, by their rows."""
        limits, motion = self._limits, plant.motion()
        found = _any_beyond(
            [
                (plant.applied, limits.acceleration),
                (motion.position, limits.distance),
                (motion.velocity, limits.speed),
            ]
        )
        for group in plant.turning:
            measured = group.measured()
            own = _any_beyond(
                [
                    (measured.angular_velocity, limits.angular_rate),
                    (measured.mrp, LARGEST),
                    (measured.wheel_momentum, LARGEST),
                ]
            )
            found = np.concatenate((found, group.members[own]))
        return np.concatenate((found, self._below(plant))) if self._has_ground else found

    def _below(self, plant: Plant) -> Rows:
        position = plant.motion().position.T
        # No satellite is nearer to the Earth's centre than its chief less its distance from it.
        longest = _DIAGONAL * max(float(position.max()), -float(position.min()))
        if self._least_radius - longest >= self._lowest:
            return _NONE
        least = self._radius - np.sqrt(_squares(plant.motion().position)) * (1.0 + _SLACK)
        suspects = np.flatnonzero(~(least >= self._lowest))
        if not suspects.size:
            return _NONE
        return suspects[~(plant.earth_distance()[suspects] >= self._lowest)]


def encode_alike(parts: Sequence[Array]) -> Array:
    """Numbers of each satellite side by side, shape (M, width)."""
    rows = [part[:, None] if part.ndim == 1 else part for part in parts]
    return rows[0] if len(rows) == 1 else np.concatenate(rows, axis=1)


def _any_beyond(checked: Sequence[tuple[Array, float]]) -> Rows:
    # As a rule the squares of all satellites' components together are below that of the limit.
    found = [
        _beyond(values, limit)
        for values, limit in checked
        if not np.vdot(values.T, values.T) <= limit * limit
    ]
    return np.concatenate(found) if found else _NONE


def _beyond(values: Array, limit: float) -> Rows:
    """Rows of vectors (M, n) that are not finite or longer than a limit."""
    suspects = np.flatnonzero(~(_squares(values) <= limit * limit * (1.0 - _SLACK)))
    lengths = [math.hypot(*row) for row in values[suspects].tolist()]
    return suspects[[not (math.isfinite(length) and length <= limit) for length in lengths]]


def _squares(values: Array) -> Array:
    """Squared length of each vector, shape (M, n) to (M,)."""
    components = values.T
    total: Array = components[0] * components[0]
    for component in components[1:]:
        total += component * component
    return total
