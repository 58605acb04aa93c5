# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about scenarios that are valid but unwise: one module a subject, put together here.

A module gives a function that takes the scenario and returns sentences, each with the field it is about;
it is listed in `SUBJECTS`, in whose order the sentences are printed.
"""

from collections.abc import Callable

from satform.scenario import Scenario
from satform_tools.check.consensus import consensus_warnings
from satform_tools.check.controllers import controller_warnings
from satform_tools.check.disturbances import disturbance_warnings
from satform_tools.check.earth_orientation import earth_orientation_warnings
from satform_tools.check.external_satellites import external_satellite_warnings
from satform_tools.check.filters import filter_warnings
from satform_tools.check.integration import integration_warnings
from satform_tools.check.linearisation import linearisation_warnings
from satform_tools.check.link_directions import link_direction_warnings
from satform_tools.check.neighbour_accelerations import neighbour_acceleration_warnings
from satform_tools.check.observability import observability_warnings
from satform_tools.check.pointing import pointing_warnings
from satform_tools.check.predictive_plans import predictive_plan_warnings
from satform_tools.check.sampling import sampling_warnings
from satform_tools.check.sensors import sensor_warnings
from satform_tools.check.start import start_warnings
from satform_tools.check.thrust import thrust_warnings
from satform_tools.check.times import time_warnings
from satform_tools.check.visibility import visibility_warnings

SUBJECTS: tuple[Callable[[Scenario], list[str]], ...] = (
    start_warnings,
    time_warnings,
    consensus_warnings,
    disturbance_warnings,
    controller_warnings,
    linearisation_warnings,
    integration_warnings,
    earth_orientation_warnings,
    sampling_warnings,
    thrust_warnings,
    predictive_plan_warnings,
    filter_warnings,
    sensor_warnings,
    neighbour_acceleration_warnings,
    observability_warnings,
    pointing_warnings,
    link_direction_warnings,
    visibility_warnings,
    external_satellite_warnings,
)
"""Every subject that is looked at."""


def warnings(scenario: Scenario) -> list[str]:
    """Sentences about what is unwise in a scenario; none when all is well."""
    return [sentence for subject in SUBJECTS for sentence in subject(scenario)]
