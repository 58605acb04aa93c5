# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What is expected of all cases of a campaign together: success rate, percentiles and means of figures."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from satform.common.spec import Number, Spec
from satform.numeric.elementwise import Array

Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Confidence = Annotated[float, Field(gt=0.0, lt=1.0)]


@dataclass(frozen=True)
class CampaignVerdict:
    """One expectation of a campaign, its statistic and whether it was met.

    Attributes:
        label: what was judged, in words.
        unit: of the statistic, as that of the figure; empty for a rate.
        statistic: estimate over all cases; NaN when the cases do not give one.
        low: lower limit of the confidence interval.
        high: upper limit of it.
        confidence: of the interval.
        compared: which of them the bounds were compared with, in words.
        allowed: what was expected, in words.
        met: whether it is allowed.
    """

    label: str
    unit: str
    statistic: float
    low: float
    high: float
    confidence: float
    compared: str
    allowed: str
    met: bool


class CampaignExpectation(Spec):
    """A statistic of all cases and its bounds."""

    label: str | None = None
    """What is judged, in words; made from the fields when left out."""
    confidence: Confidence = 0.95
    """Confidence of the two-sided interval of the statistic."""
    compare: Literal["interval", "estimate"] = "estimate"
    """What the bounds are compared with: the limit of the confidence interval that is nearer to the bound's
    wrong side, so that the bound holds with this confidence; or the estimate itself."""

    of_figure: ClassVar[bool] = True

    @property
    def lowest(self) -> float | None:
        """The smallest statistic that is allowed."""
        raise NotImplementedError

    @property
    def highest(self) -> float | None:
        """The largest statistic that is allowed."""
        raise NotImplementedError

    def describe(self) -> str:
        """The label, or one made from the fields."""
        raise NotImplementedError

    def verdict(
        self, success: NDArray[np.bool_], figures: Mapping[str, Array], units: Mapping[str, str]
    ) -> CampaignVerdict:
        """Judge all cases.

        Args:
            success: of each case, shape (R,).
            figures: of each case by name, shape (R,) each; NaN where a case does not give one.
            units: of the figures, by name.
        """
        raise NotImplementedError

    def _judged(self, unit: str, low: float, estimates: tuple[float, float], high: float) -> CampaignVerdict:
        """A verdict by the statistic for the bound `above` and for the bound `below`."""
        for_above, for_below = estimates
        by_interval = self.compare == "interval"
        allowed, met = [], True
        if self.lowest is not None:
            met = met and (low if by_interval else for_above) >= self.lowest
            allowed.append(f"≥ {self.lowest:g}")
        if self.highest is not None:
            met = met and (high if by_interval else for_below) <= self.highest
            allowed.append(f"≤ {self.highest:g}")
        statistic = for_above if self.lowest is not None else for_below
        compared = f"limit of the {100 * self.confidence:g} % interval" if by_interval else "estimate"
        return CampaignVerdict(
            self.describe(), unit, statistic, low, high, self.confidence, compared, " and ".join(allowed), met
        )

    def _has_bound(self) -> None:
        if self.lowest is None and self.highest is None:
            raise ValueError("give a bound: above, below, or both")
        if self.lowest is not None and self.highest is not None and self.lowest > self.highest:
            raise ValueError(f"above {self.lowest:g} and below {self.highest:g} allow nothing")


class SuccessRateSpec(CampaignExpectation):
    """Part of the cases that succeed, with a binomial confidence interval."""

    of_figure: ClassVar[bool] = False

    kind: Literal["success_rate"] = "success_rate"
    above: Fraction | None = None
    """The rate has to be at least this."""
    below: Fraction | None = None
    """The rate has to be at most this."""
    interval: Literal["wilson", "clopper_pearson"] = "wilson"
    """How the interval is computed: Wilson's score, or Clopper and Pearson's exact one, which is wider."""
    compare: Literal["interval", "estimate"] = "interval"
    """What the bounds are compared with: `above` with the lower limit of the confidence interval and `below`
    with the upper one, so that the bound holds with this confidence; or the rate of these cases itself."""

    @model_validator(mode="after")
    def _bounded(self) -> "SuccessRateSpec":
        self._has_bound()
        return self

    @property
    def lowest(self) -> float | None:
        return self.above

    @property
    def highest(self) -> float | None:
        return self.below

    def describe(self) -> str:
        return self.label or "success rate"

    def verdict(
        self, success: NDArray[np.bool_], figures: Mapping[str, Array], units: Mapping[str, str]
    ) -> CampaignVerdict:
        rate, low, high = success_rate(success, self.confidence, self.interval)
        return self._judged("", low, (rate, rate), high)


class OfFigure(CampaignExpectation):
    """A statistic of one figure over all cases."""

    figure: str
    """Name of a figure of the campaign, or label of an expectation of the scenario."""
    above: Number | None = None
    """The statistic has to be at least this, in the unit of the figure."""
    below: Number | None = None
    """The statistic has to be at most this, in the unit of the figure."""

    @model_validator(mode="after")
    def _bounded(self) -> "OfFigure":
        self._has_bound()
        return self

    @property
    def lowest(self) -> float | None:
        return self.above

    @property
    def highest(self) -> float | None:
        return self.below


class PercentileSpec(OfFigure):
    """A percentile of a figure. A case without the figure counts as beyond every bound."""

    kind: Literal["percentile"] = "percentile"
    percentile: Annotated[float, Field(gt=0.0, lt=100.0)]
    """Part of the cases that have a smaller figure, percent."""

    def describe(self) -> str:
        return self.label or f"{self.percentile:g} % percentile of {self.figure}"

    def verdict(
        self, success: NDArray[np.bool_], figures: Mapping[str, Array], units: Mapping[str, str]
    ) -> CampaignVerdict:
        found = figures[self.figure]
        missing = ~np.isfinite(found)
        # What a case does not give is taken for the worst: low for a bound below, high for one above.
        lowest, highest = np.where(missing, -np.inf, found), np.where(missing, np.inf, found)
        low, _ = percentile_interval(lowest, self.percentile, self.confidence)
        _, high = percentile_interval(highest, self.percentile, self.confidence)
        estimates = _percentile(lowest, self.percentile), _percentile(highest, self.percentile)
        return self._judged(units.get(self.figure, ""), low, estimates, high)


class MeanSpec(OfFigure):
    """Mean of a figure, with the interval of Student's t; missed when a case does not give the figure."""

    kind: Literal["mean"] = "mean"

    def describe(self) -> str:
        return self.label or f"mean of {self.figure}"

    def verdict(
        self, success: NDArray[np.bool_], figures: Mapping[str, Array], units: Mapping[str, str]
    ) -> CampaignVerdict:
        mean, low, high = mean_interval(figures[self.figure], self.confidence)
        return self._judged(units.get(self.figure, ""), low, (mean, mean), high)


def success_rate(
    success: NDArray[np.bool_], confidence: float, interval: Literal["wilson", "clopper_pearson"]
) -> tuple[float, float, float]:
    """Part of the cases that succeed, and its two-sided confidence interval.

    Args:
        success: of each case, shape (R,).
        confidence: of the interval, such as 0.95.
        interval: Wilson's score interval, or that of Clopper and Pearson.

    Returns:
        Rate, lower limit, upper limit; NaN, 0 and 1 without cases.

    Source: Wilson 1927; Clopper & Pearson 1934; computed by scipy.stats.binomtest.
    """
    from scipy.stats import binomtest  # noqa: PLC0415  slow to import, and not needed in flight

    if not len(success):
        return math.nan, 0.0, 1.0
    test = binomtest(int(np.count_nonzero(success)), len(success))
    method: Literal["wilson", "exact"] = "wilson" if interval == "wilson" else "exact"
    limits = test.proportion_ci(confidence_level=confidence, method=method)
    return float(np.mean(success)), float(limits.low), float(limits.high)


def percentile_interval(values: Array, percentile: float, confidence: float) -> tuple[float, float]:
    """Confidence interval of a percentile between two order statistics, for any distribution.

    Args:
        values: shape (R,).
        percentile: percent.
        confidence: of the interval; the interval has at least this.

    Returns:
        Lower and upper limit; infinite where there are too few values for a limit.

    Source: David & Nagaraja, Order Statistics, section 7.1.
    """
    from scipy.stats import binom  # noqa: PLC0415  slow to import, and not needed in flight

    ordered, tail = np.sort(values), 0.5 * (1.0 - confidence)
    count, part = len(ordered), percentile / 100.0
    # The k-th smallest value is above the percentile with the probability that fewer than k are below it.
    low = int(binom.ppf(tail, count, part)) if count else 0
    high = int(binom.ppf(1.0 - tail, count, part)) + 1 if count else 1
    lower = float(ordered[low - 1]) if low >= 1 else -math.inf
    upper = float(ordered[high - 1]) if high <= count else math.inf
    return lower, upper


def mean_interval(values: Array, confidence: float) -> tuple[float, float, float]:
    """Mean and its two-sided confidence interval by Student's t.

    Args:
        values: shape (R,).
        confidence: of the interval.

    Returns:
        Mean, lower limit, upper limit; infinite limits for fewer than two values, NaN for a value that is not
        finite.
    """
    from scipy.stats import t  # noqa: PLC0415  slow to import, and not needed in flight

    if not len(values) or not np.all(np.isfinite(values)):
        return math.nan, math.nan, math.nan
    mean = float(np.mean(values))
    if len(values) < 2:
        return mean, -math.inf, math.inf
    half = float(t.ppf(0.5 + 0.5 * confidence, len(values) - 1) * np.std(values, ddof=1))
    half /= math.sqrt(len(values))
    return mean, mean - half, mean + half


def _percentile(values: Array, percentile: float) -> float:
    """Between order statistics; infinite where cases without a figure reach so far."""
    if not len(values):
        return math.nan
    # Between a number and infinity there is no number.
    towards: Literal["linear", "higher", "lower"] = "linear"
    if not np.all(np.isfinite(values)):
        towards = "higher" if values.max() == math.inf else "lower"
    return float(np.percentile(values, percentile, method=towards))


def judge(
    expectations: Sequence[CampaignExpectation],
    success: NDArray[np.bool_],
    figures: Mapping[str, Array],
    units: Mapping[str, str],
) -> list[CampaignVerdict]:
    """Judge all cases of a campaign, or those that have been flown.

    Args:
        expectations: of the campaign.
        success: of each case, shape (R,).
        figures: of each case by name, shape (R,) each; NaN where a case does not give one.
        units: of the figures, by name.

    Returns:
        A verdict for each expectation, in order.
    """
    return [expectation.verdict(success, figures, units) for expectation in expectations]
