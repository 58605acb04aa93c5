# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors of estimated distances and relative positions, by hand and of a flight."""

import math
from dataclasses import replace

import numpy as np
import pytest

from flights import shortened
from satform.evaluation.navigation import RelativeNavigationError
from satform.flight.simulate import simulate
from satform.record.navigation_history import NavigationHistory
from scenario_problems import TRIANGLE, problems


def expectation(**fields):
    return RelativeNavigationError(below=1.0, source="none", **fields)


@pytest.fixture(scope="module")
def record():
    """A flight of three satellites, of which the first two have filters with errors that are known."""
    flown = simulate(shortened("triangle", 30.0))
    steps, rng = flown.steps, np.random.default_rng(4)
    history = NavigationHistory.empty(steps, 3, 0)
    truth = np.concatenate((flown.position[:steps], flown.velocity[:steps]), axis=-1)
    for satellite in range(2):
        history.mean[:, satellite] = (truth + rng.normal(size=truth.shape)).reshape(steps, -1)
    return replace(flown, navigation=history)


def errors(record, satellite, pair):
    """Range errors and position errors of a pair by a filter, m, from the numbers in the record."""
    first, second = pair
    estimates = record.navigation.mean[:, satellite].reshape(record.steps, 3, 6)[..., :3]
    found = estimates[:, second] - estimates[:, first]
    true = record.position[: record.steps, second] - record.position[: record.steps, first]
    ranges = np.linalg.norm(found, axis=1) - np.linalg.norm(true, axis=1)
    return np.abs(ranges), np.linalg.norm(found - true, axis=1)


def test_the_figures_are_those_of_the_filters_of_the_pair(record):
    of_range = [errors(record, satellite, (0, 1))[0] for satellite in (0, 1)]
    of_position = [errors(record, satellite, (0, 1))[1] for satellite in (0, 1)]
    pair = (record.satellites[0], record.satellites[1])
    assert expectation(satellites=pair).measure(record) == pytest.approx(max(own.max() for own in of_range))
    rms = expectation(satellites=pair, component="position", statistic="rms").measure(record)
    assert rms == pytest.approx(max(math.sqrt((own**2).mean()) for own in of_position))


def test_a_filter_of_the_own_motion_alone_does_not_count(record):
    pair = (record.satellites[1], record.satellites[2])
    assert expectation(satellites=pair).measure(record) == pytest.approx(errors(record, 1, (1, 2))[0].max())


def test_all_pairs_are_meant_when_none_is_named(record):
    largest = max(
        errors(record, satellite, pair)[0][10:].max()
        for pair in ((0, 1), (0, 2), (1, 2))
        for satellite in pair
        if satellite < 2
    )
    after = 10 * record.step
    assert expectation(after=after).measure(record) == pytest.approx(largest)


def test_a_flight_without_such_filters_has_no_figure():
    assert math.isnan(expectation().measure(simulate(shortened("triangle", 30.0))))


def test_a_scenario_without_such_filters_cannot_expect_a_figure_of_them():
    expected = "\nexpect:\n  - {kind: relative_navigation_error, below: 1.0, source: none}\n"
    (problem,) = problems(TRIANGLE[: TRIANGLE.index("\nexpect:")] + expected)
    assert "no filter of sat1, sat2, sat3 estimates the formation" in problem.sentence
