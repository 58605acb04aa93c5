# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Expectations of some satellites, over a stretch of the flight, at a moment, and of an event."""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from satform.common.spec import NonNegative, Positive
from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.record.reducer import FlightShape
from satform.record.stretch import TIME_SLACK, Stretch, rows_of, rows_within
from satform.scenario.expectation import Expectation
from satform.scenario.parts import SatelliteSpec, Timing

_EQUIPMENT = {
    "plans": "control law that makes plans",
    "attitude_filter": "filter of its attitude",
    "motion_sensor": "sensor or navigation",
}
"""What a sentence calls equipment whose name does not say it."""


class OfSatellites(Expectation):
    """An expectation of all satellites or of some of them."""

    of_equipment: ClassVar[
        Literal["", "thruster", "sensor", "filter", "attitude", "plans", "attitude_filter", "motion_sensor"]
    ] = ""
    """What each satellite has to have for it, plans being those of its control law; empty for nothing."""

    satellites: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    """Names of the satellites that are meant; all when left out."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        unknown = sorted(set(self.satellites or ()) - satellites)
        own = [f"there is no satellite {name}; there are {', '.join(sorted(satellites))}" for name in unknown]
        return super().complaints(satellites, timing) + own

    def complaints_about_satellites(
        self, satellites: Mapping[str, SatelliteSpec], announces: str
    ) -> list[str]:
        own = super().complaints_about_satellites(satellites, announces)
        if not self.of_equipment:
            return own
        meant = self.satellites or tuple(satellites)
        bare = sorted(name for name in meant if not _has(satellites[name], self.of_equipment))
        have = "has" if len(bare) == 1 else "have"
        lacking = _EQUIPMENT.get(self.of_equipment, self.of_equipment)
        return [*own, f"{', '.join(bare)} {have} no {lacking}"] if bare else own

    def whole(self, flight: FlightShape, rows: int, *, of_others: bool = False) -> Stretch:
        """All rows of a series, and the satellites that are meant.

        Args:
            flight: that is looked at.
            rows: of the series, `flight.steps` or `flight.states`.
            of_others: whether a satellite cannot give it either while another one does not fly.
        """
        return Stretch(0, rows, flight.columns(self.satellites), of_others=of_others)

    def of_what(self) -> str:
        return super().of_what() + self.whose()

    def whose(self) -> str:
        """The satellites that are meant, as the end of a label."""
        return f", {', '.join(self.satellites)}" if self.satellites else ""


def _has(satellite: SatelliteSpec, equipment: str) -> bool:
    """Whether a satellite has some equipment, or plans of its control law."""
    if equipment == "plans":
        return satellite.controller is not None and satellite.controller.makes_plans
    if equipment == "attitude_filter":
        return satellite.estimates_attitude
    if equipment == "motion_sensor":
        return satellite.measures_motion
    if equipment == "filter":
        return satellite.estimates_motion
    return getattr(satellite, equipment) is not None


class OverWindow(OfSatellites):
    """An expectation over a stretch of the flight."""

    after: NonNegative = 0.0
    """Start of the stretch, s."""
    before: Positive | None = None
    """End of the stretch, s; the end of the flight when left out."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = []
        end = timing.duration if self.before is None else self.before
        if end > timing.duration * (1 + TIME_SLACK):
            own.append(f"before {end:g} s is later than the flight's end at {timing.duration:g} s")
        if self.after >= end:
            own.append(f"after {self.after:g} s is not earlier than the stretch's end at {end:g} s")
        return super().complaints(satellites, timing) + own

    def needs(self, duration: float, step: float) -> float:
        if self.before is not None:
            return min(duration, self.before + step if self.of_steps else self.before)
        # Two steps, so that the stretch has one of its own wherever in a step it begins.
        return min(duration, self.after + 2.0 * step) if self.holds_in_part() else duration

    def ends(self, duration: float) -> float:
        return duration if self.before is None else self.before

    def holds_in_part(self) -> bool:
        """Whether what is allowed over a stretch is allowed over every part of it, too."""
        return False

    def extreme_holds_in_part(self, which: Literal["minimum", "maximum"]) -> bool:
        """Whether what is allowed of an extreme of a series is allowed over every part, too.

        Of a series that is never negative: over a part its smallest value is no less, its largest no more.
        """
        return self.smallest_allowed <= 0.0 if which == "maximum" else math.isinf(self.largest_allowed)

    def stretch(
        self,
        flight: FlightShape,
        rows: int,
        *,
        held: bool = False,
        of_others: bool = False,
        of_bodies: bool = False,
    ) -> Stretch:
        """The rows of a series that lie in the stretch, and the satellites that are meant.

        No rows when the flight ends before the stretch does. A satellite that the expectation names has to
        fly in one of the rows at least.

        Args:
            flight: that is looked at.
            rows: of the series, `flight.steps` or `flight.states`.
            held: whether a row holds for the whole step that begins at its time, such as a command; the
                step that begins where the stretch ends is not part of it.
            of_others: whether a satellite cannot give it either while another one does not fly.
            of_bodies: whether a satellite has it that does not fly, as it has a place.
        """
        first, end = rows_within(self.after, self.before, flight.step, rows, held=held)
        if self.before is not None and self.before * (1 - TIME_SLACK) > flight.steps * flight.step:
            first = end = 0
        named = self.satellites is not None and not of_bodies
        return Stretch(first, end, flight.columns(self.satellites), named, of_others, of_bodies)

    def window(
        self,
        series: Array,
        record: FlightRecord,
        *,
        held: bool = False,
        of_others: bool = False,
        of_bodies: bool = False,
    ) -> Array:
        """The rows of a series whose times lie in the stretch, and the columns that are meant.

        No rows when the record ends before the stretch does. What a satellite that does not fly does not
        give is not a number; nothing is a number when something else is missing, or when a satellite that
        the expectation names does not fly in any of these rows.

        Args:
            series: a row for each step or each state, a column for each satellite.
            record: of the flight.
            held: as of `stretch`.
            of_others: likewise.
            of_bodies: likewise.
        """
        shape = FlightShape.of(record)
        stretch = self.stretch(shape, len(series), held=held, of_others=of_others, of_bodies=of_bodies)
        return rows_of(series, record, stretch)

    def of_what(self) -> str:
        return self.when() + super().of_what()

    def when(self) -> str:
        """The stretch, as the end of a label."""
        words = f" after {self.after:g} s" if self.after else ""
        return words + (f" before {self.before:g} s" if self.before is not None else "")


class AtTime(Expectation):
    """An expectation at one moment."""

    known_before_flight: ClassVar[bool] = False
    """Whether the figure at the start is a number of the scenario itself."""

    at: NonNegative | None = None
    """Simulated time, s; the end of the flight when left out."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = []
        if self.at is not None and self.at > timing.duration * (1 + TIME_SLACK):
            own.append(f"at {self.at:g} s is later than the flight's end at {timing.duration:g} s")
        if self.known_before_flight and self.at is not None and self.at < 0.5 * timing.step:
            own.append(f"at {self.at:g} s the figure is what the scenario itself says: name a later time")
        return super().complaints(satellites, timing) + own

    def needs(self, duration: float, step: float) -> float:
        if self.at is None:
            return duration
        return min(duration, self.at + step if self.of_steps else self.at)

    def ends(self, duration: float) -> float:
        return duration if self.at is None else self.at

    def instant(
        self,
        flight: FlightShape,
        rows: int,
        satellites: tuple[str, ...] | None = None,
        *,
        of_bodies: bool = False,
    ) -> Stretch:
        """The row of a series nearest to the moment, as a stretch; no row when the flight ends before.

        A satellite that the expectation names has to fly at this moment.

        Args:
            flight: that is looked at.
            rows: of the series, `flight.steps` or `flight.states`.
            satellites: names of those that are meant; all when left out.
            of_bodies: whether a satellite has it that does not fly, as it has a position.
        """
        row = flight.steps if self.at is None else round(self.at / flight.step)
        held = rows if row <= flight.steps else 0
        # What is decided in a step has no row for the state after the last step.
        row = max(min(row, held - 1), 0)
        named = satellites is not None and not of_bodies
        return Stretch(row, min(row + 1, held), flight.columns(satellites), named, of_bodies=of_bodies)

    def of_what(self) -> str:
        return self.moment() + super().of_what()

    def moment(self) -> str:
        """The moment, as the end of a label."""
        return " at the end" if self.at is None else f" at {self.at:g} s"


class Event(OfSatellites):
    """An expectation of the time at which something happens: known as soon as it has happened."""

    def needs(self, duration: float, step: float) -> float:
        # What happens in time in the whole flight happens at the same time in one that ends after it.
        return min(duration, self.largest_allowed + step)
