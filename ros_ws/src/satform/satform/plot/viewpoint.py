# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The plane in which a flat formation is drawn, and the direction in which none is edge-on."""

import numpy as np

from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord

_THIN, _VERY_THIN = 0.08, 0.02
"""A formation is flat if its smallest extent is less than this part of the second, or of the largest one."""

_ELEVATION = 22.0
_AZIMUTHS = (32.0, -32.0, 58.0, -58.0, 5.0, 85.0)
"""Directions to choose from, degrees; the first unless another shows much more."""

_MUCH_MORE = 1.3
_RADIAL, _ALONG_TRACK, _CROSS_TRACK = range(3)

_PREFERENCE = {_CROSS_TRACK: 0.5, _RADIAL: 1.0, _ALONG_TRACK: 1.0}
"""Factors of extents: a line along an orbit is drawn in the orbit plane, whatever its small extents are."""


def plane(record: FlightRecord) -> tuple[int, int] | None:
    """The coordinate plane that all paths of a flight lie in.

    Args:
        record: of the flight.

    Returns:
        Components along the horizontal and the vertical axis (0 radial, 1 along-track, 2 cross-track); None
        for a formation with a depth.
    """
    extent = _extent(record.position)
    thin = min(_PREFERENCE, key=lambda component: _PREFERENCE[component] * extent[component])
    second, most = np.sort(np.delete(extent, thin))
    if extent[thin] > max(_THIN * second, _VERY_THIN * most):
        return None
    return {
        _RADIAL: (_ALONG_TRACK, _CROSS_TRACK),
        _ALONG_TRACK: (_CROSS_TRACK, _RADIAL),
        _CROSS_TRACK: (_ALONG_TRACK, _RADIAL),
    }[thin]


def viewpoint(points: Array) -> tuple[float, float]:
    """Elevation and azimuth from which points cover an area that is not small.

    Args:
        points: finite positions in the chief's rotating frame, shape (M, 3).

    Returns:
        Elevation and azimuth of the camera in degrees, as `view_init` of matplotlib takes them.
    """
    areas = [_area(points, azimuth) for azimuth in _AZIMUTHS]
    best = int(np.argmax(areas))
    return _ELEVATION, _AZIMUTHS[best if areas[best] > _MUCH_MORE * areas[0] else 0]


def _extent(position: Array) -> Array:
    """Largest less smallest coordinate of finite positions, shape (3,)."""
    points = position[np.isfinite(position).all(axis=-1)]
    return np.ptp(points, axis=0) if len(points) else np.zeros(3)


def _area(points: Array, azimuth: float) -> float:
    """Area of the ellipse of the points' covariance as seen from a direction, up to a factor."""
    turn, tilt = np.radians(azimuth), np.radians(_ELEVATION)
    right = np.array([-np.sin(turn), np.cos(turn), 0.0])
    up = np.array([-np.sin(tilt) * np.cos(turn), -np.sin(tilt) * np.sin(turn), np.cos(tilt)])
    seen = np.stack([points @ right, points @ up])
    return float(np.sqrt(max(0.0, np.linalg.det(np.cov(seen))))) if points.shape[0] > 1 else 0.0
