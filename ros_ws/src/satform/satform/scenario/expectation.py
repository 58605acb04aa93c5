# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What an expectation is: which figure of which satellites over which time, and what is allowed."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import ConfigDict, Field, model_validator

from satform.common.spec import NonNegative, Number, Spec
from satform.control.protocol import FlightSetting
from satform.control.sampled_stability import SampledLoop
from satform.record.flight_block import FlightBlock
from satform.record.flight_record import FlightRecord
from satform.record.reducer import FlightShape, Reducer
from satform.scenario.environment import Environment
from satform.scenario.parts import SatelliteSpec, Timing

Loops: TypeAlias = Callable[[], Sequence[SampledLoop]]
"""Gives the sampled loops of a scenario, worked out when they are asked for."""

Edges: TypeAlias = Callable[[], Sequence[tuple[str, str, bool]]]
"""Gives each edge that the graph of a scenario has at some time: sender, receiver, whether it is a radio or
optical link."""


class ComputedFrom(Enum):
    """What the figure of an expectation is computed from, by the methods that its kind defines.

    Of a kind and its bases counts the first that defines one of these methods.
    """

    BLOCKS = auto()
    """The blocks of a flight while it goes on: it defines `reducer`."""
    LOOPS = auto()
    """The scenario's sampled loops, without a flight: it is `of_loops` and defines `figure_of_loops`."""
    RECORD = auto()
    """Whole records: it defines `measure` or `figure` and none of the others."""

    @classmethod
    def of(cls, kind: type["Expectation"]) -> "ComputedFrom":
        """That of a kind."""
        for base in kind.__mro__[: kind.__mro__.index(Expectation)]:
            own = vars(base).keys()
            if kind.of_loops and "figure_of_loops" in own:
                return cls.LOOPS
            if "reducer" in own:
                return cls.BLOCKS
            if {"measure", "figure"} & own:
                break
        return cls.RECORD


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
    """A figure of the run and what it has to be: about a value, below a bound, above a bound.

    Without any of these it is a figure alone, of which a scenario cannot expect anything.
    """

    model_config = ConfigDict(
        json_schema_extra={"anyOf": [{"required": ["source"]}, {"required": ["regression"]}]}
    )

    figure_name: ClassVar[str] = ""
    """Name of the figure in the label; fields stand in it as `{0.statistic}`."""
    unit: ClassVar[str] = ""
    of_steps: ClassVar[bool] = False
    """Whether the figure is made of what is decided in steps: the flight's last state then has none."""
    of_phases: ClassVar[bool] = False
    """Whether the figure is made of arc lengths."""
    of_loops: ClassVar[bool] = False
    """Whether the figure is one of the sampled loops."""
    computed_from: ClassVar[ComputedFrom] = ComputedFrom.RECORD
    """Found for every kind when it is defined."""

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

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        cls.computed_from = ComputedFrom.of(cls)

    @model_validator(mode="after")
    def _is_definite(self) -> "Expectation":
        if self.value is not None and (self.relative is None) == (self.absolute is None):
            raise ValueError("a value needs exactly one of relative or absolute, its tolerance")
        if self.value is None and (self.relative is not None or self.absolute is not None):
            raise ValueError("a tolerance needs a value that it belongs to")
        if self.regression and self.source is not None:
            raise ValueError("a figure has a source or is a regression figure of this software, not both")
        if self.regression and (self.value is None or self.below is not None or self.above is not None):
            raise ValueError("a regression figure is a value with its tolerance; a bound needs a source")
        return self

    @property
    def has_criterion(self) -> bool:
        """Whether anything is said of the figure."""
        return not (self.value is None and self.below is None and self.above is None)

    @property
    def origin(self) -> str:
        """Where the figure comes from, in words; empty where nothing says so."""
        return "regression figure of this software" if self.regression else (self.source or "")

    def reducer(self, flight: FlightShape) -> Reducer | None:
        """What makes the figure while a flight goes on; None for a kind that measures whole records only.

        Args:
            flight: names, control period and steps of it.
        """
        return None

    def measure(self, record: FlightRecord) -> float:
        """The figure in its unit; NaN when the record does not hold it.

        Raises:
            NotImplementedError: the kind defines neither this nor `reducer`.
        """
        reducer = self.reducer(FlightShape.of(record))
        if reducer is None:
            raise NotImplementedError(f"{type(self).__name__} defines neither reducer nor measure")
        reducer.update(FlightBlock.of(record))
        return float(reducer.figures()[0])

    def figure(self, record: FlightRecord, loops: Loops | None) -> float:
        """The figure in its unit, of the flight or of the loops that are closed in it; NaN for none.

        Args:
            record: of the flight.
            loops: gives the scenario's sampled loops; None where they are not known.
        """
        return self.measure(record)

    def figure_of_loops(self, satellites: tuple[str, ...], loops: Loops) -> float:
        """The figure in its unit of those kinds that are `of_loops`; NaN for none.

        Args:
            satellites: names of all of the scenario.
            loops: gives its sampled loops.
        """
        return math.nan

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

    def orbit_complaints(self, setting: FlightSetting, timing: Timing) -> list[str]:
        """Why its figure cannot be made of a flight about this chief.

        Args:
            setting: chief of the scenario.
            timing: control period and duration.
        """
        return []

    def link_complaints(self, edges: Edges) -> list[str]:
        """Why its figure cannot be made of the links of a scenario.

        Args:
            edges: gives those of the scenario.
        """
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
        named = self.figure_name.format(self) if self.figure_name else type(self).__name__
        return self.label or named + self.of_what()

    def of_what(self) -> str:
        """Part of the flight and satellites that are meant, as the end of a label."""
        return ""

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
