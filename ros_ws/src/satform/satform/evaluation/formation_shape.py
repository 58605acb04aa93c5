# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of the shape of a formation: how close four satellites are to a regular tetrahedron."""

from collections.abc import Callable
from typing import Annotated, Literal

from pydantic import Field, model_validator

from satform.common.spec import Positive
from satform.evaluation.reducers import ExtremeOf, MeanOf
from satform.numeric.elementwise import Array
from satform.orbits.tetrahedron import QUALITIES, size_factor
from satform.record.reducer import FlightShape, Reducer
from satform.scenario.parts import Timing
from satform.scenario.windowed_expectation import AtTime, OfSatellites, OverWindow

Quality = Literal["glassmeier", "robert_roux", "volume"]


class _OfFour(OfSatellites):
    """An expectation of the tetrahedron of four satellites."""

    satellites: Annotated[tuple[str, ...], Field(min_length=4, max_length=4)] | None = None
    """Names of the four satellites; left out where there are four."""
    quality: Quality = "glassmeier"
    """glassmeier: volume and surface relative to those of a regular tetrahedron of equal mean side, plus 1,
    which gives 1 on a line and 3 for a regular one; robert_roux: cube root of the volume relative to that of
    the circumscribed sphere, 0 in a plane and 1 for a regular one; volume: volume relative to that of a
    regular one of equal mean side, 0 in a plane and 1 for a regular one."""

    mean_sides: tuple[Positive, Positive, Positive, Positive] | None = None
    """Ascending, m: the quality is multiplied by a factor that is 1 for a mean side between the second and
    the third, and falls smoothly to 0 at the first and at the fourth; with quality volume this is the quality
    factor of the Magnetospheric Multiscale mission. Left out, the size does not matter."""

    @model_validator(mode="after")
    def _ascending(self) -> "_OfFour":
        sides = self.mean_sides
        if sides is not None and not sides[0] < sides[1] <= sides[2] < sides[3]:
            raise ValueError("mean_sides have to ascend; the second and the third may be equal")
        return self

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = super().complaints(satellites, timing)
        if self.satellites is None and len(satellites) != 4:
            own.append(f"a tetrahedron has four corners; there are {len(satellites)} satellites: name four")
        if self.satellites is not None and len(set(self.satellites)) < 4:
            own.append("a tetrahedron is of four different satellites")
        return own

    def factor(self) -> str:
        """What is meant, in words."""
        size = "" if self.mean_sides is None else " and size"
        return f"tetrahedron quality ({self.quality.replace('_', ' and ')}{size})"

    def qualities(self) -> Callable[[Array], Array]:
        """Gives the quality, shape (rows, R, 1), from positions of shape (rows, R, 4, 3)."""
        quality, sides = QUALITIES[self.quality], self.mean_sides
        if sides is None:
            return lambda positions: quality(positions)[..., None]
        return lambda positions: (quality(positions) * size_factor(positions, sides))[..., None]


class TetrahedronQuality(_OfFour, OverWindow):
    """Quality factor of the tetrahedron of four satellites, its least, mean or largest."""

    kind: Literal["tetrahedron_quality"] = "tetrahedron_quality"
    statistic: Literal["minimum", "mean", "maximum"] = "minimum"
    """Which quality of the stretch is meant."""

    def holds_in_part(self) -> bool:
        return self.statistic != "mean" and self.extreme_holds_in_part(self.statistic)

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.stretch(flight, flight.states, of_bodies=True)
        if self.statistic == "mean":
            return MeanOf(stretch, "position", transform=self.qualities())
        return ExtremeOf(stretch, "position", which=self.statistic, transform=self.qualities())

    def describe(self) -> str:
        return self.label or f"{self.statistic} {self.factor()}{self.when()}{self.whose()}"


class TetrahedronQualityAt(AtTime, _OfFour):
    """Quality factor of the tetrahedron of four satellites at one moment."""

    known_before_flight = True
    kind: Literal["tetrahedron_quality_at"] = "tetrahedron_quality_at"

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.instant(flight, flight.states, self.satellites, of_bodies=True)
        return ExtremeOf(stretch, "position", transform=self.qualities())

    def describe(self) -> str:
        return self.label or f"{self.factor()}{self.moment()}{self.whose()}"
