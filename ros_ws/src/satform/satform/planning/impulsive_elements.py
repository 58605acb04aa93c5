# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Impulses from present to wanted relative orbital elements about a near-circular orbit, in closed form.

Up to three tangential pulses change semi-major axis, mean longitude and eccentricity vector, and one
normal pulse the inclination vector. A lower bound of the delta-v of any such pulses tells how good a plan is.

Equations: docs/controllers/impulsive_elements.md.
"""

import math
from dataclasses import dataclass

import numpy as np

from satform.control.protocol import Motion
from satform.control.relative_elements import RelativeElements, elements_from_motion, motion_from_elements
from satform.dynamics import cw
from satform.numeric.elementwise import Array

SHORTEST_ORBITS = 2.0
"""Shortest plan: in it every direction of a pulse comes twice."""
LONGEST_ORBITS = 50.0
"""Longest plan: the number of choices grows with the third power of its orbits."""
_ALIKE = 1e-9
"""Costs of two choices that differ by this fraction count as the same."""
_NOTHING = 1e-12
"""Share of all delta-v below which a pulse is left out."""
_DIRECTIONS = 72
"""Directions of pulses that are tried where the first one does not reach the bound."""


@dataclass(frozen=True)
class DeltaVBound:
    """Least delta-v of pulses along the track and along the normal.

    Attributes:
        tangential: of all pulses along the track, m/s.
        normal: of all pulses along the orbit normal, m/s.
    """

    tangential: float
    normal: float

    def total(self) -> float:
        """Of both together, m/s, where no pulse has both components."""
        return self.tangential + self.normal


@dataclass(frozen=True)
class ElementsPlan:
    """Pulses between two sets of relative elements.

    Attributes:
        times: of the pulses in order, s from the start, shape (m,).
        arguments: of the chief's mean latitude at the pulses, rad, not below that at the start, shape (m,).
        impulses: velocity changes, LVLH, m/s, shape (m, 3); each along one axis.
        duration: from the start to the time at which the wanted elements hold, s.
        bound: least delta-v with which this change can be made in this time.
        end: elements at the end by the Clohessy-Wiltshire equations, m.
    """

    times: Array
    arguments: Array
    impulses: Array
    duration: float
    bound: DeltaVBound
    end: RelativeElements

    def tangential_delta_v(self) -> float:
        """Of the pulses along the track, m/s."""
        return float(np.sum(np.abs(self.impulses[:, 1])))

    def normal_delta_v(self) -> float:
        """Of the pulses along the orbit normal, m/s."""
        return float(np.sum(np.abs(self.impulses[:, 2])))

    def delta_v(self) -> float:
        """Of all pulses, m/s."""
        return self.tangential_delta_v() + self.normal_delta_v()


def change_to_make(
    start: RelativeElements, wanted: RelativeElements, mean_motion: float, duration: float
) -> RelativeElements:
    """What pulses have to add to the elements, beyond the drift of the longitude without them.

    Args:
        start: elements at the start, m.
        wanted: elements at the end, m.
        mean_motion: of the chief, rad/s.
        duration: s.

    Returns:
        m.
    """
    change = wanted.as_array() - start.as_array()
    change[..., 1] += 1.5 * mean_motion * duration * start.as_array()[..., 0]
    return RelativeElements.from_array(change)


def delta_v_bound(change: RelativeElements, mean_motion: float, duration: float) -> DeltaVBound:
    """Least delta-v of any number of tangential and normal pulses that make a change in a time.

    Args:
        change: as from `change_to_make`, m, each (...,) of one satellite.
        mean_motion: of the chief, rad/s.
        duration: s.

    Returns:
        The bound.

    Source: Gaias & D'Amico 2015 for semi-major axis, eccentricity and inclination; Chernick & D'Amico 2018
    for the longitude, here with the semi-major axis that it needs at the middle of the time.
    """
    axis, longitude = float(change.semi_major_axis), float(change.mean_longitude)
    at_the_middle = axis + 4.0 * longitude / (3.0 * mean_motion * duration)
    largest = max(abs(axis), math.hypot(*change.eccentricity.tolist()), abs(at_the_middle))
    return DeltaVBound(
        tangential=0.5 * mean_motion * largest,
        normal=mean_motion * math.hypot(*change.inclination.tolist()),
    )


def plan_elements(
    start: RelativeElements,
    wanted: RelativeElements,
    mean_motion: float,
    argument: float,
    duration: float,
) -> ElementsPlan:
    """Three tangential pulses and a normal one that lead from present to wanted elements in a given time.

    Two of the tangential pulses are a whole number of orbits apart, and their sizes follow from linear
    equations. First the third is half an orbit off them, and all are where a pulse moves the eccentricity
    vector along the change that is wanted of it; that reaches the bound wherever the eccentricity sets it and
    the longitude allows. Where it does not reach the bound, 71 more directions and those of begin and end
    are tried, and the least delta-v is taken.

    Args:
        start: elements at the start, m.
        wanted: elements at the end, m.
        mean_motion: of the chief, rad/s.
        argument: of the chief's mean latitude at the start, rad.
        duration: s, two to 50 orbits.

    Returns:
        The plan; it has no pulse that is zero.

    Raises:
        ValueError: the duration is out of range.

    Source: Gaias & D'Amico 2015, three tangential and one normal pulse.
    """
    orbits = mean_motion * duration / math.tau
    if not SHORTEST_ORBITS * (1.0 - _ALIKE) <= orbits <= LONGEST_ORBITS:
        raise ValueError(
            f"a plan of elements takes {SHORTEST_ORBITS:g} to {LONGEST_ORBITS:g} orbits, got {duration:g} s, "
            f"which are {orbits:.6g}"
        )
    change = change_to_make(start, wanted, mean_motion, duration)
    until = argument + mean_motion * duration
    pulses = [
        *((argument, 1, size) for argument, size in _tangential(change, mean_motion, argument, until)),
        *((argument, 2, size) for argument, size in _normal(change, mean_motion, argument)),
    ]
    all_delta_v = sum(abs(size) for _, _, size in pulses)
    pulses = sorted(pulse for pulse in pulses if abs(pulse[2]) > _NOTHING * all_delta_v)
    arguments = np.array([argument for argument, _, _ in pulses])
    impulses = np.zeros((len(pulses), 3))
    for row, (_, axis, size) in enumerate(pulses):
        impulses[row, axis] = size
    times = (arguments - argument) / mean_motion
    return ElementsPlan(
        times=times,
        arguments=arguments,
        impulses=impulses,
        duration=duration,
        bound=delta_v_bound(change, mean_motion, duration),
        end=elements_after_pulses(start, times, impulses, mean_motion, argument, duration),
    )


def elements_after_pulses(
    start: RelativeElements,
    times: Array,
    impulses: Array,
    mean_motion: float,
    argument: float,
    duration: float,
) -> RelativeElements:
    """Elements after pulses by the Clohessy-Wiltshire equations.

    Args:
        start: elements at the start, m.
        times: of the pulses in order, s, shape (m,).
        impulses: LVLH, m/s, shape (m, 3).
        mean_motion: of the chief, rad/s.
        argument: of the chief's mean latitude at the start, rad.
        duration: s.

    Returns:
        Elements at the end, m.
    """
    rate, reached = np.asarray(mean_motion), 0.0
    motion = motion_from_elements(start, rate, np.asarray(argument))
    for time, impulse in zip(times.tolist(), impulses, strict=True):
        position, velocity = cw.propagate(motion.position, motion.velocity, mean_motion, time - reached)
        motion, reached = Motion(position, velocity + impulse), time
    moved = Motion(*cw.propagate(motion.position, motion.velocity, mean_motion, duration - reached))
    return elements_from_motion(moved, rate, np.asarray(argument + mean_motion * duration))


@dataclass(frozen=True)
class _InPlane:
    """What the tangential pulses have to add up to, and the arguments of latitude that they may have.

    Attributes:
        axis: sum of the pulses, m/s.
        eccentricity: sum of the pulses times the unit vectors of their arguments, m/s, shape (2,).
        longitude: sum of the pulses times the angles from them to the end, m/s.
        begin: first argument of latitude, rad.
        until: last one, rad.
    """

    axis: float
    eccentricity: Array
    longitude: float
    begin: float
    until: float

    def arguments(self, direction: float) -> Array:
        """Arguments of latitude of a direction (rad) from the first to the last, rad."""
        slack = _ALIKE * (self.until - self.begin)
        lowest = math.ceil((self.begin - slack - direction) / math.tau)
        highest = math.floor((self.until + slack - direction) / math.tau)
        return np.clip(direction + math.tau * np.arange(lowest, highest + 1), self.begin, self.until)

    def partner(self, direction: float) -> tuple[float, float] | None:
        """The other direction (rad) of pulses beside one, and the sum of the pulses there, m/s.

        The line from the unit vector of the direction through the eccentricity vector per unit of the sum of
        all pulses meets the unit circle again at the other direction. None where it only touches it.
        """
        unit = np.array([math.cos(direction), math.sin(direction)])
        missing = self.eccentricity - self.axis * unit
        square, along = float(missing @ missing), float(missing @ unit)
        scale = self.axis * self.axis + float(self.eccentricity @ self.eccentricity)
        if square <= _NOTHING * _NOTHING * scale:
            return direction + math.pi, 0.0
        if abs(along) <= _NOTHING * math.sqrt(square):
            return None
        size = -0.5 * square / along
        other = unit + missing / size
        return math.atan2(other[1], other[0]), size


@dataclass(frozen=True)
class _Pulses:
    """Three tangential pulses.

    Attributes:
        arguments: arguments of latitude, rad, shape (3,).
        sizes: m/s, shape (3,).
    """

    arguments: Array
    sizes: Array

    def cost(self) -> float:
        """Delta-v, m/s."""
        return float(np.sum(np.abs(self.sizes)))


def _tangential(
    change: RelativeElements, mean_motion: float, argument: float, until: float
) -> list[tuple[float, float]]:
    """Places (rad) and sizes (m/s) of three pulses along the track."""
    wanted = _InPlane(
        axis=0.5 * mean_motion * float(change.semi_major_axis),
        eccentricity=0.5 * mean_motion * np.asarray(change.eccentricity, dtype=np.float64),
        longitude=-mean_motion * float(change.mean_longitude) / 3.0,
        begin=argument,
        until=until,
    )
    x, y = change.eccentricity.tolist()
    along = math.atan2(y, x) if math.hypot(x, y) > 0.0 else argument
    bound = delta_v_bound(change, mean_motion, (until - argument) / mean_motion).tangential
    found = [_pulses_of(wanted, along)]
    if found[0] is None or found[0].cost() > bound * (1.0 + _ALIKE):
        scanned = along + math.tau * np.arange(1, _DIRECTIONS) / _DIRECTIONS
        found.extend(_pulses_of(wanted, direction) for direction in (*scanned.tolist(), argument, until))
    best = min((pulses for pulses in found if pulses is not None), key=_Pulses.cost)
    return list(zip(best.arguments.tolist(), best.sizes.tolist(), strict=True))


def _pulses_of(wanted: _InPlane, direction: float) -> _Pulses | None:
    """The three pulses of least delta-v in a direction and its partner; None where there are not three.

    Semi-major axis and eccentricity give the sum of the pulses in each of the two directions. One of the
    sums is made by two pulses some orbits apart, and their sizes follow from the longitude.
    """
    partner = wanted.partner(direction)
    if partner is None:
        return None
    other, size = partner
    here, there = (wanted.arguments(direction), wanted.axis - size), (wanted.arguments(other), size)
    candidates = [_split(wanted, *pair, *single) for pair, single in ((here, there), (there, here))]
    found = [pulses for pulses in candidates if pulses is not None]
    return min(found, key=_Pulses.cost, default=None)


def _split(wanted: _InPlane, pair: Array, total: float, singles: Array, single: float) -> _Pulses | None:
    """The best of all choices of two first arguments (rad), with a sum in m/s, and one second one."""
    if len(pair) < 2 or not len(singles):
        return None
    one, two = np.triu_indices(len(pair), 1)
    first, second, third = np.broadcast_arrays(pair[one][:, None], pair[two][:, None], singles[None, :])
    left = wanted.longitude - single * (wanted.until - third) - total * (wanted.until - second)
    first_size = left / (second - first)
    sizes = np.stack((first_size, total - first_size, np.full_like(first_size, single)))
    cost = np.sum(np.abs(sizes), axis=0)
    # Of equal choices the one whose largest pulse is smallest.
    largest = np.where(cost <= np.min(cost) * (1.0 + _ALIKE), np.max(np.abs(sizes), axis=0), np.inf)
    row, column = np.unravel_index(int(np.argmin(largest)), largest.shape)
    chosen = np.array([first[row, column], second[row, column], third[row, column]])
    return _Pulses(chosen, sizes[:, row, column].copy())


def _normal(change: RelativeElements, mean_motion: float, argument: float) -> list[tuple[float, float]]:
    """Place (rad) and size (m/s) of the first pulse along the normal that makes the change."""
    x, y = change.inclination.tolist()
    size = mean_motion * math.hypot(x, y)
    if size == 0.0:
        return []
    towards = math.atan2(y, x)
    half_orbits = math.ceil((argument - towards) / math.pi)
    return [(towards + math.pi * half_orbits, -size if half_orbits % 2 else size)]
