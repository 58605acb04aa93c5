"""Figures of the loops that are closed once a step: properties of a scenario, not of its flight."""

import math
from typing import TYPE_CHECKING, Literal

from satform.evaluation.expectation import OfSatellites
from satform.flight.record import FlightRecord

if TYPE_CHECKING:
    from satform.scenario.model import Scenario


class SpectralRadius(OfSatellites):
    """Largest factor by which a loop that is closed once a step multiplies small errors in a step.

    Below 1 the loop decays. Loops that are not analysed are left out; `show` lists them all.
    """

    kind: Literal["spectral_radius"] = "spectral_radius"
    loop: Literal["tracking", "consensus", "attitude", "estimation"] | None = None
    """Which loops are meant; all when left out."""

    def measure(self, record: FlightRecord) -> float:
        return math.nan

    def figure(self, record: FlightRecord, scenario: "Scenario | None") -> float:
        # A scenario's model holds expectations, and what loops it has can only be said with its satellites.
        from satform.evaluation.sampled_loops import sampled_loops  # noqa: PLC0415

        if scenario is None:
            return math.nan
        chosen = set(self.satellites or record.satellites)
        found = [
            loop.radius
            for loop in sampled_loops(scenario)
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
