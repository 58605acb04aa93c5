# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a run is judged by: figures of tracking, control and agreement from a flight record."""

import math
from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from satform.common.spec import Number, Positive
from satform.control.coast import CoastSpec
from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.scenario.expectation import (
    AtTime,
    Event,
    Expectation,
    OfSatellites,
    OverWindow,
    by_satellite,
    largest,
)
from satform.scenario.parts import SatelliteSpec, Timing

__all__ = [
    "ArcLengthMean",
    "ArcLengthRate",
    "ArcLengthSettling",
    "ArcLengthSpread",
    "AtTime",
    "Control",
    "DeltaV",
    "Distance",
    "Event",
    "Expectation",
    "OfSatellites",
    "OverWindow",
    "ReachingTime",
    "SettlingTime",
    "SlidingVariable",
    "TrackingError",
    "TrackingErrorAt",
    "arc_length_spread",
    "by_satellite",
    "largest",
    "largest_of_each",
    "settled",
]


class LargestOfSteps(OverWindow):
    """The largest of something that is decided in every step: its upper bound holds over every part."""

    of_steps = True

    def holds_in_part(self) -> bool:
        return self.smallest_allowed <= 0.0


class TrackingError(LargestOfSteps):
    """Largest distance between a satellite and its reference, in m."""

    unit = "m"
    kind: Literal["tracking_error"] = "tracking_error"

    def measure(self, record: FlightRecord) -> float:
        return largest(self.window(record.tracking_error, record))

    def describe(self) -> str:
        return self.label or f"largest tracking error{self.when()}{self.whose()}"


class TrackingErrorAt(AtTime, OfSatellites):
    """Largest distance between a satellite and its reference at one moment, in m."""

    unit = "m"
    of_steps = True
    known_before_flight = True
    kind: Literal["tracking_error_at"] = "tracking_error_at"

    def measure(self, record: FlightRecord) -> float:
        return largest(self.sample(record.tracking_error, record, self.columns(record)))

    def describe(self) -> str:
        return self.label or f"tracking error{self.moment()}{self.whose()}"


class SlidingVariable(LargestOfSteps):
    """Largest component of the sliding variable, in m/s."""

    unit = "m/s"
    kind: Literal["sliding_variable"] = "sliding_variable"

    def measure(self, record: FlightRecord) -> float:
        return largest(np.abs(self.window(record.sliding_variable, record)))

    def describe(self) -> str:
        return self.label or f"largest sliding variable{self.when()}{self.whose()}"


class ReachingTime(Event):
    """Time at which a component of the sliding variable first comes within a level, in s."""

    unit = "s"
    kind: Literal["reaching_time"] = "reaching_time"
    axis: Literal["x", "y", "z"]
    """Component of the sliding variable."""
    level: Positive
    """Magnitude that counts as reached, m/s."""

    def measure(self, record: FlightRecord) -> float:
        columns = self.columns(record)
        surface = np.abs(record.sliding_variable[:, columns, "xyz".index(self.axis)])
        excused = record.excluded(record.sliding_variable)[:, columns]
        reached = np.all((surface <= self.level) | excused, axis=1) & ~excused.all(axis=1)
        return float(np.argmax(reached)) * record.step if reached.any() else math.nan

    def describe(self) -> str:
        return self.label or f"reaching time, {self.axis}{self.whose()}"


class Control(OverWindow):
    """Mean, smallest or largest magnitude of the commanded acceleration, in m/s^2."""

    unit = "m/s²"
    kind: Literal["control"] = "control"
    statistic: Literal["mean", "minimum", "maximum"] = "mean"
    """Mean over the stretch, or its smallest or largest value."""

    def complaints_about_satellites(
        self, satellites: Mapping[str, SatelliteSpec], announces: str
    ) -> list[str]:
        idle = coasting(self, satellites)
        return super().complaints_about_satellites(satellites, announces) + idle

    def holds_in_part(self) -> bool:
        if self.statistic == "mean":
            return False
        return (
            self.smallest_allowed <= 0.0 if self.statistic == "maximum" else math.isinf(self.largest_allowed)
        )

    def measure(self, record: FlightRecord) -> float:
        # Who does not fly commands nothing, which is not the same as a command of zero.
        commanded = np.where(record.absent, np.nan, record.control)
        chosen = self.window(commanded, record, held=True)
        if self.statistic == "minimum":
            return -largest(-chosen)
        if self.statistic == "mean":
            known = chosen[~np.isnan(chosen)]
            return float(np.mean(known)) if known.size else math.nan
        return largest(chosen)

    def describe(self) -> str:
        return self.label or f"{self.statistic} control{self.when()}{self.whose()}"


class DeltaV(OverWindow):
    """Delta-v as the thrusters count it, or integral of an ideal command; the largest, in m/s."""

    unit = "m/s"
    kind: Literal["delta_v"] = "delta_v"

    def complaints_about_satellites(
        self, satellites: Mapping[str, SatelliteSpec], announces: str
    ) -> list[str]:
        idle = coasting(self, satellites)
        return super().complaints_about_satellites(satellites, announces) + idle

    def holds_in_part(self) -> bool:
        # A part of a flight costs less: it is judged where nothing at all may be spent.
        return self.largest_allowed <= 0.0

    def measure(self, record: FlightRecord) -> float:
        chosen = self.window(record.effort, record, held=True)
        return largest(np.sum(chosen, axis=0)) if chosen.size else math.nan

    def describe(self) -> str:
        return self.label or f"delta-v{self.when()}{self.whose()}"


class SettlingTime(Event):
    """Time after which the tracking error never exceeds a level again, in s."""

    unit = "s"
    kind: Literal["settling_time"] = "settling_time"
    level: Positive
    """Tracking error that counts as settled, m."""

    def measure(self, record: FlightRecord) -> float:
        columns, error = self.columns(record), record.tracking_error
        furthest = largest_of_each(error[:, columns], record.excluded(error)[:, columns])
        return settled(furthest, self.level, record.step)

    def describe(self) -> str:
        return self.label or f"tracking error settles to {self.level:g} m{self.whose()}"


class ArcLengthSpread(AtTime, OfSatellites):
    """Largest minus smallest generalised arc length of the satellites that fly, in m."""

    unit = "m"
    of_phases = True
    known_before_flight = True
    kind: Literal["arc_length_spread"] = "arc_length_spread"

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        meant = satellites if self.satellites is None else set(self.satellites)
        own = [] if len(meant) > 1 else [f"a spread is of two satellites or more; found {', '.join(meant)}"]
        return super().complaints(satellites, timing) + own

    def measure(self, record: FlightRecord) -> float:
        columns = self.columns(record)
        absent = record.absent_rows(record.steps + 1).astype(np.float64)
        if self.lacks_one(self.sample(absent, record, columns) > 0.0):
            return math.nan
        return largest(self.sample(arc_length_spread(record, columns), record))

    def describe(self) -> str:
        return self.label or f"arc-length spread{self.moment()}{self.whose()}"


class ArcLengthSettling(Event):
    """Time after which the spread of arc lengths stays within a fraction of its first value, in s."""

    unit = "s"
    of_phases = True
    kind: Literal["arc_length_settling"] = "arc_length_settling"
    fraction: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.01
    """Fraction of the spread at the start."""

    def measure(self, record: FlightRecord) -> float:
        spread = arc_length_spread(record)
        return settled(spread, self.fraction * float(spread[0]), record.step)

    def describe(self) -> str:
        return self.label or f"arc-length spread settles to {100 * self.fraction:g} %"


class ArcLengthMean(AtTime):
    """Mean generalised arc length less the nominal rate times the time, in m."""

    unit = "m"
    of_phases = True
    known_before_flight = True
    kind: Literal["arc_length_mean"] = "arc_length_mean"
    nominal_rate: Number
    """Rate that is taken off, m/s."""

    def measure(self, record: FlightRecord) -> float:
        arc_length, time = self.sample(record.arc_length, record), self.sample(record.time, record)
        flying = arc_length[~np.isnan(arc_length)]
        return float(np.mean(flying) - self.nominal_rate * time[0]) if flying.size else math.nan

    def describe(self) -> str:
        return self.label or f"mean arc length in the nominal motion{self.moment()}"


class ArcLengthRate(AtTime, OfSatellites):
    """Departure of the rate furthest from a nominal one, in m/s."""

    unit = "m/s"
    of_phases = True
    known_before_flight = True
    kind: Literal["arc_length_rate"] = "arc_length_rate"
    nominal_rate: Number
    """Rate that is taken off, m/s."""

    def measure(self, record: FlightRecord) -> float:
        rate = self.sample(record.rate, record, self.columns(record))
        return largest(np.abs(rate - self.nominal_rate))

    def describe(self) -> str:
        return self.label or f"arc-length rate off nominal{self.moment()}{self.whose()}"


class Distance(OverWindow):
    """Smallest or largest distance between two satellites, in m."""

    unit = "m"
    kind: Literal["distance"] = "distance"
    satellites: Annotated[tuple[str, ...], Field(min_length=2, max_length=2)]
    """The two satellites."""
    statistic: Literal["minimum", "maximum"]
    """Which distance of the stretch is meant."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        first, second = self.satellites
        same = f"a distance is between two different satellites; found {first} twice"
        return super().complaints(satellites, timing) + ([same] if first == second else [])

    def holds_in_part(self) -> bool:
        if self.statistic == "maximum":
            return self.smallest_allowed <= 0.0
        return math.isinf(self.largest_allowed)

    def measure(self, record: FlightRecord) -> float:
        pair = self.window(record.position, record, of_bodies=True)
        if not pair.size:
            return math.nan
        apart = np.linalg.norm(pair[:, 0] - pair[:, 1], axis=-1)
        return float(np.min(apart) if self.statistic == "minimum" else np.max(apart))

    def describe(self) -> str:
        return self.label or f"{self.statistic} distance{self.when()}{self.whose()}"


def coasting(expectation: OfSatellites, satellites: Mapping[str, SatelliteSpec]) -> list[str]:
    """That nothing is judged where all satellites that are meant coast: they command nothing."""
    meant = [satellites[name] for name in expectation.satellites or satellites]
    idle = all(isinstance(own.controller, CoastSpec) and own.thruster is None for own in meant)
    names = ", ".join(own.name for own in meant)
    return [f"{names} coast{'s' if len(meant) == 1 else ''} and cannot command anything else"] if idle else []


def arc_length_spread(record: FlightRecord, columns: list[int] | None = None) -> Array:
    """Largest minus smallest generalised arc length of those that fly, at every state.

    Args:
        record: of the flight.
        columns: of the satellites that are meant; all when left out.

    Returns:
        m, shape (K + 1,); not a number where fewer than two fly, whose spread is none.
    """
    chosen = list(range(len(record.satellites))) if columns is None else columns
    published, excused = record.arc_length[:, chosen], record.excluded(record.arc_length)[:, chosen]
    spread: Array = largest_of_each(published, excused) + largest_of_each(-published, excused)
    return np.where((~excused).sum(axis=1) > 1, spread, np.nan)


def largest_of_each(values: Array, excused: NDArray[np.bool_]) -> Array:
    """The largest value of each row, leaving out what is excused; shapes (K, N), gives (K,)."""
    row = np.max(np.where(excused, -np.inf, values), axis=1, initial=-np.inf)
    return np.where(excused.all(axis=1), np.nan, row)


def settled(series: Array, level: float, step: float) -> float:
    """Time from which a series stays at or below a level; NaN when it does not end there or is empty.

    What is not a number is not below anything.
    """
    outside = np.flatnonzero(~(series <= level))
    first = int(outside[-1]) + 1 if outside.size else 0
    return math.nan if first >= len(series) else first * step
