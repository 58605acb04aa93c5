# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Error of linear models of relative motion: what they leave out of two-body motion.

The Clohessy-Wiltshire equations are of first order in the distance from the chief and know a circular chief
only. What that costs a satellite without control is computed here from the solution of the two-body problem,
so that it holds for any distance and eccentricity. On the ellipse of 2 by 1 with the long half-axis d, at its
end on the track at the start, about a circular chief of radius a, it is 15/4 pi d^2/a along-track each
revolution.
"""

import math

import numpy as np

from satform.dynamics.cw import propagate
from satform.dynamics.yamanaka_ankersen import YamanakaAnkersenModel
from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.frames import chief_frame, lvlh_frame

_SAMPLES = 48
_CLOSED = 0.1
"""Drift rate, relative to the orbit rate times the distance, up to which motion counts as closed."""
_ITERATIONS = 50


def cw_error(position_lvlh: Array, velocity_lvlh: Array, chief: KeplerianChief, duration: float) -> float:
    """Largest distance between CW and two-body motion of a satellite without control.

    Args:
        position_lvlh: at the start, m, shape (3,).
        velocity_lvlh: at the start, m/s, in the rotating frame, shape (3,).
        chief: whose frame it is.
        duration: looked at, s.

    Returns:
        m; infinite where the satellite is on no ellipse about the Earth.

    Source: Battin, An Introduction to the Mathematics and Methods of Astrodynamics, section 4.3.
    """
    times = _sampled(duration)
    found = _relative_two_body(position_lvlh, velocity_lvlh, chief, times)
    if found is None:
        return math.inf
    expected = np.array([propagate(position_lvlh, velocity_lvlh, chief.mean_motion, t)[0] for t in times])
    return float(np.max(np.linalg.norm(found - expected, axis=-1)))


def eccentric_error(
    position_lvlh: Array, velocity_lvlh: Array, chief: KeplerianChief, duration: float
) -> float:
    """The same of the model of Yamanaka and Ankersen, which knows the eccentricity; as `cw_error`."""
    times = _sampled(duration)
    found = _relative_two_body(position_lvlh, velocity_lvlh, chief, times)
    if found is None:
        return math.inf
    transitions = YamanakaAnkersenModel(chief).transition(np.zeros_like(times), times)
    expected = transitions[:, :3] @ np.concatenate((position_lvlh, velocity_lvlh))
    return float(np.max(np.linalg.norm(found - expected, axis=-1)))


def _sampled(duration: float) -> Array:
    return np.linspace(0.0, duration, 1 + _SAMPLES)[1:]


def _relative_two_body(
    position_lvlh: Array, velocity_lvlh: Array, chief: KeplerianChief, times: Array
) -> Array | None:
    """Position in LVLH at times, m, shape (n, 3); None where a body is on no ellipse."""
    chief_position, chief_velocity = chief.state_in_own_axes()
    frame = chief_frame(chief_position, chief_velocity)
    start = frame.to_inertial(position_lvlh, velocity_lvlh)
    of_chief = two_body(chief_position, chief_velocity, times)
    of_satellite = two_body(*start, times)
    if of_chief is None or of_satellite is None:
        return None
    return lvlh_frame(*of_chief).vector_to_lvlh(of_satellite[0] - of_chief[0])


def two_body(position: Array, velocity: Array, times: Array) -> tuple[Array, Array] | None:
    """Motion about a point mass by the difference of the eccentric anomaly.

    Args:
        position: inertial, m, shape (3,).
        velocity: inertial, m/s, shape (3,).
        times: since then, s, shape (n,).

    Returns:
        Inertial positions in m and velocities in m/s, shape (n, 3) each; None if the motion is not on an
        ellipse.

    Source: Battin, section 4.3 (Lagrange coefficients).
    """
    mu = GRAVITATIONAL_PARAMETER
    radius, squared = float(np.linalg.norm(position)), float(velocity @ velocity)
    inverse = 2.0 / radius - squared / mu
    if radius == 0.0 or inverse <= 0.0:
        return None
    axis = 1.0 / inverse
    rate = math.sqrt(mu / axis**3)
    inward, rising = 1.0 - radius / axis, float(position @ velocity) / math.sqrt(mu * axis)
    mean = rate * times
    anomaly = mean + inward * np.sin(mean) - rising * (1.0 - np.cos(mean))
    for _ in range(_ITERATIONS):
        rest = anomaly - inward * np.sin(anomaly) + rising * (1.0 - np.cos(anomaly)) - mean
        slope = 1.0 - inward * np.cos(anomaly) + rising * np.sin(anomaly)
        # Newton's method, held back where the slope is small near the perigee of a long ellipse.
        step = np.clip(rest / slope, -1.0, 1.0)
        anomaly = anomaly - step
        if np.max(np.abs(step)) < 1e-14:
            break
    distance = axis * (1.0 - inward * np.cos(anomaly) + rising * np.sin(anomaly))
    f = 1.0 - axis / radius * (1.0 - np.cos(anomaly))
    g = times + (np.sin(anomaly) - anomaly) / rate
    f_rate = -math.sqrt(mu * axis) / (radius * distance) * np.sin(anomaly)
    g_rate = 1.0 - axis / distance * (1.0 - np.cos(anomaly))
    return (
        f[:, None] * position + g[:, None] * velocity,
        f_rate[:, None] * position + g_rate[:, None] * velocity,
    )


def free_motion(position_lvlh: Array, velocity_lvlh: Array, mean_motion: float) -> Array:
    """Velocity at which a satellite at a place of a planned motion would stay near by without control.

    Args:
        position_lvlh: planned, m, shape (3,).
        velocity_lvlh: planned, m/s, in the rotating frame, shape (3,).
        mean_motion: of the chief, rad/s.

    Returns:
        The planned velocity, where free CW motion from there is closed; else that of the ellipse of 2 by 1
        about the chief through the place, m/s, shape (3,).
    """
    size = mean_motion * float(np.linalg.norm(position_lvlh))
    drift = velocity_lvlh[1] + 2.0 * mean_motion * position_lvlh[0]
    if abs(drift) <= _CLOSED * size and float(np.linalg.norm(velocity_lvlh)) <= 3.0 * size:
        return velocity_lvlh
    x, y, _ = position_lvlh.tolist()
    return np.array([0.5 * mean_motion * y, -2.0 * mean_motion * x, 0.0])
