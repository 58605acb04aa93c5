# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Accelerations of Earth satellites in inertial space, from the force models of brahe.

Each brahe function takes one satellite; a loop over the rows costs about a microsecond a call and
gives every satellite the same bits whatever flies beside it. Nothing is downloaded: the gravity
field (EGM2008, tide free, degree 120) is part of the package, Sun and Moon follow analytical
series, and the atmosphere is one of `satform.dynamics.atmosphere`.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Protocol

import brahe
import numpy as np

from satform.dynamics.atmosphere import Atmosphere, atmosphere_of
from satform.dynamics.atmosphere_specs import HarrisPriesterSpec, Nrlmsise00Spec
from satform.dynamics.specs import BodySpec, GravitySpec
from satform.numeric.elementwise import Array, dot
from satform.orbits.chief import earth_angle_at
from satform.orbits.earth_orientation import EarthOrientation, from_file, without_file
from satform.orbits.frames import ClosedEarthRotation, EarthRotation
from satform.orbits.time_scales import brahe_epoch

MAXIMUM_DEGREE = 120


@functools.cache
def egm2008() -> Any:
    """The gravity field of brahe, loaded once."""
    # The package's type stubs take the constants of its enumerations for methods.
    field: Any = brahe.GravityModelType.EGM2008_120
    return brahe.GravityModel.from_model_type(field)


def gravitational_parameter() -> float:
    """The Earth's GM of the gravity field, m^3/s^2."""
    return float(egm2008().gm)


def central_gravity(position: Array, parameter: float) -> Array:
    """Point-mass gravity.

    Args:
        position: from the Earth's centre, m, shape (..., 3).
        parameter: GM, m^3/s^2.

    Returns:
        m/s^2, shape (..., 3).
    """
    squared = dot(position, position)
    acceleration: Array = position * (-parameter / (squared * np.sqrt(squared)))[..., None]
    return acceleration


@dataclass(frozen=True)
class FullEarthRotation:
    """GCRF to ITRF by brahe: bias, precession, nutation (IAU 2006/2000A), rotation, polar motion.

    Attributes:
        epoch: brahe's epoch of time zero.
        orientation: Earth orientation parameters of this flight.
    """

    epoch: Any
    orientation: EarthOrientation = field(default_factory=without_file)

    def matrix(self, time: float) -> Array:
        """Rotation of inertial into Earth-fixed components at `time` s after the epoch, (3, 3)."""
        return self.orientation.inertial_to_fixed(self.epoch + time)


@dataclass(frozen=True)
class Body:
    """What drag and sunlight meet.

    Attributes:
        mass: kg.
        drag_area: m^2.
        drag_coefficient: dimensionless.
        radiation_area: m^2.
        reflectivity: 1 absorbs, 2 reflects all.
    """

    mass: float
    drag_area: float
    drag_coefficient: float
    radiation_area: float
    reflectivity: float


class Force(Protocol):
    """One acceleration in inertial space."""

    def acceleration(self, time: float, position: Array, velocity: Array, bodies: Sequence[Body]) -> Array:
        """Inertial acceleration.

        Args:
            time: s after the epoch.
            position: inertial, m, shape (M, 3).
            velocity: inertial, m/s, shape (M, 3).
            bodies: M of them, or none if no force needs them.

        Returns:
            m/s^2, shape (M, 3).
        """


@dataclass(frozen=True)
class Gravity:
    """The Earth's gravity by spherical harmonics (degree 0: point mass).

    Attributes:
        degree: highest degree, 0 to 120.
        order: highest order, at most the degree.
        rotation: of the Earth-fixed frame; not used at degree 0.
    """

    degree: int
    order: int
    rotation: EarthRotation

    def __post_init__(self) -> None:
        if not 0 <= self.order <= self.degree <= MAXIMUM_DEGREE:
            raise ValueError(
                f"gravity of degree {self.degree} and order {self.order} is not 0 <= order <= degree <= 120"
            )

    def acceleration(self, time: float, position: Array, velocity: Array, bodies: Sequence[Body]) -> Array:
        """Total gravity; arguments and result as in `Force.acceleration`."""
        if self.degree == 0:
            return central_gravity(position, gravitational_parameter())
        model, matrix = egm2008(), self.rotation.matrix(time)
        evaluate, degree, order = brahe.accel_gravity_spherical_harmonics, self.degree, self.order
        result = np.empty(position.shape)
        for row, at in enumerate(position):
            result[row] = evaluate(at, matrix, model, degree, order)
        return result

    def harmonics(self, time: float, position: Array) -> Array:
        """Gravity without its central term.

        Args:
            time: s after the epoch.
            position: inertial, m, shape (M, 3).

        Returns:
            m/s^2, inertial, shape (M, 3).
        """
        total = self.acceleration(time, position, position, ())
        return total - central_gravity(position, gravitational_parameter())


@dataclass(frozen=True)
class ThirdBodies:
    """Tides of Sun and Moon, from brahe's analytical ephemerides.

    Attributes:
        epoch: brahe's epoch of time zero.
        sun: whether the gravity of the Sun acts.
        moon: whether that of the Moon acts.
    """

    epoch: Any
    sun: bool
    moon: bool

    def acceleration(self, time: float, position: Array, velocity: Array, bodies: Sequence[Body]) -> Array:
        """Tidal acceleration; arguments and result as in `Force.acceleration`."""
        now = self.epoch + time
        result = np.zeros(position.shape)
        for row, at in enumerate(position):
            if self.sun:
                result[row] += brahe.accel_third_body_sun(now, at)
            if self.moon:
                result[row] += brahe.accel_third_body_moon(now, at)
        return result


@dataclass(frozen=True)
class Drag:
    """Drag in an atmosphere that turns with the Earth.

    Attributes:
        atmosphere: its density.
        equator: rotation of inertial axes into the true equator of date, (3, 3); held over the run,
            for it turns by less than a thousandth of a degree in a month.
    """

    atmosphere: Atmosphere
    equator: Array

    def acceleration(self, time: float, position: Array, velocity: Array, bodies: Sequence[Body]) -> Array:
        """Drag; arguments and result as in `Force.acceleration`."""
        state = np.concatenate((position, velocity), axis=1)
        result = np.empty(position.shape)
        densities = self.atmosphere.densities(time, list(position))
        for row, (at, body) in enumerate(zip(state, bodies, strict=True)):
            result[row] = brahe.accel_drag(
                at, densities[row], body.mass, body.drag_area, body.drag_coefficient, self.equator
            )
        return result


@dataclass(frozen=True)
class SolarPressure:
    """Sunlight on a sphere, in the Earth's conical shadow dimmed or gone.

    Attributes:
        epoch: brahe's epoch of time zero.
    """

    epoch: Any

    def acceleration(self, time: float, position: Array, velocity: Array, bodies: Sequence[Body]) -> Array:
        """Radiation pressure; arguments and result as in `Force.acceleration`."""
        sun = brahe.sun_position(self.epoch + time)
        result = np.empty(position.shape)
        for row, (at, body) in enumerate(zip(position, bodies, strict=True)):
            lit = brahe.eclipse_conical(at, sun)
            pressure = brahe.accel_solar_radiation_pressure(
                at, sun, body.mass, body.reflectivity, body.radiation_area, brahe.P_SUN
            )
            result[row] = lit * pressure
        return result


@dataclass(frozen=True)
class ForceModel:
    """All forces on a satellite.

    Attributes:
        forces: added in this order, at least one.
    """

    forces: tuple[Force, ...]

    def acceleration(self, time: float, position: Array, velocity: Array, bodies: Sequence[Body]) -> Array:
        """Total acceleration; arguments and result as in `Force.acceleration`."""
        total = self.forces[0].acceleration(time, position, velocity, bodies)
        for force in self.forces[1:]:
            total = total + force.acceleration(time, position, velocity, bodies)
        return total


def gravity_of(spec: GravitySpec, epoch: datetime) -> Gravity:
    """The gravity that a scenario describes.

    Args:
        spec: degree, order and rotation.
        epoch: of time zero.

    Raises:
        ValueError: the file of Earth orientation parameters cannot be used.
    """
    order = spec.degree if spec.order is None else spec.order
    if spec.rotation == "closed":
        angle = earth_angle_at(epoch) if spec.earth_angle is None else spec.earth_angle
        return Gravity(spec.degree, order, ClosedEarthRotation(angle))
    return Gravity(spec.degree, order, FullEarthRotation(brahe_epoch(epoch), earth_orientation_of(spec)))


def earth_orientation_of(spec: GravitySpec) -> EarthOrientation:
    """The Earth orientation parameters that a scenario names.

    Raises:
        ValueError: its file cannot be used.
    """
    return without_file() if spec.orientation_file is None else from_file(spec.orientation_file)


def forces_of(
    epoch: datetime,
    gravity: GravitySpec,
    *,
    sun: bool,
    moon: bool,
    atmosphere: HarrisPriesterSpec | Nrlmsise00Spec | None,
    solar_pressure: bool,
) -> ForceModel:
    """All the forces that a scenario chooses for inertial propagation.

    Args:
        epoch: of time zero.
        gravity: of the Earth.
        sun: whether the Sun's gravity acts.
        moon: whether the Moon's gravity acts.
        atmosphere: in which there is drag; None for no drag.
        solar_pressure: whether sunlight presses.
    """
    zero = brahe_epoch(epoch)
    earth = gravity_of(gravity, epoch)
    chosen: list[Force] = [earth]
    if sun or moon:
        chosen.append(ThirdBodies(zero, sun, moon))
    if atmosphere is not None:
        equator, orientation = _equator(gravity, zero), earth_orientation_of(gravity)
        chosen.append(Drag(atmosphere_of(atmosphere, zero, equator, earth.rotation, orientation), equator))
    if solar_pressure:
        chosen.append(SolarPressure(zero))
    return ForceModel(tuple(chosen))


def _equator(spec: GravitySpec, epoch: Any) -> Array:
    """Rotation of inertial axes into the equator to which the atmosphere belongs, (3, 3)."""
    if spec.rotation == "closed":
        return np.eye(3)
    return earth_orientation_of(spec).inertial_to_equator_of_date(epoch)


def body_of(spec: BodySpec) -> Body:
    """The body that a scenario describes."""
    return Body(spec.mass, spec.drag_area, spec.drag_coefficient, spec.radiation_area, spec.reflectivity)
