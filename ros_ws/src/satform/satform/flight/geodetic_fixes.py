# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Positions relative to the chief as latitude, longitude and altitude, as a GNSS receiver gives them."""

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from satform.flight.orbit_states import OrbitStates, orbit_states
from satform.numeric.elementwise import Array
from satform.orbits.chief import as_utc
from satform.orbits.frames import EarthRotation, LvlhFrame
from satform.scenario import Scenario
from satform.scenario.environment import earth_rotation

if TYPE_CHECKING:
    from satform.flight.plant import Plant


@dataclass(frozen=True)
class GeodeticFix:
    """A position on the WGS 84 ellipsoid.

    Attributes:
        latitude: geodetic, deg.
        longitude: deg.
        altitude: above the ellipsoid, m.
        local_axes: rows are east, north and up in components of LVLH, shape (3, 3).
    """

    latitude: float
    longitude: float
    altitude: float
    local_axes: Array


@dataclass(frozen=True)
class GeodeticPlan:
    """What geodetic positions of a flight follow from.

    Attributes:
        orbits: motion of the chief.
        rotation: of the Earth.
        latency: of the slowest receiver, steps.
    """

    orbits: OrbitStates
    rotation: EarthRotation
    latency: int


def geodetic_plan(scenario: Scenario, latency: int) -> GeodeticPlan | None:
    """What geodetic positions of a flight follow from; None where the chief's orbit has no epoch.

    Without a truth model that has an Earth it turns as brahe says, with UT1 = UTC and no polar motion.

    Args:
        scenario: what is flown.
        latency: of the slowest receiver, steps.
    """
    orbits = orbit_states(scenario)
    if orbits is None:
        return None
    rotation = earth_rotation(scenario.dynamics)
    if rotation is None:
        from satform.dynamics.orbital_forces import FullEarthRotation  # noqa: PLC0415  brahe is slow to import
        from satform.orbits.time_scales import brahe_epoch  # noqa: PLC0415  likewise

        rotation = FullEarthRotation(brahe_epoch(as_utc(orbits.epoch)))
    return GeodeticPlan(orbits, rotation, latency)


class GeodeticFixes:
    """Geodetic positions at the newest steps of a flight, as far back as readings are late."""

    def __init__(self, plan: GeodeticPlan) -> None:
        """No step is known yet.

        Args:
            plan: of the flight.
        """
        self._plan = plan
        self._known: deque[tuple[int, LvlhFrame, Array]] = deque(maxlen=plan.latency + 1)

    def note(self, plant: "Plant") -> None:
        """Take in the chief and the Earth at the plant's present step."""
        if self._known and self._known[-1][0] == plant.step:
            return
        turned = self._plan.rotation.matrix(plant.step * self._plan.orbits.step)
        self._known.append((plant.step, self._plan.orbits.chief_frame(plant), turned))

    def at(self, position: Array, step: int) -> GeodeticFix | None:
        """A position; None at a step that is not known any more.

        Args:
            position: LVLH, m, shape (3,).
            step: at which it was measured.
        """
        for known, frame, turned in self._known:
            if known == step:
                return _fix(position, frame, turned)
        return None


def _fix(position: Array, frame: LvlhFrame, turned: Array) -> GeodeticFix:
    """A position of LVLH on the ellipsoid.

    Args:
        position: LVLH, m, shape (3,).
        frame: LVLH in inertial space.
        turned: rotation of inertial into Earth-fixed components, shape (3, 3).
    """
    import brahe  # noqa: PLC0415  slow to import, and few scenarios need it

    degrees: Any = brahe.AngleFormat.DEGREES
    inertial = frame.origin_position + frame.vector_to_inertial(position)
    longitude, latitude, altitude = brahe.position_ecef_to_geodetic(turned @ inertial, degrees).tolist()
    east, up = np.radians(longitude), np.radians(latitude)
    axes = np.array(
        [
            [-np.sin(east), np.cos(east), 0.0],
            [-np.sin(up) * np.cos(east), -np.sin(up) * np.sin(east), np.cos(up)],
            [np.cos(up) * np.cos(east), np.cos(up) * np.sin(east), np.sin(up)],
        ]
    )
    return GeodeticFix(latitude, longitude, altitude, frame.vector_to_lvlh(axes @ turned))
