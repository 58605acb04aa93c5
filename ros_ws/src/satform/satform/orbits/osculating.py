# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Osculating orbit of an inertial state: its elements, and the chief's orbit that starts in it.

brahe's elements of a state lose half of the digits on orbits that are nearly circular, and all of them at
inclination 0: for eccentricities of 1e-9 the state that is made of them again is 7 mm away. Here they come
from the vectors of eccentricity and angular momentum, and the state is kept to rounding for every
eccentricity and inclination. brahe's states of elements fail for eccentricities from 0.98 on; they are
computed here too. Between relative and absolute elements the map is brahe's; mean elements are those of
`satform.orbits.mean_elements`.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.numeric.elementwise import Array
from satform.orbits.chief import ChiefOrbitSpec, KeplerianChief, mean_anomaly
from satform.orbits.earth import GRAVITATIONAL_PARAMETER_EGM2008
from satform.orbits.inertial_motion import relative_elements
from satform.orbits.j2_elements import as_array
from satform.orbits.kepler import eccentric_anomaly, radius_ratio
from satform.orbits.mean_elements import mean_chief, osculating_elements


@dataclass(frozen=True)
class OrbitalState:
    """Inertial motion at one instant.

    Attributes:
        position: GCRF, m, shape (3,).
        velocity: GCRF, m/s, shape (3,).
    """

    position: Array
    velocity: Array

    @classmethod
    def from_array(cls, state: Array) -> "OrbitalState":
        """The state of six numbers: position in m and velocity in m/s."""
        whole = np.asarray(state, dtype=np.float64)
        return cls(whole[:3].copy(), whole[3:].copy())

    @classmethod
    def from_elements(cls, elements: Array) -> "OrbitalState":
        """The state of Keplerian elements.

        Args:
            elements: a in m, e, i, right ascension, argument of perigee and mean anomaly in rad, shape (6,).

        Raises:
            ValueError: they are of no ellipse.

        Source: Battin, An Introduction to the Mathematics and Methods of Astrodynamics, ch. 3.
        """
        a, e, inclination, node, perigee, mean = (float(value) for value in elements)
        if not (0.0 < a < math.inf and 0.0 <= e < 1.0 and np.all(np.isfinite(elements))):
            raise ValueError(f"a semi-major axis of {a:g} m and an eccentricity of {e:g} make no ellipse")
        eccentric = eccentric_anomaly(mean, e)
        sine, cosine = math.sin(eccentric), math.cos(eccentric)
        root = math.sqrt((1.0 - e) * (1.0 + e))
        speed = math.sqrt(GRAVITATIONAL_PARAMETER_EGM2008 / a) / radius_ratio(eccentric, e)
        axes = ChiefOrbitSpec.model_construct(inclination=inclination, right_ascension=node)
        to_perigee, ahead, _ = axes.axes(perigee)
        # cos(E) - e, without cancellation near perigee.
        along = (1.0 - e) - 2.0 * math.sin(0.5 * eccentric) ** 2
        return cls(
            a * (along * to_perigee + root * sine * ahead),
            speed * (root * cosine * ahead - sine * to_perigee),
        )

    def as_array(self) -> Array:
        """Position in m and velocity in m/s, shape (6,)."""
        return np.concatenate((self.position, self.velocity))

    def elements(self) -> Array:
        """Osculating a in m, e, i, right ascension, argument of perigee and mean anomaly in rad, shape (6,).

        Raises:
            ValueError: the orbit is not an ellipse.
        """
        orbit, semi_major_axis = self.orbit()
        e = orbit.eccentricity
        mean = mean_anomaly(orbit.argument_of_latitude - orbit.argument_of_perigee, e)
        angles = (orbit.inclination, orbit.right_ascension, orbit.argument_of_perigee, mean)
        return np.array([semi_major_axis, e, *angles])

    def orbit(self) -> tuple[ChiefOrbitSpec, float]:
        """The orbit that a chief in this state starts on, and its semi-major axis in m.

        Raises:
            ValueError: the orbit is not an ellipse.

        Source: Battin, An Introduction to the Mathematics and Methods of Astrodynamics, ch. 3.
        """
        position, velocity = self.position, self.velocity
        radius, speed2 = float(np.linalg.norm(position)), float(velocity @ velocity)
        momentum = np.cross(position, velocity)
        size = float(np.linalg.norm(momentum))
        energy = 0.5 * speed2 - GRAVITATIONAL_PARAMETER_EGM2008 / radius if radius > 0.0 else math.inf
        if not (energy < 0.0 and size > 0.0):
            raise ValueError(
                f"a speed of {math.sqrt(speed2):.6g} m/s at {radius:.6g} m from the Earth's centre makes no "
                "ellipse"
            )
        radial, normal = position / radius, momentum / size
        # Towards the ascending node; on an equatorial orbit along x.
        node = np.array([-normal[1], normal[0], 0.0])
        tilt = float(np.linalg.norm(node))
        node = node / tilt if tilt > 0.0 else np.array([1.0, 0.0, 0.0])
        ahead = np.cross(normal, node)
        vector = np.cross(velocity, momentum) / GRAVITATIONAL_PARAMETER_EGM2008 - radial
        orbit = ChiefOrbitSpec(
            inclination=math.atan2(tilt, float(normal[2])),
            right_ascension=math.atan2(float(node[1]), float(node[0])),
            argument_of_latitude=math.atan2(float(radial @ ahead), float(radial @ node)),
            eccentricity=min(float(np.linalg.norm(vector)), math.nextafter(1.0, 0.0)),
            argument_of_perigee=math.atan2(float(vector @ ahead), float(vector @ node)),
        )
        return orbit, -0.5 * GRAVITATIONAL_PARAMETER_EGM2008 / energy


def deputy_elements(chief: Array, relative: Array) -> Array:
    """Elements of a satellite from its quasi-nonsingular relative elements.

    Args:
        chief: a in m, e, i, right ascension, argument of perigee and mean anomaly in rad, shape (6,).
        relative: (da, dlambda, dex, dey, dix, diy), of the unit 1, shape (6,).

    Raises:
        ValueError: no ellipse has these elements, or the chief is equatorial.

    Source: D'Amico 2010, as computed by brahe.
    """
    import brahe  # noqa: PLC0415  slow to import

    _require_inclined(chief)
    radians: Any = brahe.AngleFormat.RADIANS
    found: Array = np.array(brahe.state_roe_to_oe(chief, relative, radians))
    if not (np.all(np.isfinite(found)) and found[0] > 0.0 and found[1] < 1.0):
        raise ValueError(
            f"no ellipse has these relative elements: its semi-major axis would be {found[0]:g} m "
            f"and its eccentricity {found[1]:g}"
        )
    return found


def osculating_relative_elements(chief: Array, mean_relative: Array) -> Array:
    """Osculating relative elements from mean ones, both of the unit 1, shape (6,).

    The chief's mean elements follow from its osculating ones, the satellite's from the chief's, and the
    osculating elements of both from the mean ones by the same map, so that what the chief's are off by
    is common to both and cancels.

    Args:
        chief: osculating a in m, e, i, right ascension, argument of perigee, mean anomaly in rad, shape (6,).
        mean_relative: (da, dlambda, dex, dey, dix, diy), shape (6,).

    Raises:
        ValueError: as `deputy_elements`, or no mean elements are found for the chief's orbit.

    Source: first order in J2, `satform.orbits.mean_elements`.
    """
    _require_inclined(chief)
    mean = as_array(mean_chief(KeplerianChief(*chief.tolist())))
    osculating = osculating_elements(np.stack((mean, deputy_elements(mean, mean_relative))))
    states = [OrbitalState.from_elements(elements).as_array() for elements in osculating]
    found: Array = relative_elements(*states) / osculating[0, 0]
    if not np.all(np.isfinite(found)):
        raise ValueError("no mean elements are found for the chief's orbit; give osculating elements")
    return found


def _require_inclined(chief: Array) -> None:
    if abs(math.sin(chief[2])) < 1e-6:
        raise ValueError(
            "the chief's orbit lies in the equator, where relative elements do not tell how the orbit planes "
            "differ; give the start as kind: cartesian or keplerian"
        )
