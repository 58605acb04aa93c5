# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of how a satellite comes to its reference and stays there: overshoot, times, offset, ripple."""

import math
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import Field

from satform.evaluation.tracking import LargestOfSteps, settled
from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.scenario.expectation import (
    Event,
    OfSatellites,
    OverWindow,
    by_satellite,
    largest,
    without_gaps,
)
from satform.scenario.parts import Timing

Axis: TypeAlias = Literal["x", "y", "z"]
Quantity: TypeAlias = Literal["x", "y", "z", "range"]

_WORDS = {"x": "x", "y": "y", "z": "z", "range": "distance to the chief"}


class _Response(OfSatellites):
    """An expectation of how far a satellite has come, its start being 0 and its reference 1."""

    quantity: Quantity
    """Coordinate in LVLH, or distance to the chief; its reference has to stay away from the start."""

    def progress(self, record: FlightRecord) -> Array:
        """Part of the way from the start to the reference of each step, shape (K, satellites)."""
        columns = self.columns(record)
        flown = self._values(record.position[:-1, columns])
        wanted = self._values(record.reference_position[:, columns])
        start = flown[:1]
        excused = record.excluded(record.reference_position)[:, columns]
        with np.errstate(divide="ignore", invalid="ignore"):
            # A reference that comes by the start makes no way there, and then no figure.
            part: Array = (flown - start) / (wanted - start)
        return without_gaps(np.where(np.isinf(part), np.nan, part), excused)

    def _values(self, vectors: Array) -> Array:
        if self.quantity == "range":
            length: Array = np.linalg.norm(vectors, axis=-1)
            return length
        chosen: Array = vectors[..., "xyz".index(self.quantity)]
        return chosen


class Overshoot(_Response):
    """How far a coordinate goes beyond its reference, in percent of the way from the start to it."""

    unit = "%"
    kind: Literal["overshoot"] = "overshoot"

    def measure(self, record: FlightRecord) -> float:
        return 100.0 * (largest(self.progress(record)) - 1.0)

    def describe(self) -> str:
        return self.label or f"overshoot of {_WORDS[self.quantity]}{self.whose()}"


class ResponseTime(_Response, Event):
    """Time at which a coordinate first crosses its reference, peaks, or stays near it for good, in s."""

    unit = "s"
    kind: Literal["response_time"] = "response_time"
    event: Literal["crossing", "peak", "settled"]
    """First reaches the reference; is furthest on; has come within `band` for good."""
    band: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """What counts as settled, as a fraction of the way from the start to the reference."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = []
        if (self.event == "settled") != (self.band is not None):
            own.append("a response_time of event settled needs a band, and no other event has one")
        return super().complaints(satellites, timing) + own

    def measure(self, record: FlightRecord) -> float:
        progress = self.progress(record)
        if not progress.size:
            return math.nan
        return float(np.max([self._moment(column) for column in progress.T])) * record.step

    def _moment(self, progress: Array) -> float:
        if self.event == "peak":
            return math.nan if np.isnan(progress).all() else float(np.nanargmax(progress))
        if self.event == "crossing":
            reached = progress >= 1.0
            return float(np.argmax(reached)) if reached.any() else math.nan
        return settled(np.abs(progress - 1.0), self.band or 0.0, 1.0)

    def describe(self) -> str:
        words = {
            "crossing": "first reaches its reference",
            "peak": "peaks",
            "settled": f"settles to {100.0 * (self.band or 0.0):g} %",
        }
        return self.label or f"{_WORDS[self.quantity]} {words[self.event]}{self.whose()}"


class Offset(OverWindow):
    """Mean of one coordinate of the position error, in m; the one furthest from zero."""

    unit = "m"
    of_steps = True
    kind: Literal["offset"] = "offset"
    axis: Axis
    """Coordinate in LVLH."""

    def measure(self, record: FlightRecord) -> float:
        chosen = self.window(record.position_error, record)
        if not chosen.size:
            return math.nan
        means = [float(np.mean(own)) for own in by_satellite(chosen[..., "xyz".index(self.axis)])]
        return max(means, key=abs, default=math.nan)

    def describe(self) -> str:
        return self.label or f"mean error in {self.axis}{self.when()}{self.whose()}"


class Ripple(OverWindow):
    """Half of what one coordinate of the position error goes up and down, in m."""

    unit = "m"
    of_steps = True
    kind: Literal["ripple"] = "ripple"
    axis: Axis
    """Coordinate in LVLH."""

    def measure(self, record: FlightRecord) -> float:
        chosen = self.window(record.position_error, record)[..., "xyz".index(self.axis)]
        swings = [float(np.ptp(own)) for own in by_satellite(chosen) if own.size > 1]
        return 0.5 * max(swings, default=math.nan)

    def describe(self) -> str:
        return self.label or f"ripple in {self.axis}{self.when()}{self.whose()}"


class Range(OverWindow):
    """Smallest or largest distance between a satellite and the chief, in m."""

    unit = "m"
    kind: Literal["range"] = "range"
    statistic: Literal["minimum", "maximum"]
    """Which distance of the stretch is meant."""

    def holds_in_part(self) -> bool:
        if self.statistic == "maximum":
            return self.smallest_allowed <= 0.0
        return math.isinf(self.largest_allowed)

    def measure(self, record: FlightRecord) -> float:
        away = np.linalg.norm(self.window(record.position, record, of_bodies=True), axis=-1)
        if not away.size:
            return math.nan
        return float(np.min(away) if self.statistic == "minimum" else np.max(away))

    def describe(self) -> str:
        return self.label or f"{self.statistic} distance to the chief{self.when()}{self.whose()}"


class VelocityError(LargestOfSteps):
    """Largest difference between a satellite's velocity and its reference's, in m/s."""

    unit = "m/s"
    kind: Literal["velocity_error"] = "velocity_error"

    def measure(self, record: FlightRecord) -> float:
        off = np.linalg.norm(record.velocity[:-1] - record.reference_velocity, axis=-1)
        return largest(self.window(off, record))

    def describe(self) -> str:
        return self.label or f"largest velocity error{self.when()}{self.whose()}"
