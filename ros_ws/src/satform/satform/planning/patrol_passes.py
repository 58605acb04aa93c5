# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Positions of an observer of the geostationary belt and its targets; distance and light of their passes.

Equations: docs/controllers/planning.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from satform.numeric.elementwise import Array, dot, norm
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.sun import greenwich_angle, in_cylindrical_shadow, sun_direction
from satform.planning.patrol_orbit import GEOSTATIONARY_RADIUS, Burn, PlanarOrbit

_COARSE_INTERVAL = 600.0


@dataclass(frozen=True)
class PatrolTarget:
    """A satellite on a circular geosynchronous orbit.

    Attributes:
        longitude: at which it crosses the equator, east of Greenwich, rad.
        inclination: rad.
        node: right ascension of its ascending node, rad.
    """

    longitude: float
    inclination: float
    node: float


@dataclass(frozen=True)
class Patrol:
    """What has to be patrolled, and from where.

    Attributes:
        start_day: days since 2000-01-01 12:00 UTC.
        duration: s.
        longitude: of the watcher at the start, east of Greenwich, rad.
        altitude_offset: of the watcher's first circular orbit from the belt, m; negative below.
        targets: in the order in which they are passed.
    """

    start_day: float
    duration: float
    longitude: float
    altitude_offset: float
    targets: tuple[PatrolTarget, ...]


@dataclass(frozen=True)
class Encounter:
    """The closest pass of a target.

    Attributes:
        time: since the start, s.
        distance: m.
        light_angle: at the target between the sun and the watcher, rad; small when well lit.
        sunlit: whether the target is outside the Earth's shadow.
    """

    time: float
    distance: float
    light_angle: float
    sunlit: bool


def target_position(patrol: Patrol, target: PatrolTarget, time: Array) -> Array:
    """Where a target is.

    Args:
        patrol: gives the day at time zero.
        target: whose position is wanted.
        time: since the start, s, shape (m,).

    Returns:
        Inertial equatorial position, m, shape (m, 3).

    Source: Geometry of a circular orbit.
    """
    start = greenwich_angle(patrol.start_day) + target.longitude - target.node
    argument = start + math.sqrt(GRAVITATIONAL_PARAMETER / GEOSTATIONARY_RADIUS**3) * time
    along, across = np.cos(argument), np.sin(argument) * math.cos(target.inclination)
    cosine, sine = math.cos(target.node), math.sin(target.node)
    up = np.sin(argument) * math.sin(target.inclination)
    components = (cosine * along - sine * across, sine * along + cosine * across, up)
    return GEOSTATIONARY_RADIUS * np.stack(components, axis=-1)


def watcher_position(patrol: Patrol, burns: Sequence[Burn], time: Array) -> Array:
    """Where the watcher is.

    Args:
        patrol: gives its first orbit.
        burns: in order of time.
        time: since the start, s, ascending, shape (m,).

    Returns:
        Inertial equatorial position, m, shape (m, 3).

    Source: Two-body motion between impulses.
    """
    radius = GEOSTATIONARY_RADIUS + patrol.altitude_offset
    angle = greenwich_angle(patrol.start_day) + patrol.longitude
    orbit = PlanarOrbit(radius, (0.0, 0.0), angle, 0.0)
    position = np.zeros((time.size, 3))
    ends = np.searchsorted(time, [burn.time for burn in burns])
    begin = 0
    for burn, end in zip(burns, ends.tolist(), strict=True):
        position[begin:end, :2] = orbit.state(time[begin:end])[0]
        orbit, begin = orbit.after(burn), end
    position[begin:, :2] = orbit.state(time[begin:])[0]
    return position


def closest_pass(
    patrol: Patrol, burns: Sequence[Burn], target: PatrolTarget, since: float = 0.0
) -> Encounter:
    """The closest pass of one target during the patrol.

    Args:
        patrol: the watcher's start and the duration.
        burns: in order of time.
        target: that is passed.
        since: earliest time of the pass, s.

    Returns:
        Time, distance and light of the pass.
    """
    time, distance = closest_approach(patrol, burns, target, since, patrol.duration)
    moment = np.array([time])
    position = target_position(patrol, target, moment)[0]
    apart = watcher_position(patrol, burns, moment)[0] - position
    sun = sun_direction(patrol.start_day + time / 86400.0)
    cosine = float(dot(apart, sun)) / max(distance, 1e-3)
    shadowed = in_cylindrical_shadow(position, sun)
    return Encounter(time, distance, math.acos(min(1.0, max(-1.0, cosine))), not shadowed)


def closest_approach(
    patrol: Patrol, burns: Sequence[Burn], target: PatrolTarget, begin: float, end: float
) -> tuple[float, float]:
    """When a target is nearest within a part of the patrol, and how near, of all approaches the nearest.

    Args:
        patrol: the watcher's start.
        burns: in order of time.
        target: that is approached.
        begin: of the part, s since the start.
        end: of the part, s since the start.

    Returns:
        Time in s to a tenth, distance in m.
    """
    time = _coarse(begin, end)
    return _nearest(patrol, burns, target, (time, watcher_position(patrol, burns, time)), math.inf)


def _coarse(begin: float, end: float) -> Array:
    return np.linspace(begin, end, 2 + int((end - begin) / _COARSE_INTERVAL))


def _nearest(
    patrol: Patrol,
    burns: Sequence[Burn],
    target: PatrolTarget,
    sampled: tuple[Array, Array],
    enough: float,
) -> tuple[float, float]:
    """Time and distance of the nearest approach, from the watcher's positions at some times.

    A minimum of the samples is refined unless its neighbourhood, in which the watcher moves no farther past
    the target than from sample to sample, cannot reach what is known already, nor what is enough.
    """
    time, watcher = sampled
    apart = watcher - target_position(patrol, target, time)
    distance = norm(apart)
    moved = norm(apart[1:] - apart[:-1])
    floor = distance - np.maximum(np.append(moved, 0.0), np.append(0.0, moved))
    lower = np.append(np.inf, distance[:-1]) >= distance
    minima = np.flatnonzero(lower & (np.append(distance[1:], np.inf) >= distance))
    best = (float(time[0]), math.inf)
    for index in minima[np.argsort(floor[minima], kind="stable")].tolist():
        if floor[index] >= min(best[1], enough):
            return min(best, (float(time[index]), float(floor[index])), key=lambda found: found[1])
        near = (float(time[max(index - 1, 0)]), float(time[min(index + 1, time.size - 1)]))
        best = min(best, _refined_approach(patrol, burns, target, near), key=lambda found: found[1])
    return best


def _refined_approach(
    patrol: Patrol, burns: Sequence[Burn], target: PatrolTarget, between: tuple[float, float]
) -> tuple[float, float]:
    low, high = between
    interval = _COARSE_INTERVAL
    while True:
        interval /= 20.0
        time = np.linspace(low, high, 2 + int((high - low) / interval))
        distance = norm(watcher_position(patrol, burns, time) - target_position(patrol, target, time))
        best = int(np.argmin(distance))
        if interval < 0.1:
            return float(time[best]), float(distance[best])
        low, high = float(time[max(best - 1, 0)]), float(time[min(best + 1, time.size - 1)])


def clearance(
    patrol: Patrol, burns: Sequence[Burn], begin: float, end: float, enough: float = math.inf
) -> float:
    """Distance in m to the nearest target at any time of a part of the patrol, passed on purpose or not.

    Args:
        patrol: the watcher's start and the targets.
        burns: in order of time.
        begin: of the part, s since the start.
        end: of the part, s since the start.
        enough: m; of a larger distance any number between it and the distance may stand, which takes less
            time to find.
    """
    time = _coarse(begin, end)
    sampled = time, watcher_position(patrol, burns, time)
    return min(
        (_nearest(patrol, burns, target, sampled, enough)[1] for target in patrol.targets),
        default=math.inf,
    )


def encounters(patrol: Patrol, burns: Sequence[Burn]) -> tuple[Encounter, ...]:
    """The closest pass of every target, in the targets' order."""
    return tuple(closest_pass(patrol, burns, target) for target in patrol.targets)
