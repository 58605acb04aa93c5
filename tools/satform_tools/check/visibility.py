# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about lines of sight that the report would show as blocked all the time."""

from satform.orbits.earth import EQUATORIAL_RADIUS
from satform.scenario import Scenario


def visibility_warnings(scenario: Scenario) -> list[str]:
    """A sentence where lines of sight have to keep a height that the chief's orbit does not have."""
    margin, chief = scenario.line_of_sight_margin, scenario.chief
    eccentricity = 0.0 if chief is None else chief.eccentricity
    perigee = scenario.orbit.radius * (1.0 - eccentricity) - EQUATORIAL_RADIUS
    if not 0.0 < perigee <= margin:
        return []
    return [
        f"line_of_sight_margin: {margin / 1e3:g} km is not below the chief's perigee altitude of "
        f"{perigee / 1e3:.0f} km, where every line of sight between satellites counts as blocked"
    ]
