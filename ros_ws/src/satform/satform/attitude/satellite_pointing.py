# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Desired attitude: boresight to another satellite of the formation, panel axis perpendicular to the sun.

Equations: docs/controllers/attitude.md.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.attitude.ground_pointing import (
    AttitudeReference,
    CircularOrbit,
    SensorAxes,
    direction_of,
    pointing_reference,
    sensor_axes,
    sun_safe_reference,
)
from satform.common.spec import Spec, Vector
from satform.numeric.elementwise import Array, cross, joined
from satform.numeric.time_derivatives import Jet
from satform.orbits.path_reference import Reference


def inertial_line(own: Reference, target: Reference, orbit: CircularOrbit, time: Array) -> Jet:
    """Line of sight from one desired motion to another, in inertial axes.

    Args:
        own: desired motion of the satellite that looks, LVLH, shape (..., 3).
        target: desired motion of the one that it looks at, LVLH, shape (..., 3).
        orbit: of the chief.
        time: s, shape (...).

    Returns:
        m, with its derivatives, shape (..., 3).

    Source: Kinematics in a frame that turns evenly; Schaub & Junkins, ch. 1.
    """
    apart = target.position - own.position
    moving = target.velocity - own.velocity
    speeding = target.acceleration - own.acceleration
    rate = np.asarray(orbit.mean_motion)
    # Turning about z takes x to y and y to -x.
    turned = joined(-apart[..., 1], apart[..., 0], 0.0 * apart[..., 2])
    turned_moving = joined(-moving[..., 1], moving[..., 0], 0.0 * moving[..., 2])
    flat = joined(apart[..., 0], apart[..., 1], 0.0 * apart[..., 2])
    spin = rate[..., None]
    velocity = moving + spin * turned
    acceleration = speeding + 2.0 * spin * turned_moving - spin * spin * flat
    return Jet(*(to_inertial(vector, orbit, time) for vector in (apart, velocity, acceleration)))


def to_inertial(vector: Array, orbit: CircularOrbit, time: Array) -> Array:
    """Components in LVLH, shape (..., 3), as inertial ones at a time (s, shape (...))."""
    angle = np.asarray(orbit.mean_motion) * time
    cosine, sine = np.cos(angle)[..., None], np.sin(angle)[..., None]
    x, y = vector[..., 0, None], vector[..., 1, None]
    radial, transverse = orbit.radial, orbit.transverse
    normal = cross(radial, transverse)
    outward = radial * cosine + transverse * sine
    ahead = transverse * cosine - radial * sine
    inertial: Array = x * outward + y * ahead + vector[..., 2, None] * normal
    return inertial


@dataclass(frozen=True)
class SatellitePointing:
    """A satellite that points at another one, with its panel axis perpendicular to the sun.

    Attributes:
        orbit: of the chief; inertial axes are its LVLH axes at time zero.
        sun: unit vector to the sun, inertial, shape (..., 3).
        axes: of sensor and panels.
    """

    orbit: CircularOrbit
    sun: Array
    axes: SensorAxes

    def reference(self, own: Reference, target: Reference, time: Array) -> AttitudeReference:
        """Desired attitude from the desired motions (LVLH, shape (..., 3)) at a time (s, shape (...))."""
        return pointing_reference(inertial_line(own, target, self.orbit, time), self.sun, self.axes)

    def safe_reference(self) -> AttitudeReference:
        """Desired attitude while it is not known where the target is: `sun_safe_reference`."""
        return sun_safe_reference(self.sun, self.axes)


class SatellitePointingSpec(Spec):
    """Pointing at another satellite of the formation, with the panel axis perpendicular to the sun.

    Inertial axes are the chief's LVLH axes at time zero. The satellite has to receive the other one's
    phase messages, whose phase is extrapolated by stamp and rate. Until the first message the initial phase
    of the scenario is used. Once the newest message is older than the consensus law's
    `neighbour_timeout`, the satellite rests in inertial space with boresight and panel axis
    perpendicular to the sun.
    """

    kind: Literal["satellite_pointing"] = "satellite_pointing"
    target: str
    """Name of the satellite pointed at."""
    initial_target: str | None = None
    """Name of the satellite that it points at at the start; the target when left out. No message of it is
    needed."""
    sun: Vector | None = None
    """Direction to the sun, inertial components, any length; when left out that of the truth model's
    epoch, and along the orbit normal where it has none."""
    boresight: Vector = (1.0, 0.0, 0.0)
    """Direction of the sensor, body components, any length."""
    panel_axis: Vector = (0.0, 1.0, 0.0)
    """Direction that has to be perpendicular to the sun, body components, any length."""

    @property
    def has_initial_target(self) -> bool:
        """Whether the satellite points at another one than its target at the start."""
        return self.initial_target is not None

    def build(self, mean_motion: float, radius: float) -> SatellitePointing:
        """The pointing task.

        Args:
            mean_motion: of the chief, rad/s.
            radius: of the chief's orbit, m.

        Raises:
            ValueError: a direction is zero, or the panel axis is parallel to the boresight.
        """
        sun = direction_of("sun", np.array(self.sun or (0.0, 0.0, 1.0)))
        orbit = CircularOrbit(
            radial=np.array([1.0, 0.0, 0.0]),
            transverse=np.array([0.0, 1.0, 0.0]),
            radius=np.asarray(radius, dtype=np.float64),
            mean_motion=np.asarray(mean_motion, dtype=np.float64),
        )
        return SatellitePointing(orbit, sun, sensor_axes(np.array(self.boresight), np.array(self.panel_axis)))
