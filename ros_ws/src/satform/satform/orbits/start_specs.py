# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Where satellites start, as a scenario gives it: relative elements, states, elements or files."""

import math
from datetime import datetime
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.common.spec import NonNegative, Number, Spec
from satform.numeric.elementwise import Array
from satform.orbits.chief import Angle
from satform.orbits.orbit_specs import (
    Coordinate,
    KeplerianFields,
    OemFields,
    OmmFields,
    OrbitSource,
    Speed,
    TleFields,
    inertial_state,
)
from satform.orbits.osculating import OrbitalState


class RelativeElementFields(Spec):
    """Base of starts by relative elements."""

    elements: Literal["osculating", "mean"] = "osculating"
    """mean: the periodic effect of J2 within an orbit is averaged out, to first order."""

    def relative_elements(self) -> Array:
        """(a da, a dlambda, a dex, a dey, a dix, a diy), a the chief's semi-major axis, m, shape (6,)."""
        raise NotImplementedError


class RelativeElementsStartSpec(RelativeElementFields):
    """Start by quasi-nonsingular relative orbital elements, times the chief's semi-major axis."""

    kind: Literal["relative_elements"] = "relative_elements"
    semi_major_axis: Number = 0.0
    """a da: difference of the semi-major axes, m."""
    mean_longitude: Number = 0.0
    """a dlambda: difference of the mean longitudes, m."""
    eccentricity_x: Number = 0.0
    """a dex: x component of the relative eccentricity vector, m."""
    eccentricity_y: Number = 0.0
    """a dey: its y component, m."""
    inclination_x: Number = 0.0
    """a dix: x component of the relative inclination vector, m."""
    inclination_y: Number = 0.0
    """a diy: its y component, m."""

    def relative_elements(self) -> Array:
        """The six elements; as in `RelativeElementFields.relative_elements`."""
        vectors = (self.eccentricity_x, self.eccentricity_y, self.inclination_x, self.inclination_y)
        return np.array([self.semi_major_axis, self.mean_longitude, *vectors])


class EccentricityInclinationStartSpec(RelativeElementFields):
    """Start by magnitude and phase of the relative eccentricity and inclination vectors.

    Vectors of equal or opposite phase keep satellites apart in the plane of the radial and normal axes.
    """

    kind: Literal["eccentricity_inclination"] = "eccentricity_inclination"
    eccentricity: NonNegative
    """Magnitude of the relative eccentricity vector times the chief's semi-major axis, m."""
    eccentricity_phase: Angle = 0.0
    """Mean argument of latitude at which the satellite is lowest [rad]."""
    inclination: NonNegative
    """Magnitude of the relative inclination vector times the chief's semi-major axis, m."""
    inclination_phase: Angle = 0.0
    """Mean argument of latitude at which the satellite crosses the chief's plane going up [rad]."""
    along_track_offset: Number = 0.0
    """Difference of the mean longitudes times the chief's semi-major axis, m."""

    def relative_elements(self) -> Array:
        """The six elements; as in `RelativeElementFields.relative_elements`."""
        e, i = self.eccentricity, self.inclination
        towards, up = self.eccentricity_phase, self.inclination_phase
        vectors = (e * math.cos(towards), e * math.sin(towards), i * math.cos(up), i * math.sin(up))
        return np.array([0.0, self.along_track_offset, *vectors])


class CartesianStartSpec(Spec):
    """Start by position and velocity, relative to the chief or inertial."""

    kind: Literal["cartesian"] = "cartesian"
    position: tuple[Coordinate, Coordinate, Coordinate]
    """Position, m."""
    velocity: tuple[Speed, Speed, Speed]
    """Velocity, m/s; in LVLH as seen in the rotating frame."""
    frame: Literal["LVLH", "GCRF", "EME2000"] = "LVLH"
    """LVLH: x radial, y along-track, z normal, from the chief; the others from the Earth's centre."""

    def state_at(self, date: datetime) -> OrbitalState:
        """The inertial state, of a start that is not in LVLH."""
        return inertial_state(self.position, self.velocity, self.frame)


class KeplerianStartSpec(KeplerianFields):
    """Start by osculating Keplerian elements at time zero."""

    kind: Literal["keplerian"] = "keplerian"


class TleStartSpec(TleFields):
    """Start by two-line elements: SGP4's state at time zero."""

    kind: Literal["tle"] = "tle"


class OmmStartSpec(OmmFields):
    """Start by an OMM file: SGP4's state at time zero."""

    kind: Literal["omm"] = "omm"


class OemStartSpec(OemFields):
    """Start by an OEM file: its state at time zero."""

    kind: Literal["oem"] = "oem"


StartSpec = Annotated[
    RelativeElementsStartSpec
    | EccentricityInclinationStartSpec
    | CartesianStartSpec
    | KeplerianStartSpec
    | TleStartSpec
    | OmmStartSpec
    | OemStartSpec,
    Field(discriminator="kind"),
]
"""Where a satellite starts, as a scenario gives it."""

InertialStart = OrbitSource | CartesianStartSpec
"""A start that has an inertial state."""
