# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Orbits as a scenario gives them, by elements, a state or a file: each becomes one inertial state."""

import math
from datetime import datetime
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from satform.common.angle_text import OR_DEGREES
from satform.common.spec import Spec
from satform.files.named_file import NamedFile
from satform.numeric.elementwise import Array
from satform.orbits.chief import Angle, ChiefOrbitSpec, mean_anomaly
from satform.orbits.earth import GRAVITATIONAL_PARAMETER_EGM2008
from satform.orbits.orbit_files import OrbitMotion, from_lines, from_oem, from_omm, from_tle
from satform.orbits.osculating import OrbitalState
from satform.orbits.time_scales import TimeScale, utc_of

Coordinate = Annotated[float, Field(ge=-1e10, le=1e10)]
Speed = Annotated[float, Field(ge=-1e5, le=1e5)]


class OrbitSource(Spec):
    """Base of orbits: an inertial state at a date."""

    def state_at(self, date: datetime) -> OrbitalState:
        """The inertial state at a date in UTC; of elements and of a state as they stand.

        Raises:
            ValueError: it is not known then, or no orbit is like this.
        """
        raise NotImplementedError


class KeplerianFields(OrbitSource):
    """Osculating Keplerian elements, in the axes of GCRF."""

    semi_major_axis: Annotated[float, Field(ge=1.0, le=1e10)]
    """Semi-major axis, m."""
    eccentricity: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Eccentricity."""
    inclination: Annotated[float, Field(ge=0.0, le=math.pi), OR_DEGREES]
    """Inclination to the inertial x-y plane [rad]."""
    right_ascension: Angle = 0.0
    """Right ascension of the ascending node [rad]."""
    argument_of_perigee: Angle = 0.0
    """Angle from the ascending node to the perigee [rad]."""
    true_anomaly: Angle | None = None
    """Angle from the perigee to the satellite [rad]; this, or one of the next two."""
    mean_anomaly: Angle | None = None
    """Mean anomaly [rad]."""
    argument_of_latitude: Angle | None = None
    """Angle from the ascending node to the satellite [rad]."""

    @model_validator(mode="after")
    def _one_anomaly(self) -> "KeplerianFields":
        names = ("true_anomaly", "mean_anomaly", "argument_of_latitude")
        given = [name for name in names if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                "give exactly one of true_anomaly, mean_anomaly, argument_of_latitude; found "
                f"{' and '.join(given) if given else 'none'}"
            )
        return self

    def elements(self) -> Array:
        """Semi-major axis (m), e, i, right ascension, argument of perigee, mean anomaly (rad), (6,)."""
        mean = self.mean_anomaly
        if mean is None:
            true = self.true_anomaly
            if true is None:
                assert self.argument_of_latitude is not None  # noqa: S101 - the validator has seen to it
                true = self.argument_of_latitude - self.argument_of_perigee
            mean = mean_anomaly(true, self.eccentricity)
        shape = (self.semi_major_axis, self.eccentricity, self.inclination)
        return np.array([*shape, self.right_ascension, self.argument_of_perigee, mean])

    def state_at(self, date: datetime) -> OrbitalState:
        """The inertial state; as in `OrbitSource.state_at`."""
        return OrbitalState.from_elements(self.elements())


class MotionFields(OrbitSource):
    """Base of orbits by a file or by mean elements, which give the motion over some time."""

    @model_validator(mode="after")
    def _readable(self) -> "MotionFields":
        _ = self.motion
        return self

    @cached_property
    def motion(self) -> OrbitMotion:
        """The motion.

        Raises:
            ValueError: what is given cannot be read.
        """
        raise NotImplementedError

    def state_at(self, date: datetime) -> OrbitalState:
        """The inertial state at a date; as in `OrbitSource.state_at`."""
        return self.motion.state_at(date)


class TleFields(MotionFields):
    """Two-line elements of a file or as they stand, propagated by SGP4."""

    file: NamedFile | None = None
    """File with the two lines, and one with the name before them or not; this or `lines`."""
    lines: Annotated[tuple[str, ...], Field(min_length=2, max_length=3)] | None = None
    """The two lines themselves."""

    @cached_property
    def motion(self) -> OrbitMotion:
        """Motion by SGP4."""
        if (self.file is None) == (self.lines is None):
            raise ValueError("give exactly one of file and lines")
        return from_lines(self.lines or (), "lines") if self.file is None else from_tle(self.file)


class OmmFields(MotionFields):
    """Mean elements of an OMM file of CCSDS, propagated by SGP4."""

    file: NamedFile
    """OMM file: key-value notation, XML or JSON."""

    @cached_property
    def motion(self) -> OrbitMotion:
        """Motion by SGP4."""
        return from_omm(self.file)


class OemFields(MotionFields):
    """Ephemeris of an OEM file of CCSDS, interpolated by Lagrange's polynomial."""

    file: NamedFile
    """OEM file of one segment in GCRF, ICRF, EME2000 or TEME: key-value notation, XML or JSON."""

    @cached_property
    def motion(self) -> OrbitMotion:
        """Motion along the ephemeris."""
        return from_oem(self.file)


def inertial_state(position: tuple[float, ...], velocity: tuple[float, ...], frame: str) -> OrbitalState:
    """A state in GCRF.

    Args:
        position: m, shape (3,).
        velocity: m/s, shape (3,).
        frame: GCRF or EME2000.

    Source: the frame bias, as computed by brahe.
    """
    state = np.array([*position, *velocity], dtype=np.float64)
    if frame == "EME2000":
        import brahe  # noqa: PLC0415  slow to import

        state = np.asarray(brahe.state_eme2000_to_gcrf(state))
    return OrbitalState.from_array(state)


class ChiefFields(OrbitSource):
    """What all the chief's orbits have in common: the date of time zero."""

    time_scale: TimeScale = "UTC"
    """Time scale of `epoch`."""

    def own_epoch(self) -> datetime | None:
        """The date of time zero in the scenario's words."""
        epoch: datetime | None = getattr(self, "epoch", None)
        return epoch

    @cached_property
    def time_zero(self) -> datetime:
        """Date of time zero, UTC."""
        epoch = self.own_epoch()
        if epoch is None:
            motion: OrbitMotion = self.motion  # type: ignore[attr-defined]
            return motion.epoch
        return utc_of(epoch, self.time_scale)

    @cached_property
    def at_time_zero(self) -> OrbitalState:
        """The chief's inertial state at time zero."""
        return self.state_at(self.time_zero)

    @model_validator(mode="after")
    def _is_an_ellipse(self) -> "ChiefFields":
        _ = self.mean_motion
        return self

    @property
    def orbit(self) -> ChiefOrbitSpec:
        """Osculating orbit at time zero."""
        return self._osculating[0]

    @property
    def mean_motion(self) -> float:
        """Osculating mean motion at time zero, rad/s."""
        return math.sqrt(GRAVITATIONAL_PARAMETER_EGM2008 / self._osculating[1] ** 3)

    @cached_property
    def _osculating(self) -> tuple[ChiefOrbitSpec, float]:
        return self.at_time_zero.orbit()


class KeplerianOrbitSpec(ChiefFields, KeplerianFields):
    """The chief's orbit by osculating Keplerian elements."""

    kind: Literal["keplerian"] = "keplerian"
    epoch: datetime
    """Date of the elements and of time zero, in `time_scale`."""


class CartesianOrbitSpec(ChiefFields):
    """The chief's orbit by its inertial state."""

    kind: Literal["cartesian"] = "cartesian"
    position: tuple[Coordinate, Coordinate, Coordinate]
    """Inertial position, m."""
    velocity: tuple[Speed, Speed, Speed]
    """Inertial velocity, m/s."""
    frame: Literal["GCRF", "EME2000"] = "GCRF"
    """Inertial frame of position and velocity."""
    epoch: datetime
    """Date of the state and of time zero, in `time_scale`."""

    def state_at(self, date: datetime) -> OrbitalState:
        """The inertial state; as in `OrbitSource.state_at`."""
        return inertial_state(self.position, self.velocity, self.frame)


class TleOrbitSpec(ChiefFields, TleFields):
    """The chief's orbit by two-line elements: the osculating orbit of SGP4's state at time zero."""

    kind: Literal["tle"] = "tle"
    epoch: datetime | None = None
    """Date of time zero, in `time_scale`; the elements' own when left out."""


class OmmOrbitSpec(ChiefFields, OmmFields):
    """The chief's orbit by an OMM file: the osculating orbit of SGP4's state at time zero."""

    kind: Literal["omm"] = "omm"
    epoch: datetime | None = None
    """Date of time zero, in `time_scale`; the elements' own when left out."""


class OemOrbitSpec(ChiefFields, OemFields):
    """The chief's orbit by an OEM file: the osculating orbit of its state at time zero."""

    kind: Literal["oem"] = "oem"
    epoch: datetime | None = None
    """Date of time zero, in `time_scale`, within the ephemeris; its first state's when left out."""


OrbitSpec = Annotated[
    KeplerianOrbitSpec | CartesianOrbitSpec | TleOrbitSpec | OmmOrbitSpec | OemOrbitSpec,
    Field(discriminator="kind"),
]
"""The chief's orbit as a scenario gives it."""
