"""Patrol of the geostationary belt: passing several satellites close by with the sun behind.

The watcher flies below the belt, equatorially, and drifts eastward past its targets. Only its
altitude, and with it its drift rate, is changed, by pairs of small tangential burns half a day apart.
A target whose orbit is inclined is near the equator only when it crosses its node.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from satform.control.sunlight import greenwich_angle, in_cylindrical_shadow, sun_direction
from satform.earth import GRAVITATIONAL_PARAMETER
from satform.elementwise import Array, dot, joined, norm

GEOSTATIONARY_RADIUS = 42164169.6
_KEPLER_ITERATIONS = 4
_REST_AFTER_PASS = 3600.0
_COARSE_INTERVAL = 600.0
_FINEST_CHANGE = 50.0


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
class Burn:
    """A tangential impulse.

    Attributes:
        time: since the start, s.
        speed_change: m/s, positive forward.
    """

    time: float
    speed_change: float


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


@dataclass(frozen=True)
class PlanarOrbit:
    """A nearly circular equatorial orbit.

    Attributes:
        semi_major_axis: m.
        eccentricity: components of the eccentricity vector along inertial x and y.
        mean_longitude: at `time`, rad.
        time: s.
    """

    semi_major_axis: float
    eccentricity: tuple[float, float]
    mean_longitude: float
    time: float

    def state(self, time: Array) -> tuple[Array, Array]:
        """Inertial position (m) and velocity (m/s) in the plane, each (m, 2), at times (s) of shape (m,).

        Source: Equinoctial form of Kepler's equation; Battin, An Introduction to the Mathematics and
        Methods of Astrodynamics, ch. 10.
        """
        axis, (ex, ey) = self.semi_major_axis, self.eccentricity
        motion = math.sqrt(GRAVITATIONAL_PARAMETER / axis**3)
        mean = self.mean_longitude + motion * (time - self.time)
        longitude = mean
        for _ in range(_KEPLER_ITERATIONS):
            cosine, sine = np.cos(longitude), np.sin(longitude)
            miss = longitude - ex * sine + ey * cosine - mean
            longitude = longitude - miss / (1.0 - ex * cosine - ey * sine)
        cosine, sine = np.cos(longitude), np.sin(longitude)
        weight = 1.0 / (1.0 + math.sqrt(1.0 - ex * ex - ey * ey))
        rate = motion / (1.0 - ex * cosine - ey * sine)
        xx, xy, yy = 1.0 - ey * ey * weight, ex * ey * weight, 1.0 - ex * ex * weight
        position = joined(xx * cosine + xy * sine - ex, yy * sine + xy * cosine - ey)
        velocity = joined(xy * cosine - xx * sine, yy * cosine - xy * sine)
        return axis * position, axis * rate[..., None] * velocity

    def after(self, burn: Burn) -> "PlanarOrbit":
        """The orbit after a tangential burn."""
        position, velocity = (vector[0] for vector in self.state(np.array([burn.time])))
        speed = math.hypot(*velocity)
        velocity = velocity * (1.0 + burn.speed_change / speed)
        return _orbit_through(position, velocity, burn.time)


def _orbit_through(position: Array, velocity: Array, time: float) -> PlanarOrbit:
    (x, y), (vx, vy) = position.tolist(), velocity.tolist()
    radius, momentum = math.hypot(x, y), x * vy - y * vx
    ex = vy * momentum / GRAVITATIONAL_PARAMETER - x / radius
    ey = -vx * momentum / GRAVITATIONAL_PARAMETER - y / radius
    axis = 1.0 / (2.0 / radius - (vx * vx + vy * vy) / GRAVITATIONAL_PARAMETER)
    weight = 1.0 / (1.0 + math.sqrt(1.0 - ex * ex - ey * ey))
    root = math.sqrt(1.0 - ex * ex - ey * ey)
    cosine = ex + ((1.0 - ex * ex * weight) * x / axis - ex * ey * weight * y / axis) / root
    sine = ey + ((1.0 - ey * ey * weight) * y / axis - ex * ey * weight * x / axis) / root
    longitude = math.atan2(sine, cosine)
    return PlanarOrbit(axis, (ex, ey), longitude - ex * sine + ey * cosine, time)


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
    low, high, interval = since, patrol.duration, _COARSE_INTERVAL
    while True:
        time = np.linspace(low, high, 2 + int((high - low) / interval))
        apart = watcher_position(patrol, burns, time) - target_position(patrol, target, time)
        distance = norm(apart)
        best = int(np.argmin(distance))
        if interval < 0.1:
            break
        low, high = max(since, time[best] - 2.0 * interval), min(patrol.duration, time[best] + 2.0 * interval)
        interval /= 20.0
    sun = sun_direction(patrol.start_day + time[best] / 86400.0)
    cosine = float(dot(apart[best], sun) / distance[best])
    shadowed = in_cylindrical_shadow(target_position(patrol, target, time[best : best + 1])[0], sun)
    return Encounter(
        float(time[best]), float(distance[best]), math.acos(min(1.0, max(-1.0, cosine))), not shadowed
    )


def encounters(patrol: Patrol, burns: Sequence[Burn]) -> tuple[Encounter, ...]:
    """The closest pass of every target, in the targets' order."""
    return tuple(closest_pass(patrol, burns, target) for target in patrol.targets)


def altitude_change(start: float, change: float) -> tuple[Burn, Burn]:
    """Burns that move a nearly circular orbit near the belt up or down and leave it circular.

    Args:
        start: time of the first burn, s.
        change: of altitude, m.

    Returns:
        Two equal burns half a day apart.

    Source: Hohmann 1925, linear in the altitude.
    """
    motion = math.sqrt(GRAVITATIONAL_PARAMETER / GEOSTATIONARY_RADIUS**3)
    half = 0.25 * motion * change
    return Burn(start, half), Burn(start + math.pi / motion, half)


@dataclass(frozen=True)
class PatrolGoal:
    """What makes one plan better than another.

    A pass at `distance` counts as much as light from `light_angle`, and each counts with its square.

    Attributes:
        distance: m.
        light_angle: rad.
        budget: sum of all changes of speed that is not exceeded, m/s.
        keep_out: distance below which no target is passed, m.
        altitude_reach: largest change of altitude between two targets, m.
        altitude_grid: between the changes that are tried first, m.
    """

    distance: float = 50e3
    light_angle: float = math.radians(30.0)
    budget: float = 0.45
    keep_out: float = 35e3
    altitude_reach: float = 8e3
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


def plan_patrol(patrol: Patrol, goal: PatrolGoal | None = None, width: int = 6) -> PatrolPlan:
    """Altitude changes, one before each target, after which the targets are seen near and well lit.

    Leg after leg the best partial plans are kept and extended by every altitude change of a grid;
    the best plan's changes are then refined together. The search is deterministic.

    Args:
        patrol: what has to be patrolled, and from where.
        goal: how plans are compared.
        width: number of partial plans that are kept.

    Returns:
        The plan; without burns if nothing is better.
    """
    goal = goal or PatrolGoal()
    count = round(goal.altitude_reach / goal.altitude_grid)
    changes = [goal.altitude_grid * index for index in range(-count, count + 1)]
    kept = [_Draft((), (), ())]
    for _ in patrol.targets:
        grown = [draft for parent in kept for draft in _grown(patrol, goal, parent, changes)]
        kept = sorted(grown, key=lambda draft: draft.cost(goal))[:width]
    best = _refined(patrol, goal, kept[0])
    return PatrolPlan(best.burns(), best.seen)


@dataclass(frozen=True)
class _Draft:
    """Altitude changes so far, the times at which they begin, and the passes that they lead to."""

    changes: tuple[float, ...]
    starts: tuple[float, ...]
    seen: tuple[Encounter, ...]

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
        if self.delta_v() > goal.budget:
            return math.inf
        total = 0.0
        for seen in self.seen:
            if seen.distance < goal.keep_out or not seen.sunlit:
                return math.inf
            total += (seen.distance / goal.distance) ** 2 + (seen.light_angle / goal.light_angle) ** 2
        return total


def _grown(patrol: Patrol, goal: PatrolGoal, parent: _Draft, changes: Sequence[float]) -> list[_Draft]:
    start = 0.0
    if parent.seen:
        half_day = math.pi / math.sqrt(GRAVITATIONAL_PARAMETER / GEOSTATIONARY_RADIUS**3)
        start = max(parent.seen[-1].time + _REST_AFTER_PASS, parent.starts[-1] + half_day)
    target = patrol.targets[len(parent.seen)]
    drafts = []
    for change in changes:
        draft = _Draft((*parent.changes, change), (*parent.starts, start), parent.seen)
        if draft.delta_v() > goal.budget:
            continue
        seen = closest_pass(patrol, draft.burns(), target, since=start)
        drafts.append(replace(draft, seen=(*parent.seen, seen)))
    return drafts


def _refined(patrol: Patrol, goal: PatrolGoal, draft: _Draft) -> _Draft:
    reach, best = 0.5 * goal.altitude_grid, draft
    while reach > _FINEST_CHANGE:
        before = best
        for index in range(len(best.changes)):
            for shift in (-reach, reach):
                trial = _shifted(patrol, best, index, shift)
                best = min(best, trial, key=lambda candidate: candidate.cost(goal))
        reach = 0.5 * reach if best is before else reach
    return best


def _shifted(patrol: Patrol, draft: _Draft, leg: int, shift: float) -> _Draft:
    """The draft with one altitude change shifted, and the passes that this alters."""
    changes = (*draft.changes[:leg], draft.changes[leg] + shift, *draft.changes[leg + 1 :])
    shifted = replace(draft, changes=changes)
    burns, later = shifted.burns(), zip(patrol.targets[leg:], draft.starts[leg:], strict=True)
    seen = [closest_pass(patrol, burns, target, since=start) for target, start in later]
    return replace(shifted, seen=(*draft.seen[:leg], *seen))


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
    place = watcher_position(patrol, burns, np.array([burn.time]))[0]
    motion = math.sqrt(GRAVITATIONAL_PARAMETER / GEOSTATIONARY_RADIUS**3)
    chief = greenwich_angle(patrol.start_day) + chief_longitude + motion * burn.time
    ahead = math.atan2(place[1], place[0]) - chief
    return burn.speed_change * np.array([-math.sin(ahead), math.cos(ahead), 0.0])
