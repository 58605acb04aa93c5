# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""An estimate of a neighbour is rejected when its covariance cannot be one."""

import numpy as np
import pytest

from flights import shortened
from satform.communication.covariance_check import covariance_complaint
from satform.communication.message_validator import RejectionCounter
from satform.communication.sim_time import Stamps
from satform.flight.compile import topic_plan
from satform.numeric.elementwise import Array
from satform_nodes.transport.message_forms import form_of, validator_of

STEP = 10
SIZE = 12
REASON = "a covariance that is not positive semidefinite"


def fields(covariance: Array, mean: float = 0.0) -> tuple[float, ...]:
    upper = covariance[np.triu_indices(len(covariance))]
    size = len(covariance)
    return (0, 0, 1, size, *[mean] * size, len(upper), *upper.tolist(), 0.0, 0.0, 0.0)


def with_eigenvalues(values: list[float], scale: float) -> Array:
    """A symmetric matrix of which the eigenvalues are given; rows have different units."""
    size = len(values)
    basis, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(size, size)))
    units = scale ** np.linspace(-1.0, 1.0, size)
    return np.asarray((basis * np.array(values)) @ basis.T * np.outer(units, units))


@pytest.mark.parametrize("scale", [1.0, 1e3])
@pytest.mark.parametrize(
    ("least", "reason"), [(1.0, ""), (1e-6, ""), (0.0, ""), (-1e-3, REASON), (-1.0, REASON)]
)
def test_eigenvalues_decide_whatever_the_units(scale: float, least: float, reason: str) -> None:
    assert covariance_complaint(fields(with_eigenvalues([1.0] * 11 + [least], scale))) == reason


@pytest.mark.parametrize(
    ("covariance", "reason"),
    [
        (np.zeros((2, 2)), ""),
        (np.diag([1.0, 0.0]), ""),
        (np.diag([1.0, -1e-12]), REASON),
        (np.array([[0.0, 1e-3], [1e-3, 1.0]]), REASON),
        (np.array([[1.0, 1.1], [1.1, 1.0]]), REASON),
        (np.array([[1e30, 0.0], [0.0, 1e-30]]), ""),
    ],
)
def test_special_cases(covariance: Array, reason: str) -> None:
    assert covariance_complaint(fields(covariance)) == reason


@pytest.mark.parametrize(
    ("covariance", "mean", "reason"),
    [
        (np.eye(SIZE), 0.0, None),
        (np.zeros((SIZE, SIZE)), 0.0, None),
        (-np.eye(SIZE), 0.0, REASON),
        (2.0 * np.ones((SIZE, SIZE)) - 1.5 * np.eye(SIZE), 0.0, REASON),
        (np.eye(SIZE) * np.nan, 0.0, "not finite"),
        (np.eye(SIZE), np.inf, "not finite"),
        (np.eye(SIZE) * 1e31, 0.0, "out of range"),
    ],
)
def test_receivers_count_why_an_estimate_is_rejected(
    covariance: Array, mean: float, reason: str | None
) -> None:
    plan, rejections = topic_plan(shortened("gnss_differential_pair", 100.0)), RejectionCounter()
    topic = "/chief/navigation_estimate"
    stamps = Stamps(float(STEP), STEP * 10**9)
    validator = validator_of("navigation_estimate", topic, plan, 0, rejections, stamps)
    data = form_of("navigation_estimate", plan, 0).pack(*fields(covariance, mean))
    assert (validator.validate(data, 0, 5) is None) == (reason is not None)
    assert dict(rejections.counts) == ({(topic, reason): 1} if reason else {})


def test_an_estimate_of_another_size_has_another_form() -> None:
    plan, rejections = topic_plan(shortened("gnss_differential_pair", 100.0)), RejectionCounter()
    form = form_of("navigation_estimate", plan, 0)
    stamps = Stamps(float(STEP), STEP * 10**9)
    validator = validator_of("navigation_estimate", "/chief/x", plan, 0, rejections, stamps)
    numbers = list(fields(np.eye(SIZE)))
    numbers[3] = SIZE - 1
    assert validator.validate(form.pack(*numbers), 0, 5) is None
    assert dict(rejections.counts) == {("/chief/x", "another form"): 1}
