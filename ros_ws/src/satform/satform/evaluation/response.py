# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of the step response: overshoot, crossing, peak and settling time, offset, ripple, velocity error.

`response_time` with the event `settled` is the time to a band around the reference. Other settling times:
`settling_time` of the tracking error in `tracking`, `attitude_settling` in `attitude`, that of the arc-length
spread in `arc_lengths`.
"""

from typing import Annotated, Literal, Protocol, TypeAlias

import numpy as np
from pydantic import Field

from satform.evaluation.event_reducers import FirstInside, LastOutside
from satform.evaluation.reducers import ExtremeOf, HalfRangeOf, OffsetOf, quantity
from satform.evaluation.tracking import LargestOfSteps
from satform.numeric.elementwise import Array, norm
from satform.record.flight_block import FlightBlock, base_quantities
from satform.record.reducer import FlightShape, Reducer
from satform.record.stretch import Mask, Stretch, StretchReader, gaps
from satform.scenario.parts import Timing
from satform.scenario.windowed_expectation import Event, OfSatellites, OverWindow

Axis: TypeAlias = Literal["x", "y", "z"]
Quantity: TypeAlias = Literal["x", "y", "z", "range"]

_WORDS = {"x": "x", "y": "y", "z": "z", "range": "distance to the chief"}


class ProgressFigure(Protocol):
    """A figure of the part of the way that satellites have come, made as it is flown."""

    def add(self, progress: Array) -> None:
        """Take the next steps: parts of the way from start to reference, shape (rows, R, columns)."""

    def found(self) -> Array:
        """The figure of each run, shape (R,)."""


class _Response(OfSatellites):
    """An expectation of how far a satellite has come, its start being 0 and its reference 1."""

    quantity: Quantity
    """Coordinate in LVLH, or distance to the chief; its reference has to stay away from the start."""

    def progress(self, flight: FlightShape, figure: ProgressFigure) -> Reducer:
        """What makes a figure of the part of the way from the start to the reference."""
        return _Progress(self.whole(flight, flight.steps), self.quantity, figure)


class Overshoot(_Response):
    """How far a coordinate goes beyond its reference, in percent of the way from the start to it."""

    unit = "%"
    kind: Literal["overshoot"] = "overshoot"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.progress(flight, _FurthestBeyond())

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

    def reducer(self, flight: FlightShape) -> Reducer:
        figures: dict[str, ProgressFigure] = {
            "peak": _Peak(flight.step),
            "crossing": _Crossing(flight.step),
            "settled": _ComingNear(flight.step, self.band or 0.0),
        }
        return self.progress(flight, figures[self.event])

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
    figure_name = "mean error in {0.axis}"
    kind: Literal["offset"] = "offset"
    axis: Axis
    """Coordinate in LVLH."""

    def reducer(self, flight: FlightShape) -> Reducer:
        return OffsetOf(self.stretch(flight, flight.steps), "position_error", "xyz".index(self.axis))


class Ripple(OverWindow):
    """Half of what one coordinate of the position error goes up and down, in m."""

    unit = "m"
    of_steps = True
    figure_name = "ripple in {0.axis}"
    kind: Literal["ripple"] = "ripple"
    axis: Axis
    """Coordinate in LVLH."""

    def reducer(self, flight: FlightShape) -> Reducer:
        return HalfRangeOf(self.stretch(flight, flight.steps), "position_error", "xyz".index(self.axis))


class Range(OverWindow):
    """Smallest or largest distance between a satellite and the chief, in m."""

    unit = "m"
    figure_name = "{0.statistic} distance to the chief"
    kind: Literal["range"] = "range"
    statistic: Literal["minimum", "maximum"]
    """Which distance of the stretch is meant."""

    def holds_in_part(self) -> bool:
        return self.extreme_holds_in_part(self.statistic)

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.stretch(flight, flight.states, of_bodies=True)
        return ExtremeOf(stretch, "position", which=self.statistic, transform=norm)


class VelocityError(LargestOfSteps):
    """Largest difference between a satellite's velocity and its reference's, in m/s."""

    unit = "m/s"
    figure_name = "largest velocity error"
    kind: Literal["velocity_error"] = "velocity_error"

    def reducer(self, flight: FlightShape) -> Reducer:
        return ExtremeOf(
            self.stretch(flight, flight.steps),
            lambda block: norm(block.velocity_error),
            ("velocity_error",),
        )


class _Progress:
    """A figure of the part of the way that satellites have come, which is made of all steps."""

    needs = base_quantities(("position_error", "absent"))

    def __init__(self, stretch: Stretch, coordinate: Quantity, figure: ProgressFigure) -> None:
        self._references = StretchReader(stretch)
        self._coordinate, self._figure = coordinate, figure
        self._start: Array = np.zeros(0)
        self._gap: Mask = np.zeros(0, dtype=np.bool_)

    def update(self, block: FlightBlock) -> None:
        reference = self._references.read(block, quantity("reference_position"))
        if not block.first_step:
            self._gap = np.zeros(block.runs, dtype=np.bool_)
        if reference is None:
            return
        flown = self._values(self._references.of_columns(block.position[: block.steps]))
        if not block.first_step:
            self._start = flown[0].copy()
        way = self._values(reference.values) - self._start
        with np.errstate(divide="ignore", invalid="ignore"):
            part = (flown - self._start) / way
        # A reference that comes by the start makes no way there, and then no figure.
        progress = np.where(np.isinf(part), np.nan, part)
        self._gap |= gaps(progress, reference.excused)
        self._figure.add(progress)

    def figures(self) -> Array:
        if not self._references.rows:
            return np.full(len(self._gap), np.nan)
        return np.where(self._gap, np.nan, self._figure.found())

    def _values(self, vectors: Array) -> Array:
        if self._coordinate == "range":
            return norm(vectors)
        chosen: Array = vectors[..., "xyz".index(self._coordinate)]
        return chosen


class _FurthestBeyond:
    """How far the one that goes furthest goes beyond its reference, in percent."""

    def __init__(self) -> None:
        self._furthest: Array = np.full((), np.nan)

    def add(self, progress: Array) -> None:
        self._furthest = np.fmax(self._furthest, np.fmax.reduce(progress, axis=0))

    def found(self) -> Array:
        beyond: Array = 100.0 * (np.fmax.reduce(self._furthest, axis=1) - 1.0)
        return beyond


class _Crossing:
    """When the last one first reaches its reference."""

    def __init__(self, step: float) -> None:
        self._step = step
        self._inside = FirstInside()

    def add(self, progress: Array) -> None:
        self._inside.add(progress >= 1.0)

    def found(self) -> Array:
        return _latest(self._inside.first()) * self._step


class _ComingNear:
    """When the last one has come near its reference for good."""

    def __init__(self, step: float, band: float) -> None:
        self._step, self._band = step, band
        self._outside = LastOutside()

    def add(self, progress: Array) -> None:
        self._outside.add(~(np.abs(progress - 1.0) <= self._band))

    def found(self) -> Array:
        return _latest(self._outside.settled()) * self._step


class _Peak:
    """Time at which each series has its largest progress for the first time; the latest of all series."""

    def __init__(self, step: float) -> None:
        self._step, self._rows = step, 0
        self._furthest: Array = np.full((), np.nan)
        self._row: Array = np.full((), np.nan)

    def add(self, progress: Array) -> None:
        furthest = np.fmax.reduce(progress, axis=0)
        further = (furthest > self._furthest) | (np.isnan(self._furthest) & ~np.isnan(furthest))
        row = self._rows + np.argmax(progress == furthest, axis=0)
        self._row = np.where(further, row, self._row)
        self._furthest = np.fmax(self._furthest, furthest)
        self._rows += len(progress)

    def found(self) -> Array:
        return _latest(self._row) * self._step


def _latest(rows: Array) -> Array:
    latest: Array = np.max(rows, axis=1)
    return latest
