"""The Earth's constants."""

GRAVITATIONAL_PARAMETER = 3.986004418e14
"""With the atmosphere, m^3/s^2 (WGS 84)."""

EQUATORIAL_RADIUS = 6378137.0
"""m (WGS 84)."""

ROTATION_RATE = 7.2921159e-5
"""Relative to inertial space, rad/s (WGS 84, rounded)."""

OBLATENESS = 1.08262668e-3
"""Second zonal harmonic J2."""
