# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Drawn values have the quantiles, moments and correlations of scipy's own distributions."""

import math
from typing import Any

import numpy as np
import pytest
import scipy.stats
from pydantic import TypeAdapter, ValidationError

from campaigns import campaign, of
from satform.campaign.cases import case_values
from satform.campaign.distributions import LARGEST_QUANTILE, LEAST_QUANTILE, Distribution
from satform.common.spec import specs

CASES: dict[str, tuple[dict[str, Any], Any]] = {
    "normal": (
        {"kind": "normal", "mean": 3.0, "standard_deviation": 2.0},
        scipy.stats.norm(3.0, 2.0),
    ),
    "uniform": ({"kind": "uniform", "low": -2.0, "high": 5.0}, scipy.stats.uniform(-2.0, 7.0)),
    "log_uniform": ({"kind": "log_uniform", "low": 1e-3, "high": 10.0}, scipy.stats.loguniform(1e-3, 10.0)),
    "truncated_normal": (
        {"kind": "truncated_normal", "mean": 1.0, "standard_deviation": 2.0, "low": 0.5, "high": 4.0},
        scipy.stats.truncnorm(-0.25, 1.5, 1.0, 2.0),
    ),
    "upper_tail": (
        {"kind": "truncated_normal", "mean": 0.0, "standard_deviation": 1.0, "low": 8.0, "high": 12.0},
        scipy.stats.truncnorm(8.0, 12.0),
    ),
    "lower_tail": (
        {"kind": "truncated_normal", "mean": 0.0, "standard_deviation": 1.0, "low": -12.0, "high": -8.0},
        scipy.stats.truncnorm(-12.0, -8.0),
    ),
    "choice": (
        {"kind": "choice", "values": [1.0, 2.0, 7.0], "weights": [1.0, 0.0, 3.0]},
        scipy.stats.rv_discrete(values=([1, 2, 7], [0.25, 0.0, 0.75])),
    ),
}


def made(data: dict[str, Any]) -> Distribution:
    return TypeAdapter(specs("satform.distributions")[data["kind"]]).validate_python(data)


def test_every_distribution_is_compared() -> None:
    assert {data["kind"] for data, _ in CASES.values()} == set(specs("satform.distributions"))


@pytest.mark.parametrize("name", CASES)
def test_the_value_of_a_quantile_is_that_of_scipy(name: str) -> None:
    data, theirs = CASES[name]
    own = made(data)
    quantiles = np.concatenate((np.linspace(0.001, 0.999, 333), [1e-12, 1.0 - 1e-12]))
    values = [own.value(float(quantile)) for quantile in quantiles]
    np.testing.assert_allclose(values, theirs.ppf(quantiles), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", CASES)
def test_values_at_the_ends_are_finite_and_within_the_bounds(name: str) -> None:
    data, theirs = CASES[name]
    for quantile in (LEAST_QUANTILE, LARGEST_QUANTILE):
        value = float(made(data).value(quantile))
        assert math.isfinite(value)
        assert theirs.support()[0] <= value <= theirs.support()[1]


@pytest.mark.parametrize("kind", ["monte_carlo", "latin_hypercube", "sobol"])
@pytest.mark.parametrize("name", CASES)
def test_the_cases_of_a_campaign_have_the_moments_of_the_distribution(name: str, kind: str) -> None:
    data, theirs = CASES[name]
    runs = 2000 if kind == "monte_carlo" else 512
    study = campaign(
        runs=runs, sampling={"kind": kind}, dispersions=[of("satellites[1].arc_length", data), *_others()]
    )
    drawn = np.array([case_values(study, n)["satellites[1].arc_length"] for n in range(runs)])
    mean, variance, _, kurtosis = (float(moment) for moment in theirs.stats(moments="mvsk"))
    # Four standard errors of the sample mean and variance; Sobol and Latin hypercube come closer.
    assert abs(drawn.mean() - mean) < 4.0 * math.sqrt(variance / runs)
    assert abs(drawn.var() - variance) < 4.0 * variance * math.sqrt((kurtosis + 2.0) / runs)


def _others() -> list[dict[str, Any]]:
    unit = {"kind": "uniform", "low": 0.0, "high": 1.0}
    return [of("satellites[2].arc_length", unit), of("satellites[*].position_error[*]", unit)]


@pytest.mark.parametrize("name", [name for name in CASES if name != "choice"])
def test_the_cases_of_a_campaign_have_the_shape_of_the_distribution(name: str) -> None:
    data, theirs = CASES[name]
    study = campaign(runs=2000, dispersions=[of("satellites[1].arc_length", data)])
    drawn = [case_values(study, n)["satellites[1].arc_length"] for n in range(2000)]
    assert scipy.stats.kstest(drawn, theirs.cdf).pvalue > 1e-3
    sampled = theirs.rvs(2000, random_state=np.random.default_rng(8))
    assert scipy.stats.ks_2samp(drawn, sampled).pvalue > 1e-3


def test_a_choice_has_its_weights() -> None:
    study = campaign(runs=4000, dispersions=[of("satellites[1].arc_length", CASES["choice"][0])])
    drawn = [case_values(study, n)["satellites[1].arc_length"] for n in range(4000)]
    counts = [drawn.count(value) for value in (1.0, 2.0, 7.0)]
    assert counts[1] == 0
    assert scipy.stats.binomtest(counts[0], 4000, 0.25).pvalue > 1e-3


def test_axes_are_independent_of_each_other() -> None:
    study = campaign(runs=2000, dispersions=_others())
    drawn = np.array([list(case_values(study, n).values())[:-1] for n in range(2000)])
    correlations = np.corrcoef(drawn.T) - np.eye(10)
    assert np.max(np.abs(correlations)) < 4.5 / math.sqrt(2000)


MATRIX = np.array([[1.0, 0.8, -0.3], [0.8, 1.0, 0.2], [-0.3, 0.2, 1.0]])


def correlated(last: dict[str, Any], **fields: Any) -> Any:
    normal = {"kind": "normal", "standard_deviation": 2.0}
    return campaign(
        runs=4096,
        dispersions=[
            of("satellites[0].arc_length", normal, name="a"),
            of("orbit.period", {"kind": "normal", "mean": 6000.0, "standard_deviation": 1.0}),
            of("satellites[2].arc_length", last, name="c"),
        ],
        correlated=[{"of": ["a", "orbit.period", "c"], "matrix": MATRIX.tolist()}],
        **fields,
    )


@pytest.mark.parametrize("kind", ["monte_carlo", "latin_hypercube", "sobol"])
def test_normal_distributions_have_the_given_correlations(kind: str) -> None:
    study = correlated({"kind": "normal", "standard_deviation": 5.0}, sampling={"kind": kind})
    drawn = np.array([list(case_values(study, n).values())[:-1] for n in range(4096)])
    # Standard error of a correlation r: (1 - r^2) / sqrt(n).
    found, error = np.corrcoef(drawn.T), (1.0 - MATRIX**2) / math.sqrt(4096)
    assert np.all(np.abs(found - MATRIX) <= 4.0 * error + 1e-12)
    np.testing.assert_allclose(drawn.std(axis=0), [2.0, 1.0, 5.0], rtol=4.0 / math.sqrt(2 * 4096))


def test_other_distributions_keep_their_shape_and_have_the_rank_correlations() -> None:
    study = correlated({"kind": "log_uniform", "low": 1.0, "high": 1e4})
    drawn = np.array([list(case_values(study, n).values())[:-1] for n in range(4096)])
    ranks = scipy.stats.spearmanr(drawn).statistic
    expected = 6.0 / math.pi * np.arcsin(0.5 * MATRIX)
    assert np.all(np.abs(ranks - expected) <= 4.0 / math.sqrt(4096))
    assert scipy.stats.kstest(drawn[:, 2], scipy.stats.loguniform(1.0, 1e4).cdf).pvalue > 1e-3


def test_the_fields_of_wildcards_are_correlated_one_by_one() -> None:
    normal = {"kind": "normal", "standard_deviation": 1.0}
    study = campaign(
        runs=4096,
        dispersions=[
            of("satellites[*].position_error[0]", normal, name="x"),
            of("satellites[*].velocity_error[1]", normal, name="vy"),
        ],
        correlated=[{"of": ["x", "vy"], "matrix": [[1.0, -0.9], [-0.9, 1.0]]}],
    )
    drawn = np.array([list(case_values(study, n).values())[:-1] for n in range(4096)])
    expected = np.eye(6)
    for index in range(3):
        expected[index, 3 + index] = expected[3 + index, index] = -0.9
    assert np.max(np.abs(np.corrcoef(drawn.T) - expected)) < 4.5 / math.sqrt(4096)


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        ({"kind": "uniform", "low": 2.0, "high": 1.0}, "low 2 is above high 1"),
        ({"kind": "log_uniform", "low": 0.0, "high": 1.0}, "greater than 0"),
        (
            {"kind": "truncated_normal", "standard_deviation": 1.0, "low": 40.0, "high": 50.0},
            "more than 30 standard deviations",
        ),
        ({"kind": "choice", "values": [1.0, 2.0], "weights": [1.0]}, "1 weights for 2 values"),
        ({"kind": "choice", "values": [1.0], "weights": [0.0]}, "every weight is zero"),
    ],
)
def test_a_distribution_without_values_is_refused(data: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValidationError, match=sentence):
        made(data)


def test_angles_are_written_in_degrees() -> None:
    rate = made({"kind": "normal", "mean": "0.06 deg/s", "standard_deviation": "1 deg/s"})
    assert rate.value(0.5) == pytest.approx(math.radians(0.06))
