# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints plans of impulsive flights as tables or JSON; the formulas are in `satform.planning`."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import Any

import numpy as np

from satform.control.protocol import Motion
from satform.dynamics.relative_motion_models import ModelName, relative_motion_model
from satform.orbits.chief import KeplerianChief, mean_anomaly, semi_major_axis_of
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER
from satform.orbits.sun import days_at, sun_in_lvlh
from satform.planning.coasts import ModelCoasts
from satform.planning.patrol import (
    GEOSTATIONARY_RADIUS,
    Burn,
    Encounter,
    NoPatrolError,
    Patrol,
    PatrolGoal,
    PatrolPlan,
    PatrolTarget,
    burn_in_lvlh,
    clearance,
    encounters,
    plan_patrol,
)
from satform.planning.transfer_plan import TourPlan, plan_tour
from satform.planning.transfers import Leg, node_crossing_rate
from satform_tools import console
from satform_tools.console import Table
from satform_tools.errors import CommandError, InfeasibleError
from satform_tools.plan.options import numbers, require_period

DAY = 86400.0

_GEOSTATIONARY_PERIOD = 86164.0905
"""s."""

_PERIOD_TOLERANCE = 100.0
"""Difference from the geostationary period, s, by which a chief drifts 0.4 deg in a day."""

_ANGLES = (("--true-anomaly", -360.0, 360.0), ("--inclination", 0.0, 180.0), ("--perigee", -360.0, 360.0))
"""Options of the chief's angles with least and largest value, deg, in the order of the task's orbit."""

_SAMPLES, _FEW_SAMPLES = 2000, 200
"""Moments of a coast at which its distance is looked at; few where a transition takes milliseconds."""

PATROL_DATE = datetime(2022, 10, 20, 4, 12)  # noqa: DTZ001 - the command line's dates are in UTC
PATROL_TARGETS = ("54.56,5.86,57", "56.82,0.01,270", "57.85,1.14,177")
"""The targets of the scenario `patrol_three`."""


@dataclass(frozen=True)
class ApproachTask:
    """What `plan approach` takes, as the command line gives it.

    Attributes:
        start: `x,y,z` in m or `x,y,z,vx,vy,vz` in m and m/s, LVLH; at rest where it has no velocity.
        points: `x,y,z,seconds` of each way-point, with `,pass` where the tour does not stop.
        period: of the chief's orbit, s.
        acceleration: `x,y,z`, known and constant, LVLH, m/s^2; None for none.
        step: over which each burn is held, s; None for impulses.
        date: of the start, UTC; None without a Sun angle.
        longitude: of a geostationary chief, deg east; None likewise.
        model: name of the model of relative motion.
        orbit: eccentricity, and in deg true anomaly at the start, inclination and argument of perigee of the
            chief; not for the model `cw`.
    """

    start: str
    points: Sequence[str]
    period: float
    acceleration: str | None = None
    step: float | None = None
    date: datetime | None = None
    longitude: float | None = None
    model: ModelName = "cw"
    orbit: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


def approach(task: ApproachTask, *, as_json: bool) -> None:
    """Print the burns of a tour.

    Args:
        task: what is asked.
        as_json: whether to print JSON.

    Raises:
        CommandError: a text is not of its form, or the tour cannot be flown.
    """
    if (task.date is None) != (task.longitude is None):
        raise CommandError("the Sun angle needs both --date and --longitude")
    require_period(task.period)
    if task.longitude is not None:
        _require_geostationary(task)
    if task.step is not None and not task.step > 0.0:
        raise CommandError(f"--step {task.step:g}: a control step takes a positive time")
    legs = [_leg(text) for text in task.points]
    acceleration = None if task.acceleration is None else numbers("--acceleration", task.acceleration, 3)
    try:
        plan = plan_tour(
            _motion(task.start),
            legs,
            2.0 * math.pi / task.period,
            None if acceleration is None else np.array(acceleration),
            task.step or 0.0,
            _coasts(task),
        )
    except ValueError as error:
        raise CommandError(str(error)) from None
    light = None
    if task.date is not None and task.longitude is not None:
        light = _light_at_the_end(legs, plan, task.date, math.radians(task.longitude))
    if as_json:
        console.as_json(_approach_data(plan, light))
        return
    _print_approach(plan)
    if task.date is not None:
        text = "none, as the tour ends at the chief" if light is None else f"{math.degrees(light):.1f} deg"
        console.line(f"Sun angle at the chief on arrival: {text}")


def _require_geostationary(task: ApproachTask) -> None:
    """Refuse a longitude for a chief that does not stay at it."""
    if not -360.0 <= (task.longitude or 0.0) <= 360.0:
        raise CommandError(f"--longitude {task.longitude:g}: takes -360 to 360")
    eccentricity, _, inclination, _ = task.orbit
    drift = abs(task.period - _GEOSTATIONARY_PERIOD)
    if eccentricity == 0.0 and inclination == 0.0 and drift <= _PERIOD_TOLERANCE:
        return
    raise CommandError(
        "--longitude: the Sun angle is that at a geostationary chief, whose --period is within "
        f"{_PERIOD_TOLERANCE:g} of {_GEOSTATIONARY_PERIOD:.10g} s, and whose --eccentricity and "
        f"--inclination are 0; found {task.period:.10g} s, {eccentricity:g} and {inclination:g} deg"
    )


def _coasts(task: ApproachTask) -> ModelCoasts | None:
    """Coasts by the model that is asked for; None for that of Clohessy and Wiltshire."""
    eccentricity, *angles = task.orbit
    if task.model == "cw":
        if any(task.orbit):
            raise CommandError(
                "--model cw is about a circular orbit and takes none of --eccentricity, --true-anomaly, "
                "--inclination and --perigee; use yamanaka_ankersen or j2_elements"
            )
        return None
    if not 0.0 <= eccentricity < 1.0:
        raise CommandError(f"--eccentricity {eccentricity:g}: takes 0 to below 1")
    for (option, least, largest), angle in zip(_ANGLES, angles, strict=True):
        if not least <= angle <= largest:
            raise CommandError(f"{option} {angle:g}: takes {least:g} to {largest:g} deg")
    axis = _semi_major_axis(task.period, eccentricity)
    anomaly, inclination, perigee = (math.radians(angle) for angle in angles)
    chief = KeplerianChief(
        axis,
        eccentricity,
        inclination,
        0.0,
        perigee,
        mean_anomaly(anomaly, eccentricity),
    )
    model = relative_motion_model(task.model, chief)
    return ModelCoasts(model, task.period, _FEW_SAMPLES if task.model == "j2_elements" else _SAMPLES)


def _semi_major_axis(period: float, eccentricity: float) -> float:
    """Semi-major axis in m of an orbit of a period in s that does not lead into the Earth."""
    axis = semi_major_axis_of(2.0 * math.pi / period, GRAVITATIONAL_PARAMETER)
    perigee = axis * (1.0 - eccentricity)
    if perigee < EQUATORIAL_RADIUS:
        option = f"--period {period:g}" if axis < EQUATORIAL_RADIUS else f"--eccentricity {eccentricity:.10g}"
        raise CommandError(
            f"{option}: the chief's perigee has a radius of {perigee / 1e3:.1f} km, which is inside the "
            f"Earth, whose radius is {EQUATORIAL_RADIUS / 1e3:.1f} km"
        )
    return axis


def _print_approach(plan: TourPlan) -> None:
    rows = [
        (f"{time:.6f}".rstrip("0").rstrip("."), *(f"{part:.6f}" for part in impulse), f"{size:.6f}")
        for time, impulse, size in zip(
            plan.burn_middles.tolist(),
            plan.impulses.tolist(),
            np.linalg.norm(plan.impulses, axis=1).tolist(),
            strict=True,
        )
    ]
    time = "middle [s]" if plan.burn_duration else "time [s]"
    headings = (time, "x [m/s]", "y [m/s]", "z [m/s]", "delta-v [m/s]")
    console.table(Table(headings, rows, frozenset(range(5))))
    console.line(f"delta-v {plan.delta_v():.6g} m/s in {plan.duration:g} s")
    if plan.burn_duration:
        end = ", ".join(f"{part:.3f}" for part in plan.end.position.tolist())
        console.line(f"each burn is held over {plan.burn_duration:g} s; after the last one at {end} m")
    console.line(f"closest to the chief: {plan.closest_distance:.7g} m at {plan.closest_time:.6g} s")


def patrol(
    targets: Sequence[str] | None,
    longitude: float,
    below: float,
    days: float,
    budget: float,
    keep_out: float,
    date: datetime | None,
    chief: float,
    *,
    as_json: bool,
) -> None:
    """Print the burns of a patrol, and its passes beside those of plain drift.

    Args:
        targets: `longitude,inclination,node` of each in deg; None for those of `patrol_three`.
        longitude: of the patrolling satellite at the start, deg east.
        below: depth of its orbit below the geostationary belt, km.
        days: length of the patrol.
        budget: delta-v that is not exceeded, m/s.
        keep_out: distance to every target that is kept from the start to the end, km.
        date: of the start, UTC; None for that of `patrol_three`.
        chief: longitude of the chief in whose LVLH burns are given, deg east.
        as_json: whether to print JSON.

    Raises:
        CommandError: a text is not of its form, or a number is out of range.
        InfeasibleError: no plan keeps budget, duration and keep-out distance.
    """
    if not (0.0 < days <= 60.0 and budget >= 0.0 and abs(below) <= 1000.0):
        raise CommandError("a patrol takes up to 60 days, no negative budget, and 1000 km about the belt")
    if not 0.0 <= keep_out <= 1000.0:
        raise CommandError(f"--keep-out {keep_out:g}: takes 0 to 1000 km")
    task = Patrol(
        start_day=days_at(date or PATROL_DATE),
        duration=days * DAY,
        longitude=math.radians(longitude),
        altitude_offset=-1e3 * below,
        targets=tuple(_target(text) for text in targets or PATROL_TARGETS),
    )
    try:
        plan = plan_patrol(task, PatrolGoal(budget=budget, keep_out=1e3 * keep_out))
    except NoPatrolError as error:
        raise InfeasibleError(str(error)) from None
    drifting = encounters(task, ())
    vectors = [burn_in_lvlh(task, plan.burns, burn, math.radians(chief)) for burn in plan.burns]
    if as_json:
        console.as_json(_patrol_data(task, plan, drifting, [vector.tolist() for vector in vectors]))
        return
    _print_burns(plan.burns, [vector.tolist() for vector in vectors], chief)
    console.line()
    _print_passes(task, plan.encounters, drifting)
    console.line()
    console.line(f"delta-v {plan.delta_v():.6g} m/s; drifting needs none")
    nearest = clearance(task, plan.burns, 0.0, task.duration)
    console.line(f"nearest to any target at any time: {nearest / 1e3:.1f} km")


def _motion(text: str) -> Motion:
    if text.count(",") == 2:
        return Motion(np.array(numbers("--start", text, 3)), np.zeros(3))
    try:
        state = np.array(numbers("--start", text, 6))
    except CommandError:
        raise CommandError(
            f"--start {text}: takes 3 numbers with commas between them, or 6 with the velocity"
        ) from None
    return Motion(state[:3], state[3:])


def _leg(text: str) -> Leg:
    rest = text.removesuffix(",pass")
    x, y, z, duration = numbers("--point", rest, 4)
    return Leg(np.array([x, y, z]), duration, stop=rest == text)


def _target(text: str) -> PatrolTarget:
    return PatrolTarget(*(math.radians(angle) for angle in numbers("--target", text, 3)))


def _light_at_the_end(legs: Sequence[Leg], plan: TourPlan, date: datetime, longitude: float) -> float | None:
    """Sun angle of the last point as seen from the chief, rad; None where that is the chief's own place."""
    sun = sun_in_lvlh(days_at(date) + plan.duration / DAY, longitude)
    position = legs[-1].position
    if not np.any(position):
        return None
    return math.acos(max(-1.0, min(1.0, float(position @ sun) / float(np.linalg.norm(position)))))


def _approach_data(plan: TourPlan, light: float | None) -> dict[str, Any]:
    return {
        "impulses": [
            {"time": time, "velocity_change": impulse}
            for time, impulse in zip(plan.burn_middles.tolist(), plan.impulses.tolist(), strict=True)
        ],
        "burn_duration": plan.burn_duration,
        "delta_v": plan.delta_v(),
        "duration": plan.duration,
        "end_position": plan.end.position.tolist(),
        "end_velocity": plan.end.velocity.tolist(),
        "closest_distance": plan.closest_distance,
        "closest_time": plan.closest_time,
        "light_angle": light,
    }


def _patrol_data(
    task: Patrol, plan: PatrolPlan, drifting: Sequence[Encounter], vectors: list[list[float]]
) -> dict[str, Any]:
    return {
        "burns": [
            {"time": burn.time, "velocity_change": vector}
            for burn, vector in zip(plan.burns, vectors, strict=True)
        ],
        "delta_v": plan.delta_v(),
        "closest_distance": clearance(task, plan.burns, 0.0, task.duration),
        "passes": [
            {**asdict(seen), "angular_rate": _angular_rate(target, seen)}
            for target, seen in zip(task.targets, plan.encounters, strict=True)
        ],
        "drift_passes": [
            {**asdict(seen), "angular_rate": _angular_rate(target, seen)}
            for target, seen in zip(task.targets, drifting, strict=True)
        ],
    }


def _angular_rate(target: PatrolTarget, seen: Encounter) -> float:
    speed = math.sqrt(GRAVITATIONAL_PARAMETER / GEOSTATIONARY_RADIUS)
    return node_crossing_rate(speed, target.inclination, seen.distance)


def _print_burns(burns: Sequence[Burn], vectors: list[list[float]], chief: float) -> None:
    rows = [
        (
            f"{burn.time:.1f}",
            f"{burn.time / DAY:.3f}",
            f"{burn.speed_change:.6f}",
            *(f"{part:.8f}" for part in vector),
        )
        for burn, vector in zip(burns, vectors, strict=True)
    ]
    headings = ("time [s]", "day", "forward [m/s]", "x [m/s]", "y [m/s]", "z [m/s]")
    console.table(Table(headings, rows, frozenset(range(6))))
    console.line(f"x, y and z are in the LVLH axes of a geostationary chief at {chief:g} deg E")


def _print_passes(task: Patrol, planned: Sequence[Encounter], drifting: Sequence[Encounter]) -> None:
    headings = ("pass", "day", "closest [km]", "Sun angle [deg]", "sunlit", "angular rate [deg/s]")
    rows = []
    for name, passes in (("with burns", planned), ("drifting", drifting)):
        for number, (target, seen) in enumerate(zip(task.targets, passes, strict=True), start=1):
            rows.append(
                (
                    f"target {number}, {name}",
                    f"{seen.time / DAY:.2f}",
                    f"{seen.distance / 1e3:.1f}",
                    f"{math.degrees(seen.light_angle):.1f}",
                    "yes" if seen.sunlit else "no",
                    f"{math.degrees(_angular_rate(target, seen)):.3f}",
                )
            )
    console.table(Table(headings, rows, frozenset({1, 2, 3, 5})))
