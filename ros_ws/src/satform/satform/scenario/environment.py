# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The one Sun and the one Earth of a scenario: where they stand at time zero, by the truth model's epoch.

A truth model with an epoch fixes both, and everything else in the scenario follows it. A model without
one, such as CW, knows no date: then a scenario gives the direction of the Sun itself, and Greenwich lies
on the inertial x axis at time zero.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from satform.attitude.ground_pointing import GroundPointingSpec, direction_of
from satform.attitude.satellite_pointing import SatellitePointingSpec
from satform.common.spec import Complaint
from satform.dynamics.protocol import DynamicsSpec
from satform.dynamics.truth_models import CwPerturbedDynamicsSpec, InertialDynamicsSpec
from satform.numeric.elementwise import Array
from satform.orbits.chief import as_utc, earth_angle_at
from satform.orbits.frames import EarthRotation
from satform.orbits.sun import days_at, sun_direction

Pointing = GroundPointingSpec | SatellitePointingSpec

SAME_DIRECTION = math.radians(1.0)
"""Angle within which two directions are one: the Sun moves by as much in a day."""


@dataclass(frozen=True)
class Environment:
    """Sun, Earth and chief at time zero.

    Attributes:
        epoch: of time zero, UTC.
        earth_angle: Earth rotation angle, rad.
        chief_axes: rows: the chief's radial, transverse and normal unit vectors, inertial, shape (3, 3).
    """

    epoch: datetime
    earth_angle: float
    chief_axes: Array

    def sun(self) -> Array:
        """Unit vector to the Sun, inertial, shape (3,)."""
        return sun_direction(days_at(self.epoch))


def environment_of(dynamics: DynamicsSpec) -> Environment | None:
    """Sun and Earth of a truth model; None where it has no epoch."""
    if not isinstance(dynamics, InertialDynamicsSpec | CwPerturbedDynamicsSpec):
        return None
    angle = dynamics.gravity.earth_angle
    axes = dynamics.chief.axes(dynamics.chief.argument_of_latitude)
    return Environment(
        epoch=as_utc(dynamics.epoch),
        earth_angle=earth_angle_at(dynamics.epoch) if angle is None else angle,
        chief_axes=np.stack(axes),
    )


def earth_rotation(dynamics: DynamicsSpec) -> EarthRotation | None:
    """The Earth's rotation, as the truth model has it; None where it has no epoch.

    Raises:
        ValueError: its file of Earth orientation parameters cannot be used.
    """
    if not isinstance(dynamics, InertialDynamicsSpec | CwPerturbedDynamicsSpec):
        return None
    from satform.dynamics.orbital_forces import gravity_of  # noqa: PLC0415  brahe is slow to import

    return gravity_of(dynamics.gravity, dynamics.epoch).rotation


def pointing_in(dynamics: DynamicsSpec, pointing: Pointing) -> Pointing:
    """A pointing task with the Sun and the Earth of the truth model.

    Args:
        dynamics: the truth model.
        pointing: as the scenario has it.

    Returns:
        The same where the truth model has no epoch.
    """
    environment = environment_of(dynamics)
    if environment is None:
        return pointing
    update: dict[str, object] = {"sun": tuple(_sun_for(environment, pointing).tolist())}
    if isinstance(pointing, GroundPointingSpec):
        for name in ("start_longitude", "target_longitude", "initial_target_longitude"):
            if getattr(pointing, name) is not None:
                update[name] = getattr(pointing, name) + environment.earth_angle
    return pointing.model_copy(update=update)


def _sun_for(environment: Environment, pointing: Pointing) -> Array:
    """Unit vector to the Sun in the inertial axes of a pointing task, shape (3,)."""
    sun = environment.sun()
    return environment.chief_axes @ sun if isinstance(pointing, SatellitePointingSpec) else sun


def environment_complaints(
    environment: Environment, pointings: Iterable[tuple[int, str, Pointing]]
) -> list[Complaint]:
    """What of pointing tasks contradicts the truth model's Sun, Earth or chief.

    Args:
        environment: of the truth model.
        pointings: place of a satellite, its name and its pointing task, of those that have one.

    Returns:
        Field and sentence of each contradiction.
    """
    found: list[Complaint] = []
    for index, name, pointing in pointings:
        try:
            faults = _pointing_faults(environment, pointing)
        except ValueError:
            # A direction that is none is named elsewhere.
            continue
        found += [(("satellites", index), f"attitude of {name}: {sentence}") for sentence in faults]
    return found


def _pointing_faults(environment: Environment, pointing: Pointing) -> list[str]:
    found = []
    if pointing.sun is not None:
        sun = _sun_for(environment, pointing)
        apart = _angle(direction_of("sun", np.array(pointing.sun)), sun)
        if apart > SAME_DIRECTION:
            found.append(
                f"sun stands {math.degrees(apart):.3g} degrees from where it is at the truth model's epoch, "
                f"({', '.join(f'{part:.4f}' for part in sun.tolist())}) in these axes; leave it out"
            )
    if isinstance(pointing, GroundPointingSpec):
        longitude = pointing.start_longitude + environment.earth_angle
        orbit = pointing.model_copy(update={"start_longitude": longitude}).build().orbit
        radial, transverse, _ = environment.chief_axes
        apart = max(_angle(orbit.radial, radial), _angle(orbit.transverse, transverse))
        if apart > SAME_DIRECTION:
            found.append(
                "start_latitude, start_longitude and heading are those of an orbit that is "
                f"{math.degrees(apart):.3g} degrees away from the truth model's chief, by the Earth's angle "
                "at its epoch"
            )
    return found


def _angle(first: Array, second: Array) -> float:
    return math.acos(max(-1.0, min(1.0, float(first @ second))))
