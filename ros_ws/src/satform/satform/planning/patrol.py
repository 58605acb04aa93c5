# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Patrol of the geostationary belt: close passes of several satellites with the sun behind the observer.

The observer is below the belt in the equatorial plane and drifts eastward past its targets. Only its
altitude, and with it its drift rate, is changed, by pairs of small tangential burns half a day apart.
A target with an inclined orbit is near the equator only at its node.

Equations: docs/controllers/planning.md.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from satform.numeric.elementwise import Array
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.sun import greenwich_angle
from satform.planning.patrol_orbit import GEOSTATIONARY_RADIUS, Burn, altitude_change
from satform.planning.patrol_passes import (
    Encounter,
    Patrol,
    PatrolTarget,
    clearance,
    closest_approach,
    closest_pass,
    encounters,
    target_position,
    watcher_position,
)

__all__ = [
    "GEOSTATIONARY_RADIUS",
    "Burn",
    "Encounter",
    "NoPatrolError",
    "Patrol",
    "PatrolGoal",
    "PatrolPlan",
    "PatrolTarget",
    "altitude_change",
    "burn_in_lvlh",
    "clearance",
    "closest_approach",
    "closest_pass",
    "encounters",
    "plan_patrol",
    "target_position",
    "watcher_position",
]

_REST_AFTER_PASS = 3600.0
_FINEST_CHANGE = 50.0


@dataclass(frozen=True)
class PatrolGoal:
    """What makes one plan better than another.

    A pass at `distance` counts as much as light from `light_angle`, and each counts with its square.

    Attributes:
        distance: m.
        light_angle: rad.
        budget: sum of all changes of speed that is not exceeded, m/s.
        keep_out: distance to every target below which the watcher never comes, m.
        largest_altitude_change: largest change of altitude between two targets, m.
        altitude_grid: between the changes that are tried first, m.
    """

    distance: float = 50e3
    light_angle: float = math.radians(30.0)
    budget: float = 0.45
    keep_out: float = 35e3
    largest_altitude_change: float = 8e3
    altitude_grid: float = 500.0


@dataclass(frozen=True)
class PatrolPlan:
    """Burns, and the passes that they lead to.

    Attributes:
        burns: in order of time.
        encounters: in the order of the targets.
    """

    burns: tuple[Burn, ...]
    encounters: tuple[Encounter, ...]

    def delta_v(self) -> float:
        """Sum of the burns' magnitudes, m/s."""
        return sum(abs(burn.speed_change) for burn in self.burns)


class NoPatrolError(ValueError):
    """No plan that keeps its constraints was found.

    Attributes:
        nearest: largest distance in m to every target that a plan within budget and duration keeps; None
            when none passes every target in sunlight.
    """

    def __init__(self, sentence: str, nearest: float | None) -> None:
        super().__init__(sentence, nearest)
        self.nearest = nearest

    def __str__(self) -> str:
        return str(self.args[0])


def plan_patrol(patrol: Patrol, goal: PatrolGoal | None = None, width: int = 6) -> PatrolPlan:
    """Altitude changes, one before each target, after which the targets are seen near and well lit.

    Leg after leg the best partial plans are kept and extended by every altitude change of a grid;
    the best plan's changes are then refined together. The search is deterministic.

    Args:
        patrol: what has to be patrolled, and from where.
        goal: how plans are compared, and what they have to keep: the budget, and the keep-out distance to
            every target from the patrol's start to its end.
        width: number of partial plans that are kept.

    Returns:
        The plan; without burns if nothing is better.

    Raises:
        NoPatrolError: no plan was found that keeps budget, duration, keep-out distance and sunlight.
    """
    goal = goal or PatrolGoal()
    best = _Search(patrol, goal, lambda draft: draft.cost(goal), goal.keep_out).best(width)
    if best is None:
        # What a search for nearness leaves out, one for distance may find; else it finds what is feasible.
        best = _Search(patrol, goal, lambda draft: draft.closeness(goal), math.inf).best(width)
        if best is None or best.clear < goal.keep_out:
            raise _no_plan(patrol, goal, None if best is None else best.clear)
    return PatrolPlan(best.burns(), best.seen)


def _no_plan(patrol: Patrol, goal: PatrolGoal, nearest: float | None) -> NoPatrolError:
    within = f"within {goal.budget:g} m/s and {patrol.duration / 86400.0:g} days"
    if nearest is None:
        return NoPatrolError(f"no plan was found that passes every target in sunlight {within}", None)
    return NoPatrolError(
        f"no plan was found that stays {goal.keep_out / 1e3:g} km away from every target all the time "
        f"{within}; the largest distance for which one was found is "
        f"{math.floor(nearest / 10.0) / 100.0:g} km",
        nearest,
    )


@dataclass(frozen=True)
class _Draft:
    """Altitude changes so far, the times at which they begin, and the passes that they lead to.

    Attributes:
        changes: of altitude, m.
        starts: of the first burn of each, s.
        seen: passes of the targets.
        clear: distance to the nearest target up to the last pass, and up to the end in a whole plan, m.
    """

    changes: tuple[float, ...]
    starts: tuple[float, ...]
    seen: tuple[Encounter, ...]
    clear: float = math.inf

    def burns(self) -> tuple[Burn, ...]:
        pairs = [
            altitude_change(start, change)
            for start, change in zip(self.starts, self.changes, strict=True)
            if change != 0.0
        ]
        return tuple(burn for pair in pairs for burn in pair)

    def delta_v(self) -> float:
        return sum(abs(burn.speed_change) for burn in self.burns())

    def cost(self, goal: PatrolGoal) -> float:
        """What is less the better, infinite for what breaks a constraint."""
        if self.delta_v() > goal.budget or self.clear < goal.keep_out:
            return math.inf
        total = 0.0
        for seen in self.seen:
            if not seen.sunlit:
                return math.inf
            total += (seen.distance / goal.distance) ** 2 + (seen.light_angle / goal.light_angle) ** 2
        return total

    def closeness(self, goal: PatrolGoal) -> float:
        """The less the farther the nearest target is, infinite for what breaks another constraint."""
        if self.delta_v() > goal.budget or not all(seen.sunlit for seen in self.seen):
            return math.inf
        return -self.clear


@dataclass(frozen=True)
class _Search:
    """A search for the plan of least cost.

    Attributes:
        patrol: what has to be patrolled.
        goal: grid of the changes of altitude.
        cost: of a draft, infinite for one that breaks a constraint.
        enough: clearance beyond which it does not matter, m.
    """

    patrol: Patrol
    goal: PatrolGoal
    cost: Callable[[_Draft], float]
    enough: float

    def best(self, width: int) -> _Draft | None:
        """The best plan that is found, None when every one breaks a constraint."""
        count = round(self.goal.largest_altitude_change / self.goal.altitude_grid)
        changes = [self.goal.altitude_grid * index for index in range(-count, count + 1)]
        kept = [_Draft((), (), ())]
        for _ in self.patrol.targets:
            grown = [draft for parent in kept for draft in self._grown(parent, changes)]
            kept = sorted(grown, key=self.cost)[:width]
        feasible = [draft for draft in map(self._completed, kept) if self.cost(draft) < math.inf]
        return self._refined(min(feasible, key=self.cost)) if feasible else None

    def _grown(self, parent: _Draft, changes: Sequence[float]) -> list[_Draft]:
        """The draft with each change of altitude before the next target, where it keeps its constraints."""
        start, since = 0.0, 0.0
        if parent.seen:
            half_day = math.pi / math.sqrt(GRAVITATIONAL_PARAMETER / GEOSTATIONARY_RADIUS**3)
            since = parent.seen[-1].time
            start = max(since + _REST_AFTER_PASS, parent.starts[-1] + half_day)
        if start >= self.patrol.duration:
            return []
        target = self.patrol.targets[len(parent.seen)]
        drafts = []
        for change in changes:
            draft = _Draft((*parent.changes, change), (*parent.starts, start), parent.seen, parent.clear)
            burns = draft.burns()
            if self.cost(draft) == math.inf or not self._in_time(burns):
                continue
            seen = closest_pass(self.patrol, burns, target, since=start)
            draft = replace(draft, seen=(*parent.seen, seen))
            # Light and budget are known already, and the clearance takes longest to find.
            if self.cost(draft) < math.inf:
                clear = clearance(self.patrol, burns, since, seen.time, self.enough)
                drafts.append(replace(draft, clear=min(parent.clear, clear)))
        return [draft for draft in drafts if self.cost(draft) < math.inf]

    def _in_time(self, burns: Sequence[Burn]) -> bool:
        return not burns or burns[-1].time <= self.patrol.duration

    def _completed(self, draft: _Draft) -> _Draft:
        """The draft with its clearance over the whole patrol."""
        whole = clearance(self.patrol, draft.burns(), 0.0, self.patrol.duration, self.enough)
        return replace(draft, clear=whole)

    def _refined(self, draft: _Draft) -> _Draft:
        shift_size, best = 0.5 * self.goal.altitude_grid, draft
        while shift_size > _FINEST_CHANGE:
            before = best
            for leg in range(len(best.changes)):
                for shift in (-shift_size, shift_size):
                    trial = self._shifted(best, leg, shift)
                    best = best if trial is None else min(best, trial, key=self.cost)
            shift_size = 0.5 * shift_size if best is before else shift_size
        return best

    def _shifted(self, draft: _Draft, leg: int, shift: float) -> _Draft | None:
        """The draft with one altitude change shifted, and the passes that this alters; None past the end."""
        changes = (*draft.changes[:leg], draft.changes[leg] + shift, *draft.changes[leg + 1 :])
        shifted = replace(draft, changes=changes)
        burns, later = shifted.burns(), zip(self.patrol.targets[leg:], draft.starts[leg:], strict=True)
        if not self._in_time(burns):
            return None
        seen = [closest_pass(self.patrol, burns, target, since=start) for target, start in later]
        return self._completed(replace(shifted, seen=(*draft.seen[:leg], *seen)))


def burn_in_lvlh(patrol: Patrol, burns: Sequence[Burn], burn: Burn, chief_longitude: float) -> Array:
    """A tangential burn of the watcher in the LVLH axes of a geostationary chief.

    Args:
        patrol: gives the watcher's first orbit.
        burns: all of them, in order of time.
        burn: the one that is wanted.
        chief_longitude: east of Greenwich, rad.

    Returns:
        m/s, shape (3,). The watcher's direction of flight is taken square to its radius.
    """
    position = watcher_position(patrol, burns, np.array([burn.time]))[0]
    motion = math.sqrt(GRAVITATIONAL_PARAMETER / GEOSTATIONARY_RADIUS**3)
    chief = greenwich_angle(patrol.start_day) + chief_longitude + motion * burn.time
    ahead = math.atan2(position[1], position[0]) - chief
    return burn.speed_change * np.array([-math.sin(ahead), math.cos(ahead), 0.0])
