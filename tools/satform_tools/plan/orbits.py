# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints Hohmann transfers, drift rates and passing rates; `satform.planning.transfers` has the formulas."""

import math
from collections.abc import Sequence
from dataclasses import asdict

from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER
from satform.planning.transfers import (
    drift_rate,
    hohmann_transfer,
    node_crossing_rate,
    semi_major_axis_offset_for_drift,
)
from satform_tools import console
from satform_tools.console import Table
from satform_tools.errors import CommandError

_DAY = 86400.0
_LARGEST_RADIUS = 1e12


def hohmann(start: float, end: float, *, altitudes: bool, as_json: bool) -> None:
    """Print the burns between two circular orbits.

    Args:
        start: radius of the orbit at the start, m.
        end: radius of the orbit at the end, m.
        altitudes: whether both are altitudes above the equator instead.
        as_json: whether to print JSON.

    Raises:
        CommandError: a radius is below the Earth's surface, or too large.
    """
    base = EQUATORIAL_RADIUS if altitudes else 0.0
    radii = _radius("--start", start + base), _radius("--end", end + base)
    transfer = hohmann_transfer(*radii, GRAVITATIONAL_PARAMETER)
    if as_json:
        names = ("start_radius", "end_radius")
        console.as_json(
            {**dict(zip(names, radii, strict=True)), **asdict(transfer), "delta_v": transfer.delta_v()}
        )
        return
    waiting = "any time"
    if math.isfinite(transfer.waiting_period):
        waiting = f"every {_time(transfer.waiting_period)}"
    _print(
        (
            ("first burn, forward", f"{transfer.first:.6f} m/s"),
            ("second burn, forward", f"{transfer.second:.6f} m/s"),
            ("delta-v", f"{transfer.delta_v():.6f} m/s"),
            ("from burn to burn", _time(transfer.duration)),
            ("transfer ellipse", f"a {transfer.semi_major_axis:.10g} m, e {transfer.eccentricity:.8g}"),
            ("lead angle of a target", f"{math.degrees(transfer.lead_angle):.6g} deg, {waiting}"),
        )
    )


def drift(
    offset: float | None, rate: float | None, radius: float, angle: float | None, *, as_json: bool
) -> None:
    """Print the drift of one circular orbit relative to another.

    Args:
        offset: of its semi-major axis from the other's, m; None to find it.
        rate: of the drift, deg/day, positive eastward; None to find it.
        radius: of the other orbit, m.
        angle: to drift, deg; None without a time.
        as_json: whether to print JSON.

    Raises:
        CommandError: not exactly one of offset and rate is given, or an orbit is below the Earth's surface.
    """
    radius = _radius("--radius", radius)
    if rate is not None and offset is None:
        motion = math.sqrt(GRAVITATIONAL_PARAMETER / radius**3)
        wanted = math.radians(rate) / _DAY
        if not motion + wanted > 0.0:
            raise CommandError(
                f"--rate {rate:g}: takes more than {-math.degrees(motion) * _DAY:g} deg/day, at which the "
                "drifting satellite would stand still"
            )
        offset = semi_major_axis_offset_for_drift(wanted, radius, GRAVITATIONAL_PARAMETER)
    elif rate is not None or offset is None:
        raise CommandError("give exactly one of --offset [m] and --rate [deg/day]")
    name = "--offset" if rate is None else "--rate"
    drifting = _radius(name, radius + offset, "the drifting orbit")
    found = drift_rate(offset, radius, GRAVITATIONAL_PARAMETER)
    duration = None if angle is None else _drift_time(angle, found)
    revolution = math.tau * math.sqrt(radius**3 / GRAVITATIONAL_PARAMETER)
    per_orbit = radius * found * revolution
    if as_json:
        console.as_json(
            {
                "offset": offset,
                "radius": radius,
                "rate": found,
                "along_track_per_orbit": per_orbit,
                "duration": duration,
            }
        )
        return
    rows = [
        ("offset", f"{offset:.9g} m, at radius {drifting:.10g} m"),
        ("drift, positive eastward", f"{found:.9g} rad/s, {math.degrees(found) * _DAY:.9g} deg/day"),
        ("along track, per revolution", f"{per_orbit:.7g} m"),
    ]
    if duration is not None:
        rows.append((f"time for {angle:g} deg", _time(duration)))
    _print(rows)


def passing(
    inclination: float, distance: float | None, rate: float | None, radius: float, *, as_json: bool
) -> None:
    """Print the angular rate of a pass at the node.

    Args:
        inclination: between the two orbits, deg.
        distance: closest, m; None to find it.
        rate: angular rate of the pass, deg/s; None to find it.
        radius: of both orbits, m.
        as_json: whether to print JSON.

    Raises:
        CommandError: not exactly one of distance and rate is given, or a number is out of range.
    """
    radius = _radius("--radius", radius)
    if not 0.0 < inclination <= 180.0:
        raise CommandError(f"--inclination {inclination:g}: takes more than 0 and at most 180 deg")
    speed = math.sqrt(GRAVITATIONAL_PARAMETER / radius)
    if (distance is None) == (rate is None):
        raise CommandError("give exactly one of --distance [m] and --rate [deg/s]")
    for name, value in (("--distance", distance), ("--rate", rate)):
        if value is not None and not (value > 0.0 and math.isfinite(value)):
            raise CommandError(f"{name} {value:g}: takes a positive number")
    # At a distance of 1 m the rate in rad/s is the relative speed in m/s.
    relative = node_crossing_rate(speed, math.radians(inclination), 1.0)
    if distance is None:
        assert rate is not None  # noqa: S101 - exactly one is given
        distance = relative / math.radians(rate)
    found = node_crossing_rate(speed, math.radians(inclination), distance)
    if as_json:
        console.as_json(
            {
                "inclination": math.radians(inclination),
                "distance": distance,
                "relative_speed": relative,
                "rate": found,
            }
        )
        return
    _print(
        (
            ("relative speed", f"{relative:.7g} m/s"),
            ("closest distance", f"{distance:.7g} m"),
            ("angular rate", f"{found:.7g} rad/s, {math.degrees(found):.7g} deg/s"),
        )
    )


def _radius(option: str, radius: float, what: str = "the orbit") -> float:
    if not EQUATORIAL_RADIUS <= radius <= _LARGEST_RADIUS:
        raise CommandError(
            f"{option}: {what} has a radius of {radius:g} m; it takes {EQUATORIAL_RADIUS:g} m, the Earth's "
            f"surface, to {_LARGEST_RADIUS:g} m"
        )
    return radius


def _drift_time(angle: float, rate: float) -> float:
    if rate == 0.0 or angle / rate < 0.0:
        raise CommandError(
            f"--angle {angle:g}: the drift of {math.degrees(rate) * _DAY:g} deg/day does not lead there"
        )
    return math.radians(angle) / rate


def _time(seconds: float) -> str:
    if seconds < _DAY:
        return f"{seconds:.3f} s, {seconds / 3600.0:.6g} h"
    return f"{seconds:.1f} s, {seconds / _DAY:.6g} days"


def _print(rows: Sequence[tuple[str, str]]) -> None:
    console.table(Table(("quantity", "value"), list(rows), frozenset()))
