# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about files of Earth orientation parameters that do not reach over the flight."""

from datetime import timedelta

from satform.dynamics.truth_models import CwPerturbedDynamicsSpec, InertialDynamicsSpec
from satform.scenario import Scenario


def earth_orientation_warnings(scenario: Scenario) -> list[str]:
    """A sentence where the flight begins before the first or ends after the last entry of its file."""
    spec = scenario.dynamics
    if not isinstance(spec, InertialDynamicsSpec | CwPerturbedDynamicsSpec):
        return []
    file = spec.gravity.orientation_file
    if file is None:
        return []
    from satform.orbits.earth_orientation import from_file  # noqa: PLC0415 - brahe is slow to import
    from satform.orbits.time_scales import brahe_epoch  # noqa: PLC0415

    orientation = from_file(file)
    moments = (spec.epoch, spec.epoch + timedelta(seconds=scenario.timing.duration))
    beyond = [moment for moment in moments if not orientation.covers(brahe_epoch(moment))]
    if not beyond:
        return []
    return [
        f"dynamics.gravity.orientation_file: {file.name} has no entry for {beyond[0].isoformat()}, within "
        "the flight; beyond its first and last entries the parameters are held"
    ]
