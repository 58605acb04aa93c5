# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Orbits under J2 by numbers, over years: equinoctial elements integrated along the true longitude.

Each part of a revolution is integrated by Picard iteration on Gauss-Legendre points. J2 changes the elements
by a thousandth, so that each iteration gains three digits. Nothing is averaged; no code of satform is used.
"""

import functools

import numpy as np

POINTS = 24
PARTS = 4
"""Of a revolution."""

ITERATIONS = 8


@functools.cache
def _points() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of (0, 1), weights, and the matrix of integrals from 0 to each point."""
    abscissae, weights = np.polynomial.legendre.leggauss(POINTS)
    values = np.polynomial.legendre.legvander(abscissae, POINTS - 1)
    integrals = np.stack(
        [
            np.polynomial.legendre.legval(abscissae, np.polynomial.legendre.legint(unit, lbnd=-1))
            for unit in np.eye(POINTS)
        ],
        axis=-1,
    )
    return 0.5 * (1.0 + abscissae), 0.5 * weights, 0.5 * integrals @ np.linalg.inv(values)


class J2Motion:
    """Orbits about an oblate body, from Keplerian elements on.

    Attributes:
        elements: p (m), f, g, h, k of each orbit, shape (5, n).
        longitude: true longitude, rad, shape (n,).
        time: s, shape (n,).
    """

    def __init__(self, keplerian: np.ndarray, constants: tuple[float, float, float]) -> None:
        """At time zero.

        Args:
            keplerian: osculating a (m), e, i, node, argument of perigee, true anomaly (rad), shape (n, 6).
            constants: gravitational parameter (m^3/s^2), J2, equatorial radius (m).
        """
        a, e, inclination, node, perigee, anomaly = keplerian.T
        self._constants = constants
        tangent = np.tan(0.5 * inclination)
        self.elements = np.stack(
            (
                a * (1.0 - e * e),
                e * np.cos(node + perigee),
                e * np.sin(node + perigee),
                tangent * np.cos(node),
                tangent * np.sin(node),
            )
        )
        self.longitude = node + perigee + anomaly
        self.time = np.zeros_like(a)

    def advance_to(self, time: float) -> None:
        """Move all orbits to a time in s."""
        part = np.full_like(self.time, 2.0 * np.pi / PARTS)
        while True:
            elements, end = self._over(part)
            if np.any(end > time):
                break
            self.elements, self.time, self.longitude = elements, end, self.longitude + part
        # What is left is less than a part for one of them, and a few for the others.
        for _ in range(50):
            left = time - self.time
            if np.max(np.abs(left)) < 1e-7:
                return
            rate = 1.0 / self._rates(self.elements, self.longitude)[1]
            step = np.clip(left * rate, -part, part)
            self.elements, self.time = self._over(step)
            self.longitude = self.longitude + step
        raise RuntimeError("the time was not reached")

    def keplerian(self) -> np.ndarray:
        """Osculating elements as at the start, shape (n, 6)."""
        p, f, g, h, k = self.elements
        e, node = np.hypot(f, g), np.arctan2(k, h)
        perigee = np.arctan2(g, f) - node
        inclination = 2.0 * np.arctan(np.hypot(h, k))
        return np.stack(
            (p / (1.0 - e * e), e, inclination, node, perigee, self.longitude - node - perigee), axis=-1
        )

    def constants_of_motion(self) -> np.ndarray:
        """Energy per mass and angular momentum about the body's axis, shape (2, n)."""
        mu, oblateness, radius = self._constants
        p, f, g, h, k = self.elements
        sine, cosine = np.sin(self.longitude), np.cos(self.longitude)
        s, tilt = 1.0 + h * h + k * k, h * h + k * k
        r = p / (1.0 + f * cosine + g * sine)
        height = 2.0 * (h * sine - k * cosine) / s
        ellipse = -0.5 * mu * (1.0 - f * f - g * g) / p
        bulge = 0.5 * mu * oblateness * radius**2 / r**3 * (3.0 * height**2 - 1.0)
        return np.stack((ellipse + bulge, np.sqrt(mu * p) * (1.0 - tilt) / s))

    def _over(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Elements and time after an angle of true longitude for each orbit."""
        points, weights, integrals = _points()
        longitude = self.longitude[:, None] + angle[:, None] * points
        elements = np.repeat(self.elements[:, :, None], POINTS, axis=-1)
        for _ in range(ITERATIONS):
            slopes, _ = self._rates(elements, longitude)
            before, elements = elements, self.elements[:, :, None] + angle[:, None] * (slopes @ integrals.T)
            if np.max(np.abs(elements - before) / (np.abs(before[:1]) + 1.0)) < 1e-15:
                break
        slopes, pace = self._rates(elements, longitude)
        return self.elements + angle * (slopes @ weights), self.time + angle * (pace @ weights)

    def _rates(self, elements: np.ndarray, longitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of elements and time by the true longitude.

        Source: Walker, Ireland & Owens 1985, a set of modified equinoctial orbit elements.
        """
        mu, oblateness, radius = self._constants
        p, f, g, h, k = elements
        sine, cosine = np.sin(longitude), np.cos(longitude)
        w, s = 1.0 + f * cosine + g * sine, 1.0 + h * h + k * k
        q = h * sine - k * cosine
        pull = -1.5 * mu * oblateness * radius**2 * (w / p) ** 4
        radial = pull * (1.0 - 12.0 * q * q / (s * s))
        transverse = pull * 8.0 * q * (h * cosine + k * sine) / (s * s)
        normal = pull * 4.0 * (1.0 - h * h - k * k) * q / (s * s)
        root = np.sqrt(p / mu)
        pace = 1.0 / (np.sqrt(mu * p) * (w / p) ** 2 + root * q * normal / w)
        along = transverse / w
        slopes = (
            2.0 * p * along,
            radial * sine + ((w + 1.0) * cosine + f) * along - q * g * normal / w,
            -radial * cosine + ((w + 1.0) * sine + g) * along + q * f * normal / w,
            0.5 * s * normal / w * cosine,
            0.5 * s * normal / w * sine,
        )
        return root * pace * np.stack(slopes), pace
