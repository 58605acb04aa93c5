# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear relative motion about a chief of any eccentricity below 1, without perturbations.

Frame: LVLH of the chief (x radial outward, y along-track, z orbit normal), which turns at the orbit rate.
The motion is written in position times rho = 1 + e cos(true anomaly), with the true anomaly in place of time.

Equations: docs/controllers/eccentric.md.
"""

import math
from dataclasses import dataclass

import numpy as np

from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief


@dataclass(frozen=True)
class YamanakaAnkersenModel:
    """Relative motion about a Keplerian chief, to first order in the distance.

    Attributes:
        chief: its orbit.
    """

    chief: KeplerianChief

    def transition(self, start: float | Array, end: float | Array) -> Array:
        """State transition from one time to another.

        Args:
            start: since time zero, s, shape (...).
            end: likewise; may be before `start`.

        Returns:
            Of the state (position, velocity) in m and m/s, LVLH, shape (..., 6, 6).

        Source: Yamanaka & Ankersen 2002.
        """
        first, last = np.broadcast_arrays(np.asarray(start, float), np.asarray(end, float))
        e, rate = self.chief.eccentricity, self._rate
        begin, finish = self._anomalies(first), self._anomalies(last)
        apart = _solutions(finish, e, rate * (last - first)) @ _constants(begin, e)
        whole: Array = _from_scaled(finish, e, rate) @ apart @ _to_scaled(begin, e, rate)
        return whole

    def system_matrix(self, time: float | Array) -> Array:
        """Continuous-time matrix A of d(state)/dt = A state at a time in s of shape (...): (..., 6, 6).

        Source: Tschauner & Hempel 1965; Yamanaka & Ankersen 2002, Eqs. (2) to (4).
        """
        e, anomaly = self.chief.eccentricity, self._anomalies(np.asarray(time, float))
        rho = 1.0 + e * np.cos(anomaly)
        turn = self._rate * rho * rho
        gravity = self._rate * self._rate * rho * rho * rho
        faster = -2.0 * e * np.sin(anomaly) * gravity
        matrix = np.zeros((*anomaly.shape, 6, 6))
        for axis in range(3):
            matrix[..., axis, 3 + axis] = 1.0
        matrix[..., 3, 0] = turn * turn + 2.0 * gravity
        matrix[..., 3, 1], matrix[..., 4, 0] = faster, -faster
        matrix[..., 3, 4], matrix[..., 4, 3] = 2.0 * turn, -2.0 * turn
        matrix[..., 4, 1] = turn * turn - gravity
        matrix[..., 5, 2] = -gravity
        return matrix

    @property
    def _rate(self) -> float:
        """sqrt(mu/p^3), p the semi-latus rectum, rad/s: the orbit turns at this rate times rho^2."""
        return self.chief.mean_motion / math.pow(1.0 - self.chief.eccentricity**2, 1.5)

    def _anomalies(self, times: Array) -> Array:
        found = [self.chief.true_anomaly(time) for time in np.ravel(times).tolist()]
        return np.asarray(found, dtype=np.float64).reshape(np.shape(times))


def _solutions(anomaly: Array, e: float, lag: Array) -> Array:
    """The six free motions in scaled position and its derivative by the anomaly, shape (..., 6, 6).

    Args:
        anomaly: true, rad, shape (...).
        e: eccentricity.
        lag: time since the constants were taken, times `_rate`, shape (...).
    """
    sine, cosine = np.sin(anomaly), np.cos(anomaly)
    rho = 1.0 + e * cosine
    s, c = rho * sine, rho * cosine
    s_rate, c_rate = cosine + e * np.cos(2.0 * anomaly), -(sine + e * np.sin(2.0 * anomaly))
    motions = np.zeros((*anomaly.shape, 6, 6))
    motions[..., 0, 0], motions[..., 3, 0] = s, s_rate
    motions[..., 1, 0], motions[..., 4, 0] = cosine * (1.0 + rho), -2.0 * s
    motions[..., 0, 1], motions[..., 3, 1] = c, c_rate
    motions[..., 1, 1], motions[..., 4, 1] = -sine * (1.0 + rho), -2.0 * c + e
    motions[..., 0, 2] = 2.0 - 3.0 * e * s * lag
    motions[..., 3, 2] = -3.0 * e * (s_rate * lag + s / (rho * rho))
    motions[..., 1, 2], motions[..., 4, 2] = -3.0 * rho * rho * lag, 6.0 * e * s * lag - 3.0
    motions[..., 1, 3] = 1.0
    motions[..., 2, 4], motions[..., 5, 4] = cosine, -sine
    motions[..., 2, 5], motions[..., 5, 5] = sine, cosine
    return motions


def _constants(anomaly: Array, e: float) -> Array:
    """Amplitudes of the six free motions from the scaled state at no lag: the inverse of `_solutions`."""
    sine, cosine = np.sin(anomaly), np.cos(anomaly)
    rho = 1.0 + e * cosine
    s, c = rho * sine, rho * cosine
    s_rate, c_rate = cosine + e * np.cos(2.0 * anomaly), -(sine + e * np.sin(2.0 * anomaly))
    square = rho * rho
    # The constant of the along-track motion, y' + 2 x, leaves two equations in the first two amplitudes.
    constant = np.zeros((*anomaly.shape, 6))
    constant[..., 0], constant[..., 4] = 2.0, 1.0
    radial, rising = -2.0 * constant, 3.0 * e * (s / square)[..., None] * constant
    radial[..., 0] += 1.0
    rising[..., 3] += 1.0
    lead, trail = c_rate + 3.0 * e * e * s / square, c - 2.0 * e
    determinant = -(1.0 - e * e)
    inverse = np.zeros((*anomaly.shape, 6, 6))
    inverse[..., 0, :] = (radial * lead[..., None] - rising * trail[..., None]) / determinant
    inverse[..., 1, :] = (rising * s[..., None] - radial * s_rate[..., None]) / determinant
    inverse[..., 2, :] = constant - e * inverse[..., 1, :]
    inverse[..., 3, 1] = 1.0
    inverse[..., 3, :] -= (cosine * (1.0 + rho))[..., None] * inverse[..., 0, :]
    inverse[..., 3, :] += (sine * (1.0 + rho))[..., None] * inverse[..., 1, :]
    inverse[..., 4, 2], inverse[..., 4, 5] = cosine, -sine
    inverse[..., 5, 2], inverse[..., 5, 5] = sine, cosine
    return inverse


def _to_scaled(anomaly: Array, e: float, rate: float) -> Array:
    """From the state to scaled position and its derivative by the true anomaly, shape (..., 6, 6)."""
    rho = 1.0 + e * np.cos(anomaly)
    return _blocks(rho, -e * np.sin(anomaly), 1.0 / (rate * rho))


def _from_scaled(anomaly: Array, e: float, rate: float) -> Array:
    """The inverse of `_to_scaled`."""
    rho = 1.0 + e * np.cos(anomaly)
    return _blocks(1.0 / rho, rate * e * np.sin(anomaly), rate * rho)


def _blocks(position: Array, mixed: Array, velocity: Array) -> Array:
    """Matrix of the blocks (position 1, 0; mixed 1, velocity 1), shape (..., 6, 6)."""
    matrix = np.zeros((*position.shape, 6, 6))
    for axis in range(3):
        matrix[..., axis, axis] = position
        matrix[..., 3 + axis, axis] = mixed
        matrix[..., 3 + axis, 3 + axis] = velocity
    return matrix
