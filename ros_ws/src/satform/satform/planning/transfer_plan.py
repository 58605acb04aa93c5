# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A tour of two-impulse transfers as a plan: times, impulses, delta-v, least distance to the chief.

Equations: docs/controllers/planning.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from satform.control.protocol import Motion
from satform.dynamics import cw
from satform.numeric.elementwise import Array
from satform.planning.transfers import Leg, total_delta_v, tour_impulses

_SAMPLES = 2000


@dataclass(frozen=True)
class TourPlan:
    """Impulses of a tour and how near it comes to the chief.

    Attributes:
        times: of the impulses, s, shape (m,).
        impulses: velocity changes, LVLH, m/s, shape (m, 3).
        closest_distance: to the chief, m.
        closest_time: at which that is so, s.
    """

    times: Array
    impulses: Array
    closest_distance: float
    closest_time: float

    def delta_v(self) -> float:
        """Sum of the impulses' magnitudes, m/s."""
        return total_delta_v(list(self.impulses))


def plan_tour(start: Motion, legs: Sequence[Leg], mean_motion: float) -> TourPlan:
    """Impulses of a tour with their times, and the closest distance to the chief on the way.

    Args:
        start: position (m) and velocity (m/s) before the first impulse, LVLH, each (3,).
        legs: coasts in order; the last one ends at rest whatever its `stop` says.
        mean_motion: of the chief's orbit, rad/s.

    Returns:
        The plan; the closest distance is that of 2000 moments of each leg.

    Raises:
        ValueError: there are no legs, or one of them has no two-impulse solution.

    Source: Clohessy & Wiltshire 1960.
    """
    impulses = tour_impulses(start, legs, mean_motion)
    times, flown = [0.0], iter(impulses)
    position, velocity = start.position, start.velocity + next(flown)
    begin, closest = 0.0, (np.inf, 0.0)
    for number, leg in enumerate(legs):
        offsets = np.linspace(0.0, leg.duration, _SAMPLES)
        track = np.array([_coasted(position, velocity, mean_motion, offset)[:3] for offset in offsets])
        away = np.linalg.norm(track, axis=1)
        nearest = int(np.argmin(away))
        closest = min(closest, (float(away[nearest]), begin + float(offsets[nearest])))
        velocity = _coasted(position, velocity, mean_motion, leg.duration)[3:]
        position, begin = leg.position, begin + leg.duration
        last = number == len(legs) - 1
        for _ in range(1 if last or not leg.stop else 2):
            velocity = velocity + next(flown)
            times.append(begin)
    return TourPlan(np.array(times), np.array(impulses), *closest)


def _coasted(position: Array, velocity: Array, mean_motion: float, duration: float) -> Array:
    moved: Array = cw.transition_matrix(mean_motion, duration) @ np.concatenate((position, velocity))
    return moved
