# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Mean orbital elements under J2: secular rates, and the transition matrix of relative elements.

Relative elements are quasi-nonsingular, in the order (da, dlambda, dex, dey, dix, diy), dimensionless and in
rad: relative semi-major axis, mean longitude, eccentricity vector and inclination vector of a satellite to
the chief. They hold for any eccentricity below 1 and for inclinations other than 0 and pi.

Equations: docs/controllers/eccentric.md.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER, OBLATENESS


@dataclass(frozen=True)
class SecularRates:
    """Rates of the mean angles of an orbit under J2.

    Attributes:
        right_ascension: of the ascending node, rad/s.
        argument_of_perigee: rad/s.
        mean_anomaly: with the mean motion, rad/s.
    """

    right_ascension: float
    argument_of_perigee: float
    mean_anomaly: float


def secular_rates(chief: KeplerianChief) -> SecularRates:
    """Rates of the mean angles, to first order in J2.

    Args:
        chief: by mean elements.

    Source: Brouwer 1959; as in Koenig, Guffanti & D'Amico 2017, Eq. (13).
    """
    factor, root = _oblateness(chief), math.sqrt(1.0 - chief.eccentricity**2)
    cosine = math.cos(chief.inclination)
    return SecularRates(
        right_ascension=-2.0 * factor * cosine,
        argument_of_perigee=factor * (5.0 * cosine * cosine - 1.0),
        mean_anomaly=chief.mean_motion + factor * root * (3.0 * cosine * cosine - 1.0),
    )


def drifted(chief: KeplerianChief, duration: float) -> KeplerianChief:
    """The mean elements `duration` s later, as the elements of time zero."""
    rates = secular_rates(chief)
    return replace(
        chief,
        right_ascension=chief.right_ascension + rates.right_ascension * duration,
        argument_of_perigee=chief.argument_of_perigee + rates.argument_of_perigee * duration,
        mean_anomaly=chief.mean_anomaly + rates.mean_anomaly * duration,
    )


def element_transition(chief: KeplerianChief, duration: float) -> Array:
    """Transition of mean relative elements under J2, from time zero to `duration` s later.

    Args:
        chief: by mean elements at time zero.
        duration: s, may be negative.

    Returns:
        Shape (6, 6), dimensionless, for elements in the order of this module.

    Source: Koenig, Guffanti & D'Amico 2017, appendix: quasi-nonsingular elements under J2.
    """
    e, factor = chief.eccentricity, _oblateness(chief) * duration
    square = 1.0 - e * e
    root = math.sqrt(square)
    cosine, sine = math.cos(chief.inclination), math.sin(chief.inclination)
    node, perigee, twice = 3.0 * cosine * cosine - 1.0, 5.0 * cosine * cosine - 1.0, 2.0 * sine * cosine
    turn = factor * perigee
    ex, ey = e * math.cos(chief.argument_of_perigee), e * math.sin(chief.argument_of_perigee)
    later = chief.argument_of_perigee + turn
    end_x, end_y = e * math.cos(later), e * math.sin(later)
    # A difference of the perigee's rate turns the eccentricity vector at the end.
    eccentric = 4.0 / square * perigee
    by_perigee = factor * np.array([-3.5 * perigee, 0.0, eccentric * ex, eccentric * ey, -5.0 * twice, 0.0])
    transition = np.eye(6)
    transition[1] = (
        -1.5 * chief.mean_motion * duration - 3.5 * factor * (1.0 + root) * node,
        1.0,
        factor * (4.0 + 3.0 * root) / square * node * ex,
        factor * (4.0 + 3.0 * root) / square * node * ey,
        -factor * (4.0 + 3.0 * root) * twice,
        0.0,
    )
    turned = np.zeros((2, 6))
    turned[:, 2:4] = ((math.cos(turn), -math.sin(turn)), (math.sin(turn), math.cos(turn)))
    transition[2] = turned[0] - end_y * by_perigee
    transition[3] = turned[1] + end_x * by_perigee
    transition[5] = factor * np.array(
        [3.5 * twice, 0.0, -4.0 * ex / square * twice, -4.0 * ey / square * twice, 2.0 * sine * sine, 0.0]
    )
    transition[5, 5] = 1.0
    return transition


def oblate_acceleration(position: Array, gravitational_parameter: float) -> Array:
    """Acceleration by J2 about the inertial z axis.

    Args:
        position: inertial, m, shape (3,).
        gravitational_parameter: GM, m^3/s^2.

    Returns:
        Inertial, m/s^2, shape (3,).

    Source: Vallado, Fundamentals of Astrodynamics and Applications, ch. 8.
    """
    square = float(position @ position)
    size = -1.5 * OBLATENESS * gravitational_parameter * EQUATORIAL_RADIUS**2
    above = 5.0 * float(position[2]) ** 2 / square
    acceleration: Array = (
        size / (square * square * math.sqrt(square)) * position * (np.array([1.0, 1.0, 3.0]) - above)
    )
    return acceleration


def as_array(chief: KeplerianChief) -> Array:
    """(a, e, i, right ascension, argument of perigee, mean anomaly), m and rad, as brahe takes them."""
    return np.array(
        [
            chief.semi_major_axis,
            chief.eccentricity,
            chief.inclination,
            chief.right_ascension,
            chief.argument_of_perigee,
            chief.mean_anomaly,
        ]
    )


def _oblateness(chief: KeplerianChief) -> float:
    """3/4 J2 (R/p)^2 n, rad/s, p the semi-latus rectum."""
    a, square = chief.semi_major_axis, 1.0 - chief.eccentricity**2
    motion = math.sqrt(GRAVITATIONAL_PARAMETER / a**3)
    return 0.75 * OBLATENESS * (EQUATORIAL_RADIUS / (a * square)) ** 2 * motion
