# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which motions of a formation its sensors can tell apart: the observability Gramian along a planned flight.

The state is that of the satellites that are estimated, at the start. A small change of it is followed by the
linear model of the filter, seen by each channel through its Jacobian on the planned motion, and divided by
the standard deviation of the channel's noise. The singular values of all that stacked are the roots of those
of the observability Gramian with noise, the Fisher information of the start. Directions in which they vanish
cannot be observed; they are named by projection on motions that an engineer knows. For analysis, not for
flight.

Source: Kailath, Linear Systems, ch. 2.3 and 9.2 (Gramian); Woffinden & Geller 2009, Observability criteria
for angles-only navigation, IEEE Trans. Aerosp. Electron. Syst. 45 (scale of bearings with linear dynamics).
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from satform.consensus.graph import Graph
from satform.equipment.sensors.protocol import MeasurementModel, VaryingVariance
from satform.numeric.elementwise import Array

_VANISHING = 1e-9
"""Ratio to the largest below which a singular value counts as zero; rounding leaves 1e-13."""

_USELESS = 10.0
"""Times the formation's extent by which the standard deviation in an observable direction may exceed it."""

_WITHIN = 0.99
"""Cosine of the angle to the unobservable directions up to which a named direction lies in them."""

_NEW = 0.3
"""Least part of a named direction, in squares, that is not named yet; common motions of few are partly."""

Pair: TypeAlias = tuple[int, int]
"""Observer and target of a channel."""

Named: TypeAlias = tuple[str, Array]
"""A motion in words, and its orthonormal directions, shape (6 M, n)."""

_AXES = ("radial", "along-track", "cross-track")


@dataclass(frozen=True)
class PlannedFlight:
    """Motion along which observability is asked for.

    Attributes:
        states: position (m) and velocity (m/s) in LVLH of N satellites at K times, shape (K, N, 6).
        transitions: of a state from the start to each of these times, shape (K, 6, 6).
        rate: of the chief's orbit, rad/s; a velocity counts as the distance of velocity divided by it.
        names: of the satellites.
    """

    states: Array
    transitions: Array
    rate: float
    names: tuple[str, ...]


@dataclass(frozen=True)
class Sight:
    """One channel over the planned flight.

    Attributes:
        model: of the channel.
        readings: how many there are about each of the K times, shape (K,); 0 where it sees nothing.
    """

    model: MeasurementModel
    readings: Array


@dataclass(frozen=True)
class Observability:
    """What some channels tell of the motion of M satellites at the start.

    Attributes:
        singular_values: in 1/m, descending, shape (6 M,); the inverse is a standard deviation.
        unobservable: orthonormal directions that cannot be observed, of positions and of velocities divided
            by the orbit's rate, shape (6 M, n).
        words: these directions in words.
    """

    singular_values: Array
    unobservable: Array
    words: tuple[str, ...]


def observability(
    flight: PlannedFlight, sights: Sequence[Sight], estimated: Sequence[int] | None = None
) -> Observability:
    """What channels observe of a flight.

    Args:
        flight: as planned.
        sights: the channels that count, of all satellites.
        estimated: indices of the M satellites whose motion is asked for, ascending; that of the others is
            known. All when left out.
    """
    members = list(range(len(flight.names)) if estimated is None else estimated)
    size = 6 * len(members)
    rows = [_rows(flight, sight)[:, members].reshape(-1, size) for sight in sights]
    stacked = np.concatenate([*rows, np.zeros((size, size))])
    # Of the triangular factor instead of all rows: it has the same singular values.
    _, values, directions = np.linalg.svd(np.linalg.qr(stacked, mode="r"))
    weakest = max(_VANISHING * float(values[0]), 1.0 / (_USELESS * _extent(flight)))
    unobservable = directions[values < weakest].T
    pairs = [
        (sight.model.observer, sight.model.target)
        for sight in sights
        if sight.model.target is not None and sight.readings.any()
    ]
    words = _words(_named(flight, members, pairs), [flight.names[index] for index in members], unobservable)
    return Observability(values, unobservable, tuple(dict.fromkeys(words)))


def sources(graph: Graph) -> tuple[frozenset[int], ...]:
    """Whose measurements reach each satellite along the edges of a graph, by any number of hops.

    Args:
        graph: of communication; an estimate that is fused is handed on.

    Returns:
        For each satellite the indices of itself and of all from which there is a path to it.
    """
    reach: NDArray[np.bool_] = (graph.adjacency + np.eye(len(graph))) > 0.0
    for middle in range(len(graph)):
        reach |= reach[:, middle, None] & reach[None, middle, :]
    return tuple(frozenset(np.flatnonzero(row).tolist()) for row in reach)


def _rows(flight: PlannedFlight, sight: Sight) -> Array:
    """Change of a channel's readings in standard deviations by a change of the scaled start, (K m, N, 6)."""
    model, count = sight.model, len(flight.names)
    times = np.flatnonzero(sight.readings)
    own = flight.states[times, model.observer]
    other = own if model.target is None else flight.states[times, model.target]
    by_own, by_other = model.jacobian(own, other)
    variance = model.variance
    if isinstance(model, VaryingVariance):
        variance = model.variance_at(model.predicted(own, other))
    whitening = np.sqrt(sight.readings[times])[:, None, None] / np.sqrt(variance)[..., :, None]
    scale = np.repeat([1.0, flight.rate], 3)
    rows = np.zeros((*by_own.shape[:2], count, 6))
    rows[:, :, model.observer] = whitening * (by_own @ flight.transitions[times]) * scale
    if model.target is not None:
        rows[:, :, model.target] += whitening * (by_other @ flight.transitions[times]) * scale
    return rows.reshape(-1, count, 6)


def _extent(flight: PlannedFlight) -> float:
    """Largest distance between two satellites or from the chief, m; at least 1 m."""
    position = flight.states[..., :3]
    between = position[:, :, None] - position[:, None]
    return max(
        1.0, float(np.linalg.norm(between, axis=-1).max()), float(np.linalg.norm(position, axis=-1).max())
    )


def _words(named: Iterable[Named], names: Sequence[str], unobservable: Array) -> Iterator[str]:
    """The directions in words: those of named motions that lie in them, and whose motion the others are."""
    rest = unobservable
    for words, directions in named:
        inside = np.linalg.norm(unobservable.T @ directions, axis=0).min()
        new = np.linalg.norm(rest.T @ directions) ** 2
        if inside < _WITHIN or new < _NEW * directions.shape[1]:
            continue
        yield words
        # What is named is taken out of what is left.
        left, size, _ = np.linalg.svd(rest - directions @ (directions.T @ rest), full_matrices=False)
        rest = left[:, size > 0.5]
    for direction in rest.T:
        blocks = np.linalg.norm(direction.reshape(-1, 6), axis=1)
        shares = [names[index] for index in np.flatnonzero(blocks > 0.5 * blocks.max()).tolist()]
        yield f"a combined motion of {', '.join(shares)}"


def _named(flight: PlannedFlight, members: Sequence[int], pairs: Sequence[Pair]) -> Iterator[Named]:
    """Motions of M members that have a name, each with orthonormal directions, larger ones first."""
    names, count = [flight.names[index] for index in members], len(members)
    start = flight.states[0] / np.repeat([1.0, flight.rate], 3)
    own = start[members]
    inside = [(members.index(pair[0]), members.index(pair[1])) for pair in pairs if {*pair} <= {*members}]
    groups = _groups(count, inside)
    for group in groups:
        yield from _blocks(_members(count, group), _together(names, group))
    everyone = list(range(count))
    if everyone not in groups:
        yield from _blocks(_members(count, everyone), _together(names, everyone))
    for pair in pairs:
        seen, by = pair if pair[1] not in members else pair[::-1]
        if seen in members:
            ray = np.zeros((count, 6))
            ray[members.index(seen)] = start[seen] - start[by]
            yield from _one(f"the distance of {flight.names[seen]} from {flight.names[by]}", ray)
    for group in groups:
        yield from _turned_and_scaled(own, names, group)


def _turned_and_scaled(start: Array, names: Sequence[str], group: Sequence[int]) -> Iterator[Named]:
    """Size and orientation of a group, about its middle and about a satellite whose motion is known."""
    whose = _together(names, group)
    if len(group) < 2:
        return
    for middle in (start[group].mean(axis=0), *start[group]):
        arms = _members(len(names), group)[:, None] * (start - middle)
        if len(group) > 2:
            yield from _one(f"the size of {whose}, with all distances in the same ratio", arms)
        yield from _one(f"the phase of {whose} on its relative orbits", _moved_on(arms))
        for axis, name in enumerate(_AXES):
            turned = np.cross(np.eye(3)[axis], arms.reshape(-1, 2, 3))
            yield from _one(f"rotation of {whose} about the {name} axis", turned)


def _moved_on(arms: Array) -> Array:
    """Derivative of free motion about a circular chief by the chief's angle, shape (M, 6), all in m.

    Ranges cannot tell a later time where they do not change, as of satellites on one general circular orbit.
    """
    x, z = arms[:, 0], arms[:, 2]
    along, radial = arms[:, 4], arms[:, 3]
    return np.column_stack((arms[:, 3:], 3.0 * x + 2.0 * along, -2.0 * radial, -z))


def _groups(count: int, pairs: Sequence[Pair]) -> list[list[int]]:
    """Satellites that are measured relative to each other, over any number of pairs."""
    observers, targets = [observer for observer, _ in pairs], [target for _, target in pairs]
    both = Graph.of_edges(count, observers + targets, targets + observers)
    return sorted(map(sorted, set(sources(both))))


def _together(names: Sequence[str], group: Sequence[int]) -> str:
    """Satellites of a group in words."""
    own = [names[index] for index in group]
    if len(own) == 1:
        return own[0]
    return "the whole formation" if len(own) == len(names) else f"{', '.join(own)} together"


def _members(count: int, group: Sequence[int]) -> Array:
    """1 for each satellite of a group, else 0, shape (M,)."""
    members: Array = np.zeros(count)
    members[list(group)] = 1.0
    return members


def _blocks(members: Array, whose: str) -> Iterator[Named]:
    """The same motion of all members: any, in the orbital plane, out of it."""
    share = members / np.sqrt(members.sum())
    for axes, where in (((0, 1, 2), ""), ((0, 1), "in-plane "), ((2,), "cross-track ")):
        columns = [axis + 3 * half for half in (0, 1) for axis in axes]
        directions: Array = (share[:, None, None] * np.eye(6)[:, columns]).reshape(-1, len(columns))
        yield f"{where}position and velocity of {whose}", directions


def _one(words: str, motion: Array) -> Iterator[Named]:
    """A single direction, where there is such a motion at all."""
    flat = motion.reshape(-1, 1)
    length = float(np.linalg.norm(flat))
    if length > 0.0:
        direction: Array = flat / length
        yield words, direction
