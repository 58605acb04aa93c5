# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of satellites that are lost and come back."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.common.spec import Positive
from satform.evaluation.arc_lengths import SpreadReader
from satform.evaluation.event_reducers import LastOutside
from satform.evaluation.reducers import LargestSum
from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock, base_quantities
from satform.record.reducer import FlightShape, Reducer
from satform.record.stretch import Stretch
from satform.scenario.expectation import Expectation
from satform.scenario.parts import Timing
from satform.scenario.windowed_expectation import OverWindow


class StepsAbsent(OverWindow):
    """Steps in which a satellite does not fly, the most of the satellites."""

    figure_name = "steps absent"
    kind: Literal["steps_absent"] = "steps_absent"

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.stretch(flight, flight.steps, held=True, of_bodies=True)
        return LargestSum(stretch, lambda block: block.absent.astype(np.float64), ("absent",))


class RejoinTime(Expectation):
    """Time from a satellite's last return until the spread of all arc lengths is small for good, in s."""

    unit = "s"
    kind: Literal["rejoin_time"] = "rejoin_time"
    satellite: Annotated[str, Field(min_length=1)]
    """Name of the satellite that comes back."""
    within: Positive
    """Spread of the generalised arc lengths that counts as being together, m."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = []
        if self.satellite not in satellites:
            own.append(f"there is no satellite {self.satellite}; there are {', '.join(sorted(satellites))}")
        return super().complaints(satellites, timing) + own

    def reducer(self, flight: FlightShape) -> Reducer:
        return _Rejoining(flight, self.satellite, self.within)

    def describe(self) -> str:
        return self.label or f"{self.satellite} is back among the others to {self.within:g} m"


class _Rejoining:
    """Time from a satellite's last return until the spread of all arc lengths is small for good."""

    needs = base_quantities(("arc_length", "absent"))

    def __init__(self, flight: FlightShape, satellite: str, within: float) -> None:
        self._column = flight.satellites.index(satellite)
        self._steps, self._step, self._within = flight.steps, flight.step, within
        self._spread = SpreadReader(Stretch(0, flight.steps, flight.columns(None)))
        self._outside, self._absent = LastOutside(), LastOutside()

    def update(self, block: FlightBlock) -> None:
        self._outside.add(~(self._spread.read(block) <= self._within))
        self._absent.add(block.absent[:, :, self._column])

    def figures(self) -> Array:
        # A satellite that was never lost, or is not back, does not join again.
        back = np.where(self._absent.last < 0, self._steps, self._absent.last + 1)
        return self._outside.settled(back) * self._step
