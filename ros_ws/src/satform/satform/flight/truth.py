# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The truth model of a scenario, built."""

from satform.dynamics.protocol import Dynamics
from satform.scenario.model import Scenario


def truth_model(scenario: Scenario) -> Dynamics:
    """The model that moves the satellites of a flight."""
    return scenario.dynamics.build(scenario.dynamics_setting)
