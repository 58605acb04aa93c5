# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Distributions of dispersed values: from a quantile to a value, as percent-point functions of scipy.stats.

A value is a pure function of the quantile, so that every way to sample quantiles serves every distribution.
Random quantiles are sampled in `sampling`; `cases` computes the values of a case from quantiles and
distributions.
"""

import bisect
import itertools
import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator
from scipy.special import ndtr, ndtri

from satform.common.angle_text import OR_EITHER_ANGLE
from satform.common.spec import NonNegative, Number, Positive, Spec

LEAST_QUANTILE = 2.0**-54
"""The smallest quantile that is drawn; the largest is 1 - 2^-53. A normal value is finite at both."""

LARGEST_QUANTILE = 1.0 - 2.0**-53


Quantity = Annotated[Number, OR_EITHER_ANGLE]
"""A number in the unit of the dispersed field, or an angle as text."""

Value = bool | int | float | str
"""A value of a field of a scenario."""


class Distribution(Spec):
    """What a dispersed value may be, and how probable it is."""

    numeric: ClassVar[bool] = True
    """Whether all values are numbers."""

    def value(self, quantile: float) -> Value:
        """The value below which a case lies with the probability `quantile`.

        Args:
            quantile: above 0 and below 1.
        """
        raise NotImplementedError

    def has_width(self) -> bool:
        """Whether there is more than one value."""
        return self.value(0.999) != self.value(0.001)

    def probes(self) -> tuple[float, ...]:
        """Quantiles at which to look whether values change anything: of every value if these are few."""
        return (0.02, 0.5, 0.98)


class NormalSpec(Distribution):
    """Normal distribution."""

    kind: Literal["normal"] = "normal"
    mean: Quantity = 0.0
    """Mean, in the unit of the field."""
    standard_deviation: Annotated[NonNegative, OR_EITHER_ANGLE]
    """Standard deviation, in the unit of the field."""

    def value(self, quantile: float) -> float:
        return self.mean + self.standard_deviation * float(ndtri(quantile))


class UniformSpec(Distribution):
    """Uniform distribution over an interval."""

    kind: Literal["uniform"] = "uniform"
    low: Quantity
    """Least value, in the unit of the field."""
    high: Quantity
    """Largest value, in the unit of the field."""

    @model_validator(mode="after")
    def _ascending(self) -> "UniformSpec":
        _require_ascending(self)
        return self

    def value(self, quantile: float) -> float:
        return min(self.high, self.low + quantile * (self.high - self.low))


class LogUniformSpec(Distribution):
    """Distribution of a positive value whose logarithm is uniform: every factor is as probable."""

    kind: Literal["log_uniform"] = "log_uniform"
    low: Annotated[Positive, OR_EITHER_ANGLE]
    """Least value, in the unit of the field."""
    high: Annotated[Positive, OR_EITHER_ANGLE]
    """Largest value, in the unit of the field."""

    @model_validator(mode="after")
    def _ascending(self) -> "LogUniformSpec":
        _require_ascending(self)
        return self

    def value(self, quantile: float) -> float:
        value = math.exp(math.log(self.low) + quantile * math.log(self.high / self.low))
        return min(self.high, max(self.low, value))


class TruncatedNormalSpec(Distribution):
    """Normal distribution without the values outside an interval."""

    kind: Literal["truncated_normal"] = "truncated_normal"
    mean: Quantity = 0.0
    """Mean of the normal distribution before it is truncated, in the unit of the field."""
    standard_deviation: Annotated[Positive, OR_EITHER_ANGLE]
    """Its standard deviation, in the unit of the field."""
    low: Quantity
    """Least value, in the unit of the field."""
    high: Quantity
    """Largest value, in the unit of the field."""

    @model_validator(mode="after")
    def _has_probability(self) -> "TruncatedNormalSpec":
        begin, end = self._standardised()
        if begin < end and min(abs(begin), abs(end)) > 30.0 and begin * end > 0.0:
            raise ValueError(
                f"the interval from {self.low:g} to {self.high:g} lies more than 30 standard deviations from "
                "the mean; there is no probability left in it"
            )
        _require_ascending(self)
        return self

    def _standardised(self) -> tuple[float, float]:
        width = self.standard_deviation
        return (self.low - self.mean) / width, (self.high - self.mean) / width

    def value(self, quantile: float) -> float:
        begin, end = self._standardised()
        if begin > 0.0:
            # In the upper tail probabilities differ from one by less than a double resolves: mirrored.
            below, above = float(ndtr(-begin)), float(ndtr(-end))
            standard = -float(ndtri((1.0 - quantile) * below + quantile * above))
        else:
            below, above = float(ndtr(begin)), float(ndtr(end))
            standard = float(ndtri((1.0 - quantile) * below + quantile * above))
        return min(self.high, max(self.low, self.mean + self.standard_deviation * standard))


class ChoiceSpec(Distribution):
    """One of a few values: numbers, text, or true and false."""

    numeric: ClassVar[bool] = False

    kind: Literal["choice"] = "choice"
    values: Annotated[tuple[Value, ...], Field(min_length=1, max_length=10_000)]
    """The values, numbers in the unit of the field."""
    weights: Annotated[tuple[NonNegative, ...], Field(min_length=1)] | None = None
    """How probable each is, relative to the others; all alike when left out."""

    @model_validator(mode="after")
    def _weighted(self) -> "ChoiceSpec":
        if self.weights is None:
            return self
        if len(self.weights) != len(self.values):
            raise ValueError(f"there are {len(self.weights)} weights for {len(self.values)} values")
        if not sum(self.weights) > 0.0:
            raise ValueError("every weight is zero; one at least has to be above")
        return self

    def value(self, quantile: float) -> Value:
        weights = self.weights or (1.0,) * len(self.values)
        limits = list(itertools.accumulate(weights))
        index = bisect.bisect_right(limits, quantile * limits[-1])
        # Rounding may carry the last quantile to the sum itself; values without weight are never chosen.
        last = max(index for index, weight in enumerate(weights) if weight > 0.0)
        return self.values[min(index, last)]

    def has_width(self) -> bool:
        return len({self.value(quantile) for quantile in self.probes()}) > 1

    def probes(self) -> tuple[float, ...]:
        weights = self.weights or (1.0,) * len(self.values)
        limits = [0.0, *itertools.accumulate(weights)]
        middles = [
            0.5 * (begin + end) / limits[-1] for begin, end in itertools.pairwise(limits) if end > begin
        ]
        return tuple(middles[:20])


def _require_ascending(spec: Any) -> None:
    if spec.low > spec.high:
        raise ValueError(f"low {spec.low:g} is above high {spec.high:g}")
