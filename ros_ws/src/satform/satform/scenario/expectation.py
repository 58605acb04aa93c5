# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What an expectation is: which figure of which satellites over which time, and what is allowed."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, model_validator

from satform.common.spec import NonNegative, Number, Positive, Spec
from satform.control.sampled_stability import SampledLoop
from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.scenario.environment import Environment
from satform.scenario.parts import SatelliteSpec, Timing

Loops: TypeAlias = Callable[[], Sequence[SampledLoop]]
"""Gives the sampled loops of a scenario, worked out when they are asked for."""

_TIME_SLACK = 1e-9
"""Relative slack when a time is looked up on the grid of steps."""


@dataclass(frozen=True)
class Verdict:
    """One expectation, its figure and whether it was met.

    Attributes:
        label: what was measured, in words.
        unit: unit of the figure.
        figure: what the run gave; NaN when the run does not give one.
        allowed: what was expected, in words.
        met: whether the figure is allowed.
        origin: where what was expected comes from, in words.
    """

    label: str
    unit: str
    figure: float
    allowed: str
    met: bool
    origin: str = ""


class Expectation(Spec):
    """A figure of the run and what it has to be: about a value, below a bound, above a bound."""

    model_config = ConfigDict(
        json_schema_extra={"anyOf": [{"required": ["source"]}, {"required": ["regression"]}]}
    )

    unit: ClassVar[str] = ""
    of_steps: ClassVar[bool] = False
    """Whether the figure is made of what is decided in steps: the flight's last state then has none."""
    of_phases: ClassVar[bool] = False
    """Whether the figure is made of arc lengths."""

    label: str | None = None
    """What is measured, in words; made from the fields when left out."""
    value: Number | None = None
    """The expected figure; needs `relative` or `absolute`."""
    relative: NonNegative | None = None
    """Allowed departure from `value` as a fraction of it."""
    absolute: NonNegative | None = None
    """Allowed departure from `value` in its own unit."""
    below: Number | None = None
    """The figure has to be less than or equal to this."""
    above: Number | None = None
    """The figure has to be greater than or equal to this."""
    source: Annotated[str, Field(min_length=1)] | None = None
    """Where the figure comes from: paper, theory, another program. Given unless `regression` is."""
    regression: bool = False
    """Whether `value` is what this software gave, to notice every change of it; no source is named then."""

    @model_validator(mode="after")
    def _has_a_criterion(self) -> "Expectation":
        if self.value is not None and (self.relative is None) == (self.absolute is None):
            raise ValueError("a value needs exactly one of relative or absolute, its tolerance")
        if self.value is None and (self.relative is not None or self.absolute is not None):
            raise ValueError("a tolerance needs a value that it belongs to")
        if self.value is None and self.below is None and self.above is None:
            raise ValueError("give a value with its tolerance, or below, or above")
        if self.regression and self.source is not None:
            raise ValueError("a figure has a source or is a regression figure of this software, not both")
        if self.regression and (self.value is None or self.below is not None or self.above is not None):
            raise ValueError("a regression figure is a value with its tolerance; a bound needs a source")
        return self

    @property
    def origin(self) -> str:
        """Where the figure comes from, in words; empty where nothing says so."""
        return "regression figure of this software" if self.regression else (self.source or "")

    def measure(self, record: FlightRecord) -> float:
        """The figure in its unit; NaN when the record does not hold it."""
        raise NotImplementedError

    def figure(self, record: FlightRecord, loops: Loops | None) -> float:
        """The figure in its unit, of the flight or of the loops that are closed in it; NaN for none.

        Args:
            record: of the flight.
            loops: gives the scenario's sampled loops; None where they are not known.
        """
        return self.measure(record)

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        """What is wrong with this expectation in a scenario with these satellites and times."""
        return []

    def complaints_about_satellites(
        self, satellites: Mapping[str, SatelliteSpec], announces: str
    ) -> list[str]:
        """What the satellites of a scenario lack for this expectation to be able to be missed or met.

        Args:
            satellites: complete ones, by name.
            announces: what they exchange, `arc_length` or `motion`.
        """
        if self.of_phases and announces != "arc_length":
            return ["satellites share their motion here; they have no arc lengths to be judged"]
        return []

    def environment_complaints(self, environment: Environment) -> list[tuple[str, str]]:
        """Field and sentence of what contradicts the truth model's Sun, Earth or chief."""
        return []

    def needs(self, duration: float, step: float) -> float:
        """How long a flight has to last to be judged by this, s.

        A shorter flight may be judged when it cannot miss what the whole flight meets: its figure is the
        same, or the bound holds over every part of the flight.

        Args:
            duration: of the flight for which the expectation was written, s.
            step: control period, s.

        Returns:
            Not longer than `duration`; the whole flight unless a subclass knows better.
        """
        return duration

    def ends(self, duration: float) -> float:
        """The time up to which it looks at a flight of a duration, s."""
        return duration

    @property
    def smallest_allowed(self) -> float:
        """The smallest figure that is allowed; minus infinity when every small one is."""
        bounds = [-math.inf if self.above is None else self.above]
        if self.value is not None:
            bounds.append(self.value - self._tolerance(self.value))
        return max(bounds)

    @property
    def largest_allowed(self) -> float:
        """The largest figure that is allowed; infinity when every large one is."""
        bounds = [math.inf if self.below is None else self.below]
        if self.value is not None:
            bounds.append(self.value + self._tolerance(self.value))
        return min(bounds)

    def _tolerance(self, value: float) -> float:
        return abs(value) * self.relative if self.relative is not None else (self.absolute or 0.0)

    def describe(self) -> str:
        """The label, or one made from the fields."""
        return self.label or type(self).__name__

    def judge(self, record: FlightRecord, loops: Loops | None = None) -> Verdict:
        """The figure of a run, or of the loops that are closed in it, against what is expected."""
        return self.verdict(self.figure(record, loops))

    def verdict(self, figure: float) -> Verdict:
        """A figure against what is expected; one that is not finite is never as expected."""
        allowed = []
        met = math.isfinite(figure)
        if self.value is not None:
            met = met and abs(figure - self.value) <= self._tolerance(self.value)
            shown = f"{self.absolute:g}" if self.relative is None else f"{100 * self.relative:g} %"
            allowed.append(f"{self.value:.9g} ± {shown}")
        if self.below is not None:
            met = met and figure <= self.below
            allowed.append(f"≤ {self.below:g}")
        if self.above is not None:
            met = met and figure >= self.above
            allowed.append(f"≥ {self.above:g}")
        return Verdict(self.describe(), self.unit, figure, " and ".join(allowed), met, self.origin)


class OfSatellites(Expectation):
    """An expectation of all satellites or of some of them."""

    of_equipment: ClassVar[Literal["", "thruster", "sensor", "attitude"]] = ""
    """What each satellite has to have for it; empty for nothing."""

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
        bare = sorted(name for name in meant if getattr(satellites[name], self.of_equipment) is None)
        have = "has" if len(bare) == 1 else "have"
        return [*own, f"{', '.join(bare)} {have} no {self.of_equipment}"] if bare else own

    def columns(self, record: FlightRecord) -> list[int]:
        """Columns of the satellites that are meant."""
        chosen = self.satellites or record.satellites
        return [record.satellites.index(name) for name in chosen]

    def lacks_one(self, absent: NDArray[np.bool_]) -> bool:
        """Whether a satellite that is named does not fly at all.

        Args:
            absent: a row for each moment, a column for each satellite that is meant.
        """
        return self.satellites is not None and bool(absent.size) and bool(absent.all(axis=0).any())

    def whose(self) -> str:
        """The satellites that are meant, as the end of a label."""
        return f", {', '.join(self.satellites)}" if self.satellites else ""


class OverWindow(OfSatellites):
    """An expectation over a stretch of the flight."""

    after: NonNegative = 0.0
    """Start of the stretch, s."""
    before: Positive | None = None
    """End of the stretch, s; the end of the flight when left out."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = []
        end = timing.duration if self.before is None else self.before
        if end > timing.duration * (1 + _TIME_SLACK):
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
            held: whether a row holds for the whole step that begins at its time, such as a command; the
                step that begins where the stretch ends is not part of it.
            of_others: whether a satellite cannot give it either while another one does not fly.
            of_bodies: whether a satellite has it that does not fly, as it has a place.
        """
        if self.before is not None and self.before * (1 - _TIME_SLACK) > record.steps * record.step:
            return series[:0, self.columns(record)]
        time = np.arange(len(series)) * record.step
        end = math.inf if self.before is None else self.before * (1 + (-_TIME_SLACK if held else _TIME_SLACK))
        rows = (time >= self.after * (1 - _TIME_SLACK)) & (time <= end)
        columns = self.columns(record)
        chosen = series[rows][:, columns]
        if not of_bodies and self.lacks_one(record.absent_rows(len(series))[rows][:, columns]):
            return np.full_like(chosen, np.nan)
        excused = record.excluded(series, of_others=of_others)[rows][:, columns]
        return without_gaps(chosen, excused)

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
        if self.at is not None and self.at > timing.duration * (1 + _TIME_SLACK):
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

    def sample(
        self,
        series: Array,
        record: FlightRecord,
        columns: list[int] | None = None,
        *,
        of_others: bool = False,
    ) -> Array:
        """The row of a series nearest to the moment, as its only row; none when the record ends before.

        Args:
            series: a row for each step or each state, a column for each satellite where it has columns.
            record: of the flight.
            columns: of the satellites that are meant; all when left out.
            of_others: whether a satellite cannot give it either while another one does not fly.
        """
        row = record.steps if self.at is None else round(self.at / record.step)
        if row > record.steps:
            return series[:0]
        # What is decided in a step has no row for the state after the last step.
        row = min(row, len(series) - 1)
        if series.ndim == 1:
            return series[row : row + 1]
        chosen = list(range(series.shape[1])) if columns is None else columns
        excused = record.excluded(series, of_others=of_others)[row : row + 1, chosen]
        return without_gaps(series[row : row + 1, chosen], excused)

    def moment(self) -> str:
        """The moment, as the end of a label."""
        return " at the end" if self.at is None else f" at {self.at:g} s"


def largest(values: Array) -> float:
    """The largest of those values that are numbers; NaN when there are none."""
    numbers = values[~np.isnan(values)]
    return float(np.max(numbers)) if numbers.size else math.nan


def by_satellite(values: Array) -> list[Array]:
    """The numbers of each satellite that gives any, from a row for each moment and a column for each."""
    columns = [values[:, place] for place in range(values.shape[1])]
    numbers = [column[~np.isnan(column)] for column in columns]
    return [column for column in numbers if column.size]


def without_gaps(chosen: Array, excused: NDArray[np.bool_]) -> Array:
    """No numbers at all where something is missing without an excuse, so that nothing is judged by the rest.

    Args:
        chosen: rows and columns that are meant, shape (K, N, ...).
        excused: where what is missing may be left out, shape (K, N).
    """
    missing = np.isnan(chosen).any(axis=tuple(range(2, chosen.ndim)))
    return np.full_like(chosen, np.nan) if np.any(missing & ~excused) else chosen


class Event(OfSatellites):
    """An expectation of the time at which something happens: known as soon as it has happened."""

    def needs(self, duration: float, step: float) -> float:
        # What happens in time in the whole flight happens at the same time in one that ends after it.
        return min(duration, self.largest_allowed + step)
