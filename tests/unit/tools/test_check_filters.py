# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about filters whose model lacks an acceleration, about an eccentric chief."""

import numpy as np
import pytest

from flights import shipped
from satform.flight.compile_satellite import flight_plan
from satform.scenario import Scenario
from satform_tools.check.filters import filter_warnings, unmodelled_acceleration


def largest(scenario: Scenario, index: int) -> float:
    """Largest unmodelled acceleration of a satellite's filter, m/s^2."""
    estimator = flight_plan(scenario, index).estimator
    assert estimator is not None
    found = unmodelled_acceleration(scenario, {index: estimator})[index]
    return float(np.linalg.norm(found.acceleration, axis=-1).max())


def test_each_filter_of_eccentric_navigation_is_warned_of_that_is_inconsistent_in_the_flight() -> None:
    """Whose satellites begin by `start`, near the apogee, and pass the perigee."""
    circular, keplerian = filter_warnings(shipped("eccentric_navigation"))
    assert circular.startswith("filter of circular: ")
    assert keplerian.startswith("filter of keplerian: ")
    # Its flight has 350 on average after the perigee.
    assert 350.0 < float(keplerian.split("up to about ")[1].split()[0]) < 1500.0


def test_the_acceleration_is_that_of_a_whole_revolution_wherever_it_begins() -> None:
    found = []
    for anomaly in (np.pi, 0.0):
        scenario = shipped("eccentric_navigation").with_(
            {"dynamics.chief.argument_of_latitude": 0.7 + anomaly, "timing.duration": 28080.0}
        )
        found.append(largest(scenario, 1))
    # The satellite's own motion about the chief differs with where it begins.
    assert found[0] == pytest.approx(found[1], rel=0.5)
    assert min(found) > 3e-8
