# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The check of every step of many runs flown as one: which runs computed or reached something beyond a limit.

A run is found here in the step in which `satform.flight.limits` would end it if it flew alone.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from satform.flight.limits import (
    QUANTITIES,
    Quantity,
    attitude_values,
    computed_values,
    limit_values,
    true_values,
)
from satform.flight.plans import LimitPlan
from satform.flight.plant import Plant
from satform.flight.satellite_step import Decision
from satform.numeric.elementwise import Array, Indices
from satform.orbits.earth import EQUATORIAL_RADIUS

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
        limits = plans[0].limits
        self._limits = limit_values(limits)
        self._lowest = EQUATORIAL_RADIUS + limits.altitude
        radius = np.repeat(np.array([plan.chief_radius for plan in plans]), count)
        self._radius = np.where(radius > max(self._lowest, EQUATORIAL_RADIUS), radius, np.inf)
        self._least_radius = float(self._radius.min())
        self._has_ground = bool(np.isfinite(self._radius).any())

    def keep(self, rows: Indices) -> None:
        """Go on with some of the satellites alone."""
        self._radius = self._radius[rows]

    def of_decision(self, decision: Decision, announced: Array) -> Indices:
        """Satellites that computed in a step what is not finite or beyond its limit, by their rows.

        Args:
            decision: of all of them.
            announced: numbers that each of them announces for the next step, shape (M, width).
        """
        return self._any_beyond(
            (quantity, values)
            for quantity, values in zip(QUANTITIES, computed_values(decision, announced), strict=True)
            if values is not None
        )

    def of_plant(self, plant: Plant) -> Indices:
        """Satellites whose true states are not finite or beyond a limit, by their rows."""
        found = self._any_beyond(true_values(plant))
        for group in plant.turning:
            own = self._any_beyond(attitude_values(group.measured()))
            found = np.concatenate((found, group.members[own]))
        return np.concatenate((found, self._below(plant))) if self._has_ground else found

    def _any_beyond(self, checked: Iterable[tuple[Quantity, Array]]) -> Indices:
        found = []
        for quantity, values in checked:
            limit = self._limits[quantity.bound]
            # As a rule the squares of all satellites' components together are below that of the limit.
            if not np.vdot(values.T, values.T) <= limit * limit:
                found.append(_beyond(values, limit))
        return np.concatenate(found) if found else _NONE

    def _below(self, plant: Plant) -> Indices:
        distance = plant.modelled_earth_distance()
        if distance is not None:
            return np.flatnonzero(~(distance >= self._lowest) & np.isfinite(self._radius))
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


def _beyond(values: Array, limit: float) -> Indices:
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
