# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Statistical expectations: rates and figures with their confidence intervals, and verdicts by them."""

import math
from typing import Any

import numpy as np
import pytest
import scipy.stats
from pydantic import TypeAdapter, ValidationError

from satform.campaign.expectations import (
    CampaignExpectation,
    CampaignVerdict,
    judge,
    mean_interval,
    percentile_interval,
    success_rate,
)
from satform.common.spec import specs


def made(kind: str, **fields: Any) -> CampaignExpectation:
    spec = specs("satform.campaign_expectations")[kind]
    found: CampaignExpectation = TypeAdapter(spec).validate_python({"kind": kind, **fields})
    return found


def verdict(expectation: CampaignExpectation, figure: Any = (), success: Any = ()) -> CampaignVerdict:
    flown = np.array(success, dtype=bool)
    return judge([expectation], flown, {"dv": np.array(figure, dtype=float)}, {"dv": "m/s"})[0]


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


@pytest.mark.parametrize(("runs", "met"), [(20, False), (400, True)])
def test_a_success_rate_holds_with_confidence_only_with_enough_runs(runs: int, met: bool) -> None:
    success = np.ones(runs, dtype=bool)
    found = verdict(made("success_rate", above=0.95), success=success)
    assert found.met is met
    assert found.statistic == 1.0
    assert "interval" in found.compared
    assert verdict(made("success_rate", above=0.95, compare="estimate"), success=success).met


def test_a_rate_can_be_bounded_from_above() -> None:
    few = np.arange(1000) < 5
    assert verdict(made("success_rate", below=0.02), success=few).met
    assert not verdict(made("success_rate", below=0.006), success=few).met


def test_without_cases_nothing_is_met() -> None:
    assert not verdict(made("success_rate", above=0.1, compare="estimate")).met
    assert not verdict(made("success_rate", above=0.1)).met
    assert not verdict(made("percentile", figure="dv", percentile=50, below=3)).met
    assert not verdict(made("mean", figure="dv", below=3)).met


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


def test_a_percentile_is_between_the_figures() -> None:
    figures = np.arange(101.0)
    found = verdict(made("percentile", figure="dv", percentile=95, below=95.0), figures)
    assert (found.statistic, found.met, found.unit) == (95.0, True, "m/s")
    assert not verdict(made("percentile", figure="dv", percentile=95, below=94.9), figures).met
    assert not verdict(
        made("percentile", figure="dv", percentile=95, below=95.0, compare="interval"), figures
    ).met


def test_a_case_without_the_figure_is_on_the_wrong_side_of_every_bound() -> None:
    figures = np.where(np.arange(100) < 10, np.nan, 1.0)
    assert not verdict(made("percentile", figure="dv", percentile=95, below=2.0), figures).met
    assert not verdict(made("percentile", figure="dv", percentile=5, above=0.5), figures).met
    assert verdict(made("percentile", figure="dv", percentile=85, below=2.0), figures).met
    assert verdict(made("percentile", figure="dv", percentile=15, above=0.5), figures).met
    assert not verdict(made("mean", figure="dv", below=2.0), figures).met


def test_the_interval_of_a_mean_is_students() -> None:
    values = np.random.default_rng(1).normal(5.0, 2.0, 30)
    mean, low, high = mean_interval(values, 0.95)
    theirs = scipy.stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert (mean, low, high) == pytest.approx((values.mean(), theirs.low, theirs.high))
    assert verdict(made("mean", figure="dv", above=low - 0.01, compare="interval"), values).met
    assert not verdict(made("mean", figure="dv", above=low + 0.01, compare="interval"), values).met


@pytest.mark.parametrize("kind", ["success_rate", "mean", "percentile"])
def test_an_expectation_needs_a_bound_that_allows_something(kind: str) -> None:
    fields: dict[str, Any] = {} if kind == "success_rate" else {"figure": "dv"}
    fields |= {"percentile": 50} if kind == "percentile" else {}
    with pytest.raises(ValidationError, match="give a bound"):
        made(kind, **fields)
    with pytest.raises(ValidationError, match="allow nothing"):
        made(kind, **fields, above=0.9, below=0.1)
