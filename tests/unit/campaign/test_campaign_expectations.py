# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Statistical expectations of a campaign: rates, percentiles and means are compared with their bounds."""

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from satform.campaign.expectations import (
    CampaignExpectation,
    CampaignVerdict,
    judge,
)
from satform.campaign.statistics import mean_interval
from satform.common.spec import specs


def made(kind: str, **fields: Any) -> CampaignExpectation:
    spec = specs("satform.campaign_expectations")[kind]
    found: CampaignExpectation = TypeAdapter(spec).validate_python({"kind": kind, **fields})
    return found


def verdict(expectation: CampaignExpectation, figure: Any = (), success: Any = ()) -> CampaignVerdict:
    flown = np.array(success, dtype=bool)
    return judge([expectation], flown, {"dv": np.array(figure, dtype=float)}, {"dv": "m/s"})[0]


@pytest.mark.parametrize(("runs", "met"), [(20, False), (400, True)])
def test_a_success_rate_holds_with_confidence_only_with_enough_runs(runs: int, met: bool) -> None:
    success = np.ones(runs, dtype=bool)
    found = verdict(made("success_rate", above=0.95), success=success)
    assert found.met is met
    assert found.statistic == 1.0
    assert "interval" in found.compared
    assert verdict(made("success_rate", above=0.95, compare="estimate"), success=success).met


def test_a_verdict_says_where_its_bounds_come_from() -> None:
    success = [True, False]
    for fields, origin in (
        ({"source": "a paper"}, "a paper"),
        ({"regression": True}, "regression bound of this software"),
        ({}, ""),
    ):
        expectation = made("success_rate", above=0.4, compare="estimate", **fields)
        assert verdict(expectation, success=success).origin == expectation.origin == origin


def test_a_rate_can_be_bounded_from_above() -> None:
    few = np.arange(1000) < 5
    assert verdict(made("success_rate", below=0.02), success=few).met
    assert not verdict(made("success_rate", below=0.006), success=few).met


def test_without_cases_nothing_is_met() -> None:
    assert not verdict(made("success_rate", above=0.1, compare="estimate")).met
    assert not verdict(made("success_rate", above=0.1)).met
    assert not verdict(made("percentile", figure="dv", percentile=50, below=3)).met
    assert not verdict(made("mean", figure="dv", below=3)).met


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


def test_the_mean_is_judged_by_the_limits_of_its_interval() -> None:
    values = np.random.default_rng(1).normal(5.0, 2.0, 30)
    _, low, _ = mean_interval(values, 0.95)
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


def test_cases_that_are_not_random_are_judged_by_the_estimate_and_have_no_interval() -> None:
    success, figures = np.ones(20, dtype=bool), {"dv": np.arange(20.0)}
    expected = [made("success_rate", above=0.95), made("percentile", figure="dv", percentile=50, below=10.0)]
    assert [found.met for found in judge(expected, success, figures, {})] == [False, True]
    for found in judge(expected, success, figures, {}, is_random=False):
        assert (found.met, found.compared) == (True, "estimate")
        assert np.isnan([found.low, found.high]).all()
