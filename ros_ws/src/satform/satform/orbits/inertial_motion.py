# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Inertial states of a chief and its satellites, and their osculating relative orbital elements."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np

from satform.numeric.elementwise import Array, cross, dot, joined, norm
from satform.orbits.chief import KeplerianChief
from satform.orbits.earth import GRAVITATIONAL_PARAMETER_EGM2008
from satform.orbits.frames import LvlhFrame, lvlh_frame

RELATIVE_ELEMENTS = ("da", "dlambda", "dex", "dey", "dix", "diy")
"""Quasi-nonsingular relative orbital elements in their order (D'Amico), each times the chief's
semi-major axis."""

_EQUATORIAL = 1e-6
"""Sine of the inclination below which an orbit has no node."""


@dataclass(frozen=True)
class ChiefMotion:
    """The chief in inertial space (GCRF) at the states of a flight.

    Attributes:
        epoch: date and time of time zero.
        frames: its LVLH frame at each state, with arrays of shape (K + 1, 3).
        nominal: whether it is the unperturbed orbit of time zero, because the truth model does not
            propagate a chief.
    """

    epoch: datetime
    frames: LvlhFrame
    nominal: bool = False

    @property
    def position(self) -> Array:
        """m, shape (K + 1, 3)."""
        return self.frames.origin_position

    @property
    def velocity(self) -> Array:
        """m/s, shape (K + 1, 3)."""
        return self.frames.origin_velocity

    def of_satellites(self, position_lvlh: Array, velocity_lvlh: Array) -> tuple[Array, Array]:
        """Inertial motion of satellites from their relative motion.

        Args:
            position_lvlh: m, shape (K + 1, N, 3).
            velocity_lvlh: m/s, in the rotating frame, shape (K + 1, N, 3).

        Returns:
            Position in m and velocity in m/s, GCRF, shape (K + 1, N, 3).
        """
        own = self.frames
        parts = (own.origin_position, own.origin_velocity, own.radial, own.along_track, own.normal, own.rate)
        return LvlhFrame(*(part[:, None, :] for part in parts)).to_inertial(position_lvlh, velocity_lvlh)

    def relative_elements(self, position: Array, velocity: Array) -> Array:
        """Osculating quasi-nonsingular relative orbital elements times the chief's semi-major axis.

        Args:
            position: of the satellites, GCRF, m, shape (K + 1, N, 3).
            velocity: of the satellites, GCRF, m/s, shape (K + 1, N, 3).

        Returns:
            m, shape (K + 1, N, 6); see the function `relative_elements`.
        """
        chief = np.concatenate((self.position, self.velocity), axis=-1)
        return relative_elements(chief[:, None, :], np.concatenate((position, velocity), axis=-1))


def relative_elements(chief: Array, deputy: Array) -> Array:
    """Osculating quasi-nonsingular relative orbital elements times the chief's semi-major axis.

    They are taken from the vectors of eccentricity and angular momentum and not from brahe's elements of a
    state, which lose half of their digits on orbits that are nearly circular.

    Args:
        chief: inertial position in m and velocity in m/s, shape (..., 6).
        deputy: likewise, of a shape that the chief's can be broadcast to, (..., 6).

    Returns:
        m, shape (..., 6), in the order of `RELATIVE_ELEMENTS`. NaN where a state is not known, is on no
        ellipse, or the chief's orbit lies in the equator, where it has no node.

    Source: D'Amico 2010 (definition); Battin, ch. 3 (vectors of eccentricity and angular momentum).
    """
    return elements_between(nodal_elements(chief), nodal_elements(deputy))


def elements_between(own: "NodalElements", other: "NodalElements") -> Array:
    """Quasi-nonsingular relative orbital elements of two orbits, osculating or mean, as `relative_elements`.

    Args:
        own: of the chief.
        other: of the satellites, of shapes that the chief's can be broadcast to.

    Returns:
        m, shape (..., 6), in the order of `RELATIVE_ELEMENTS`.
    """
    sine, cosine = np.sin(own.inclination), np.cos(own.inclination)
    turned = _within_half_a_turn(other.right_ascension - own.right_ascension)
    found = np.stack(
        np.broadcast_arrays(
            other.semi_major_axis / own.semi_major_axis - 1.0,
            _within_half_a_turn(other.mean_argument - own.mean_argument + turned * cosine),
            *(other.eccentricity - own.eccentricity),
            other.inclination - own.inclination,
            turned * sine,
        ),
        axis=-1,
    )
    equatorial = np.abs(sine) < _EQUATORIAL
    whole: Array = np.where(equatorial[..., None], np.nan, own.semi_major_axis[..., None] * found)
    return whole


@dataclass(frozen=True)
class NodalElements:
    """Elements, shape (...), that are defined on circular orbits too.

    Attributes:
        semi_major_axis: m.
        inclination: rad.
        right_ascension: of the ascending node, rad.
        eccentricity: e cos w and e sin w, w the argument of perigee, shape (2, ...).
        mean_argument: of latitude, w + M, rad.
    """

    semi_major_axis: Array
    inclination: Array
    right_ascension: Array
    eccentricity: Array
    mean_argument: Array


def nodal_elements(state: Array) -> NodalElements:
    """Osculating elements of inertial positions in m and velocities in m/s, shape (..., 6)."""
    position, velocity = state[..., :3], state[..., 3:]
    radius, speed_squared = norm(position), dot(velocity, velocity)
    momentum = cross(position, velocity)
    size = norm(momentum)
    with np.errstate(invalid="ignore", divide="ignore"):
        semi_major_axis = 1.0 / (2.0 / radius - speed_squared / GRAVITATIONAL_PARAMETER_EGM2008)
        axis = np.where(semi_major_axis > 0.0, semi_major_axis, np.nan)
        radial, normal = position / radius[..., None], momentum / size[..., None]
        right_ascension = np.arctan2(normal[..., 0], -normal[..., 1])
        node = joined(np.cos(right_ascension), np.sin(right_ascension), np.zeros_like(right_ascension))
        ahead = cross(normal, node)
        vector = cross(velocity, momentum) / GRAVITATIONAL_PARAMETER_EGM2008 - radial
        along, across = dot(vector, node), dot(vector, ahead)
        latitude = np.arctan2(dot(radial, ahead), dot(radial, node))
        eccentricity = np.hypot(along, across)
        true_anomaly = latitude - np.arctan2(across, along)
        # Eccentric less true anomaly, and mean less eccentric: both vanish with the eccentricity.
        ratio = eccentricity / (1.0 + np.sqrt(1.0 - eccentricity * eccentricity))
        behind = -2.0 * np.arctan2(ratio * np.sin(true_anomaly), 1.0 + ratio * np.cos(true_anomaly))
        mean_argument = latitude + behind - eccentricity * np.sin(true_anomaly + behind)
    inclination = np.arctan2(np.hypot(normal[..., 0], normal[..., 1]), normal[..., 2])
    return NodalElements(axis, inclination, right_ascension, np.stack((along, across)), mean_argument)


def _within_half_a_turn(angle: Array) -> Array:
    wrapped: Array = np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi
    return wrapped


def frames_of(frames: Sequence[LvlhFrame]) -> LvlhFrame:
    """One frame with arrays of shape (K + 1, 3) from K + 1 frames of single instants."""
    return LvlhFrame(
        *(
            np.array([getattr(frame, name) for frame in frames])
            for name in ("origin_position", "origin_velocity", "radial", "along_track", "normal", "rate")
        )
    )


def unperturbed(chief: KeplerianChief, times: Array) -> LvlhFrame:
    """The LVLH frames of a chief that keeps to its Keplerian orbit.

    Args:
        chief: by its elements at time zero.
        times: since the start, s, shape (K + 1,).

    Returns:
        A frame with arrays of shape (K + 1, 3).
    """
    import brahe  # noqa: PLC0415  slow to import, and needed where inertial states are asked for

    radians: Any = brahe.AngleFormat.RADIANS
    angles = (chief.inclination, chief.right_ascension, chief.argument_of_perigee)
    elements = np.empty((len(times), 6))
    elements[:, :5] = (chief.semi_major_axis, chief.eccentricity, *angles)
    elements[:, 5] = np.remainder(chief.mean_anomaly + chief.mean_motion * times, 2.0 * np.pi)
    states: Array = brahe.state_koe_to_eci(elements, radians)
    return lvlh_frame(np.ascontiguousarray(states[:, :3]), np.ascontiguousarray(states[:, 3:]))
