# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Kepler's equation for every eccentricity below 1.

Differences that cancel near perigee of a very eccentric orbit are written without cancellation, so that the
solution is accurate there too.
"""

import math

_ITERATIONS = 50
"""Bound of Newton's method; it takes fewer than ten."""

_SMALL = 0.5
"""Anomaly in rad below which the series of E - sin(E) is used; seven terms of it have full precision."""


def eccentric_anomaly(mean_anomaly: float, eccentricity: float) -> float:
    """Eccentric anomaly from the mean one, rad, of the same revolution.

    Newton's method from above the solution, where Kepler's equation is convex and the iteration monotonic.

    Args:
        mean_anomaly: rad, of any size.
        eccentricity: at least 0 and below 1.

    Raises:
        ValueError: the eccentricity is of no ellipse, or the mean anomaly is not finite.

    Source: Battin, An Introduction to the Mathematics and Methods of Astrodynamics, ch. 5.
    """
    if not (0.0 <= eccentricity < 1.0 and math.isfinite(mean_anomaly)):
        raise ValueError(
            f"no true anomaly for eccentricity {eccentricity:g} and mean anomaly {mean_anomaly:g} rad"
        )
    if eccentricity == 0.0:
        return mean_anomaly
    revolutions = round(mean_anomaly / math.tau)
    within = mean_anomaly - math.tau * revolutions
    return math.tau * revolutions + math.copysign(_solved(abs(within), eccentricity), within)


def mean_from_eccentric(eccentric: float, eccentricity: float) -> float:
    """Mean anomaly from the eccentric one, rad, of the same revolution."""
    return (1.0 - eccentricity) * eccentric + eccentricity * _less_sine(eccentric)


def radius_ratio(eccentric: float, eccentricity: float) -> float:
    """Distance from the focus at an eccentric anomaly in rad, in semi-major axes: 1 - e cos(E)."""
    return (1.0 - eccentricity) + 2.0 * eccentricity * math.sin(0.5 * eccentric) ** 2


def _solved(mean: float, eccentricity: float) -> float:
    """Eccentric anomaly of a mean one within [0, pi], rad."""
    # Each of these is at or above the solution.
    found = min(
        math.pi,
        mean + eccentricity,
        mean / (1.0 - eccentricity),
        math.cbrt(12.0 * mean / eccentricity),
    )
    for _ in range(_ITERATIONS):
        step = (mean_from_eccentric(found, eccentricity) - mean) / radius_ratio(found, eccentricity)
        found -= step
        if abs(step) <= 4e-16 * found:
            break
    return found


def _less_sine(angle: float) -> float:
    """The angle less its sine, rad."""
    if abs(angle) >= _SMALL:
        return angle - math.sin(angle)
    square, series = angle * angle, 1.0
    for product in (210.0, 156.0, 110.0, 72.0, 42.0, 20.0):
        series = 1.0 - square / product * series
    return angle * square / 6.0 * series
