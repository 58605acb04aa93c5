# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A tour of two-impulse transfers as a plan: burns with their times, delta-v, least distance to the chief.

Burns are impulses, or accelerations that are held over one control step.

Equations: docs/controllers/planning.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from satform.control.protocol import Motion
from satform.numeric.elementwise import Array
from satform.planning.coasts import CircularCoasts, Coasts, ModelCoasts
from satform.planning.transfers import Leg, total_delta_v

_STEP_TOLERANCE = 1e-6
_LEAST_STEPS = 3
"""Steps of a leg: its burn, a coast, and the burn at its end."""


@dataclass(frozen=True)
class TourPlan:
    """Burns of a tour and how near it comes to the chief.

    Attributes:
        times: at which the burns begin, s, shape (m,).
        impulses: velocity changes, LVLH, m/s, shape (m, 3); of a burn that is held its acceleration times
            its duration.
        burn_duration: of each burn, s; 0 for impulses.
        closest_distance: to the chief, m.
        closest_time: at which that is so, s.
        end: motion after the last burn, LVLH.
    """

    times: Array
    impulses: Array
    burn_duration: float
    closest_distance: float
    closest_time: float
    end: Motion

    def delta_v(self) -> float:
        """Sum of the impulses' magnitudes, m/s."""
        return total_delta_v(list(self.impulses))

    @property
    def duration(self) -> float:
        """Time from the start to the end of the last burn, s."""
        return float(self.times[-1]) + self.burn_duration

    @property
    def burn_middles(self) -> Array:
        """Times of the middles of the burns, as `timed_burns` takes them, s, shape (m,)."""
        middles: Array = self.times + 0.5 * self.burn_duration
        return middles


def plan_tour(
    start: Motion,
    legs: Sequence[Leg],
    mean_motion: float,
    acceleration: Array | None = None,
    step: float = 0.0,
    model: ModelCoasts | None = None,
) -> TourPlan:
    """Burns of a tour with their times, and the closest distance to the chief on the way.

    Args:
        start: position (m) and velocity (m/s) before the first burn, LVLH, each (3,).
        legs: coasts in order; the last one ends at rest whatever its `stop` says.
        mean_motion: of the chief's orbit, rad/s.
        acceleration: known and constant, acts besides the burns from the start to the end, LVLH, m/s^2,
            shape (3,); none by default.
        step: control step over which each burn is held, s; 0 for impulses. A leg's duration counts from
            the begin of its departure burn and is a whole number of steps; where the tour stops on the way,
            the next departure is one step later.
        model: coasts of another model of relative motion, as about an eccentric chief, with the tour
            beginning at time zero; those of Clohessy and Wiltshire by default.

    Returns:
        The plan; the closest distance is that of 2000 moments of each coast and each burn, or as many as
        the model is looked at.

    Raises:
        ValueError: there are no legs, one of them has no two-impulse solution, or a leg is no whole number
            of steps, or shorter than three.

    Source: Clohessy & Wiltshire 1960; Yamanaka & Ankersen 2002 and Koenig, Guffanti & D'Amico 2017 for
    other models.
    """
    if not legs:
        raise ValueError("a tour needs at least one leg")
    coasts = CircularCoasts(mean_motion) if model is None else model
    flight = _Flight(start, coasts, np.zeros(3) if acceleration is None else np.asarray(acceleration))
    for number, leg in enumerate(legs):
        stop = leg.stop or number == len(legs) - 1
        if step > 0.0:
            _fly_held(flight, leg, number, step, stop=stop)
        else:
            _fly_impulses(flight, leg, stop=stop)
    return TourPlan(
        np.array(flight.times),
        np.array(flight.impulses),
        step,
        *flight.closest,
        Motion(flight.state[:3], flight.state[3:]),
    )


class _Flight:
    """The motion so far, its burns, and how near it came to the chief."""

    def __init__(self, start: Motion, coasts: Coasts, acceleration: Array) -> None:
        self.coasts = coasts
        self.acceleration = acceleration
        self.state = np.concatenate((start.position, start.velocity)).astype(np.float64)
        self.time = 0.0
        self.times: list[float] = []
        self.impulses: list[Array] = []
        self.closest = (np.inf, 0.0)

    def kick(self, impulse: Array) -> None:
        """Change the velocity (m/s) at once."""
        self._note(impulse)
        self.state = np.concatenate((self.state[:3], self.state[3:] + impulse))

    def burn(self, command: Array, step: float) -> None:
        """Hold an acceleration (m/s^2) over a step (s)."""
        self._note(command * step)
        self._move(step, self.acceleration + command)

    def coast(self, duration: float) -> None:
        """Coast for a time, s."""
        self._move(duration, self.acceleration)

    def _note(self, impulse: Array) -> None:
        self.times.append(self.time)
        self.impulses.append(impulse)

    def after(self, duration: float) -> Array:
        """State after a coast from now on, which is not flown."""
        return self.coasts.moved(self.state, self.time, duration, self.acceleration)

    def _move(self, duration: float, acceleration: Array) -> None:
        offsets, track = self.coasts.track(self.state, self.time, duration, acceleration)
        away = np.linalg.norm(track, axis=1)
        nearest = int(np.argmin(away))
        self.closest = min(self.closest, (float(away[nearest]), self.time + float(offsets[nearest])))
        self.state = self.coasts.moved(self.state, self.time, duration, acceleration)
        self.time += duration


def _fly_impulses(flight: _Flight, leg: Leg, *, stop: bool) -> None:
    effect = flight.coasts.position_effect(flight.time, leg.duration)
    missed = leg.position - flight.after(leg.duration)[:3]
    flight.kick(_solved(effect, missed))
    flight.coast(leg.duration)
    if stop:
        flight.kick(-flight.state[3:])


def _fly_held(flight: _Flight, leg: Leg, number: int, step: float, *, stop: bool) -> None:
    coasts, ratio = flight.coasts, leg.duration / step
    steps = round(ratio)
    if abs(ratio - steps) > _STEP_TOLERANCE * max(1.0, ratio) or steps < _LEAST_STEPS:
        raise ValueError(
            f"leg {number} of {leg.duration:g} s is {ratio:.7g} steps of {step:g} s; it has to be a whole "
            f"number of steps, at least {_LEAST_STEPS}"
        )
    coasts.position_effect(flight.time, steps * step)
    held = coasts.held(flight.time, step)
    after_burn = coasts.transition(flight.time + step, (steps - 1) * step)
    missed = leg.position - flight.after(steps * step)[:3]
    flight.burn(_solved((after_burn @ held)[:3], missed), step)
    flight.coast((steps - 1) * step)
    if stop:
        velocity = flight.after(step)[3:]
        flight.burn(-_solved(coasts.held(flight.time, step)[3:], velocity), step)


def _solved(matrix: Array, right: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
