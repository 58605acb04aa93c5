# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What is expected of all cases of a campaign together: success rate, percentiles and means of figures."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, model_validator

from satform.campaign.statistics import mean_interval, percentile_interval, success_rate
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
        low: lower limit of the confidence interval; NaN where the sampling is not random.
        high: upper limit of it; NaN likewise.
        confidence: of the interval.
        compared: which of them the bounds were compared with, in words.
        allowed: what was expected, in words.
        met: whether it is allowed.
        origin: where the bounds come from, in words.
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
    origin: str = ""


class CampaignExpectation(Spec):
    """A statistic of all cases and its bounds."""

    model_config = ConfigDict(
        json_schema_extra={"anyOf": [{"required": ["source"]}, {"required": ["regression"]}]}
    )

    label: str | None = None
    """What is judged, in words; made from the fields when left out."""
    above: Number | None = None
    """The statistic has to be at least this, in the unit of the figure."""
    below: Number | None = None
    """The statistic has to be at most this, in the unit of the figure."""
    confidence: Confidence = 0.95
    """Confidence of the two-sided interval of the statistic."""
    compare: Literal["interval", "estimate"] = "estimate"
    """What the bounds are compared with: the limit of the confidence interval that is nearer to the bound's
    wrong side, so that the bound holds with this confidence; or the estimate itself. The samplings `grid` and
    `one_at_a_time` have no interval."""
    source: Annotated[str, Field(min_length=1)] | None = None
    """Where the bounds come from: requirement, paper, theory, another program. Left out with `regression`."""
    regression: bool = False
    """Whether the bounds follow what this software gave, to notice changes; no source is named then."""

    @model_validator(mode="after")
    def _has_one_origin(self) -> "CampaignExpectation":
        if self.regression and self.source is not None:
            raise ValueError("bounds have a source or follow what this software gave, not both")
        return self

    @property
    def origin(self) -> str:
        """Where the bounds come from, in words; empty where nothing says so."""
        return "regression bound of this software" if self.regression else (self.source or "")

    of_figure: ClassVar[bool] = True

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
        if self.above is not None:
            met = met and (low if by_interval else for_above) >= self.above
            allowed.append(f"≥ {self.above:g}")
        if self.below is not None:
            met = met and (high if by_interval else for_below) <= self.below
            allowed.append(f"≤ {self.below:g}")
        statistic = for_above if self.above is not None else for_below
        compared = f"limit of the {100 * self.confidence:g} % interval" if by_interval else "estimate"
        return CampaignVerdict(
            label=self.describe(),
            unit=unit,
            statistic=statistic,
            low=low,
            high=high,
            confidence=self.confidence,
            compared=compared,
            allowed=" and ".join(allowed),
            met=met,
            origin=self.origin,
        )

    @model_validator(mode="after")
    def _has_bound(self) -> "CampaignExpectation":
        if self.above is None and self.below is None:
            raise ValueError("give a bound: above, below, or both")
        if self.above is not None and self.below is not None and self.above > self.below:
            raise ValueError(f"above {self.above:g} and below {self.below:g} allow nothing")
        return self


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
    with the upper one, so that the bound holds with this confidence; or the rate of these cases itself. The
    samplings `grid` and `one_at_a_time` have no interval, and always compare the rate itself."""

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
    *,
    is_random: bool = True,
) -> list[CampaignVerdict]:
    """Judge all cases of a campaign, or those that have been flown.

    Args:
        expectations: of the campaign.
        success: of each case, shape (R,).
        figures: of each case by name, shape (R,) each; NaN where a case does not give one.
        units: of the figures, by name.
        is_random: whether the cases are drawn at random. If not, no statistic has an interval, and estimates
            are compared.

    Returns:
        A verdict for each expectation, in order.
    """
    if is_random:
        return [expectation.verdict(success, figures, units) for expectation in expectations]
    verdicts = (by_estimate(expectation).verdict(success, figures, units) for expectation in expectations)
    return [replace(verdict, low=math.nan, high=math.nan) for verdict in verdicts]


def by_estimate(expectation: CampaignExpectation) -> CampaignExpectation:
    """The expectation with its bounds compared with the estimate."""
    return expectation.model_copy(update={"compare": "estimate"})
