# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Desired attitude: boresight to a target on the ground, panel axis perpendicular to the sun.

Equations: docs/controllers/attitude.md.
"""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from satform.attitude.yaw_steering import Mask, sight_triad, square_direction, yaw
from satform.common.angle_text import OR_DEGREES
from satform.common.spec import Number, Positive, Spec, Vector
from satform.dynamics.linear import multiply
from satform.numeric.elementwise import Array, cross, dot, joined, numbers
from satform.numeric.modified_rodrigues import mrp_from_direction_cosines
from satform.numeric.time_derivatives import Jet
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER, ROTATION_RATE

Latitude = Annotated[float, Field(ge=-math.pi / 2, le=math.pi / 2), OR_DEGREES]
Longitude = Annotated[Number, OR_DEGREES]

_LEAST_LENGTH = 1e-9
"""Length above which a vector of any length counts as a direction."""

_LEAST_PANEL_ANGLE = 1e-3
"""Sine of the angle between boresight and panel axis below which they count as parallel."""

SHORTEST_SIGHT = 1e-3
"""Length of a line of sight below which it has no direction, m."""


@dataclass(frozen=True)
class AttitudeReference:
    """Desired attitude and its motion.

    Attributes:
        mrp: inertial to desired body axes, of length at most one, shape (..., 3).
        angular_velocity: of the desired axes, in desired body components, rad/s, shape (..., 3).
        angular_acceleration: of the desired axes, in desired body components, rad/s^2, (..., 3).
        feasible: whether the panel axis can be perpendicular to the sun, shape (...).
    """

    mrp: Array
    angular_velocity: Array
    angular_acceleration: Array
    feasible: Mask


@dataclass(frozen=True)
class CircularOrbit:
    """A circular orbit in inertial space.

    Attributes:
        radial: unit vector to the satellite at time zero, inertial, shape (..., 3).
        transverse: unit vector of its velocity at time zero, inertial, shape (..., 3).
        radius: m, shape (...).
        mean_motion: rad/s, shape (...).
    """

    radial: Array
    transverse: Array
    radius: Array
    mean_motion: Array

    def position(self, time: Array) -> Jet:
        """Inertial position (m), velocity and acceleration at a time (s), shape (..., 3)."""
        angle = numbers(self.mean_motion * time)[..., None]
        radius, motion = np.asarray(self.radius)[..., None], np.asarray(self.mean_motion)[..., None]
        outward = radius * (self.radial * np.cos(angle) + self.transverse * np.sin(angle))
        ahead = radius * (self.transverse * np.cos(angle) - self.radial * np.sin(angle))
        return Jet(outward, motion * ahead, -(motion * motion) * outward)


def circular_orbit_over(latitude: float, longitude: float, heading: float, altitude: float) -> CircularOrbit:
    """Circular orbit that passes over a place at time zero, when Greenwich lies on the inertial x axis.

    Args:
        latitude: geocentric, rad.
        longitude: east of Greenwich, rad.
        heading: of the inertial velocity, from north towards east, rad.
        altitude: above the spherical Earth, m.

    Returns:
        The orbit.

    Source: Spherical geometry.
    """
    radial = _direction(latitude, longitude)
    east = np.array([-math.sin(longitude), math.cos(longitude), 0.0])
    north = np.cross(radial, east)
    radius = EQUATORIAL_RADIUS + altitude
    return CircularOrbit(
        radial=radial,
        transverse=math.cos(heading) * north + math.sin(heading) * east,
        radius=np.asarray(radius),
        mean_motion=np.asarray(math.sqrt(GRAVITATIONAL_PARAMETER / radius**3)),
    )


def _direction(latitude: float, longitude: float) -> Array:
    return np.array(
        [
            math.cos(latitude) * math.cos(longitude),
            math.cos(latitude) * math.sin(longitude),
            math.sin(latitude),
        ]
    )


def ground_target(latitude: float, longitude: float, time: Array) -> Jet:
    """Inertial position of a place on the turning spherical Earth, with its derivatives.

    Args:
        latitude: geocentric, rad.
        longitude: east of Greenwich, which lies on the inertial x axis at time zero, rad.
        time: s, shape (...).

    Returns:
        Position in m with its derivatives, shape (..., 3).

    Source: Long & Hall: the target on a spherical Earth.
    """
    angle = longitude + ROTATION_RATE * numbers(time)
    distance = EQUATORIAL_RADIUS * math.cos(latitude)
    zero = np.zeros_like(angle)
    across, along = distance * np.cos(angle), distance * np.sin(angle)
    up = zero + EQUATORIAL_RADIUS * math.sin(latitude)
    return Jet(
        joined(across, along, up),
        ROTATION_RATE * joined(-along, across, zero),
        -(ROTATION_RATE**2) * joined(across, along, zero),
    )


@dataclass(frozen=True)
class SensorAxes:
    """How sensor and panels sit on the body.

    Attributes:
        boresight: of the sensor, unit vector, body components, shape (..., 3).
        panel_axis: unit vector that has to be perpendicular to the sun, body components, (..., 3).
        triad: rows: the boresight, the direction square to boresight and panel axis, and the one
            square to both, body components, shape (..., 3, 3).
    """

    boresight: Array
    panel_axis: Array
    triad: Array


def direction_of(name: str, vector: Array) -> Array:
    """Unit vector along a direction that a scenario gives in any length.

    Args:
        name: of the field, for the message.
        vector: shape (3,).

    Returns:
        Shape (3,).

    Raises:
        ValueError: it is the zero vector, or so short that its direction is lost to rounding.
    """
    vector = np.asarray(vector, dtype=np.float64)
    length = math.sqrt(float(vector @ vector))
    if not length > _LEAST_LENGTH:
        found = "a zero vector" if length == 0.0 else f"one of length {length:.3g}"
        raise ValueError(f"{name} needs a direction, got {found}")
    return vector / length


def sensor_axes(boresight: Array, panel_axis: Array) -> SensorAxes:
    """Body axes of sensor and panels from two directions of any length.

    Args:
        boresight: body components, shape (3,).
        panel_axis: direction that has to be perpendicular to the sun, body components, shape (3,).

    Returns:
        Unit vectors and the triad that they span.

    Raises:
        ValueError: a direction is zero, or they are parallel to within a milliradian.
    """
    first, axis = direction_of("boresight", boresight), direction_of("panel_axis", panel_axis)
    second = np.cross(first, axis)
    length = float(np.linalg.norm(second))
    if not length > _LEAST_PANEL_ANGLE:
        raise ValueError("the panel axis is parallel to the boresight: no turn about it moves the panels")
    second = second / length
    return SensorAxes(first, axis, np.stack((first, second, np.cross(first, second))))


def pointing_reference(line_of_sight: Jet, sun: Array, axes: SensorAxes) -> AttitudeReference:
    """Attitude with the boresight along a line of sight and the panel axis square to the sun.

    Args:
        line_of_sight: from the satellite to the target, inertial, m, shape (..., 3).
        sun: unit vector to the sun, inertial, constant, shape (..., 3).
        axes: of sensor and panels.

    Returns:
        Desired attitude with analytic rates, finite for every line of sight that is not zero. Where no
        turn about the boresight makes the panel axis square to the sun, the turn that comes nearest is
        taken and `feasible` is false. Within `SUN_CONE` of the sun or of the direction away from it the
        turn is taken from a fixed direction instead, and a line of sight shorter than `SHORTEST_SIGHT`
        gives `sun_safe_reference`.

    Source: Long & Hall: target pointing with yaw steering; of the two yaw angles the one with a
    positive sine is taken.
    """
    short = dot(line_of_sight.value, line_of_sight.value) < SHORTEST_SIGHT * SHORTEST_SIGHT
    if np.any(short):
        direction = square_direction(np.broadcast_to(sun, line_of_sight.value.shape))
        still = np.zeros_like(direction)
        line_of_sight = Jet(
            np.where(short[..., None], direction, line_of_sight.value),
            np.where(short[..., None], still, line_of_sight.rate),
            np.where(short[..., None], still, line_of_sight.acceleration),
        )
    first, second, third, along, across = sight_triad(line_of_sight, sun)
    axis_along = dot(axes.panel_axis, axes.triad[..., 0, :])
    axis_across = dot(axes.panel_axis, axes.triad[..., 2, :])
    cosine, sine, feasible = yaw(along.times(-axis_along), across.times(axis_across))
    turned_second = second * cosine.along() + third * sine.along()
    turned_third = third * cosine.along() - second * sine.along()
    triad = (first, turned_second, turned_third)
    matrix = _body_axes(axes.triad, triad)
    rate = 0.5 * (
        cross(first.value, first.rate)
        + cross(turned_second.value, turned_second.rate)
        + cross(turned_third.value, turned_third.rate)
    )
    acceleration = 0.5 * (
        cross(first.value, first.acceleration)
        + cross(turned_second.value, turned_second.acceleration)
        + cross(turned_third.value, turned_third.acceleration)
    )
    return AttitudeReference(
        mrp=mrp_from_direction_cosines(matrix),
        angular_velocity=multiply(matrix, rate),
        angular_acceleration=multiply(matrix, acceleration),
        feasible=feasible,
    )


def sun_safe_reference(sun: Array, axes: SensorAxes) -> AttitudeReference:
    """Attitude of a satellite that has nothing to point at: at rest in inertial space, panels to the sun.

    The boresight is square to the sun, so that every panel axis can be; it needs no motion of any target,
    no time and no memory, and is the same whenever it is needed again.

    Args:
        sun: unit vector to the sun, inertial, constant, shape (..., 3).
        axes: of sensor and panels.

    Returns:
        Desired attitude, of zero rate.
    """
    still = np.zeros_like(sun)
    return pointing_reference(Jet(square_direction(sun), still, still), sun, axes)


def _body_axes(body_triad: Array, triad: tuple[Jet, Jet, Jet]) -> Array:
    rows = [
        body_triad[..., 0, axis, None] * triad[0].value
        + body_triad[..., 1, axis, None] * triad[1].value
        + body_triad[..., 2, axis, None] * triad[2].value
        for axis in range(3)
    ]
    return np.stack(rows, axis=-2)


def pointing_error(direction_cosine: Array, boresight: Array, line_of_sight: Array) -> Array:
    """Angle between a satellite's boresight and its line of sight.

    Args:
        direction_cosine: inertial to body, shape (..., 3, 3).
        boresight: unit vector, body components, shape (3,).
        line_of_sight: inertial, any length, shape (..., 3).

    Returns:
        rad, shape (...).
    """
    seen = multiply(direction_cosine, line_of_sight)
    aim = np.broadcast_to(boresight, seen.shape)
    off = cross(aim, seen)
    angle: Array = np.arctan2(np.sqrt(dot(off, off)), dot(aim, seen))
    return angle


@dataclass(frozen=True)
class GroundPointing:
    """A satellite on a circular orbit that has to point at a place on the ground.

    Attributes:
        orbit: of the satellite.
        latitude: of the place, geocentric, rad.
        longitude: of the place, east of Greenwich, rad.
        sun: unit vector to the sun, inertial, shape (3,).
        axes: of sensor and panels.
    """

    orbit: CircularOrbit
    latitude: float
    longitude: float
    sun: Array
    axes: SensorAxes

    def line_of_sight(self, time: Array) -> Jet:
        """From the satellite to the place, inertial, m, at times (s) of shape (...)."""
        return ground_target(self.latitude, self.longitude, time) - self.orbit.position(time)

    def reference(self, time: Array) -> AttitudeReference:
        """Desired attitude at times (s) of shape (...); many times at once cost little more than one."""
        return pointing_reference(self.line_of_sight(time), self.sun, self.axes)


class GroundPointingSpec(Spec):
    """Pointing at a target on the ground from a circular orbit; panel axis perpendicular to the sun."""

    kind: Literal["ground_pointing"] = "ground_pointing"
    altitude: Positive
    """Of the orbit above the spherical Earth, m."""
    start_latitude: Latitude
    """Of the sub-satellite point at time zero, geocentric, rad."""
    start_longitude: Longitude
    """Of the sub-satellite point at time zero, east of Greenwich, rad."""
    heading: Longitude
    """Of the inertial velocity at time zero, from north towards east, rad."""
    target_latitude: Latitude
    """Of the target, geocentric, rad."""
    target_longitude: Longitude
    """Of the target, east of Greenwich, rad."""
    initial_target_latitude: Latitude | None = None
    """Of the place that the satellite points at at the start, geocentric, rad; the target when left out."""
    initial_target_longitude: Longitude | None = None
    """Of the place that the satellite points at at the start, east of Greenwich, rad."""
    sun: Vector | None = None
    """Direction to the sun, inertial equatorial components, any length; when left out that of the truth
    model's epoch, and along x where it has none."""
    boresight: Vector = (1.0, 0.0, 0.0)
    """Direction of the sensor, body components, any length."""
    panel_axis: Vector = (0.0, 1.0, 0.0)
    """Direction that has to be perpendicular to the sun, body components, any length."""

    @model_validator(mode="after")
    def _both_coordinates(self) -> "GroundPointingSpec":
        if (self.initial_target_latitude is None) != (self.initial_target_longitude is None):
            raise ValueError("give both initial_target_latitude and initial_target_longitude, or neither")
        return self

    @property
    def has_initial_target(self) -> bool:
        """Whether the satellite points at another place than its target at the start."""
        return self.initial_target_latitude is not None

    def build(self) -> GroundPointing:
        """The pointing task.

        Raises:
            ValueError: a direction is zero, or the panel axis is parallel to the boresight.
        """
        orbit = circular_orbit_over(self.start_latitude, self.start_longitude, self.heading, self.altitude)
        return GroundPointing(
            orbit=orbit,
            latitude=self.target_latitude,
            longitude=self.target_longitude,
            sun=direction_of("sun", np.array(self.sun or (1.0, 0.0, 0.0))),
            axes=sensor_axes(np.array(self.boresight), np.array(self.panel_axis)),
        )

    def build_initial(self) -> GroundPointing:
        """The pointing that the attitude at the start is taken from; raises as `build`."""
        pointing, latitude, longitude = (
            self.build(),
            self.initial_target_latitude,
            self.initial_target_longitude,
        )
        if latitude is None or longitude is None:
            return pointing
        return replace(pointing, latitude=latitude, longitude=longitude)
