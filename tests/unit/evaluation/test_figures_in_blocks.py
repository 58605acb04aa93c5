# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every figure by its formula over whole arrays, for any blocks of steps and any runs side by side."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pytest

from satform.common.spec import specs
from satform.control.sampled_stability import SampledLoop
from satform.evaluation.flight_figures import FlightFigures
from satform.evaluation.loops import SpectralRadius
from satform.evaluation.reducers import ExtremeOf, added_in_order
from satform.evaluation.tracking import Distance, TrackingError, TrackingErrorAt
from satform.orbits.sun import days_at, sun_in_lvlh
from satform.record.flight_block import FlightBlock
from satform.record.flight_record import QUANTITIES, STATES, FlightRecord
from satform.record.reducer import FlightShape, Reducer
from satform.scenario.expectation import Expectation
from satform.scenario.windowed_expectation import OverWindow

SLACK = 1e-9
"""Relative slack of times, as the pages of the expectations say."""

KINDS = sorted(set(specs("satform.metrics")) - {"spectral_radius"})
SEEDS = range(20)
RADIUS = SpectralRadius(below=1.0, source="none")
COMPONENTS = {
    **dict.fromkeys(
        ("arc_length", "rate", "propellant", "delta_v", "innovation", "rejected_measurements"), ()
    ),
    **dict.fromkeys(("saturated_steps", "below_minimum_impulse_steps", "propellant_depleted_steps"), ()),
    **dict.fromkeys(("torque_saturated_steps", "momentum_saturated_steps"), ()),
    **dict.fromkeys(("pointing_error", "panel_to_sun", "attitude_error", "attitude_rate_error"), ()),
    "estimate_covariance": (6, 6),
}
"""Shape of what a satellite has of a quantity at a time; (3,) where nothing is said."""

OF_ATTITUDE = {
    *("mrp", "angular_velocity", "wheel_momentum", "wheel_torque", "torque_saturated_steps"),
    *("momentum_saturated_steps", "pointing_error", "panel_to_sun", "attitude_error", "attitude_rate_error"),
}
LOST = ("arc_length", "rate", "sliding_variable", "pointing_error", "estimated_position_error")
"""What a satellite that does not fly does not give, besides its reference."""

SOME_LACK = ("propellant", "delta_v", "sliding_variable", "pointing_error")
"""What a satellite may lack throughout."""

SOMETIMES_MISSING = ("position", "arc_length", "rate", "wheel_torque", "reference_position")
"""Of what a number may be missing without a reason."""


@dataclass(frozen=True)
class Flight:
    """The arrays of one flight, and what the formulas below need of them."""

    names: tuple[str, ...]
    step: float
    arrays: dict[str, np.ndarray]

    @property
    def steps(self) -> int:
        return len(self.arrays["acceleration"])

    @property
    def record(self) -> FlightRecord:
        return FlightRecord(self.names, self.step, **self.arrays)

    @cached_property
    def absent(self) -> list[list[bool]]:
        """Who does not fly in each step and, as in the last step, at the end."""
        reference, command = self.arrays["reference_position"], self.arrays["acceleration"]
        steps = [
            [
                bool(np.isnan(reference[k, n]).all() and not command[k, n].any())
                for n in range(len(self.names))
            ]
            for k in range(self.steps)
        ]
        return [*steps, steps[-1]]

    def columns(self, names: tuple[str, ...] | None) -> list[int]:
        return [self.names.index(name) for name in names or self.names]

    def kept(
        self,
        series: np.ndarray,
        rows: list[int],
        columns: list[int],
        *,
        named: bool = False,
        of_others: bool = False,
        of_bodies: bool = False,
    ) -> np.ndarray | None:
        """The numbers of some rows; None where there is no figure."""
        if not rows or not len(series):
            return None
        if named and any(all(self.absent[k][n] for k in rows) for n in columns):
            return None
        for k in rows:
            for n in columns:
                away = any(self.absent[k]) if of_others else self.absent[k][n]
                excused = away and not np.isnan(series[0, n]).any() and not of_bodies
                if np.isnan(series[k, n]).any() and not excused:
                    return None
        return series[rows][:, columns]

    def window(
        self, expectation: Any, series: np.ndarray, *, held: bool = False, **how: bool
    ) -> np.ndarray | None:
        columns = self.columns(expectation.satellites)
        before, after = expectation.before, expectation.after * (1 - SLACK)
        if before is not None and before * (1 - SLACK) > self.steps * self.step:
            return None
        end = math.inf if before is None else before * (1 - SLACK if held else 1 + SLACK)
        rows = [k for k in range(len(series)) if after <= k * self.step <= end]
        named = expectation.satellites is not None and not how.get("of_bodies")
        return self.kept(series, rows, columns, named=named, **how)

    def row(self, expectation: Any, rows: int) -> list[int]:
        row = self.steps if expectation.at is None else round(expectation.at / self.step)
        return [] if row > self.steps else [min(row, rows - 1)]

    def excused(self, series: np.ndarray, k: int, n: int, *, of_others: bool = False) -> bool:
        away = any(self.absent[k]) if of_others else self.absent[k][n]
        return bool(away and np.isnan(series[k, n]).any() and not np.isnan(series[0, n]).any())

    def spread(self, k: int, columns: list[int]) -> float:
        series = self.arrays["arc_length"]
        flying = [series[k, n] for n in columns if not self.excused(series, k, n)]
        known = len(flying) > 1 and not any(math.isnan(own) for own in flying)
        return max(flying) - min(flying) if known else math.nan


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


def closest_pass(expectation: Any, flight: Flight) -> tuple[float, np.ndarray] | None:
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
            )
        )
    _, time, nearest = min(passes, key=lambda own: own[0])
    return float(time), nearest


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


def offset(expectation: Any, flight: Flight) -> float:
    wrong = flight.arrays["position"][:-1] - flight.arrays["reference_position"]
    values = flight.window(expectation, wrong)
    if values is None:
        return math.nan
    columns = by_satellite(values[..., "xyz".index(expectation.axis)])
    return max((total(own) / len(own) for own in columns if own), key=abs, default=math.nan)


def ripple(expectation: Any, flight: Flight) -> float:
    wrong = flight.arrays["position"][:-1] - flight.arrays["reference_position"]
    values = flight.window(expectation, wrong)
    if values is None:
        return math.nan
    columns = by_satellite(values[..., "xyz".index(expectation.axis)])
    return 0.5 * max((max(own) - min(own) for own in columns if len(own) > 1), default=math.nan)


FORMULAS: dict[str, Callable[[Any, Flight], float]] = {
    "arc_length_mean": mean_at,
    "arc_length_rate": rate_at,
    "arc_length_settling": spread_settling,
    "arc_length_spread": spread_at,
    "attitude_error_at": at_moment(named("attitude_error"), of_others=True),
    "attitude_rate_error_at": at_moment(named("attitude_rate_error"), of_others=True),
    "attitude_settling": attitude_settling,
    "below_minimum_impulse_steps": change("below_minimum_impulse_steps"),
    "control": control,
    "delta_v": delta_v,
    "distance": distance,
    "estimation_error": statistic(estimation_error),
    "navigation_error": statistic(
        lambda own: length(own.arrays["measured_position"] - own.arrays["position"])
    ),
    "offset": offset,
    "overshoot": overshoot,
    "panel_to_sun": largest(named("panel_to_sun"), of_others=True),
    "pass_distance": pass_distance,
    "pass_light_angle": pass_light_angle,
    "pass_time": pass_time,
    "pointing_error": largest(named("pointing_error"), of_others=True),
    "propellant_depleted_steps": change("propellant_depleted_steps"),
    "propellant_used": change("propellant"),
    "range": away,
    "reaching_time": reaching,
    "rejoin_time": rejoin_time,
    "response_time": response_time,
    "ripple": ripple,
    "saturated_steps": change("saturated_steps"),
    "settling_time": settling(tracking_error),
    "sliding_variable": lambda own, flight: wheels("sliding_variable")(_with_axes(own), flight),
    "steps_absent": steps_absent,
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


def flights(rng: np.random.Generator, runs: int) -> list[Flight]:
    """Flights of the same names and steps, in which satellites may be lost and numbers may be missing."""
    steps, names = int(rng.integers(1, 25)), ("a", "b", "c", "d")[: int(rng.integers(2, 5))]
    turning, step = rng.random() < 0.8, float(rng.choice([0.1, 0.5, 2.0]))
    return [one_flight(rng, steps, names, step, turning=turning) for _ in range(runs)]


def one_flight(
    rng: np.random.Generator, steps: int, names: tuple[str, ...], step: float, *, turning: bool
) -> Flight:
    count, arrays = len(names), {}
    whole = rng.random() < 0.4
    for name in QUANTITIES:
        rows = 0 if name in OF_ATTITUDE and not turning else steps + (name in STATES)
        shape = (rows, count, *COMPONENTS.get(name, (3,)))
        # Whole numbers are often equal to each other and to a level.
        arrays[name] = rng.integers(-3, 4, shape).astype(float) if whole else 3.0 * rng.standard_normal(shape)
    for name in ("pointing_error", "panel_to_sun", "attitude_error", "attitude_rate_error"):
        arrays[name] = np.abs(arrays[name])
    for n in range(count):
        if rng.random() < 0.3:
            begin, end = sorted(rng.integers(0, steps + 2, 2).tolist())
            lose(arrays, n, begin, end, steps)
        if rng.random() < 0.2:
            arrays[str(rng.choice(SOME_LACK))][:, n] = np.nan
    if rng.random() < 0.15:
        values = arrays[str(rng.choice(SOMETIMES_MISSING))]
        if values.size:
            values[tuple(int(rng.integers(0, size)) for size in values.shape)] = np.nan
    return Flight(names, step, arrays)


def lose(arrays: dict[str, np.ndarray], satellite: int, begin: int, end: int, steps: int) -> None:
    arrays["reference_position"][begin:end, satellite] = np.nan
    arrays["reference_velocity"][begin:end, satellite] = np.nan
    arrays["acceleration"][begin:end, satellite] = 0.0
    for name in LOST:
        until = end + 1 if end >= steps else end
        arrays[name][begin:until, satellite] = np.nan


def expectation_of(kind: str, rng: np.random.Generator, flight: Flight) -> Expectation:
    """An expectation of a kind with fields at random; what is allowed does not matter."""
    spec = specs("satform.metrics")[kind]
    end = flight.steps * flight.step
    fields = {
        "satellites": lambda: satellites(kind, rng, flight.names),
        "satellite": lambda: str(rng.choice(flight.names)),
        "after": lambda: float(rng.choice([0.0, 0.3 * end, rng.integers(0, flight.steps + 1) * flight.step])),
        "before": lambda: rng.choice(
            [None, 0.7 * end + 0.01, rng.integers(1, flight.steps + 2) * flight.step]
        ),
        "at": lambda: rng.choice([None, 0.4 * end, rng.integers(0, flight.steps + 2) * flight.step]),
        "axis": lambda: str(rng.choice(["x", "y", "z"])),
        "level": lambda: float(rng.choice([1.0, 3.0, 6.0])),
        "within": lambda: float(rng.choice([4.0, 9.0])),
        "fraction": lambda: float(rng.choice([0.5, 0.9])),
        "nominal_rate": lambda: 0.7,
        "epoch": lambda: "2020-06-01T12:00:00Z",
        "chief_longitude": lambda: 0.4,
        "quantity": lambda: str(rng.choice(quantities(kind))),
        "statistic": lambda: str(rng.choice(statistics(kind))),
        "limit": lambda: str(rng.choice(["torque", "momentum"])),
    }
    data = {name: fields[name]() for name in spec.model_fields if name in fields}
    if kind == "response_time":
        data["event"] = str(rng.choice(["crossing", "peak", "settled"]))
        data["band"] = 0.5 if data["event"] == "settled" else None
    return spec.model_validate({"kind": kind, "below": 0.0, "source": "none", **data})


def satellites(kind: str, rng: np.random.Generator, names: tuple[str, ...]) -> tuple[str, ...] | None:
    if kind == "distance" or kind.startswith("pass"):
        return tuple(rng.permutation(names)[:2].tolist())
    if rng.random() < 0.4:
        return None
    return tuple(rng.permutation(names)[: int(rng.integers(1, len(names) + 1))].tolist())


def quantities(kind: str) -> list[str]:
    return ["pointing_error", "panel_to_sun"] if kind == "attitude_settling" else ["x", "y", "z", "range"]


def statistics(kind: str) -> list[str]:
    return {
        "control": ["mean", "minimum", "maximum"],
        "navigation_error": ["maximum", "rms"],
        "estimation_error": ["maximum", "rms"],
    }.get(kind, ["minimum", "maximum"])


def blocks(flown: list[Flight], cuts: list[int], needs: frozenset[str]) -> Iterator[FlightBlock]:
    """Flights side by side, cut before some steps, with only what is needed."""
    steps = flown[0].steps
    for begin, end in zip([0, *cuts], [*cuts, steps], strict=True):
        last = end == steps
        held = {
            name: np.stack(
                [own.arrays[name][begin : end + (last and name in STATES)] for own in flown], axis=1
            )
            for name in needs
        }
        yield FlightBlock(flown[0].names, flown[0].step, begin, end - begin, len(flown), last, held)


def shape(flight: Flight) -> FlightShape:
    return FlightShape(flight.names, flight.step, flight.steps)


def reduced(reducer: Reducer | None, flown: list[Flight], cuts: list[int]) -> np.ndarray:
    assert reducer is not None
    for block in blocks(flown, cuts, reducer.needs):
        reducer.update(block)
    return reducer.figures()


def bits(figures: Any) -> list[int]:
    """The bits of numbers, those of what is not a number all alike."""
    values = np.atleast_1d(np.asarray(figures, dtype=np.float64))
    return np.where(np.isnan(values), np.nan, values).view(np.int64).tolist()


@pytest.mark.parametrize("kind", KINDS)
def test_a_figure_is_that_of_its_formula_for_any_blocks_and_any_runs_beside(kind: str) -> None:
    known = 0
    for seed in SEEDS:
        rng = np.random.default_rng([seed, *kind.encode()])
        flown = flights(rng, runs=3)
        steps = flown[0].steps
        expectation = expectation_of(kind, rng, flown[0])
        expected = [FORMULAS[kind](expectation, flight) for flight in flown]
        measured = [expectation.measure(flight.record) for flight in flown]
        # A zero has no sign here.
        assert bits(np.array(measured) + 0.0) == bits(np.array(expected) + 0.0), f"seed {seed}"
        known += sum(not math.isnan(figure) for figure in measured)
        some = sorted(set(rng.integers(1, steps, 4).tolist())) if steps > 1 else []
        for cuts in (some, list(range(1, steps))):
            found = reduced(expectation.reducer(shape(flown[0])), flown, cuts)
            assert bits(found) == bits(measured), f"seed {seed}, blocks from {cuts}"
        alone = [reduced(expectation.reducer(shape(flight)), [flight], some) for flight in flown]
        assert bits(np.concatenate(alone)) == bits(measured), f"seed {seed}, alone"
    # Where no figure was known there would be nothing to compare.
    assert known >= 5


def test_every_kind_has_a_formula_and_a_reducer() -> None:
    assert sorted(FORMULAS) == KINDS


def held_bytes(thing: Any, seen: set[int]) -> int:
    """Bytes of all arrays that an object refers to, and of the arrays that these are views of."""
    if id(thing) in seen:
        return 0
    seen.add(id(thing))
    if isinstance(thing, np.ndarray):
        return thing.nbytes if thing.base is None else held_bytes(thing.base, seen)
    if isinstance(thing, dict):
        return sum(held_bytes(own, seen) for own in thing.values())
    cells = [cell.cell_contents for cell in getattr(thing, "__closure__", None) or ()]
    return sum(held_bytes(own, seen) for own in (*cells, *getattr(thing, "__dict__", {}).values()))


@pytest.mark.parametrize("kind", KINDS)
def test_the_memory_of_a_figure_does_not_grow_with_the_flight_nor_with_its_blocks(kind: str) -> None:
    rng = np.random.default_rng([1, *kind.encode()])
    expectation = expectation_of(kind, rng, one_flight(rng, 10, ("a", "b"), 1.0, turning=True))
    held = []
    for steps, size in ((20, 10), (2000, 10), (2000, 500)):
        flight = one_flight(np.random.default_rng(7), steps, ("a", "b"), 1.0, turning=True)
        reducer = expectation.reducer(shape(flight))
        reduced(reducer, [flight], list(range(size, steps, size)))
        held.append(held_bytes(reducer, set()))
    assert max(held) <= held[0] + 64


def test_several_expectations_are_figured_together() -> None:
    rng = np.random.default_rng(5)
    flown = flights(rng, runs=4)
    expectations = [expectation_of(kind, rng, flown[0]) for kind in KINDS]
    figures = FlightFigures(expectations, shape(flown[0]))
    for block in blocks(flown, list(range(1, flown[0].steps)), figures.needs):
        figures.update(block)
    expected = [[own.measure(flight.record) for flight in flown] for own in expectations]
    assert bits(figures.figures().ravel()) == bits(np.ravel(expected))
    assert (figures.whole_records, figures.of_loops) == ((), ())


@pytest.mark.parametrize("width", [1, 3, 63, 64, 200])
def test_rows_are_added_in_order_however_many_numbers_they_have(width: int) -> None:
    values = np.random.default_rng(width).standard_normal((40, width)) * 10.0 ** np.arange(-20, 20)[:, None]
    expected = [total(column) for column in values.T.tolist()]
    assert added_in_order(np.zeros(()), values).tolist() == expected
    assert added_in_order(added_in_order(np.zeros(()), values[:7]), values[7:]).tolist() == expected


class MeanSpeed(OverWindow):
    """A metric of one's own that measures whole records."""

    kind: str = "mean_speed"

    def measure(self, record: FlightRecord) -> float:
        return float(np.mean(np.linalg.norm(self.window(record.velocity, record), axis=-1)))


class TrackingSquared(TrackingError):  # noqa: N818 - the figure is called an error
    """A metric of one's own that changes what a kind of the project measures."""

    def measure(self, record: FlightRecord) -> float:
        return super().measure(record) ** 2


class FromReducer(TrackingSquared):
    """One that has a reducer again."""

    def reducer(self, flight: FlightShape) -> Reducer:
        return ExtremeOf(self.stretch(flight, flight.steps), "control")


def test_a_metric_that_measures_whole_records_has_no_reducer_and_the_figures_say_so() -> None:
    flown = flights(np.random.default_rng(1), runs=2)
    expectations = [MeanSpeed(below=9.0, source="none"), TrackingSquared(below=9.0, source="none")]
    assert [own.reducer_in_flight(shape(flown[0])) for own in expectations] == [None, None]
    assert expectations[0].reducer(shape(flown[0])) is None
    assert all(math.isfinite(own.measure(flown[0].record)) for own in expectations)
    figures = FlightFigures([*expectations, FromReducer(below=9.0, source="none"), RADIUS], shape(flown[0]))
    assert (figures.whole_records, figures.of_loops) == ((0, 1), (3,))
    for block in blocks(flown, [], figures.needs):
        figures.update(block)
    found = figures.figures()
    assert np.isnan(found[[0, 1, 3]]).all()
    assert found[2].tolist() == [float(length(flight.arrays["acceleration"]).max()) for flight in flown]


def test_a_kind_without_a_figure_is_named() -> None:
    flight = flights(np.random.default_rng(1), runs=1)[0]
    with pytest.raises(NotImplementedError, match="OverWindow defines neither reducer nor measure"):
        OverWindow(below=0.0, source="none").measure(flight.record)


def test_the_figure_of_loops_needs_no_flight() -> None:
    loops = [SampledLoop("tracking", ("a",), 0.5, "law"), SampledLoop("tracking", ("b",), 0.9, "law")]
    assert RADIUS.figure_of_loops(("a", "b"), lambda: loops) == 0.9
    assert math.isnan(TrackingError(below=1.0, source="none").figure_of_loops(("a", "b"), lambda: loops))


@pytest.mark.parametrize("seed", range(10))
def test_rows_for_a_metric_of_one_s_own_are_those_of_the_figures(seed: int) -> None:
    rng = np.random.default_rng(seed)
    flight = flights(rng, runs=1)[0]
    record = flight.record
    window = expectation_of("tracking_error", rng, flight)
    assert isinstance(window, OverWindow)
    assert same(greatest(window.window(record.tracking_error, record)), window.measure(record))
    pointing = expectation_of("pointing_error", rng, flight)
    assert isinstance(pointing, OverWindow)
    if len(record.pointing_error):
        rows = pointing.window(record.pointing_error, record, of_others=True)
        assert same(greatest(rows), pointing.measure(record))
    pair = expectation_of("distance", rng, flight)
    assert isinstance(pair, Distance)
    apart = pair.window(record.position, record, of_bodies=True)
    expected = {"minimum": least, "maximum": greatest}[pair.statistic](length(apart[:, 0] - apart[:, 1]))
    assert same(expected, pair.measure(record))
    moment = expectation_of("tracking_error_at", rng, flight)
    assert isinstance(moment, TrackingErrorAt)
    row = moment.sample(record.tracking_error, record, moment.columns(record))
    assert same(greatest(row), moment.measure(record))


def same(one: float, other: float) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other))
