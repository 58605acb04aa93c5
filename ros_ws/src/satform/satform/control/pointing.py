"""Attitude that points a sensor at a place on the ground and turns about it to keep panels to the sun."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from satform.control.jets import Jet, constant, reciprocal, scalar_product, square_root, unit, vector_product
from satform.dynamics.attitude import (
    direction_cosines,
    gravity_gradient_torque,
    mrp_from_direction_cosines,
)
from satform.dynamics.linear import multiply
from satform.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER, ROTATION_RATE
from satform.elementwise import Array, cross, dot, joined
from satform.spec import Number, Positive, Spec, Vector

Mask: TypeAlias = NDArray[np.bool_]
Latitude = Annotated[float, Field(ge=-math.pi / 2, le=math.pi / 2)]


@dataclass(frozen=True)
class AttitudeReference:
    """Desired attitude and its motion.

    Attributes:
        mrp: inertial to desired body axes, of length at most one, shape (..., 3).
        angular_velocity: of the desired axes, in desired body components, rad/s, shape (..., 3).
        angular_acceleration: of the desired axes, in desired body components, rad/s^2, (..., 3).
        feasible: whether the panels can be kept to the sun while the sensor points, shape (...).
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
        angle = np.asarray(self.mean_motion * time)[..., None]
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
    angle = longitude + ROTATION_RATE * np.asarray(time, dtype=np.float64)
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


def sensor_axes(boresight: Array, panel_axis: Array) -> SensorAxes:
    """Body axes of sensor and panels from two directions of any length.

    Args:
        boresight: body components, shape (3,).
        panel_axis: direction that has to be perpendicular to the sun, body components, shape (3,).

    Returns:
        Unit vectors and the triad that they span.

    Raises:
        ValueError: a direction is zero or they are parallel.
    """
    lengths = np.linalg.norm(boresight), np.linalg.norm(panel_axis)
    if not min(lengths) > 0.0:
        raise ValueError("boresight and panel axis need a direction, got a zero vector")
    first, axis = np.asarray(boresight) / lengths[0], np.asarray(panel_axis) / lengths[1]
    second = np.cross(first, axis)
    length = float(np.linalg.norm(second))
    if not length > 1e-9:
        raise ValueError("the panel axis is parallel to the boresight: no turn about it moves the panels")
    second = second / length
    return SensorAxes(first, axis, np.stack((first, second, np.cross(first, second))))


def pointing_reference(line_of_sight: Jet, sun: Array, axes: SensorAxes) -> AttitudeReference:
    """Attitude with the boresight along a line of sight and the panel axis square to the sun.

    Args:
        line_of_sight: from the satellite to the target, inertial, any length, shape (..., 3);
            nowhere parallel to the sun's direction.
        sun: unit vector to the sun, inertial, constant, shape (..., 3).
        axes: of sensor and panels.

    Returns:
        Desired attitude with analytic rates. Where no turn about the boresight makes the panel axis
        square to the sun, the turn that comes nearest is taken and `feasible` is false.

    Source: Long & Hall: target pointing with yaw steering; of the two yaw angles the one with a
    positive sine is taken.
    """
    first, second, third, along, across = _sight_triad(line_of_sight, sun)
    axis_along = dot(axes.panel_axis, axes.triad[..., 0, :])
    axis_across = dot(axes.panel_axis, axes.triad[..., 2, :])
    cosine, sine, feasible = _yaw(along.times(-axis_along), across.times(axis_across))
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


def _sight_triad(line_of_sight: Jet, sun: Array) -> tuple[Jet, Jet, Jet, Jet, Jet]:
    """Triad of line of sight and sun, and the sun's components along its first and third axes."""
    to_sun = constant(np.broadcast_to(sun, line_of_sight.value.shape))
    first = unit(line_of_sight)
    second = unit(vector_product(first, to_sun))
    third = vector_product(first, second)
    return first, second, third, scalar_product(to_sun, first), scalar_product(to_sun, third)


def _yaw(numerator: Jet, denominator: Jet) -> tuple[Jet, Jet, Mask]:
    """Cosine and sine of the yaw angle from the cosine's two parts, and where they are attainable."""
    feasible = np.abs(numerator.value) < np.abs(denominator.value)
    divisor = np.where(feasible, denominator.value, 1.0)
    cosine = numerator * reciprocal(Jet(divisor, denominator.rate, denominator.acceleration))
    held = np.where(np.signbit(numerator.value) == np.signbit(denominator.value), 1.0, -1.0)
    nothing = np.zeros_like(held)
    cosine = Jet(
        np.where(feasible, cosine.value, held),
        np.where(feasible, cosine.rate, nothing),
        np.where(feasible, cosine.acceleration, nothing),
    )
    return cosine, _sine(cosine, feasible), feasible


def _sine(cosine: Jet, feasible: Mask) -> Jet:
    squared = constant(np.ones_like(cosine.value)) - cosine * cosine
    safe = Jet(np.where(feasible, squared.value, 1.0), squared.rate, squared.acceleration)
    root = square_root(safe)
    nothing = np.zeros_like(cosine.value)
    return Jet(
        np.where(feasible, root.value, nothing),
        np.where(feasible, root.rate, nothing),
        np.where(feasible, root.acceleration, nothing),
    )


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

    def gravity_torque(self, inertia: Array, mrp: Array, time: Array) -> Array:
        """Gravity-gradient torque on the satellite.

        Args:
            inertia: of the whole satellite, body axes, kg m^2, shape (..., 3, 3).
            mrp: its attitude, shape (..., 3).
            time: s, shape (...).

        Returns:
            Body components, N m, shape (..., 3).
        """
        nadir = -self.orbit.position(time).value / np.asarray(self.orbit.radius)[..., None]
        down = multiply(direction_cosines(mrp), nadir)
        return gravity_gradient_torque(inertia, down, self.orbit.radius, GRAVITATIONAL_PARAMETER)


class GroundPointingSpec(Spec):
    """Pointing at a place on the ground from a circular orbit, with the panels kept to the sun."""

    kind: Literal["ground_pointing"] = "ground_pointing"
    altitude: Positive
    """Of the orbit above the spherical Earth, m."""
    start_latitude: Latitude
    """Of the point below the satellite at time zero, geocentric, rad."""
    start_longitude: Number
    """Of the point below the satellite at time zero, east of Greenwich, rad."""
    heading: Number
    """Of the inertial velocity at time zero, from north towards east, rad."""
    target_latitude: Latitude
    """Of the place pointed at, geocentric, rad."""
    target_longitude: Number
    """Of the place pointed at, east of Greenwich, rad."""
    sun: Vector = (1.0, 0.0, 0.0)
    """Direction to the sun, inertial equatorial components, any length."""
    boresight: Vector = (1.0, 0.0, 0.0)
    """Direction of the sensor, body components, any length."""
    panel_axis: Vector = (0.0, 1.0, 0.0)
    """Direction that has to be perpendicular to the sun, body components, any length."""

    def build(self) -> GroundPointing:
        """The pointing task.

        Raises:
            ValueError: a direction is zero, or the panel axis is parallel to the boresight.
        """
        sun = np.array(self.sun, dtype=np.float64)
        if not np.any(sun):
            raise ValueError("sun needs a direction, got a zero vector")
        orbit = circular_orbit_over(self.start_latitude, self.start_longitude, self.heading, self.altitude)
        return GroundPointing(
            orbit=orbit,
            latitude=self.target_latitude,
            longitude=self.target_longitude,
            sun=sun / np.linalg.norm(sun),
            axes=sensor_axes(np.array(self.boresight), np.array(self.panel_axis)),
        )
