# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Motion on a nearly circular equatorial orbit near the geostationary belt, with small tangential burns.

Equations: docs/controllers/planning.md.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.numeric.elementwise import Array, joined
from satform.orbits.earth import GRAVITATIONAL_PARAMETER

GEOSTATIONARY_RADIUS = 42164169.6


@dataclass(frozen=True)
class Burn:
    """A tangential impulse.

    Attributes:
        time: since the start, s.
        speed_change: m/s, positive forward.
    """

    time: float
    speed_change: float


@dataclass(frozen=True)
class PlanarOrbit:
    """A nearly circular equatorial orbit.

    Attributes:
        semi_major_axis: m.
        eccentricity: components of the eccentricity vector along inertial x and y.
        mean_longitude: at `time`, rad.
        time: s.
    """

    semi_major_axis: float
    eccentricity: tuple[float, float]
    mean_longitude: float
    time: float

    def state(self, time: Array) -> tuple[Array, Array]:
        """Inertial position (m) and velocity (m/s) in the plane, each (m, 2), at times (s) of shape (m,).

        Source: Equinoctial elements; Battin, An Introduction to the Mathematics and Methods of Astrodynamics,
        ch. 10.
        """
        import brahe  # noqa: PLC0415  slow to import, and few scenarios need a patrol's orbit

        axis, (ex, ey) = self.semi_major_axis, self.eccentricity
        motion = math.sqrt(GRAVITATIONAL_PARAMETER / axis**3)
        mean = self.mean_longitude + motion * (time - self.time)
        perigee = math.atan2(ey, ex)
        radians: Any = brahe.AngleFormat.RADIANS
        anomaly = brahe.anomaly_mean_to_eccentric(mean - perigee, math.hypot(ex, ey), angle_format=radians)
        longitude = perigee + anomaly
        cosine, sine = np.cos(longitude), np.sin(longitude)
        weight = 1.0 / (1.0 + math.sqrt(1.0 - ex * ex - ey * ey))
        rate = motion / (1.0 - ex * cosine - ey * sine)
        xx, xy, yy = 1.0 - ey * ey * weight, ex * ey * weight, 1.0 - ex * ex * weight
        position = joined(xx * cosine + xy * sine - ex, yy * sine + xy * cosine - ey)
        velocity = joined(xy * cosine - xx * sine, yy * cosine - xy * sine)
        return axis * position, axis * rate[..., None] * velocity

    def after(self, burn: Burn) -> "PlanarOrbit":
        """The orbit after a tangential burn."""
        position, velocity = (vector[0] for vector in self.state(np.array([burn.time])))
        speed = math.hypot(*velocity)
        velocity = velocity * (1.0 + burn.speed_change / speed)
        return _orbit_through(position, velocity, burn.time)


def _orbit_through(position: Array, velocity: Array, time: float) -> PlanarOrbit:
    (x, y), (vx, vy) = position.tolist(), velocity.tolist()
    radius, momentum = math.hypot(x, y), x * vy - y * vx
    ex = vy * momentum / GRAVITATIONAL_PARAMETER - x / radius
    ey = -vx * momentum / GRAVITATIONAL_PARAMETER - y / radius
    axis = 1.0 / (2.0 / radius - (vx * vx + vy * vy) / GRAVITATIONAL_PARAMETER)
    weight = 1.0 / (1.0 + math.sqrt(1.0 - ex * ex - ey * ey))
    root = math.sqrt(1.0 - ex * ex - ey * ey)
    cosine = ex + ((1.0 - ex * ex * weight) * x / axis - ex * ey * weight * y / axis) / root
    sine = ey + ((1.0 - ey * ey * weight) * y / axis - ex * ey * weight * x / axis) / root
    longitude = math.atan2(sine, cosine)
    return PlanarOrbit(axis, (ex, ey), longitude - ex * sine + ey * cosine, time)


def altitude_change(start: float, change: float) -> tuple[Burn, Burn]:
    """Burns that move a nearly circular orbit near the belt up or down and leave it circular.

    Args:
        start: time of the first burn, s.
        change: of altitude, m.

    Returns:
        Two equal burns half a day apart.

    Source: Hohmann 1925, linear in the altitude.
    """
    motion = math.sqrt(GRAVITATIONAL_PARAMETER / GEOSTATIONARY_RADIUS**3)
    half = 0.25 * motion * change
    return Burn(start, half), Burn(start + math.pi / motion, half)
