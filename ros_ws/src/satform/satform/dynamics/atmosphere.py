# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Density of the upper atmosphere: Harris-Priester with any exponent, and NRLMSISE-00 with any activity.

Harris-Priester is a table for mean solar activity (a flux of 150 at 10.7 cm), from 100 to 1000 km, between
a bulge that follows the Sun by two hours and its opposite. NRLMSISE-00 follows solar and geomagnetic
activity, which a scenario gives as constants: nothing is downloaded. Drag is computed from this density in
`orbital_forces.Drag`.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import brahe
import numpy as np

from satform.dynamics.atmosphere_specs import HarrisPriesterSpec, Nrlmsise00Spec
from satform.numeric.elementwise import Array
from satform.orbits.earth_orientation import EarthOrientation
from satform.orbits.frames import EarthRotation, rotation_about_z

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_BRAHES_EXPONENT = 6.0
"""Of brahe's Harris-Priester model, which takes no other."""

_SAME_AXES = np.eye(3).tolist()
"""The rotation into the equator of date where that is the inertial one."""

_LAG = 0.523599
"""Angle in rad by which the density's bulge follows the Sun, as brahe has it: two hours."""


class Atmosphere(Protocol):
    """Density as a function of time and place."""

    def at(self, time: float) -> "Callable[[Array], float]":
        """Density at one instant, `time` s after the epoch, as a function of the inertial position."""

    def densities(self, time: float, positions: "Sequence[Array]") -> list[float]:
        """Densities.

        Args:
            time: s after the epoch.
            positions: inertial, m, shape (3,) each.

        Returns:
            kg/m^3.
        """


@dataclass(frozen=True)
class HarrisPriester:
    """The table of Harris and Priester for mean solar activity.

    Attributes:
        epoch: brahe's epoch of time zero.
        equator: rotation of inertial axes into the true equator of date, (3, 3).
        exponent: of the cosine of half the angle to the bulge, 2 to 6.

    Source: Montenbruck & Gill, Satellite Orbits, section 3.5.2.
    """

    epoch: Any
    equator: Array
    exponent: float = _BRAHES_EXPONENT

    def at(self, time: float) -> "Callable[[Array], float]":
        """Density at one instant; as in `Atmosphere.at`."""
        sun: Array = self.equator @ brahe.sun_position(self.epoch + time)
        if self.exponent == _BRAHES_EXPONENT and self.equator.tolist() == _SAME_AXES:
            # Half of the time that the general case takes, for the same numbers.
            density = brahe.density_harris_priester
            return lambda position: density(position, sun)
        return lambda position: self._density(self.equator @ position, sun)

    def densities(self, time: float, positions: "Sequence[Array]") -> list[float]:
        """Densities; as in `Atmosphere.densities`."""
        density = self.at(time)
        return [density(position) for position in positions]

    def _density(self, position: Array, sun: Array) -> float:
        if self.exponent == _BRAHES_EXPONENT:
            return float(brahe.density_harris_priester(position, sun))
        # The table's limits at this height are the densities in the bulge and opposite to it.
        outward = position / math.sqrt(float(position @ position))
        behind = rotation_about_z(_LAG)
        largest = float(brahe.density_harris_priester(position, behind @ outward))
        least = float(brahe.density_harris_priester(position, behind @ -outward))
        bulge = behind.T @ (sun / math.sqrt(float(sun @ sun)))
        half_cosine = 0.5 + 0.5 * float(outward @ bulge)
        return least + (largest - least) * math.pow(max(0.0, half_cosine), 0.5 * self.exponent)


@dataclass(frozen=True)
class Nrlmsise00:
    """The empirical model NRLMSISE-00 at constant activity.

    Attributes:
        epoch: brahe's epoch of time zero.
        rotation: of the Earth-fixed frame.
        orientation: Earth orientation parameters of this flight.
        weather: brahe's provider of constant indices.

    Source: Picone, Hedin, Drob & Aikin 2002, J. Geophys. Res. 107(A12).
    """

    epoch: Any
    rotation: EarthRotation
    orientation: EarthOrientation
    weather: Any

    def at(self, time: float) -> "Callable[[Array], float]":
        """Density at one instant; as in `Atmosphere.at`."""
        matrix, now = self.rotation.matrix(time), self.epoch + time
        return lambda position: self.orientation.density(now, matrix @ position, self.weather)

    def densities(self, time: float, positions: "Sequence[Array]") -> list[float]:
        """Densities; as in `Atmosphere.densities`."""
        density = self.at(time)
        return [density(position) for position in positions]


def atmosphere_of(
    spec: HarrisPriesterSpec | Nrlmsise00Spec,
    epoch: Any,
    equator: Array,
    rotation: EarthRotation,
    orientation: EarthOrientation,
) -> Atmosphere:
    """The atmosphere that a scenario chooses.

    Args:
        spec: what the scenario says.
        epoch: brahe's epoch of time zero.
        equator: rotation of inertial axes into the true equator of date, (3, 3).
        rotation: of the Earth-fixed frame.
        orientation: Earth orientation parameters of this flight.
    """
    if isinstance(spec, HarrisPriesterSpec):
        return HarrisPriester(epoch, np.asarray(equator), spec.exponent)
    # brahe 1.8 takes the flux of the day for its mean over 81 days, too.
    weather = brahe.StaticSpaceWeatherProvider.from_values(0.0, spec.ap, spec.f107, spec.f107, 0)
    return Nrlmsise00(epoch, rotation, orientation, weather)
