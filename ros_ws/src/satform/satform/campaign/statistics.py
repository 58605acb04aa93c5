# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Confidence intervals of statistics over cases: of a success rate, a percentile and a mean.

They hold for cases drawn independently of each other.
"""

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from satform.numeric.elementwise import Array


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
