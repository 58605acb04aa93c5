# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The chief's motion under J2 as flight software predicts it, and mean elements of satellites beside it.

Elements are those that are defined on a circle too, of single orbits: every array has the shape ().

Equations: docs/controllers/mean_elements.md.
"""

import math
from dataclasses import dataclass

import numpy as np

from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief
from satform.orbits.earth import GRAVITATIONAL_PARAMETER_EGM2008
from satform.orbits.frames import LvlhFrame, chief_frame
from satform.orbits.inertial_motion import NodalElements
from satform.orbits.j2_elements import as_array, drifted, oblate_acceleration
from satform.orbits.mean_elements import mean_chief, periodic_part

_ITERATIONS = 12
"""Of Newton's method for Kepler's equation; it converges in half of them."""


@dataclass(frozen=True)
class ChiefAtTime:
    """The chief as predicted for one moment.

    Attributes:
        mean: its mean elements.
        osculating: its osculating elements.
        short_period: osculating less mean: semi-major axis (m), both components of the eccentricity vector,
            inclination, right ascension and mean argument of latitude (rad), shape (6,).
        frame: its LVLH frame, turning as J2 turns it.
    """

    mean: NodalElements
    osculating: NodalElements
    short_period: Array
    frame: LvlhFrame


@dataclass(frozen=True)
class PredictedChief:
    """The chief's motion under two-body gravity and J2, from its elements at time zero.

    Attributes:
        mean: elements at time zero; osculating ones without `oblate`.
        oblate: whether J2 acts.
    """

    mean: KeplerianChief
    oblate: bool

    @classmethod
    def of(cls, chief: KeplerianChief, *, oblate: bool) -> "PredictedChief":
        """The prediction from osculating elements at time zero.

        Raises:
            ValueError: the orbit has no mean elements.
        """
        return cls(mean_chief(chief) if oblate else chief, oblate)

    def at(self, time: float) -> ChiefAtTime:
        """The chief `time` s after the start."""
        if not self.oblate:
            mean = nodal_of(self.mean)
            short_period = np.zeros(6)
            mean = moved(mean, np.array([0.0, 0.0, 0.0, 0.0, 0.0, self.mean.mean_motion * time]))
            return ChiefAtTime(mean, mean, short_period, chief_frame(*state_of(mean)))
        mean = nodal_of(drifted(self.mean, time))
        short_period = short_period_of(mean)
        osculating = moved(mean, short_period)
        position, velocity = state_of(osculating)
        acceleration = oblate_acceleration(position, GRAVITATIONAL_PARAMETER_EGM2008)
        frame = chief_frame(position, velocity, acceleration)
        return ChiefAtTime(mean, osculating, short_period, frame)

    def mean_beside(self, now: ChiefAtTime, osculating: NodalElements) -> NodalElements:
        """Mean elements of a satellite that is near the chief.

        The chief's short-period variation gives them up to itself times the relative distance, and that of
        these elements gives them up to its square.

        Args:
            now: the chief at this moment.
            osculating: of the satellite.

        Returns:
            Not a number where the satellite has no mean elements, as on no ellipse.
        """
        if not self.oblate:
            return osculating
        return moved(osculating, -_short_period_of_satellite(moved(osculating, -now.short_period)))


def short_period_of(mean: NodalElements) -> Array:
    """Osculating less mean elements under J2, in the order of `ChiefAtTime.short_period`, shape (6,)."""
    ex, ey = mean.eccentricity.tolist()
    perigee = math.atan2(ey, ex)
    whole = (
        float(mean.semi_major_axis),
        math.hypot(ex, ey),
        float(mean.inclination),
        float(mean.right_ascension),
        perigee,
        float(mean.mean_argument) - perigee,
    )
    short_period: Array = periodic_part(np.array([whole]))[0]
    return short_period


def _short_period_of_satellite(mean: NodalElements) -> Array:
    """As `short_period_of`; not a number where it is not found, so that a flight ends with a sentence."""
    axis, (ex, ey) = float(mean.semi_major_axis), mean.eccentricity.tolist()
    if not (0.0 < axis < math.inf and math.hypot(ex, ey) < 1.0 and math.isfinite(mean.mean_argument)):
        return np.full(6, np.nan)
    try:
        return short_period_of(mean)
    except ValueError:
        # Kepler's equation has no solution in double precision, as for eccentricities near 1.
        return np.full(6, np.nan)


def moved(elements: NodalElements, by: Array) -> NodalElements:
    """Elements plus a difference in the order of `ChiefAtTime.short_period`, shape (6,)."""
    axis, ex, ey, inclination, node, argument = by
    return NodalElements(
        semi_major_axis=elements.semi_major_axis + axis,
        inclination=elements.inclination + inclination,
        right_ascension=elements.right_ascension + node,
        eccentricity=elements.eccentricity + np.array([ex, ey]),
        mean_argument=elements.mean_argument + argument,
    )


def nodal_of(chief: KeplerianChief) -> NodalElements:
    """The chief's elements at time zero."""
    _, eccentricity, inclination, node, perigee, anomaly = as_array(chief)
    return NodalElements(
        semi_major_axis=np.asarray(chief.semi_major_axis),
        inclination=np.asarray(inclination),
        right_ascension=np.asarray(node),
        eccentricity=eccentricity * np.array([math.cos(perigee), math.sin(perigee)]),
        mean_argument=np.asarray(perigee + anomaly),
    )


def state_of(elements: NodalElements) -> tuple[Array, Array]:
    """Inertial position in m and velocity in m/s of one orbit, shape (3,) each.

    Source: Battin, An Introduction to the Mathematics and Methods of Astrodynamics, ch. 3.
    """
    a, (ex, ey) = float(elements.semi_major_axis), elements.eccentricity.tolist()
    root = math.sqrt(1.0 - ex * ex - ey * ey)
    longitude, factor = _eccentric_argument(float(elements.mean_argument), ex, ey), 1.0 / (1.0 + root)
    cosine, sine = math.cos(longitude), math.sin(longitude)
    x = a * ((1.0 - ey * ey * factor) * cosine + ex * ey * factor * sine - ex)
    y = a * ((1.0 - ex * ex * factor) * sine + ex * ey * factor * cosine - ey)
    radius, speed = math.hypot(x, y), math.sqrt(GRAVITATIONAL_PARAMETER_EGM2008 / a) / root
    along, across = -speed * (y / radius + ey), speed * (x / radius + ex)
    sn, cn = math.sin(elements.right_ascension), math.cos(elements.right_ascension)
    si, ci = math.sin(elements.inclination), math.cos(elements.inclination)
    node, ahead = np.array([cn, sn, 0.0]), np.array([-sn * ci, cn * ci, si])
    return x * node + y * ahead, along * node + across * ahead


def _eccentric_argument(mean_argument: float, ex: float, ey: float) -> float:
    """Eccentric anomaly plus argument of perigee from mean anomaly plus argument of perigee, rad."""
    found = mean_argument + ex * math.sin(mean_argument) - ey * math.cos(mean_argument)
    for _ in range(_ITERATIONS):
        sine, cosine = math.sin(found), math.cos(found)
        missing = mean_argument - found + ex * sine - ey * cosine
        found += missing / (1.0 - ex * cosine - ey * sine)
    return found
