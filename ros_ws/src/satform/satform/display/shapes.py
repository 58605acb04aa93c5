# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Shapes and colours of a formation's picture: desired orbits, headings, attitudes in LVLH, links."""

import colorsys

import numpy as np

from satform.attitude.ground_pointing import CircularOrbit
from satform.numeric.elementwise import Array, cross, dot, norm
from satform.numeric.modified_rodrigues import mrp_from_direction_cosines, quaternion, relative_mrp
from satform.orbits.curve import Curve
from satform.orbits.frames import lvlh_frame

Colour = tuple[float, float, float, float]
"""Red, green, blue and opacity, each from 0 to 1."""

GREY: Colour = (0.5, 0.5, 0.5, 0.6)
"""Of a satellite that is lost, and of its incoming links."""
RED: Colour = (0.9, 0.1, 0.1, 1.0)
"""Of a link to a satellite that is lost."""
FRESH: Colour = (0.2, 0.8, 0.3, 1.0)
"""Of a link whose sender has published just now."""
STALE: Colour = (1.0, 0.6, 0.0, 1.0)
"""Of a link whose sender has not published for long."""

FRESH_STEPS = 2.0
"""Age of an announcement up to which it counts as fresh, steps: it may be under way."""
STALE_STEPS = 20.0
"""Age of an announcement from which a link shows no further change, steps."""

_GOLDEN_RATIO = 0.6180339887498949


def desired_orbit(curve: Curve, samples: int) -> Array:
    """A closed curve as a polyline, evenly spaced in arc length.

    Args:
        curve: of a single satellite.
        samples: pieces of the polyline, 1 or more.

    Returns:
        m, LVLH, shape (samples + 1, 3); the last point is the first one. One point, shape (1, 3), of a
        curve without extent.
    """
    perimeter = float(curve.perimeter)
    if perimeter == 0.0:
        return curve.point(np.zeros(1)).position
    points = curve.point(curve.angle_at(np.linspace(0.0, perimeter, samples + 1))).position
    points[-1] = points[0]
    return points


def heading(direction: Array) -> Array:
    """Quaternion of the shortest rotation that takes the x axis to a direction.

    Args:
        direction: of any length, shape (3,); without one the axes stay as they are.

    Returns:
        x, y, z, w, of unit length, shape (4,).
    """
    length = float(norm(direction))
    if length == 0.0:
        return np.array([0.0, 0.0, 0.0, 1.0])
    unit = direction / length
    # Twice the square of the half angle's cosine: it vanishes where the turn has no axis of its own.
    doubled = 1.0 + float(unit[0])
    if doubled < 1e-12:
        return np.array([0.0, 0.0, 1.0, 0.0])
    axis = cross(np.array([1.0, 0.0, 0.0]), unit)
    turned = np.array([axis[0], axis[1], axis[2], doubled])
    result: Array = turned / np.sqrt(turned[3] * turned[3] + dot(axis, axis))
    return result


def attitude_in_lvlh(mrp: Array, orbit: CircularOrbit, time: float | Array) -> Array:
    """Attitude of a body as seen in the chief's rotating frame.

    Args:
        mrp: modified Rodrigues parameters, inertial to body, shape (..., 3).
        orbit: of the chief in the same inertial axes.
        time: simulated, s, a number or shape (...).

    Returns:
        x, y, z, w of the quaternion that takes body components to LVLH components, shape (..., 4).

    Source: Schaub & Junkins, ch. 3 and 14.
    """
    chief = orbit.position(np.asarray(time, dtype=np.float64))
    frame = lvlh_frame(chief.value, chief.rate)
    axes = np.stack((frame.radial, frame.along_track, frame.normal), axis=-2)
    scalar, vector = quaternion(relative_mrp(mrp, mrp_from_direction_cosines(axes)))
    turned: Array = np.concatenate((vector, np.asarray(scalar)[..., None]), axis=-1)
    return turned


def satellite_colour(index: int) -> Colour:
    """A colour of its own for each satellite: neighbours in the list are far apart on the colour wheel."""
    red, green, blue = colorsys.hsv_to_rgb((0.58 + index * _GOLDEN_RATIO) % 1.0, 0.65, 1.0)
    return red, green, blue, 1.0


def link_colour(age: float, *, receiver_alive: bool, sender_alive: bool) -> Colour:
    """Colour of an edge of the communication graph.

    Args:
        age: of the sender's newest announcement, steps; infinite when it has published none yet.
        receiver_alive: whether the receiver takes part.
        sender_alive: whether the sender takes part.

    Returns:
        Grey for a receiver that is lost, red for a sender that is lost; else from fresh to stale.
    """
    if not receiver_alive:
        return GREY
    if not sender_alive:
        return RED
    staleness = min(max((age - FRESH_STEPS) / (STALE_STEPS - FRESH_STEPS), 0.0), 1.0)
    red, green, blue, opacity = (
        (1.0 - staleness) * fresh + staleness * stale for fresh, stale in zip(FRESH, STALE, strict=True)
    )
    return red, green, blue, opacity
