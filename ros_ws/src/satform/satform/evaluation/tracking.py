# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of tracking: tracking error, sliding variable, settling time, distance between two.

Control and delta-v are in `control_effort`, the control law of attitude tracking in
`satform.attitude.mrp_tracking`.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.common.spec import Positive
from satform.evaluation.event_reducers import EventTime, FirstInside, SettlingOf, not_all_within
from satform.evaluation.reducers import ExtremeOf, MeanOf
from satform.numeric.elementwise import Array, norm
from satform.record.reducer import FlightShape, Reducer
from satform.record.stretch import Part, Stretch
from satform.scenario.parts import Timing
from satform.scenario.windowed_expectation import AtTime, Event, OfSatellites, OverWindow


class LargestOfSteps(OverWindow):
    """The largest of something that is decided in every step: its upper bound holds over every part."""

    of_steps = True

    def holds_in_part(self) -> bool:
        return self.extreme_holds_in_part("maximum")


class TrackingError(LargestOfSteps):
    """Largest distance between a satellite and its reference, in m."""

    unit = "m"
    figure_name = "largest tracking error"
    kind: Literal["tracking_error"] = "tracking_error"

    def reducer(self, flight: FlightShape) -> Reducer:
        return ExtremeOf(self.stretch(flight, flight.steps), "tracking_error")


class TrackingErrorRms(OverWindow):
    """Root of the mean square of the distance between satellites and their references, in m."""

    unit = "m"
    of_steps = True
    figure_name = "rms tracking error"
    kind: Literal["tracking_error_rms"] = "tracking_error_rms"

    def reducer(self, flight: FlightShape) -> Reducer:
        return MeanOf(self.stretch(flight, flight.steps), "tracking_error", root_of_squares=True)


class TrackingErrorAt(AtTime, OfSatellites):
    """Largest distance between a satellite and its reference at one moment, in m."""

    unit = "m"
    of_steps = True
    known_before_flight = True
    figure_name = "tracking error"
    kind: Literal["tracking_error_at"] = "tracking_error_at"

    def reducer(self, flight: FlightShape) -> Reducer:
        return ExtremeOf(self.instant(flight, flight.steps, self.satellites), "tracking_error")


class SlidingVariable(LargestOfSteps):
    """Largest component of the sliding variable, in m/s."""

    unit = "m/s"
    figure_name = "largest sliding variable"
    kind: Literal["sliding_variable"] = "sliding_variable"

    def reducer(self, flight: FlightShape) -> Reducer:
        return ExtremeOf(self.stretch(flight, flight.steps), "sliding_variable", transform=np.abs)


class ReachingTime(Event):
    """Time at which a component of the sliding variable first comes within a level, in s."""

    unit = "s"
    figure_name = "reaching time, {0.axis}"
    kind: Literal["reaching_time"] = "reaching_time"
    axis: Literal["x", "y", "z"]
    """Component of the sliding variable."""
    level: Positive
    """Magnitude that counts as reached, m/s."""

    def reducer(self, flight: FlightShape) -> Reducer:
        return _Reaching(self.whole(flight, flight.steps), self.level, flight.step, "xyz".index(self.axis))


class SettlingTime(Event):
    """Time after which the tracking error never exceeds a level again, in s."""

    unit = "s"
    figure_name = "tracking error settles to {0.level:g} m"
    kind: Literal["settling_time"] = "settling_time"
    level: Positive
    """Tracking error that counts as settled, m."""

    def reducer(self, flight: FlightShape) -> Reducer:
        return SettlingOf(self.whole(flight, flight.steps), "tracking_error", self.level, flight.step)


class Distance(OverWindow):
    """Smallest or largest distance between two satellites, in m."""

    unit = "m"
    figure_name = "{0.statistic} distance"
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
        return self.extreme_holds_in_part(self.statistic)

    def reducer(self, flight: FlightShape) -> Reducer:
        return ExtremeOf(
            self.stretch(flight, flight.states, of_bodies=True),
            "position",
            which=self.statistic,
            transform=lambda pair: norm(pair[:, :, 0] - pair[:, :, 1]),
        )


class _Reaching(EventTime):
    """Time at which a component of the sliding variable first comes within a level."""

    def __init__(self, stretch: Stretch, level: float, step: float, axis: int) -> None:
        super().__init__(stretch, "sliding_variable", level, step)
        self._axis = axis
        self._inside = FirstInside()

    def take(self, part: Part) -> None:
        if not self._inside.all_known:
            values = np.abs(part.values[..., self._axis])
            self._inside.add(~not_all_within(values, part.excused, self._level))

    def _rows(self) -> Array:
        return self._inside.first()
