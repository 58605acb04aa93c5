# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of agreement: spread, mean and rate of the generalised arc lengths."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.common.spec import Number
from satform.evaluation.event_reducers import LastOutside
from satform.evaluation.reducers import ExtremeOf, OverStretch, highest_of, quantity
from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock, base_quantities
from satform.record.flight_record import FlightRecord
from satform.record.reducer import FlightShape, Reducer
from satform.record.stretch import Mask, Part, Stretch, StretchReader
from satform.scenario.parts import Timing
from satform.scenario.windowed_expectation import AtTime, Event, OfSatellites


class ArcLengthSpread(AtTime, OfSatellites):
    """Largest minus smallest generalised arc length of the satellites that fly, in m."""

    unit = "m"
    of_phases = True
    known_before_flight = True
    figure_name = "arc-length spread"
    kind: Literal["arc_length_spread"] = "arc_length_spread"

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        meant = satellites if self.satellites is None else set(self.satellites)
        own = [] if len(meant) > 1 else [f"a spread is of two satellites or more; found {', '.join(meant)}"]
        return super().complaints(satellites, timing) + own

    def reducer(self, flight: FlightShape) -> Reducer:
        return _SpreadAt(self.instant(flight, flight.states, self.satellites))


class ArcLengthSettling(Event):
    """Time after which the spread of arc lengths stays within a fraction of its first value, in s."""

    unit = "s"
    of_phases = True
    kind: Literal["arc_length_settling"] = "arc_length_settling"
    fraction: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.01
    """Fraction of the spread at the start."""

    def reducer(self, flight: FlightShape) -> Reducer:
        everybody = Stretch(0, flight.states, flight.columns(None))
        return _SpreadSettling(everybody, self.fraction, flight.step)

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

    def reducer(self, flight: FlightShape) -> Reducer:
        instant = self.instant(flight, flight.states)
        return _MeanLess(instant, self.nominal_rate * (instant.first * flight.step))

    def describe(self) -> str:
        return self.label or f"mean arc length in the nominal motion{self.moment()}"


class ArcLengthRate(AtTime, OfSatellites):
    """Departure of the rate furthest from a nominal one, in m/s."""

    unit = "m/s"
    of_phases = True
    known_before_flight = True
    figure_name = "arc-length rate off nominal"
    kind: Literal["arc_length_rate"] = "arc_length_rate"
    nominal_rate: Number
    """Rate that is taken off, m/s."""

    def reducer(self, flight: FlightShape) -> Reducer:
        return ExtremeOf(
            self.instant(flight, flight.states, self.satellites),
            "rate",
            transform=lambda rate: np.abs(rate - self.nominal_rate),
        )


def arc_length_spread(record: FlightRecord) -> Array:
    """Largest minus smallest generalised arc length of those that fly, at every state.

    Args:
        record: of the flight.

    Returns:
        m, shape (K + 1,); not a number where fewer than two fly, whose spread is none.
    """
    flight = FlightShape.of(record)
    everybody = Stretch(0, flight.states, flight.columns(None))
    return SpreadReader(everybody).read(FlightBlock.of(record))[:, 0]


def spread_of(arc_length: Array, excused: Mask | None) -> Array:
    """Largest minus smallest of the last axis, leaving out what is excused.

    Args:
        arc_length: shape (..., columns).
        excused: of the same shape; None for nothing.

    Returns:
        Shape (...); not a number where fewer than two are left, or one is missing without an excuse.
    """
    if excused is None:
        spread = highest_of(arc_length) + highest_of(-arc_length)
        return spread if arc_length.shape[-1] > 1 else np.full_like(spread, np.nan)
    left_out = -np.inf
    spread = highest_of(np.where(excused, left_out, arc_length))
    spread += highest_of(np.where(excused, left_out, -arc_length))
    return np.where((~excused).sum(axis=-1) > 1, spread, np.nan)


class SpreadReader:
    """Takes the spread of arc lengths of all satellites from the blocks of a flight."""

    def __init__(self, stretch: Stretch) -> None:
        self._reader = StretchReader(stretch)

    def read(self, block: FlightBlock) -> Array:
        """The spread of each of the block's rows that lie in the stretch, m, shape (rows, R)."""
        part = self._reader.read(block, quantity("arc_length"))
        return np.empty((0, block.runs)) if part is None else spread_of(part.values, part.excused)


class _SpreadAt(OverStretch):
    """Spread of arc lengths at one moment."""

    def __init__(self, stretch: Stretch) -> None:
        super().__init__(stretch, "arc_length")
        self._spread: Array = np.empty(0)

    def take(self, part: Part) -> None:
        self._spread = spread_of(part.values, part.excused)[-1]

    def found(self) -> Array:
        return self._spread


class _MeanLess(OverStretch):
    """Mean of the arc lengths at one moment, less those of the nominal motion."""

    def __init__(self, stretch: Stretch, nominal: float) -> None:
        super().__init__(stretch, "arc_length")
        self._nominal = nominal
        self._row: Array = np.empty(0)

    def take(self, part: Part) -> None:
        self._row = part.values[-1].copy()

    def found(self) -> Array:
        flying = ~np.isnan(self._row)
        total = np.add.accumulate(np.where(flying, self._row, 0.0), axis=1)[:, -1]
        mean: Array = total / flying.sum(axis=1) - self._nominal
        return mean


class _SpreadSettling:
    """Time after which the spread of arc lengths stays within a fraction of its first value."""

    needs = base_quantities(("arc_length", "absent"))

    def __init__(self, stretch: Stretch, fraction: float, step: float) -> None:
        self._spread = SpreadReader(stretch)
        self._fraction, self._step = fraction, step
        self._level: Array = np.empty(0)
        self._outside = LastOutside()

    def update(self, block: FlightBlock) -> None:
        spread = self._spread.read(block)
        if not block.first_step:
            self._level = self._fraction * spread[0]
        self._outside.add(~(spread <= self._level))

    def figures(self) -> Array:
        return self._outside.settled() * self._step
