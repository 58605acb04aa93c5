"""Where the sun stands, to a hundredth of a degree, and whether the Earth hides it."""

import math
from datetime import UTC, datetime

import numpy as np

from satform.earth import EQUATORIAL_RADIUS
from satform.elementwise import Array


def days_since_2000(year: int, month: int, day: int, hour: float = 0.0) -> float:
    """Days since 2000-01-01 12:00, of a date of the Gregorian calendar.

    Args:
        year: 1901 to 2099.
        month: 1 to 12.
        day: of the month.
        hour: of the day, UTC.

    Returns:
        days.

    Source: Vallado, Fundamentals of Astrodynamics and Applications, ch. 3: Julian date.
    """
    whole = 367 * year - (7 * (year + (month + 9) // 12)) // 4 + (275 * month) // 9 + day
    return whole - 730531.5 + hour / 24.0


def sun_direction(days: float) -> Array:
    """Unit vector from the Earth to the sun.

    Args:
        days: since 2000-01-01 12:00.

    Returns:
        Inertial equatorial components, shape (3,), good to about 0.01 degrees between 1950 and 2050.

    Source: The Astronomical Almanac: low-precision formulas for the sun.
    """
    anomaly = math.radians(357.528 + 0.9856003 * days)
    mean_longitude = math.radians(280.460 + 0.9856474 * days)
    equation = math.radians(1.915 * math.sin(anomaly) + 0.020 * math.sin(2.0 * anomaly))
    longitude = mean_longitude + equation
    obliquity = math.radians(23.439 - 0.0000004 * days)
    return np.array(
        [
            math.cos(longitude),
            math.cos(obliquity) * math.sin(longitude),
            math.sin(obliquity) * math.sin(longitude),
        ]
    )


def greenwich_angle(days: float) -> float:
    """Right ascension of the Greenwich meridian.

    Args:
        days: since 2000-01-01 12:00.

    Returns:
        rad, within one turn.

    Source: Vallado, Fundamentals of Astrodynamics and Applications, ch. 3: mean sidereal time, linear
    part.
    """
    return math.radians((280.46061837 + 360.98564736629 * days) % 360.0)


def in_cylindrical_shadow(position: Array, sun: Array) -> bool:
    """Whether the spherical Earth hides the sun, whose rays are taken as parallel.

    Args:
        position: inertial, m, shape (3,).
        sun: unit vector to the sun, inertial, shape (3,).

    Returns:
        True in the shadow.

    Source: Vallado, Fundamentals of Astrodynamics and Applications, ch. 5.
    """
    along = float(np.dot(position, sun))
    off_axis = float(np.linalg.norm(position - along * sun))
    return along < 0.0 and off_axis < EQUATORIAL_RADIUS


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
    utc = moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)
    return (utc - datetime(2000, 1, 1, 12, tzinfo=UTC)).total_seconds() / 86400.0
