# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Inertial, LVLH (Hill) and Earth-fixed frames: the one place for every axis and every sign.

LVLH is carried by the chief: x radial outward, y along-track, z along the orbit normal. Two rates
of that frame are in use, and they differ in what "velocity" means:

- the orbit rate (0, 0, h/r^2) is what most packages turn their radial/along-track frame at;
- the exact rate adds (r a_z/h) about x, the turning of the orbit plane by the acceleration a_z
  normal to it. Only with it is the LVLH velocity the time derivative of the LVLH position.

On an orbit that stays in its plane the two are equal.

The Earth rotation angle is computed here because brahe gives it only as a matrix, from a Julian date whose
rounding makes it differ by up to 2.3e-11 rad, which would change the results of `rotation: closed`.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from satform.numeric.elementwise import Array, cross, norm
from satform.orbits.earth import ROTATION_RATE

EARTH_ROTATION_RATE = ROTATION_RATE
"""Rate of the Earth rotation angle; the one of `satform.orbits.earth`."""


@dataclass(frozen=True)
class LvlhFrame:
    """The chief's rotating frame at one instant.

    Attributes:
        origin_position: of the chief, inertial, m, shape (..., 3).
        origin_velocity: of the chief, inertial, m/s, shape (..., 3).
        radial: unit vector x, inertial components, shape (..., 3).
        along_track: unit vector y, inertial components, shape (..., 3).
        normal: unit vector z, inertial components, shape (..., 3).
        rate: of the frame against inertial space, in LVLH components, rad/s, shape (..., 3).
    """

    origin_position: Array
    origin_velocity: Array
    radial: Array
    along_track: Array
    normal: Array
    rate: Array

    def vector_to_lvlh(self, vector_inertial: Array) -> Array:
        """Components of a vector along the LVLH axes.

        Args:
            vector_inertial: inertial components, any unit, shape (..., 3).

        Returns:
            LVLH components in the same unit, shape (..., 3).
        """
        # Three multiplications of whole vectors cost a third of three scalar products.
        rows = np.stack((self.radial, self.along_track, self.normal), axis=-1)
        vector: Array = (
            vector_inertial[..., 0:1] * rows[..., 0, :]
            + vector_inertial[..., 1:2] * rows[..., 1, :]
            + vector_inertial[..., 2:3] * rows[..., 2, :]
        )
        return vector

    def vector_to_inertial(self, vector_lvlh: Array) -> Array:
        """Inertial components of a vector given along the LVLH axes.

        Args:
            vector_lvlh: LVLH components, any unit, shape (..., 3).

        Returns:
            Inertial components in the same unit, shape (..., 3).
        """
        vector: Array = (
            vector_lvlh[..., 0:1] * self.radial
            + vector_lvlh[..., 1:2] * self.along_track
            + vector_lvlh[..., 2:3] * self.normal
        )
        return vector

    def to_lvlh(self, position_inertial: Array, velocity_inertial: Array) -> tuple[Array, Array]:
        """Relative motion of satellites as seen in this frame.

        Args:
            position_inertial: m, shape (..., 3).
            velocity_inertial: m/s, shape (..., 3).

        Returns:
            Position in m and velocity in m/s taken in the rotating frame (at this frame's `rate`),
            both in LVLH components, shape (..., 3).

        Source: Schaub & Junkins, Analytical Mechanics of Space Systems, ch. 14 (transport theorem).
        """
        position = self.vector_to_lvlh(position_inertial - self.origin_position)
        velocity = self.vector_to_lvlh(velocity_inertial - self.origin_velocity)
        return position, velocity - cross(self.rate, position)

    def to_inertial(self, position_lvlh: Array, velocity_lvlh: Array) -> tuple[Array, Array]:
        """Inertial motion of satellites from their relative motion; the inverse of `to_lvlh`.

        Args:
            position_lvlh: m, shape (..., 3).
            velocity_lvlh: m/s, taken in the rotating frame (at this frame's `rate`), shape (..., 3).

        Returns:
            Inertial position in m and velocity in m/s, shape (..., 3).
        """
        carried = velocity_lvlh + cross(self.rate, position_lvlh)
        position = self.origin_position + self.vector_to_inertial(position_lvlh)
        return position, self.origin_velocity + self.vector_to_inertial(carried)


def lvlh_frame(chief_position: Array, chief_velocity: Array) -> LvlhFrame:
    """The chief's LVLH frame turning at the orbit rate (0, 0, h/r^2).

    Args:
        chief_position: inertial, m, shape (..., 3).
        chief_velocity: inertial, m/s, shape (..., 3), not parallel to the position.

    Returns:
        The frame at this instant.

    Source: Schaub & Junkins, ch. 14.
    """
    radius = norm(chief_position)
    momentum = cross(chief_position, chief_velocity)
    momentum_norm = norm(momentum)
    radial = chief_position / radius[..., None]
    normal = momentum / momentum_norm[..., None]
    zero = np.zeros_like(radius)
    rate = np.stack((zero, zero, momentum_norm / (radius * radius)), axis=-1)
    return LvlhFrame(chief_position, chief_velocity, radial, cross(normal, radial), normal, rate)


def chief_axes(chief_position: Array, chief_velocity: Array) -> tuple[Array, Array, Array]:
    """The LVLH axes of a single chief, the same to the last bit as those of `lvlh_frame`.

    On plain floats it takes a fifth of the time, which counts where every stage of an integrator
    needs the axes.

    Args:
        chief_position: inertial, m, shape (3,).
        chief_velocity: inertial, m/s, shape (3,), not parallel to the position.

    Returns:
        Radial, along-track and normal unit vectors, inertial components, shape (3,) each.
    """
    axes, _, _ = _axes_of_floats(chief_position, chief_velocity)
    return axes


def chief_frame(
    chief_position: Array, chief_velocity: Array, chief_acceleration: Array | None = None
) -> LvlhFrame:
    """The LVLH frame of a single chief, bitwise the same as that of `lvlh_frame` at the orbit rate.

    Args:
        chief_position: inertial, m, shape (3,).
        chief_velocity: inertial, m/s, shape (3,), not parallel to the position.
        chief_acceleration: total inertial acceleration, m/s^2, shape (3,), for the exact rate
            (r a_z/h, 0, h/r^2); None for the orbit rate as in `lvlh_frame`.

    Returns:
        The frame at this instant.

    Source: Schaub & Junkins, ch. 14; the rate about x is Gauss's equation for the orbit plane.
    """
    axes, radius, momentum = _axes_of_floats(chief_position, chief_velocity)
    orbit_rate = momentum / (radius * radius)
    about_radial = 0.0
    if chief_acceleration is not None:
        ax, ay, az = chief_acceleration.tolist()
        nx, ny, nz = axes[2].tolist()
        about_radial = (ax * nx + ay * ny + az * nz) / (radius * orbit_rate)
    rate = np.array([about_radial, 0.0, orbit_rate])
    return LvlhFrame(chief_position, chief_velocity, *axes, rate)


def _axes_of_floats(position: Array, velocity: Array) -> tuple[tuple[Array, Array, Array], float, float]:
    """Axes, distance and specific angular momentum of a single chief."""
    px, py, pz = position.tolist()
    vx, vy, vz = velocity.tolist()
    radius = math.sqrt(px * px + py * py + pz * pz)
    rx, ry, rz = px / radius, py / radius, pz / radius
    hx, hy, hz = py * vz - pz * vy, pz * vx - px * vz, px * vy - py * vx
    momentum = math.sqrt(hx * hx + hy * hy + hz * hz)
    nx, ny, nz = hx / momentum, hy / momentum, hz / momentum
    along_track = np.array([ny * rz - nz * ry, nz * rx - nx * rz, nx * ry - ny * rx])
    return (np.array([rx, ry, rz]), along_track, np.array([nx, ny, nz])), radius, momentum


def rotation_about_z(angle: float) -> Array:
    """Matrix that gives components in axes turned by an angle about z: [[c,s,0],[-s,c,0],[0,0,1]].

    Args:
        angle: rad.

    Returns:
        Shape (3, 3).
    """
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def earth_rotation_angle(days: int, seconds: float) -> float:
    """Earth rotation angle with UT1 = UTC.

    Args:
        days: whole days from 2000-01-01T12:00:00 UTC, negative before.
        seconds: of the day that began at that noon, s.

    Returns:
        Angle from the celestial to the terrestrial intermediate origin in rad within [0, 2 pi).

    Source: IERS Conventions 2010, Eq. (5.15).
    """
    # Whole turns are left out before the sum, so that no digits go to them.
    turns = 0.7790572732640 + 0.00273781191135448 * days + 1.00273781191135448 * (seconds / 86400.0)
    return 2.0 * math.pi * math.fmod(math.fmod(turns, 1.0) + 1.0, 1.0)


class EarthRotation(Protocol):
    """Orientation of the Earth-fixed frame as a function of time."""

    def matrix(self, time: float) -> Array:
        """Rotation of inertial into Earth-fixed components at `time` s after the epoch, (3, 3)."""


@dataclass(frozen=True)
class ClosedEarthRotation:
    """Uniform rotation about the inertial z axis: theta = angle + rate t.

    Attributes:
        angle: at the epoch, rad.
        rate: rad/s.
    """

    angle: float
    rate: float = EARTH_ROTATION_RATE

    def matrix(self, time: float) -> Array:
        """Rotation of inertial into Earth-fixed components at `time` s after the epoch, (3, 3)."""
        return rotation_about_z(self.angle + self.rate * time)
