# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The figure of each kind of expectation by its definition, over the whole arrays of one flight."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from figure_reductions import by_satellite, first, greatest, least, length, mean, numbers, settles, total
from flight_arrays import Flight
from pair_formulas import (
    collision,
    pass_distance,
    pass_light_angle,
    pass_time,
    passive_safety,
    radial_normal,
    tetrahedron_quality,
    tetrahedron_quality_at,
)
from satform.numeric.modified_rodrigues import relative_mrp, rotation_of_mrp


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


def turned_from_estimate(flight: Flight) -> np.ndarray:
    """Rotation vectors from estimated to true body axes; by the library, for the same bits."""
    estimated = flight.arrays["estimated_mrp"]
    return rotation_of_mrp(relative_mrp(flight.arrays["mrp"][: len(estimated)], estimated))


def attitude_nees(flight: Flight) -> np.ndarray:
    off, covariance = turned_from_estimate(flight), flight.arrays["attitude_covariance"]
    squared = np.full(off.shape[:2], np.nan)
    for row, column in np.ndindex(*squared.shape):
        if np.all(np.isfinite(off[row, column])):
            solved = np.linalg.solve(covariance[row, column, :3, :3], off[row, column])
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
        if expectation.satellites is not None and any(flight.absent[k][n] for k in rows for n in columns):
            return math.nan
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


def root_mean_square(series: Callable[[Flight], np.ndarray]) -> Callable[[Any, Flight], float]:
    def figure(expectation: Any, flight: Flight) -> float:
        values = flight.window(expectation, series(flight))
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


def steps_absent(expectation: Any, flight: Flight) -> float:
    series = np.array(flight.absent[:-1], dtype=np.float64)
    values = flight.window(expectation, series, held=True, of_bodies=True)
    return math.nan if values is None else float(values.sum(axis=0).max())


def unsolved_plans(expectation: Any, flight: Flight) -> float:
    series = np.where(np.array(flight.absent[:-1]), 0.0, flight.arrays["unsolved_plans"])
    values = flight.window(expectation, series, held=True)
    return math.nan if values is None else greatest(np.cumsum(values, axis=0)[-1:])


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
    "attitude_estimation_error": statistic(lambda own: length(turned_from_estimate(own))),
    "attitude_nees": statistic(attitude_nees),
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
    "tracking_error_rms": root_mean_square(tracking_error),
    "tracking_error_at": at_moment(tracking_error),
    "unsolved_plans": unsolved_plans,
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
