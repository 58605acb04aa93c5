# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Position and velocity in LVLH that a satellite's `start:` stands for.

A truth model in inertial space gives the chief's frame at time zero, in which the start is taken exactly. A
model that is linear about a circular orbit takes the start's relative elements through the map of
near-circular orbits, so that what grows with time does so at the right rate; it is off by the separation
times the eccentricity and times the separation over the chief's radius.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from satform.common.spec import Complaint
from satform.control.protocol import Motion
from satform.control.relative_elements import RelativeElements, motion_from_elements
from satform.dynamics.protocol import DynamicsSetting, DynamicsSpec
from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief, as_utc, semi_major_axis_of
from satform.orbits.earth import GRAVITATIONAL_PARAMETER_EGM2008
from satform.orbits.frames import LvlhFrame
from satform.orbits.inertial_motion import relative_elements
from satform.orbits.osculating import (
    OrbitalState,
    deputy_elements,
    osculating_relative_elements,
)
from satform.orbits.start_specs import CartesianStartSpec, InertialStart, RelativeElementFields, StartSpec
from satform.scenario.parts import Orbit, SatelliteSpec

_ERRORS = ("position_error", "velocity_error")
"""Fields of a satellite that a start excludes."""

_OF_THE_CHIEF = ("chief", "epoch")
"""Fields of a truth model that `orbit.chief` gives."""


@dataclass(frozen=True)
class ChiefAtStart:
    """What of the chief a satellite's start is counted from.

    Attributes:
        mean_motion: rad/s.
        elements: a in m, e, i, right ascension, argument of perigee and mean anomaly in rad, shape (6,);
            None for a circular orbit in an unknown plane.
        epoch: of time zero, UTC; None where the scenario has no date.
        frame: in which the truth model takes positions and velocities; None for a linear one.
    """

    mean_motion: float
    elements: Array | None
    epoch: datetime | None
    frame: LvlhFrame | None

    def motion(self, start: StartSpec) -> Motion:
        """Position in m and velocity in m/s in LVLH at time zero, shape (3,) each.

        Raises:
            ValueError: the start cannot be taken about this chief.
        """
        if isinstance(start, CartesianStartSpec) and start.frame == "LVLH":
            return Motion(np.array(start.position), np.array(start.velocity))
        if isinstance(start, RelativeElementFields):
            return self._by_elements(start)
        return self._by_state(start)

    def _by_elements(self, start: RelativeElementFields) -> Motion:
        scaled = start.relative_elements()
        if self.frame is None:
            return self._near_circular(scaled)
        chief = OrbitalState(self.frame.origin_position, self.frame.origin_velocity).elements()
        relative = scaled / chief[0]
        if start.elements == "mean":
            relative = osculating_relative_elements(chief, relative)
        state = OrbitalState.from_elements(deputy_elements(chief, relative))
        return Motion(*self.frame.to_lvlh(state.position, state.velocity))

    def _by_state(self, start: InertialStart) -> Motion:
        if self.elements is None or self.epoch is None:
            raise ValueError(
                "an inertial start needs the plane of the chief's orbit and the date: give orbit.chief, or a "
                "truth model that has both"
            )
        state = start.state_at(self.epoch)
        if self.frame is not None:
            return Motion(*self.frame.to_lvlh(state.position, state.velocity))
        chief = OrbitalState.from_elements(self.elements)
        scaled = relative_elements(chief.as_array(), state.as_array())
        if not np.all(np.isfinite(scaled)):
            raise ValueError("its orbit, or the chief's, is no ellipse or lies in the equator")
        return self._near_circular(scaled)

    def _near_circular(self, scaled: Array) -> Motion:
        """Motion by relative elements in m, shape (6,), near a circular orbit."""
        latitude = np.asarray(0.0 if self.elements is None else self.elements[4] + self.elements[5])
        mean_motion = np.asarray(self.mean_motion)
        return motion_from_elements(RelativeElements.from_array(scaled), mean_motion, latitude)


def chief_at_start(
    orbit: Orbit, dynamics: DynamicsSpec, setting: DynamicsSetting, known: KeplerianChief | None
) -> ChiefAtStart:
    """What of a scenario's chief the starts of its satellites are counted from.

    Args:
        orbit: the chief's.
        dynamics: the truth model, which knows the chief.
        setting: in which it is built.
        known: the chief's orbit at time zero; None for a circular one in an unknown plane.

    Raises:
        ValueError: the truth model cannot be flown.
    """
    rate, elements = setting.mean_motion, None
    epoch: datetime | None = getattr(dynamics, "epoch", None)
    if orbit.chief is not None:
        elements, epoch = orbit.chief.at_time_zero.elements(), orbit.chief.time_zero
    elif known is not None:
        plane = (known.inclination, known.right_ascension, known.argument_of_perigee, known.mean_anomaly)
        axis = semi_major_axis_of(rate, GRAVITATIONAL_PARAMETER_EGM2008)
        elements = np.array([axis, known.eccentricity, *plane])
    return ChiefAtStart(
        mean_motion=rate,
        elements=elements,
        epoch=None if epoch is None else as_utc(epoch),
        frame=dynamics.start_frame(setting),
    )


def chief_complaints(dynamics: DynamicsSpec) -> list[Complaint]:
    """What a truth model says of the chief though `orbit.chief` says it: field and sentence of each."""
    given = [name for name in _OF_THE_CHIEF if name in dynamics.model_fields_set]
    return [
        (("dynamics", name), f"orbit.chief gives the chief's orbit and the date; leave dynamics.{name} out")
        for name in given
    ]


def without_chief(dynamics: DynamicsSpec, orbit: Orbit) -> DynamicsSpec:
    """A truth model as the scenario has it, without what follows from `orbit.chief`."""
    if orbit.chief is None:
        return dynamics
    fields = type(dynamics).model_fields
    return dynamics.model_copy(
        update={name: fields[name].default for name in _OF_THE_CHIEF if name in fields}
    )


def start_complaints(
    satellites: Sequence[SatelliteSpec], shared: Collection[str], start_of: Callable[[int], Motion | None]
) -> list[Complaint]:
    """Why satellites cannot start where the scenario says: field and sentence of each fault.

    Args:
        satellites: as the scenario has them.
        shared: names of the fields that `satellite_defaults` sets.
        start_of: motion at time zero by a satellite's `start`, from its index.
    """
    found: list[Complaint] = []
    for index, satellite in enumerate(satellites):
        if satellite.start is None:
            continue
        own = [name for name in _ERRORS if name in satellite.model_fields_set]
        twice = own or [f"{name} of satellite_defaults" for name in _ERRORS if name in shared]
        try:
            motion = start_of(index)
            assert motion is not None  # noqa: S101 - the satellite has a start
            if twice:
                raise ValueError(f"it says where the satellite is; leave {' and '.join(twice)} out")
            if not np.all(np.isfinite([motion.position, motion.velocity])):
                raise ValueError("it stands for no finite position and velocity")
        except ValueError as error:
            path = ("satellites", index, "start")
            found.append((path, f"the start of satellite {satellite.name}: {error}"))
    return found


def known_starts(count: int, start_of: Callable[[int], Motion | None]) -> list[Motion | None]:
    """Motion at time zero of each satellite whose `start` says it; None for the others.

    Args:
        count: of satellites.
        start_of: as in `start_complaints`, which names the faults that are passed over here.
    """
    found: list[Motion | None] = []
    for index in range(count):
        try:
            found.append(start_of(index))
        except ValueError:
            found.append(None)
    return found
