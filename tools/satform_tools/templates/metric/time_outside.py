# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A figure of a flight: how long a satellite is further from its reference than a level."""

from typing import Literal

import numpy as np

from satform.common.spec import Positive
from satform.evaluation.reducers import OverStretch
from satform.numeric.elementwise import Array
from satform.record.reducer import FlightShape, Reducer
from satform.record.stretch import Part, Stretch
from satform.scenario.windowed_expectation import OverWindow


class TimeOutside(OverWindow):
    unit = "s"
    of_steps = True
    kind: Literal["time_outside"] = "time_outside"
    level: Positive
    """Tracking error from which on a satellite counts as outside, m."""

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.stretch(flight, flight.steps)
        return StepsAbove(stretch, "tracking_error", self.level, flight.step)

    def describe(self) -> str:
        return self.label or f"longest time outside {self.level:g} m{self.when()}{self.whose()}"


class StepsAbove(OverStretch):
    """The time in which a series is above a level, of the satellite for which it is longest."""

    def __init__(self, stretch: Stretch, series: str, level: float, step: float) -> None:
        super().__init__(stretch, series)
        self.level, self.step = level, step
        self.counts = np.zeros((), dtype=np.int64)

    def take(self, part: Part) -> None:
        self.counts = self.counts + np.count_nonzero(part.values > self.level, axis=0)

    def found(self) -> Array:
        longest: Array = self.step * self.counts.max(axis=1)
        return longest
