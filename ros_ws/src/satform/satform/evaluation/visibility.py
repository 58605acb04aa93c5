# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Eclipses, ground contacts and lines of sight in a flight: intervals of time, and distances of pairs.

Between the states of the record motion is interpolated by cubic polynomials of position and velocity. An
interval that is shorter than the time between two samples, at least 10 s, may be missed.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal, TypeAlias

import brahe
import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import minimize_scalar

from satform.numeric.elementwise import Array
from satform.orbits.frames import EarthRotation
from satform.orbits.line_of_sight import blocked_by_earth
from satform.orbits.time_scales import brahe_epoch
from satform.record.flight_record import FlightRecord
from satform.scenario.stations import StationSpec

Kind: TypeAlias = Literal["penumbra", "umbra", "contact", "blocked"]
"""penumbra: part of the Sun is hidden at least; umbra: all of it; contact: a station sees the satellite above
its elevation mask; blocked: the Earth is between two satellites."""

SAMPLING = 10.0
"""Time between two states that are looked at, s, where the record has them closer."""

MOST_PAIRS = 300
"""Of more pairs of satellites than this none is looked at."""

_TOLERANCE = 1e-4
"""To which the ends of an interval are found, s."""

Motion: TypeAlias = CubicHermiteSpline
"""Inertial position, m, over time, s."""


@dataclass(frozen=True)
class Interval:
    """A time in which something holds.

    Attributes:
        kind: what holds.
        satellite: for which.
        other: the station or the other satellite; empty in an eclipse.
        begin: s since the start of the flight; the start itself if it holds there.
        end: s; the end of the flight if it holds there.
        open_begin: whether it held at the start of the flight.
        open_end: whether it held at its end.
        highest_elevation: of a contact, rad; NaN otherwise.
        highest_at: when, s; NaN otherwise.
    """

    kind: Kind
    satellite: str
    other: str
    begin: float
    end: float
    open_begin: bool
    open_end: bool
    highest_elevation: float = math.nan
    highest_at: float = math.nan

    @property
    def duration(self) -> float:
        """S."""
        return self.end - self.begin


@dataclass(frozen=True)
class Timeline:
    """What was seen from where in a flight.

    Attributes:
        intervals: by their begin.
        pairs_left_out: whether the flight has too many satellites for lines of sight.
    """

    intervals: tuple[Interval, ...]
    pairs_left_out: bool


def timeline(
    record: FlightRecord,
    stations: Sequence[StationSpec] = (),
    rotation: EarthRotation | None = None,
    line_of_sight_margin: float = 0.0,
) -> Timeline:
    """Eclipses, contacts with stations and blocked lines of sight of all satellites.

    Args:
        record: of the flight; its chief's motion has to be known.
        stations: on the ground.
        rotation: of the Earth, with which the stations turn; needed where there are any.
        line_of_sight_margin: height above the Earth's equatorial radius that a line of sight keeps, m.

    Raises:
        ValueError: the chief's motion is not known.
    """
    position, velocity = record.inertial_position, record.inertial_velocity
    assert record.chief is not None  # noqa: S101 - there would be no inertial positions
    zero = brahe_epoch(record.chief.epoch)
    times = _sampled(record)
    found: list[Interval] = []
    motions: dict[str, Motion] = {}
    for column, name in enumerate(record.satellites):
        known = np.isfinite(position[:, column]).all(axis=-1) & np.isfinite(velocity[:, column]).all(axis=-1)
        if known.all() and len(record.time) > 1:
            motions[name] = CubicHermiteSpline(record.time, position[:, column], velocity[:, column])
    turned = [] if rotation is None or not stations else [rotation.matrix(time) for time in times.tolist()]
    for name, motion in motions.items():
        found += _eclipses(name, motion, times, zero)
        if rotation is not None:
            for station in stations:
                found += _contacts(name, motion, times, station, rotation, turned)
    pairs = list(combinations(motions, 2))
    if len(pairs) <= MOST_PAIRS:
        for first, second in pairs:
            found += _blocked((first, second), (motions[first], motions[second]), times, line_of_sight_margin)
    found.sort(key=lambda interval: (interval.begin, interval.satellite, interval.other, interval.kind))
    return Timeline(tuple(found), len(pairs) > MOST_PAIRS)


def _sampled(record: FlightRecord) -> Array:
    """Times of the states that are looked at, s; the last is that of the last state."""
    stride = max(1, int(SAMPLING / record.step))
    times: Array = np.unique(np.append(record.time[::stride], record.time[-1]))
    return times


def _eclipses(name: str, motion: Motion, times: Array, zero: Any) -> list[Interval]:
    """Penumbra and umbra by brahe's conical shadow."""

    def light(time: float, position: Array | None = None) -> float:
        point = motion(time) if position is None else position
        return float(brahe.eclipse_conical(point, brahe.sun_position(zero + time)))

    sampled = np.array(
        [light(time, point) for time, point in zip(times.tolist(), motion(times), strict=True)]
    )
    found = []
    for kind, limit in (("penumbra", 1.0), ("umbra", 0.0)):
        inside = sampled < 1.0 if kind == "penumbra" else sampled <= 0.0

        def holds(time: float, limit: float = limit) -> bool:
            return light(time) < 1.0 if limit else light(time) <= 0.0

        for begin, end, open_begin, open_end in _intervals(inside, times, holds):
            found.append(Interval(kind, name, "", begin, end, open_begin, open_end))  # type: ignore[arg-type]
    return found


def _contacts(
    name: str,
    motion: Motion,
    times: Array,
    station: StationSpec,
    rotation: EarthRotation,
    turned: Sequence[Array],
) -> list[Interval]:
    """When a satellite is above a station's mask; elevations by brahe."""
    radians: Any = brahe.AngleFormat.RADIANS
    geodetic: Any = brahe.EllipsoidalConversionType.GEODETIC
    coordinates = np.array([station.longitude, station.latitude, station.altitude])
    ground = brahe.position_geodetic_to_ecef(coordinates, radians)

    def elevations(fixed: Array) -> Array:
        local = brahe.relative_position_ecef_to_enz(ground, fixed, geodetic)
        seen: Array = brahe.position_enz_to_azel(local, radians)[..., 1]
        return seen

    def elevation(time: float) -> float:
        return float(elevations(rotation.matrix(time) @ motion(time)))

    sampled = elevations(np.einsum("kij,kj->ki", np.array(turned), motion(times)))
    found = []
    for begin, end, open_begin, open_end in _intervals(
        sampled > station.elevation_mask, times, lambda time: elevation(time) > station.elevation_mask
    ):
        best = minimize_scalar(
            lambda time: -elevation(time), bounds=(begin, end), method="bounded", options={"xatol": 1e-3}
        )
        highest = max((begin, end, float(best.x)), key=elevation)
        found.append(
            Interval(
                "contact",
                name,
                station.name,
                begin,
                end,
                open_begin,
                open_end,
                elevation(highest),
                highest,
            )
        )
    return found


def _blocked(
    names: tuple[str, str], motions: tuple[Motion, Motion], times: Array, margin: float
) -> list[Interval]:
    """When the segment between two satellites is nearer to the Earth than a height above it, m."""
    first, second = motions

    def holds(time: float) -> bool:
        return bool(blocked_by_earth(first(time), second(time), margin))

    inside = blocked_by_earth(first(times), second(times), margin)
    return [
        Interval("blocked", *names, begin, end, open_begin, open_end)
        for begin, end, open_begin, open_end in _intervals(inside, times, holds)
    ]


def _intervals(
    inside: Any, times: Array, holds: Callable[[float], bool]
) -> list[tuple[float, float, bool, bool]]:
    """Intervals in which a condition holds, from where it holds among samples.

    Args:
        inside: of each sample, shape (K,).
        times: of the samples, s, shape (K,).
        holds: the condition at any time.

    Returns:
        Begin and end in s, and whether it held at the first and last sample, of each.
    """
    changes = np.flatnonzero(inside[1:] != inside[:-1])
    ends = [_change(float(times[row]), float(times[row + 1]), holds) for row in changes]
    if inside[0]:
        ends.insert(0, float(times[0]))
    if inside[-1]:
        ends.append(float(times[-1]))
    pairs = list(zip(ends[::2], ends[1::2], strict=True))
    return [
        (begin, end, bool(inside[0]) and number == 0, bool(inside[-1]) and number == len(pairs) - 1)
        for number, (begin, end) in enumerate(pairs)
    ]


def _change(before: float, after: float, holds: Callable[[float], bool]) -> float:
    """When a condition changes between two times, s."""
    held = holds(before)
    while after - before > _TOLERANCE:
        middle = 0.5 * (before + after)
        if holds(middle) == held:
            before = middle
        else:
            after = middle
    return 0.5 * (before + after)
