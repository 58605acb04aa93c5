# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The Earth's constants."""

import math

GRAVITATIONAL_PARAMETER = 3.986004418e14
"""With the atmosphere, m^3/s^2 (WGS 84); of laws, plans and linear models."""

GRAVITATIONAL_PARAMETER_EGM2008 = 3.986004415e14
"""Of the gravity field EGM2008, with which truth models propagate, m^3/s^2."""

EQUATORIAL_RADIUS = 6378137.0
"""m (WGS 84)."""

ROTATION_RATE = 2.0 * math.pi * 1.00273781191135448 / 86400.0
"""Relative to inertial space with UT1 = UTC, rad/s (IERS Conventions 2010, Eq. 5.15)."""

OBLATENESS = 1.08262668e-3
"""Second zonal harmonic J2."""
