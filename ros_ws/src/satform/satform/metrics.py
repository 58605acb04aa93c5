"""What a run is judged by: figures from a flight record, and what a scenario expects of them."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from satform.elementwise import Array
from satform.record import FlightRecord
from satform.spec import NonNegative, Number, Positive, Spec

if TYPE_CHECKING:
    from satform.scenario.model import Timing

_TIME_SLACK = 1e-9
"""Relative slack when a time is looked up on the grid of steps."""


@dataclass(frozen=True)
class Verdict:
    """One expectation, its figure and whether it was met.

    Attributes:
        label: what was measured, in words.
        unit: unit of the figure.
        figure: what the run gave; NaN when the run was too short to give one.
        allowed: what was expected, in words.
        met: whether the figure is allowed.
    """

    label: str
    unit: str
    figure: float
    allowed: str
    met: bool


class Expectation(Spec):
    """A figure of the run and what it has to be: about a value, below a bound, above a bound."""

    unit: ClassVar[str] = ""

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
    source: str | None = None
    """Where the expected figure comes from."""

    @model_validator(mode="after")
    def _says_something(self) -> "Expectation":
        if self.value is not None and (self.relative is None) == (self.absolute is None):
            raise ValueError("a value needs exactly one of relative or absolute, its tolerance")
        if self.value is None and (self.relative is not None or self.absolute is not None):
            raise ValueError("a tolerance needs a value that it belongs to")
        if self.value is None and self.below is None and self.above is None:
            raise ValueError("give a value with its tolerance, or below, or above")
        return self

    def measure(self, record: FlightRecord) -> float:
        """The figure in its unit; NaN when the record does not hold it."""
        raise NotImplementedError

    def complaints(self, satellites: set[str], timing: "Timing") -> list[str]:
        """What is wrong with this expectation in a scenario with these satellites and times."""
        return []

    def complaints_about_thrusters(self, satellites: set[str], equipped: set[str]) -> list[str]:
        """What is wrong with this expectation if only the satellites equipped have thrusters."""
        return []

    def needs(self, duration: float) -> float:
        """How long a flight has to last to be judged by this, s; to its end unless another is named.

        Args:
            duration: of the flight for which the expectation was written, s.
        """
        return duration

    def describe(self) -> str:
        """The label, or one made from the fields."""
        return self.label or type(self).__name__

    def judge(self, record: FlightRecord) -> Verdict:
        """The figure of a run against what is expected."""
        figure = self.measure(record)
        allowed = []
        met = not math.isnan(figure)
        if self.value is not None:
            relative = self.relative is not None
            tolerance = abs(self.value) * (self.relative or 0.0) if relative else (self.absolute or 0.0)
            met = met and abs(figure - self.value) <= tolerance
            shown = f"{100 * (self.relative or 0.0):g} %" if relative else f"{self.absolute:g}"
            allowed.append(f"{self.value:.9g} ± {shown}")
        if self.below is not None:
            met = met and figure <= self.below
            allowed.append(f"≤ {self.below:g}")
        if self.above is not None:
            met = met and figure >= self.above
            allowed.append(f"≥ {self.above:g}")
        return Verdict(self.describe(), self.unit, figure, " and ".join(allowed), met)


class OfSatellites(Expectation):
    """An expectation of all satellites or of some of them."""

    satellites: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    """Names of the satellites that are meant; all when left out."""

    def complaints(self, satellites: set[str], timing: "Timing") -> list[str]:
        unknown = sorted(set(self.satellites or ()) - satellites)
        own = [f"there is no satellite {name}; there are {', '.join(sorted(satellites))}" for name in unknown]
        return super().complaints(satellites, timing) + own

    def columns(self, record: FlightRecord) -> list[int]:
        """Columns of the satellites that are meant."""
        chosen = self.satellites or record.satellites
        return [record.satellites.index(name) for name in chosen]

    def whose(self) -> str:
        """The satellites that are meant, as the end of a label."""
        return f", {', '.join(self.satellites)}" if self.satellites else ""


class OverWindow(OfSatellites):
    """An expectation over a stretch of the flight."""

    after: NonNegative = 0.0
    """Start of the stretch, s."""
    before: Positive | None = None
    """End of the stretch, s; the end of the flight when left out."""

    def complaints(self, satellites: set[str], timing: "Timing") -> list[str]:
        own = []
        end = timing.duration if self.before is None else self.before
        if end > timing.duration * (1 + _TIME_SLACK):
            own.append(f"before {end:g} s is later than the flight's end at {timing.duration:g} s")
        if self.after >= end:
            own.append(f"after {self.after:g} s is not earlier than the stretch's end at {end:g} s")
        return super().complaints(satellites, timing) + own

    def needs(self, duration: float) -> float:
        return duration if self.before is None else self.before

    def window(
        self, series: Array, record: FlightRecord, *, held: bool = False, of_others: bool = False
    ) -> Array:
        """The rows of a series whose times lie in the stretch, and the columns that are meant.

        No rows when the record ends before the stretch does. What a satellite that does not fly does not
        give is not a number; nothing is a number when something else is missing.

        Args:
            series: a row for each step or each state, a column for each satellite.
            record: of the flight.
            held: whether a row holds for the whole step that begins at its time, such as a command; the
                step that begins where the stretch ends is not part of it.
            of_others: whether a satellite cannot give it either while another one does not fly.
        """
        if self.before is not None and self.before * (1 - _TIME_SLACK) > record.steps * record.step:
            return series[:0, self.columns(record)]
        time = np.arange(len(series)) * record.step
        end = math.inf if self.before is None else self.before * (1 + (-_TIME_SLACK if held else _TIME_SLACK))
        rows = (time >= self.after * (1 - _TIME_SLACK)) & (time <= end)
        columns = self.columns(record)
        excused = record.left_out(series, of_others=of_others)[rows][:, columns]
        return _honest(series[rows][:, columns], excused)

    def when(self) -> str:
        """The stretch, as the end of a label."""
        words = f" after {self.after:g} s" if self.after else ""
        return words + (f" before {self.before:g} s" if self.before is not None else "")


class AtTime(Expectation):
    """An expectation at one moment."""

    at: NonNegative | None = None
    """Simulated time, s; the end of the flight when left out."""

    def complaints(self, satellites: set[str], timing: "Timing") -> list[str]:
        own = []
        if self.at is not None and self.at > timing.duration * (1 + _TIME_SLACK):
            own.append(f"at {self.at:g} s is later than the flight's end at {timing.duration:g} s")
        return super().complaints(satellites, timing) + own

    def needs(self, duration: float) -> float:
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
        excused = record.left_out(series, of_others=of_others)[row : row + 1, chosen]
        return _honest(series[row : row + 1, chosen], excused)

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


def _honest(chosen: Array, excused: NDArray[np.bool_]) -> Array:
    """No numbers at all where something is missing without an excuse, so that nothing is judged by the rest.

    Args:
        chosen: rows and columns that are meant, shape (K, N, ...).
        excused: where what is missing may be left out, shape (K, N).
    """
    missing = np.isnan(chosen).any(axis=tuple(range(2, chosen.ndim)))
    return np.full_like(chosen, np.nan) if np.any(missing & ~excused) else chosen


class TrackingError(OverWindow):
    """Largest distance between a satellite and its reference, in m."""

    unit = "m"
    kind: Literal["tracking_error"] = "tracking_error"

    def measure(self, record: FlightRecord) -> float:
        return largest(self.window(record.tracking_error, record))

    def describe(self) -> str:
        return self.label or f"largest tracking error{self.when()}{self.whose()}"


class TrackingErrorAt(AtTime, OfSatellites):
    """Largest distance between a satellite and its reference at one moment, in m."""

    unit = "m"
    kind: Literal["tracking_error_at"] = "tracking_error_at"

    def measure(self, record: FlightRecord) -> float:
        return largest(self.sample(record.tracking_error, record, self.columns(record)))

    def describe(self) -> str:
        return self.label or f"tracking error{self.moment()}{self.whose()}"


class SlidingVariable(OverWindow):
    """Largest component of the sliding variable, in m/s."""

    unit = "m/s"
    kind: Literal["sliding_variable"] = "sliding_variable"

    def measure(self, record: FlightRecord) -> float:
        return largest(np.abs(self.window(record.sliding_variable, record)))

    def describe(self) -> str:
        return self.label or f"largest sliding variable{self.when()}{self.whose()}"


class ReachingTime(OfSatellites):
    """Time at which a component of the sliding variable first comes within a level, in s."""

    unit = "s"
    kind: Literal["reaching_time"] = "reaching_time"
    axis: Literal["x", "y", "z"]
    """Component of the sliding variable."""
    level: Positive
    """Magnitude that counts as reached, m/s."""

    def measure(self, record: FlightRecord) -> float:
        columns = self.columns(record)
        surface = np.abs(record.sliding_variable[:, columns, "xyz".index(self.axis)])
        excused = record.left_out(record.sliding_variable)[:, columns]
        reached = np.all((surface <= self.level) | excused, axis=1) & ~excused.all(axis=1)
        return float(np.argmax(reached)) * record.step if reached.any() else math.nan

    def describe(self) -> str:
        return self.label or f"reaching time, {self.axis}{self.whose()}"


class Control(OverWindow):
    """Mean, smallest or largest magnitude of the commanded acceleration, in m/s^2."""

    unit = "m/s²"
    kind: Literal["control"] = "control"
    statistic: Literal["mean", "smallest", "largest"] = "mean"
    """Mean over the stretch, or its smallest or largest value."""

    def measure(self, record: FlightRecord) -> float:
        chosen = self.window(record.control, record, held=True)
        if self.statistic == "smallest":
            return -largest(-chosen)
        return float(np.mean(chosen)) if self.statistic == "mean" and chosen.size else largest(chosen)

    def describe(self) -> str:
        return self.label or f"{self.statistic} control{self.when()}{self.whose()}"


class DeltaV(OverWindow):
    """Delta-v as the thrusters count it, or integral of an ideal command; the largest, in m/s."""

    unit = "m/s"
    kind: Literal["delta_v"] = "delta_v"

    def measure(self, record: FlightRecord) -> float:
        chosen = self.window(record.effort, record, held=True)
        return largest(np.sum(chosen, axis=0)) if chosen.size else math.nan

    def describe(self) -> str:
        return self.label or f"delta-v{self.when()}{self.whose()}"


class SettlingTime(OfSatellites):
    """Time after which the tracking error never exceeds a level again, in s."""

    unit = "s"
    kind: Literal["settling_time"] = "settling_time"
    level: Positive
    """Tracking error that counts as settled, m."""

    def measure(self, record: FlightRecord) -> float:
        columns, error = self.columns(record), record.tracking_error
        furthest = largest_of_each(error[:, columns], record.left_out(error)[:, columns])
        return settled(furthest, self.level, record.step)

    def describe(self) -> str:
        return self.label or f"tracking error settles to {self.level:g} m{self.whose()}"


class ArcLengthSpread(AtTime, OfSatellites):
    """Largest minus smallest generalised arc length of the satellites that fly, in m."""

    unit = "m"
    kind: Literal["arc_length_spread"] = "arc_length_spread"

    def measure(self, record: FlightRecord) -> float:
        return largest(self.sample(arc_length_spread(record, self.columns(record)), record))

    def describe(self) -> str:
        return self.label or f"arc-length spread{self.moment()}{self.whose()}"


class ArcLengthSettling(Expectation):
    """Time after which the spread of arc lengths stays within a fraction of its first value, in s."""

    unit = "s"
    kind: Literal["arc_length_settling"] = "arc_length_settling"
    fraction: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.01
    """Fraction of the spread at the start."""

    def measure(self, record: FlightRecord) -> float:
        spread = arc_length_spread(record)
        return settled(spread, self.fraction * float(spread[0]), record.step)

    def describe(self) -> str:
        return self.label or f"arc-length spread settles to {100 * self.fraction:g} %"


class ArcLengthMean(AtTime):
    """Mean generalised arc length less the nominal rate times the time, in m."""

    unit = "m"
    kind: Literal["arc_length_mean"] = "arc_length_mean"
    nominal_rate: Number
    """Rate that is taken off, m/s."""

    def measure(self, record: FlightRecord) -> float:
        arc_length, time = self.sample(record.arc_length, record), self.sample(record.time, record)
        flying = arc_length[~np.isnan(arc_length)]
        return float(np.mean(flying) - self.nominal_rate * time[0]) if flying.size else math.nan

    def describe(self) -> str:
        return self.label or f"mean arc length in the nominal motion{self.moment()}"


class ArcLengthRate(AtTime, OfSatellites):
    """Departure of the rate furthest from a nominal one, in m/s."""

    unit = "m/s"
    kind: Literal["arc_length_rate"] = "arc_length_rate"
    nominal_rate: Number
    """Rate that is taken off, m/s."""

    def measure(self, record: FlightRecord) -> float:
        rate = self.sample(record.rate, record, self.columns(record))
        return largest(np.abs(rate - self.nominal_rate))

    def describe(self) -> str:
        return self.label or f"arc-length rate off nominal{self.moment()}{self.whose()}"


class Distance(OverWindow):
    """Smallest or largest distance between two satellites, in m."""

    unit = "m"
    kind: Literal["distance"] = "distance"
    satellites: Annotated[tuple[str, ...], Field(min_length=2, max_length=2)]
    """The two satellites."""
    statistic: Literal["smallest", "largest"]
    """Which distance of the stretch is meant."""

    def complaints(self, satellites: set[str], timing: "Timing") -> list[str]:
        first, second = self.satellites
        same = f"a distance is between two different satellites; found {first} twice"
        return super().complaints(satellites, timing) + ([same] if first == second else [])

    def measure(self, record: FlightRecord) -> float:
        pair = self.window(record.position, record)
        if not pair.size:
            return math.nan
        apart = np.linalg.norm(pair[:, 0] - pair[:, 1], axis=-1)
        return float(np.min(apart) if self.statistic == "smallest" else np.max(apart))

    def describe(self) -> str:
        return self.label or f"{self.statistic} distance{self.when()}{self.whose()}"


def arc_length_spread(record: FlightRecord, columns: list[int] | None = None) -> Array:
    """Largest minus smallest generalised arc length of those that fly, at every state.

    Args:
        record: of the flight.
        columns: of the satellites that are meant; all when left out.

    Returns:
        m, shape (K + 1,); not a number where nobody flies.
    """
    chosen = list(range(len(record.satellites))) if columns is None else columns
    told, excused = record.arc_length[:, chosen], record.left_out(record.arc_length)[:, chosen]
    spread: Array = largest_of_each(told, excused) + largest_of_each(-told, excused)
    return spread


def largest_of_each(values: Array, excused: NDArray[np.bool_]) -> Array:
    """The largest value of each row, leaving out what is excused; shapes (K, N), gives (K,)."""
    row = np.max(np.where(excused, -np.inf, values), axis=1, initial=-np.inf)
    return np.where(excused.all(axis=1), np.nan, row)


def judge(expectations: tuple[Expectation, ...], record: FlightRecord) -> list[Verdict]:
    """Every expectation of a scenario against a run's record, in order."""
    return [expectation.judge(record) for expectation in expectations]


def settled(series: Array, level: float, step: float) -> float:
    """Time from which a series stays at or below a level; NaN when it does not end there or is empty."""
    outside = np.flatnonzero(series > level)
    first = int(outside[-1]) + 1 if outside.size else 0
    return math.nan if first >= len(series) or math.isnan(series[-1]) else first * step
