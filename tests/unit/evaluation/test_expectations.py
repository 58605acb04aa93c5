# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What is expected of a flight can be missed: of shipped scenarios, and in general."""

import pytest

from flights import SCENARIOS, shipped
from satform.scenario import ScenarioError

NAMES = sorted(path.stem for path in SCENARIOS.glob("*.yaml"))
TIGHT = 0.02
"""Relative; the widest that a figure of this software's own may be off."""


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_expectation_is_missed_on_either_side_of_what_is_allowed(name: str) -> None:
    assert shipped(name).expect
    for expectation in shipped(name).expect:
        lowest, highest = expectation.smallest_allowed, expectation.largest_allowed
        beyond = 1e-6 * max(abs(highest), 1e-12)
        assert not expectation.verdict(highest + beyond).met, expectation.describe()
        # Nobody can promise what the wall clock makes of a flight but its bounds.
        if name != "realtime_triangle":
            assert not expectation.verdict(lowest - beyond).met, expectation.describe()
            assert expectation.verdict(0.5 * (lowest + highest)).met, expectation.describe()


@pytest.mark.parametrize("name", NAMES)
def test_a_figure_of_this_software_s_own_is_expected_within_little(name: str) -> None:
    for expectation in shipped(name).expect:
        if expectation.regression:
            assert expectation.value is not None
            width = expectation.largest_allowed - expectation.smallest_allowed
            assert width <= 2.0 * TIGHT * abs(expectation.value) * (1.0 + 1e-9), expectation.describe()


@pytest.mark.parametrize("index", range(len(shipped("compare_controllers").expect)))
def test_a_control_law_that_is_a_tenth_worse_than_it_was_is_noticed(index: int) -> None:
    expectation = shipped("compare_controllers").expect[index]
    assert expectation.value is not None
    assert not expectation.verdict(1.1 * expectation.value).met
    assert not expectation.verdict(0.9 * expectation.value).met


@pytest.mark.parametrize(
    ("name", "expected", "said"),
    [
        ("triangle", "{kind: navigation_error, below: 1.0", "sat1, sat2, sat3 have no sensor"),
        ("triangle", "{kind: estimation_error, below: 1.0", "sat1, sat2, sat3 have no sensor or navigation"),
        ("triangle", "{kind: pointing_error, below: 1.0", "sat1, sat2, sat3 have no attitude"),
        ("triangle", "{kind: saturated_steps, below: 1.0", "sat1, sat2, sat3 have no thruster"),
        (
            "triangle",
            "{kind: unsolved_plans, below: 1.0, satellites: [sat2]",
            "sat2 has no control law that makes plans",
        ),
        (
            "directed_triangle",
            "{kind: arc_length_spread, below: 1.0",
            "they have no arc lengths",
        ),
        ("directed_triangle", "{kind: arc_length_settling, below: 1.0", "they have no arc lengths"),
        (
            "geo_degree10",
            "{kind: delta_v, satellites: [coasting], below: 1.0",
            "cannot command anything",
        ),
        (
            "geo_degree10",
            "{kind: control, satellites: [coasting], below: 1.0",
            "cannot command anything",
        ),
        (
            "attitude_cape_canaveral",
            "{kind: wheel_saturation, limit: torque, value: 0.0, absolute: 0.0",
            "sat1 has no wheel_torque_limit to be met",
        ),
    ],
)
def test_what_would_be_met_whatever_happens_is_refused(name: str, expected: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        shipped(name, f"expect=[{expected}, source: a test}}]")
