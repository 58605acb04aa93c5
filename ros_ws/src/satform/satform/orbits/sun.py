# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Sun, Earth angle and Earth's shadow, as the force models have them."""

import math
from datetime import datetime, timedelta

import numpy as np

from satform.numeric.elementwise import Array
from satform.orbits.chief import J2000, as_utc
from satform.orbits.frames import earth_rotation_angle
from satform.orbits.time_scales import brahe_epoch


def sun_direction(days: float) -> Array:
    """Unit vector from the Earth to the sun, as the force models have it.

    It lags behind the true Sun by 0.2 arc minutes for each year since 2000, to 0.25 arc minutes: by 5 in 2025
    and 7 in 2035. The series leaves out that the perihelion moves in inertial space, by 0.32 deg a century.
    Aberration (0.34 arc minutes) is left out.

    Args:
        days: since 2000-01-01 12:00 UTC.

    Returns:
        Inertial components (GCRF), shape (3,).

    Source: brahe's low-precision series.
    """
    position = sun_position(days)
    return position / math.sqrt(float(position @ position))


def sun_position(days: float) -> Array:
    """The sun from the Earth's centre, as the force models have it.

    Args:
        days: since 2000-01-01 12:00 UTC.

    Returns:
        Inertial position (GCRF), m, shape (3,).
    """
    import brahe  # noqa: PLC0415  slow to import, and few scenarios look at the sun

    position: Array = brahe.sun_position(brahe_epoch(J2000 + timedelta(days=days)))
    return position


def greenwich_angle(days: float) -> float:
    """Earth rotation angle, as gravity with `rotation: closed` has it.

    Args:
        days: since 2000-01-01 12:00 UTC.

    Returns:
        rad, within one turn.

    Source: see `satform.orbits.frames.earth_rotation_angle`.
    """
    whole = math.floor(days)
    return earth_rotation_angle(whole, 86400.0 * (days - whole))


def in_cylindrical_shadow(position: Array, sun: Array) -> bool:
    """Whether the Earth hides the sun, whose rays are taken as parallel, by brahe's cylindrical shadow.

    Args:
        position: inertial, m, shape (3,).
        sun: unit vector to the sun, inertial, shape (3,).

    Returns:
        True in the shadow.
    """
    import brahe  # noqa: PLC0415  slow to import, and few scenarios look at the sun

    return float(brahe.eclipse_cylindrical(position, sun)) == 0.0


def sun_in_lvlh(days: float, longitude: float) -> Array:
    """Unit vector to the sun in the LVLH axes of a geostationary chief.

    Args:
        days: since 2000-01-01 12:00 UTC.
        longitude: of the chief, east of Greenwich, rad.

    Returns:
        Components radial, along-track and cross-track, shape (3,).

    Source: Geometry; see `sun_direction` for the accuracy.
    """
    x, y, z = sun_direction(days).tolist()
    angle = greenwich_angle(days) + longitude
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([cosine * x + sine * y, cosine * y - sine * x, z])


def days_at(moment: datetime) -> float:
    """Days since 2000-01-01 12:00 UTC of a moment; without a time zone it is in UTC."""
    return (as_utc(moment) - J2000).total_seconds() / 86400.0
