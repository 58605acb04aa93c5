# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Gravity of a point mass on satellites about a chief on a circular orbit, in its rotating LVLH frame."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.dynamics.cw import natural_acceleration
from satform.numeric.elementwise import Array, joined
from satform.orbits.earth import GRAVITATIONAL_PARAMETER

GravityKind = Literal["none", "cw", "point_mass"]
"""none: there is none, and LVLH does not rotate; cw: to first order in the distance; point_mass: exact."""


@dataclass(frozen=True)
class CircularGravity:
    """Natural acceleration in LVLH, with the frame's rotation.

    Attributes:
        mean_motion: of the chief, rad/s.
        radius: of its orbit, m.
        exact: whether the gravity of the point mass is exact, or linear in the distance.
    """

    mean_motion: float
    radius: float
    exact: bool

    def at(self, position: Array, velocity: Array) -> Array:
        """Acceleration of a free satellite.

        Args:
            position: m, LVLH, shape (N, 3).
            velocity: m/s, in the rotating frame, shape (N, 3).

        Returns:
            m/s^2, in the rotating frame, shape (N, 3).

        Source: Schaub & Junkins, ch. 14: the exact equations of relative motion about a circular orbit, and
        Clohessy & Wiltshire 1960 for their linear part.
        """
        motion = self.mean_motion
        if not self.exact:
            return natural_acceleration(motion).at(position, velocity)
        outward, along, across = self.radius + position[..., 0], position[..., 1], position[..., 2]
        radius_ratio = self.radius / np.sqrt(outward * outward + along * along + across * across)
        attraction = motion * motion * (radius_ratio * radius_ratio * radius_ratio)
        excess = motion * motion - attraction
        return joined(
            excess * outward + 2.0 * motion * velocity[..., 1],
            excess * along - 2.0 * motion * velocity[..., 0],
            -(attraction * across),
        )


def circular_gravity(kind: GravityKind, mean_motion: float) -> CircularGravity | None:
    """Gravity of a kind about a chief of a mean motion in rad/s; None for none."""
    if kind == "none":
        return None
    radius = math.cbrt(GRAVITATIONAL_PARAMETER / (mean_motion * mean_motion))
    return CircularGravity(mean_motion, radius, exact=kind == "point_mass")
