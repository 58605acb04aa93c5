# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Coasts of relative motion under a constant acceleration, by Clohessy and Wiltshire or by another model.

Equations: docs/controllers/planning.md.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from satform.dynamics import cw
from satform.dynamics.relative_motion_models import RelativeMotionModel, input_matrix
from satform.numeric.elementwise import Array
from satform.planning.transfers import coast_to_point, velocity_to_point

_SAMPLES = 2000
"""Moments of a coast at which its distance is looked at."""

_LEAST_PIECES = 16
"""Pieces of a coast over each of which the effect of a constant acceleration is integrated."""


class Coasts(Protocol):
    """Motion from a time on, states as (position, velocity) in LVLH, m and m/s."""

    def transition(self, begin: float, duration: float) -> Array:
        """State transition over a duration from a time on, s, shape (6, 6)."""

    def held(self, begin: float, duration: float) -> Array:
        """Effect of an acceleration that is held over one control step, shape (6, 3)."""

    def position_effect(self, begin: float, duration: float) -> Array:
        """Effect of a velocity on the position after a coast, s, shape (3, 3).

        Raises:
            ValueError: the duration is not positive, or not every point can be reached.
        """

    def moved(self, state: Array, begin: float, duration: float, acceleration: Array) -> Array:
        """State (6,) after a coast under a constant acceleration (3,)."""

    def track(self, state: Array, begin: float, duration: float, acceleration: Array) -> tuple[Array, Array]:
        """Times since the begin of a coast, s, shape (n,), and positions then, m, shape (n, 3)."""


@dataclass(frozen=True)
class CircularCoasts:
    """Coasts about a circular orbit, in closed form.

    Attributes:
        mean_motion: of the chief, rad/s.
    """

    mean_motion: float

    def transition(self, begin: float, duration: float) -> Array:
        """State transition; as in `Coasts.transition`."""
        return cw.transition_matrix(self.mean_motion, duration)

    def held(self, begin: float, duration: float) -> Array:
        """Effect of a held acceleration; as in `Coasts.held`."""
        return cw.input_matrix(self.mean_motion, duration)

    def position_effect(self, begin: float, duration: float) -> Array:
        """Effect of a velocity on the position; as in `Coasts.position_effect`."""
        return coast_to_point(self.mean_motion, duration)[1]

    def moved(self, state: Array, begin: float, duration: float, acceleration: Array) -> Array:
        """State after a coast; as in `Coasts.moved`."""
        moved: Array = self.transition(begin, duration) @ state
        return moved + self.held(begin, duration) @ acceleration

    def track(self, state: Array, begin: float, duration: float, acceleration: Array) -> tuple[Array, Array]:
        """Positions on a coast; as in `Coasts.track`."""
        offsets = np.linspace(0.0, duration, _SAMPLES)
        coast = cw.FreeMotion.over(self.mean_motion, offsets)
        held = cw.HeldInputStep.over(self.mean_motion, offsets)
        positions = (
            coast.position_from_position(state[:3])
            + coast.position_from_velocity(state[3:])
            + held.position_from_input(acceleration)
        )
        return offsets, positions


@dataclass(frozen=True)
class ModelCoasts:
    """Coasts by a model of relative motion by name, as about an eccentric chief.

    Attributes:
        model: whose time zero is that of the plan.
        period: of the chief's orbit, s.
        samples: moments of a coast at which its distance is looked at.
    """

    model: RelativeMotionModel
    period: float
    samples: int = _SAMPLES

    def transition(self, begin: float, duration: float) -> Array:
        """State transition; as in `Coasts.transition`."""
        return self.model.transition(begin, begin + duration)

    def held(self, begin: float, duration: float) -> Array:
        """Effect of a held acceleration; as in `Coasts.held`. Exact to the seventh power of the duration."""
        return input_matrix(self.model, begin, begin + duration)

    def position_effect(self, begin: float, duration: float) -> Array:
        """Effect of a velocity on the position; as in `Coasts.position_effect`."""
        return velocity_to_point(self.model, begin, duration)

    def moved(self, state: Array, begin: float, duration: float, acceleration: Array) -> Array:
        """State after a coast; as in `Coasts.moved`.

        The effect of the acceleration is integrated piece by piece, a hundred and more in an orbit.
        """
        moved: Array = self.transition(begin, duration) @ state
        if np.any(acceleration):
            pieces = max(_LEAST_PIECES, int(np.ceil(128.0 * duration / self.period)))
            edges = begin + duration * np.arange(pieces + 1) / pieces
            forced = input_matrix(self.model, edges[:-1], edges[1:]) @ acceleration
            onward = self.model.transition(edges[1:], np.full(pieces, edges[-1]))
            moved = moved + (onward @ forced[..., None])[..., 0].sum(axis=0)
        return moved

    def track(self, state: Array, begin: float, duration: float, acceleration: Array) -> tuple[Array, Array]:
        """Positions on a coast; as in `Coasts.track`."""
        offsets = np.linspace(0.0, duration, self.samples)
        ahead = self.model.transition(np.full(self.samples, begin), begin + offsets)
        states = ahead @ state
        if np.any(acceleration):
            times = begin + offsets
            forced = input_matrix(self.model, times[:-1], times[1:]) @ acceleration
            onward = self.model.transition(times[:-1], times[1:])
            response = np.zeros(6)
            for sample, (transition, increment) in enumerate(zip(onward, forced, strict=True), 1):
                response = transition @ response + increment
                states[sample] += response
        return offsets, states[:, :3]
