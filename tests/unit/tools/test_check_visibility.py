# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""`check` warns of lines of sight that are blocked all the time."""

from flights import shipped
from satform_tools.check.visibility import visibility_warnings


def test_a_margin_that_the_orbit_does_not_keep_is_warned_of() -> None:
    scenario = shipped("triangle_inertial")
    height = scenario.orbit.altitude
    assert visibility_warnings(scenario) == []
    assert visibility_warnings(scenario.with_({"line_of_sight_margin": height - 1.0})) == []
    (sentence,) = visibility_warnings(scenario.with_({"line_of_sight_margin": height + 1.0}))
    assert sentence.startswith("line_of_sight_margin: ")
    assert f"perigee altitude of {height / 1e3:.0f} km" in sentence
    lower = {"line_of_sight_margin": height - 1.0, "dynamics.chief.eccentricity": 0.001}
    assert len(visibility_warnings(scenario.with_(lower))) == 1
