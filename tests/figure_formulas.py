# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The figure of each kind of expectation by its definition, over the whole arrays of one flight."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from flight_arrays import Flight
from satform.control.protocol import Motion
from satform.control.relative_elements import elements_from_motion
from satform.dynamics.free_drift import least_free_distance
from satform.orbits.collision_probability import collision_probability
from satform.orbits.radial_normal import least_radial_normal_distance
from satform.orbits.sun import days_at, sun_in_lvlh
from satform.orbits.tetrahedron import QUALITIES


def length(vectors: np.ndarray) -> np.ndarray:
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.sqrt(x * x + y * y + z * z)


def numbers(values: np.ndarray | None) -> list[float]:
    return [] if values is None else [own for own in np.ravel(values).tolist() if not math.isnan(own)]


def greatest(values: np.ndarray | None) -> float:
    return max(numbers(values), default=math.nan)


def least(values: np.ndarray | None) -> float:
    return min(numbers(values), default=math.nan)


def total(values: list[float]) -> float:
    found = 0.0
    for own in values:
        found += own
    return found


def by_satellite(values: np.ndarray | None) -> list[list[float]]:
    return [] if values is None else [numbers(values[:, n]) for n in range(values.shape[1])]


def mean(values: np.ndarray | None) -> float:
    columns = by_satellite(values)
    count = sum(map(len, columns))
    return total([total(own) for own in columns]) / count if count else math.nan


def settles(within: list[bool], step: float) -> float:
    outside = [k for k, own in enumerate(within) if not own]
    first = outside[-1] + 1 if outside else 0
    return first * step if first < len(within) else math.nan


def first(reached: list[bool], step: float) -> float:
    return reached.index(True) * step if True in reached else math.nan


def tracking_error(flight: Flight) -> np.ndarray:
    return length(flight.arrays["position"][:-1] - flight.arrays["reference_position"])


def estimation_error(flight: Flight) -> np.ndarray:
    wrong = flight.arrays["position"][:-1] - flight.arrays["reference_position"]
    return length(flight.arrays["estimated_position_error"] - wrong)


def nees(flight: Flight) -> np.ndarray:
    motion = [flight.arrays[name][:-1] for name in ("position", "velocity")]
    desired = [flight.arrays[f"reference_{name}"] for name in ("position", "velocity")]
    found = [flight.arrays[f"estimated_{name}_error"] for name in ("position", "velocity")]
    pairs = zip(found, motion, desired, strict=True)
    off = np.concatenate([own - (true - wanted) for own, true, wanted in pairs], axis=-1)
    covariance = flight.arrays["estimate_covariance"]
    squared = np.full(off.shape[:2], np.nan)
    for row, column in np.ndindex(*squared.shape):
        if np.all(np.isfinite(off[row, column])):
            solved = np.linalg.solve(covariance[row, column], off[row, column])
            squared[row, column] = (off[row, column] * solved).sum()
    return squared


def largest(series: Callable[[Flight], np.ndarray], **how: bool) -> Callable[[Any, Flight], float]:
    return lambda expectation, flight: greatest(flight.window(expectation, series(flight), **how))


def named(name: str) -> Callable[[Flight], np.ndarray]:
    return lambda flight: flight.arrays[name]


def at_moment(series: Callable[[Flight], np.ndarray], **how: bool) -> Callable[[Any, Flight], float]:
    def figure(expectation: Any, flight: Flight) -> float:
        values = series(flight)
        rows, columns = flight.row(expectation, len(values)), flight.columns(expectation.satellites)
        return greatest(flight.kept(values, rows, columns, **how)) if len(values) else math.nan

    return figure


def statistic(series: Callable[[Flight], np.ndarray]) -> Callable[[Any, Flight], float]:
    def figure(expectation: Any, flight: Flight) -> float:
        values = flight.window(expectation, series(flight))
        if expectation.statistic == "maximum":
            return greatest(values)
        if expectation.statistic == "mean":
            return mean(values)
        return math.sqrt(mean(None if values is None else values * values))

    return figure


def control(expectation: Any, flight: Flight) -> float:
    commanded = length(flight.arrays["acceleration"])
    commanded[np.array(flight.absent[:-1])] = math.nan
    values = flight.window(expectation, commanded, held=True)
    return {"mean": mean, "minimum": least, "maximum": greatest}[expectation.statistic](values)


def delta_v(expectation: Any, flight: Flight) -> float:
    counted = flight.arrays["delta_v"][1:] - flight.arrays["delta_v"][:-1]
    ideal = flight.step * length(flight.arrays["applied_acceleration"])
    values = flight.window(expectation, np.where(np.isnan(counted), ideal, counted), held=True)
    if values is None:
        return math.nan
    return greatest(np.array([[total(values[:, n].tolist()) for n in range(values.shape[1])]]))


def change(name: str, *, magnitude: bool = True) -> Callable[[Any, Flight], float]:
    def figure(expectation: Any, flight: Flight) -> float:
        values = flight.window(expectation, flight.arrays[name])
        if values is None or len(values) < 2:
            return math.nan
        changed = values[-1] - values[0]
        return greatest(np.abs(changed) if magnitude else changed)

    return figure


def wheels(name: str) -> Callable[[Any, Flight], float]:
    def figure(expectation: Any, flight: Flight) -> float:
        values = flight.window(expectation, flight.arrays[name])
        if values is None:
            return math.nan
        axes = "xyz" if expectation.axis is None else expectation.axis
        return greatest(np.abs(np.array([values[..., "xyz".index(axis)] for axis in axes])))

    return figure


def saturation(expectation: Any, flight: Flight) -> float:
    return change(f"{expectation.limit}_saturated_steps", magnitude=False)(expectation, flight)


def settling(series: Callable[[Flight], np.ndarray], **how: bool) -> Callable[[Any, Flight], float]:
    def figure(expectation: Any, flight: Flight) -> float:
        values, columns = series(flight), flight.columns(expectation.satellites)
        within = []
        for k in range(len(values)):
            flying = [values[k, n] for n in columns if not flight.excused(values, k, n, **how)]
            within.append(bool(flying) and all(own <= expectation.level for own in flying))
        return settles(within, flight.step)

    return figure


def attitude_settling(expectation: Any, flight: Flight) -> float:
    return settling(named(expectation.quantity), of_others=True)(expectation, flight)


def reaching(expectation: Any, flight: Flight) -> float:
    series, columns = flight.arrays["sliding_variable"], flight.columns(expectation.satellites)
    reached = []
    for k in range(flight.steps):
        flying = [n for n in columns if not flight.excused(series, k, n)]
        levels = [abs(series[k, n, "xyz".index(expectation.axis)]) for n in flying]
        reached.append(bool(flying) and all(own <= expectation.level for own in levels))
    return first(reached, flight.step)


def spread_at(expectation: Any, flight: Flight) -> float:
    columns = flight.columns(expectation.satellites)
    for k in flight.row(expectation, flight.steps + 1):
        lacks = expectation.satellites is not None and any(flight.absent[k][n] for n in columns)
        return math.nan if lacks else flight.spread(k, columns)
    return math.nan


def spread_settling(expectation: Any, flight: Flight) -> float:
    spreads = [flight.spread(k, flight.columns(None)) for k in range(flight.steps + 1)]
    return settles([own <= expectation.fraction * spreads[0] for own in spreads], flight.step)


def mean_at(expectation: Any, flight: Flight) -> float:
    series = flight.arrays["arc_length"]
    rows = flight.row(expectation, len(series))
    flying = numbers(flight.kept(series, rows, flight.columns(None)))
    return (
        total(flying) / len(flying) - expectation.nominal_rate * (rows[0] * flight.step)
        if flying
        else math.nan
    )


def rate_at(expectation: Any, flight: Flight) -> float:
    return at_moment(lambda own: np.abs(own.arrays["rate"] - expectation.nominal_rate))(expectation, flight)


def distance(expectation: Any, flight: Flight) -> float:
    pair = flight.window(expectation, flight.arrays["position"], of_bodies=True)
    if pair is None:
        return math.nan
    return {"minimum": least, "maximum": greatest}[expectation.statistic](length(pair[:, 0] - pair[:, 1]))


def away(expectation: Any, flight: Flight) -> float:
    values = flight.window(expectation, flight.arrays["position"], of_bodies=True)
    far = None if values is None else length(values)
    return {"minimum": least, "maximum": greatest}[expectation.statistic](far)


def closest_pass(expectation: Any, flight: Flight) -> tuple[float, np.ndarray, int] | None:
    """Time and separation of the closest pass, and the step from which it is found."""
    places = flight.window(expectation, flight.arrays["position"], of_bodies=True)
    motions = flight.window(expectation, flight.arrays["velocity"], of_bodies=True)
    if places is None or motions is None:
        return None
    times = flight.window(
        expectation.model_copy(update={"satellites": flight.names[:1]}),
        (np.arange(flight.steps + 1) * flight.step)[:, None],
        of_bodies=True,
    )
    assert times is not None
    passes = []
    for time, place, motion in zip(times[:, 0], places, motions, strict=True):
        apart, closing = place[0] - place[1], motion[0] - motion[1]
        speed_squared = closing[0] * closing[0] + closing[1] * closing[1] + closing[2] * closing[2]
        product = apart[0] * closing[0] + apart[1] * closing[1] + apart[2] * closing[2]
        ahead = -product / speed_squared if speed_squared > 0.0 else -product
        ahead = max(-0.5 * flight.step, min(0.5 * flight.step, ahead))
        ahead = max(times[0, 0], min(times[-1, 0], time + ahead)) - time
        nearest = apart + ahead * closing
        passes.append(
            (
                nearest[0] * nearest[0] + nearest[1] * nearest[1] + nearest[2] * nearest[2],
                time + ahead,
                nearest,
                round(time / flight.step),
            )
        )
    _, when, nearest, step = min(passes, key=lambda own: own[0])
    return float(when), nearest, step


def pass_distance(expectation: Any, flight: Flight) -> float:
    found = closest_pass(expectation, flight)
    return math.nan if found is None else float(length(found[1]))


def pass_time(expectation: Any, flight: Flight) -> float:
    found = closest_pass(expectation, flight)
    return math.nan if found is None else found[0]


def pass_light_angle(expectation: Any, flight: Flight) -> float:
    found = closest_pass(expectation, flight)
    if found is None or not float(length(found[1])):
        return math.nan
    sun = sun_in_lvlh(days_at(expectation.epoch) + found[0] / 86400.0, expectation.chief_longitude)
    product = found[1][0] * sun[0] + found[1][1] * sun[1] + found[1][2] * sun[2]
    return math.acos(max(-1.0, min(1.0, product / float(length(found[1])))))


def steps_absent(expectation: Any, flight: Flight) -> float:
    series = np.array(flight.absent[:-1], dtype=np.float64)
    values = flight.window(expectation, series, held=True, of_bodies=True)
    return math.nan if values is None else float(values.sum(axis=0).max())


def rejoin_time(expectation: Any, flight: Flight) -> float:
    column = flight.names.index(expectation.satellite)
    lost = [k for k in range(flight.steps) if flight.absent[k][column]]
    back = lost[-1] + 1 if lost else flight.steps
    spreads = [flight.spread(k, flight.columns(None)) for k in range(back, flight.steps)]
    return settles([own <= expectation.within for own in spreads], flight.step)


def progress(expectation: Any, flight: Flight) -> np.ndarray | None:
    def of(vectors: np.ndarray) -> np.ndarray:
        if expectation.quantity == "range":
            return length(vectors)
        found: np.ndarray = vectors[..., "xyz".index(expectation.quantity)]
        return found

    reference, columns = flight.arrays["reference_position"], flight.columns(expectation.satellites)
    flown, wanted = of(flight.arrays["position"][:-1, columns]), of(reference[:, columns])
    part = np.full_like(flown, math.nan)
    for k in range(flight.steps):
        for place, n in enumerate(columns):
            way = wanted[k, place] - flown[0, place]
            if way and not math.isnan(way):
                part[k, place] = (flown[k, place] - flown[0, place]) / way
            elif not flight.excused(reference, k, n):
                return None
            if math.isnan(part[k, place]) and not flight.excused(reference, k, n):
                return None
    return part


def overshoot(expectation: Any, flight: Flight) -> float:
    return 100.0 * (greatest(progress(expectation, flight)) - 1.0)


def response_time(expectation: Any, flight: Flight) -> float:
    part = progress(expectation, flight)
    if part is None:
        return math.nan
    moments = []
    for column in part.T.tolist():
        if expectation.event == "peak":
            most = max((own for own in column if not math.isnan(own)), default=None)
            moments.append(math.nan if most is None else float(column.index(most)))
        elif expectation.event == "crossing":
            moments.append(first([own >= 1.0 for own in column], 1.0))
        else:
            moments.append(settles([abs(own - 1.0) <= expectation.band for own in column], 1.0))
    return math.nan if any(map(math.isnan, moments)) else max(moments) * flight.step


def position_errors(expectation: Any, flight: Flight) -> list[list[float]]:
    """Position errors along the axis within the window, of each satellite; none where the window is empty."""
    wrong = flight.arrays["position"][:-1] - flight.arrays["reference_position"]
    values = flight.window(expectation, wrong)
    return [] if values is None else by_satellite(values[..., "xyz".index(expectation.axis)])


def offset(expectation: Any, flight: Flight) -> float:
    columns = position_errors(expectation, flight)
    return max((total(own) / len(own) for own in columns if own), key=abs, default=math.nan)


def ripple(expectation: Any, flight: Flight) -> float:
    columns = position_errors(expectation, flight)
    return 0.5 * max((max(own) - min(own) for own in columns if len(own) > 1), default=math.nan)


def pairs(expectation: Any, flight: Flight) -> list[tuple[str, str]]:
    return list(combinations(expectation.satellites or flight.names, 2))


def collision(expectation: Any, flight: Flight) -> float:
    found = []
    for pair in pairs(expectation, flight):
        closest = closest_pass(expectation.model_copy(update={"satellites": pair}), flight)
        whole = flight.window(expectation, flight.arrays["position"], of_bodies=True)
        motions = flight.window(expectation, flight.arrays["velocity"], of_bodies=True)
        if closest is None or whole is None or motions is None:
            return math.nan
        _, nearest, k = closest
        columns = flight.columns(pair)
        closing = flight.arrays["velocity"][k, columns[0]] - flight.arrays["velocity"][k, columns[1]]
        # Of a circular chief; the frame turns with it.
        closing = closing + flight.mean_motion * np.array([-nearest[1], nearest[0], 0.0])
        squared = nearest[0] * nearest[0] + nearest[1] * nearest[1] + nearest[2] * nearest[2]
        product = nearest[0] * closing[0] + nearest[1] * closing[1] + nearest[2] * closing[2]
        across = closing - nearest * (product / squared if squared > 0.0 else product)
        covariance = np.diag(np.square(expectation.standard_deviation or (math.nan,) * 3))
        if expectation.standard_deviation is None:
            estimates = flight.arrays["estimate_covariance"][min(k, flight.steps - 1)]
            covariance = estimates[columns[0], :3, :3] + estimates[columns[1], :3, :3]
        found.append(collision_probability(nearest, across, covariance, expectation.combined_radius))
    return math.nan if any(map(math.isnan, found)) else max(found)


def relative_motions(expectation: Any, flight: Flight) -> list[list[Motion]] | None:
    """Motion of each pair in each row."""
    places = flight.window(expectation, flight.arrays["position"], of_bodies=True)
    motions = flight.window(expectation, flight.arrays["velocity"], of_bodies=True)
    if places is None or motions is None:
        return None
    indices = list(combinations(range(places.shape[1]), 2))
    return [
        [Motion(place[one] - place[other], motion[one] - motion[other]) for one, other in indices]
        for place, motion in zip(places, motions, strict=True)
    ]


def radial_normal(expectation: Any, flight: Flight) -> float:
    rate, angle = np.array([flight.mean_motion]), np.zeros(())
    found = [
        elements_from_motion(Motion(own.position[None], own.velocity[None]), rate, angle).as_array()
        for row in relative_motions(expectation, flight) or []
        for own in row
    ]
    return min((float(least_radial_normal_distance(own)[0]) for own in found), default=math.nan)


def passive_safety(expectation: Any, flight: Flight) -> float:
    found = [
        least_free_distance(own.position, own.velocity, flight.mean_motion, expectation.orbits)[0]
        for row in (relative_motions(expectation, flight) or [])[:: expectation.every]
        for own in row
    ]
    return min(map(float, found), default=math.nan)


def tetrahedron(expectation: Any, flight: Flight) -> np.ndarray | None:
    corners = flight.window(expectation, flight.arrays["position"], of_bodies=True)
    return None if corners is None else QUALITIES[expectation.quality](corners)[:, None]


def tetrahedron_quality(expectation: Any, flight: Flight) -> float:
    make = {"mean": mean, "minimum": least, "maximum": greatest}[expectation.statistic]
    return make(tetrahedron(expectation, flight))


def tetrahedron_quality_at(expectation: Any, flight: Flight) -> float:
    values = flight.arrays["position"]
    corners = flight.kept(
        values, flight.row(expectation, len(values)), flight.columns(expectation.satellites)
    )
    return math.nan if corners is None else float(QUALITIES[expectation.quality](corners)[0])


def delta_v_per_orbit(expectation: Any, flight: Flight) -> float:
    held = flight.window(expectation, flight.arrays["acceleration"], held=True)
    if held is None:
        return math.nan
    return delta_v(expectation, flight) / (len(held) * (flight.step * flight.mean_motion / math.tau))


FORMULAS: dict[str, Callable[[Any, Flight], float]] = {
    "arc_length_mean": mean_at,
    "arc_length_rate": rate_at,
    "arc_length_settling": spread_settling,
    "arc_length_spread": spread_at,
    "attitude_error_at": at_moment(named("attitude_error"), of_others=True),
    "attitude_rate_error_at": at_moment(named("attitude_rate_error"), of_others=True),
    "attitude_settling": attitude_settling,
    "below_minimum_impulse_steps": change("below_minimum_impulse_steps"),
    "collision_probability": collision,
    "control": control,
    "delta_v": delta_v,
    "delta_v_per_orbit": delta_v_per_orbit,
    "distance": distance,
    "estimation_error": statistic(estimation_error),
    "nees": statistic(nees),
    "nis": statistic(named("innovation")),
    "navigation_error": statistic(
        lambda own: length(own.arrays["measured_position"] - own.arrays["position"])
    ),
    "offset": offset,
    "overshoot": overshoot,
    "panel_to_sun": largest(named("panel_to_sun"), of_others=True),
    "passive_safety": passive_safety,
    "pass_distance": pass_distance,
    "pass_light_angle": pass_light_angle,
    "pass_time": pass_time,
    "pointing_error": largest(named("pointing_error"), of_others=True),
    "propellant_depleted_steps": change("propellant_depleted_steps"),
    "propellant_used": change("propellant"),
    "radial_normal_distance": radial_normal,
    "range": away,
    "reaching_time": reaching,
    "rejoin_time": rejoin_time,
    "response_time": response_time,
    "ripple": ripple,
    "saturated_steps": change("saturated_steps"),
    "settling_time": settling(tracking_error),
    "sliding_variable": lambda own, flight: wheels("sliding_variable")(_with_axes(own), flight),
    "steps_absent": steps_absent,
    "tetrahedron_quality": tetrahedron_quality,
    "tetrahedron_quality_at": tetrahedron_quality_at,
    "tracking_error": largest(tracking_error),
    "tracking_error_at": at_moment(tracking_error),
    "velocity_error": largest(
        lambda own: length(own.arrays["velocity"][:-1] - own.arrays["reference_velocity"])
    ),
    "wheel_momentum": wheels("wheel_momentum"),
    "wheel_saturation": saturation,
    "wheel_torque": wheels("wheel_torque"),
}
"""The figure of each kind by its definition, over the whole arrays of one flight."""


@dataclass(frozen=True)
class _with_axes:  # noqa: N801 - stands for a function
    expectation: Any
    axis: None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self.expectation, name)
