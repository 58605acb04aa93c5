# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The chief's motion in a flight, computed once more from the scenario: no command acts on a chief."""

from dataclasses import replace
from functools import partial

import numpy as np

from satform.flight.compile import truth_model
from satform.numeric.elementwise import Array
from satform.orbits.inertial_motion import ChiefMotion, unperturbed
from satform.record.flight_record import FlightRecord
from satform.scenario.environment import environment_of
from satform.scenario.model import Scenario


def chief_motion(scenario: Scenario, steps: int) -> ChiefMotion | None:
    """The chief of a flight in inertial space, bitwise as the truth model has it.

    Args:
        scenario: that is flown.
        steps: K, up to which it is computed.

    Returns:
        None where the scenario has no epoch or does not say in which plane the chief moves. Where the truth
        model does not propagate a chief, the unperturbed orbit of time zero.
    """
    environment = environment_of(scenario.dynamics)
    given = scenario.orbit.chief
    if environment is not None:
        epoch = environment.epoch
    elif given is not None:
        epoch = given.time_zero
    else:
        return None
    frames = truth_model(scenario).chief_frames(steps)
    if frames is not None:
        return ChiefMotion(epoch, frames)
    chief = scenario.chief if given is None else given.orbit.keplerian(given.mean_motion)
    if chief is None:
        return None
    times: Array = np.arange(steps + 1, dtype=np.float64) * scenario.timing.step
    return ChiefMotion(epoch, unperturbed(chief, times), nominal=True)


def with_chief(record: FlightRecord, scenario: Scenario) -> FlightRecord:
    """A record that can compute its chief's motion, and with it inertial states and relative elements.

    Args:
        record: of a flight.
        scenario: that was flown.
    """
    return replace(record, chief_source=partial(chief_motion, scenario))
