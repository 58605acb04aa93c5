# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of the loops that are closed once a step: properties of a scenario, not of its flight."""

import math
from typing import Literal

from satform.record.flight_record import FlightRecord
from satform.scenario.expectation import Loops
from satform.scenario.windowed_expectation import OfSatellites


class SpectralRadius(OfSatellites):
    """Largest factor by which a loop that is closed once a step multiplies small errors in a step.

    Below 1 the loop decays. Loops that are not analysed are left out; `show` lists them all.
    """

    of_loops = True
    kind: Literal["spectral_radius"] = "spectral_radius"
    loop: Literal["tracking", "consensus", "attitude", "estimation"] | None = None
    """Which loops are meant; all when left out."""

    def measure(self, record: FlightRecord) -> float:
        return math.nan

    def figure(self, record: FlightRecord, loops: Loops | None) -> float:
        return math.nan if loops is None else self.figure_of_loops(record.satellites, loops)

    def figure_of_loops(self, satellites: tuple[str, ...], loops: Loops) -> float:
        chosen = set(self.satellites or satellites)
        found = [
            loop.radius
            for loop in loops()
            if loop.radius is not None and self.loop in (None, loop.kind) and chosen & set(loop.satellites)
        ]
        return max(found, default=math.nan)

    def needs(self, duration: float, step: float) -> float:
        return step

    def ends(self, duration: float) -> float:
        return 0.0

    def describe(self) -> str:
        what = "all loops" if self.loop is None else f"the {self.loop} loop"
        return self.label or f"spectral radius of {what} a step{self.whose()}"
