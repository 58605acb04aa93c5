# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Confidence intervals of rates, percentiles and means over cases."""

import math

import numpy as np
import pytest
import scipy.stats

from satform.campaign.statistics import mean_interval, percentile_interval, success_rate


def test_the_interval_of_a_rate_is_wilsons() -> None:
    success = np.arange(50) < 47
    rate, low, high = success_rate(success, 0.95, "wilson")
    z, n, p = 1.959963984540054, 50, 0.94
    centre, half = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    assert rate == pytest.approx(0.94)
    assert (low, high) == pytest.approx(
        ((centre - half) / (1 + z * z / n), (centre + half) / (1 + z * z / n))
    )


def test_the_exact_interval_of_a_rate_is_that_of_clopper_and_pearson() -> None:
    _, low, high = success_rate(np.arange(50) < 47, 0.95, "clopper_pearson")
    assert low == pytest.approx(scipy.stats.beta.ppf(0.025, 47, 4))
    assert high == pytest.approx(scipy.stats.beta.ppf(0.975, 48, 3))


def test_the_interval_of_a_percentile_covers_it_as_often_as_it_says() -> None:
    generator = np.random.default_rng(4)
    true = float(scipy.stats.expon.ppf(0.9))
    covered = 0
    for _ in range(1500):
        low, high = percentile_interval(generator.exponential(size=120), 90.0, 0.9)
        covered += low <= true <= high
    # At least 90 %, and between order statistics not much more.
    assert 0.9 - 3 * math.sqrt(0.09 / 1500) < covered / 1500 < 0.96


def test_too_few_values_have_no_limit_of_a_high_percentile() -> None:
    assert percentile_interval(np.arange(20.0), 99.0, 0.95)[1] == math.inf


def test_the_interval_of_a_mean_is_students() -> None:
    values = np.random.default_rng(1).normal(5.0, 2.0, 30)
    theirs = scipy.stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert mean_interval(values, 0.95) == pytest.approx((values.mean(), theirs.low, theirs.high))
