# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A scenario: the one file from which a run follows, as a typed model, its loader and its errors.

Imports `record` and below.
"""

from satform.scenario.errors import Problem, ScenarioError
from satform.scenario.loader import load_scenario, parse_scenario, save_scenario
from satform.scenario.model import Scenario
from satform.scenario.parts import Orbit, SatelliteSpec, Timing

__all__ = [
    "Orbit",
    "Problem",
    "SatelliteSpec",
    "Scenario",
    "ScenarioError",
    "Timing",
    "load_scenario",
    "parse_scenario",
    "save_scenario",
]
