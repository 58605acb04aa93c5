# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Inertial states and relative elements of all satellites at one step, as the record gives them of all."""

from dataclasses import dataclass
from datetime import datetime

import numpy as np

from satform.flight.plant import Plant
from satform.numeric.elementwise import Array
from satform.numeric.stacking import item
from satform.orbits.chief import KeplerianChief
from satform.orbits.frames import LvlhFrame
from satform.orbits.inertial_motion import ChiefMotion, frames_of, unperturbed
from satform.scenario import Scenario
from satform.scenario.environment import environment_of


@dataclass(frozen=True)
class OrbitStates:
    """What the inertial states of a flight follow from.

    Attributes:
        epoch: date and time of time zero.
        step: control period, s.
        chief: whose unperturbed orbit is the chief's where the truth model does not propagate one; None where
            it does.
    """

    epoch: datetime
    step: float
    chief: KeplerianChief | None

    def chief_frame(self, plant: Plant) -> LvlhFrame:
        """LVLH in inertial space at the plant's present step."""
        own = plant.chief_frame()
        if own is not None:
            return own
        assert self.chief is not None  # noqa: S101 - otherwise there is no plan of these states
        return item(unperturbed(self.chief, np.array([plant.step * self.step])), 0)

    def at(self, plant: Plant) -> tuple[Array, Array, Array]:
        """States of all satellites at the plant's present step.

        Returns:
            Position in m and velocity in m/s, GCRF, shapes (N, 3); osculating relative elements times the
            chief's semi-major axis, m, shape (N, 6), NaN where they are undefined.
        """
        chief, motion = ChiefMotion(self.epoch, frames_of([self.chief_frame(plant)])), plant.motion()
        position, velocity = chief.of_satellites(motion.position[None], motion.velocity[None])
        return position[0], velocity[0], chief.relative_elements(position, velocity)[0]


def epoch_of(scenario: Scenario) -> datetime | None:
    """Date and time of time zero; None where the scenario has none."""
    environment = environment_of(scenario.dynamics)
    if environment is not None:
        return environment.epoch
    return None if scenario.orbit.chief is None else scenario.orbit.chief.time_zero


def unperturbed_chief(scenario: Scenario) -> KeplerianChief | None:
    """The chief's orbit of time zero; None where the scenario does not say in which plane it moves."""
    given = scenario.orbit.chief
    return scenario.chief if given is None else given.orbit.keplerian(given.mean_motion)


def orbit_states(scenario: Scenario) -> OrbitStates | None:
    """What the inertial states of a flight follow from, step by step; None as in `chief_motion`."""
    epoch, chief = epoch_of(scenario), unperturbed_chief(scenario)
    if epoch is None:
        return None
    return OrbitStates(epoch, scenario.timing.step, chief)
