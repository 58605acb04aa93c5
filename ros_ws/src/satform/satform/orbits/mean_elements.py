# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Mean and osculating elements of an orbit under J2, to first order, for any eccentricity below 1.

The periodic part of J2 is integrated over one revolution of the mean orbit from Gauss's equations, by Fourier
series in the true anomaly, and its mean over the mean anomaly is left out. brahe's Brouwer-Lyddane map is not
used: its node and perigee are wrong by as much as the periodic part itself for eccentricities from 0.1 on,
and for mean anomalies above pi at any (brahe 1.8.0).

Equations: docs/controllers/eccentric.md.
"""

import math

import numpy as np

from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief, true_anomaly
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER, OBLATENESS
from satform.orbits.j2_elements import as_array

_POINTS = 128
"""True anomalies of a revolution; the series of an eccentricity of 0.9 has 1e-14 left at half of them."""

_ITERATIONS = 50


def osculating_elements(mean: Array) -> Array:
    """Osculating elements from mean ones.

    Args:
        mean: rows of (a, e, i, right ascension, argument of perigee, mean anomaly), m and rad, shape (n, 6);
            the inclination is neither 0 nor pi.

    Returns:
        The same of the osculating orbit, shape (n, 6).
    """
    return _keplerian(_nonsingular(mean) + periodic_part(mean))


def mean_chief(osculating: KeplerianChief) -> KeplerianChief:
    """Mean elements at time zero of a chief that is given by osculating ones.

    Raises:
        ValueError: they are not found, as for an orbit far inside the Earth.
    """
    given = as_array(osculating)[None]
    wanted = _nonsingular(given)
    mean = given
    for _ in range(_ITERATIONS):
        found = wanted - periodic_part(mean)
        closer = _keplerian(found)
        change = np.abs(_nonsingular(closer) - _nonsingular(mean)) / np.array([given[0, 0], 1, 1, 1, 1, 1])
        mean = closer
        if np.max(change) < 1e-14:
            break
    else:
        if not np.max(change) < 1e-11:
            raise ValueError("no mean elements are found for this orbit under J2")
    values = mean[0].tolist()
    # Perigee and anomaly in the revolution of the given ones; of a circular orbit their sum alone counts.
    turns = math.tau * round((osculating.argument_of_perigee - values[4]) / math.tau)
    perigee = values[4] + turns
    anomaly = float(found[0, 5]) - perigee
    return KeplerianChief(values[0], values[1], values[2], values[3], perigee, anomaly)


def _nonsingular(elements: Array) -> Array:
    """(a, e cos w, e sin w, i, right ascension, mean argument of latitude) of rows of Keplerian elements."""
    a, e, inclination, node, perigee, anomaly = elements.T
    vector = e * np.cos(perigee), e * np.sin(perigee)
    return np.stack((a, *vector, inclination, node, perigee + anomaly), axis=-1)


def _keplerian(elements: Array) -> Array:
    """The inverse of `_nonsingular`."""
    a, ex, ey, inclination, node, latitude = elements.T
    perigee = np.arctan2(ey, ex)
    return np.stack((a, np.hypot(ex, ey), inclination, node, perigee, latitude - perigee), axis=-1)


def periodic_part(mean: Array) -> Array:
    """Osculating minus mean elements.

    Args:
        mean: rows of Keplerian elements as `osculating_elements` takes them, shape (n, 6).

    Returns:
        Semi-major axis (m), e cos w, e sin w, inclination, right ascension, mean argument of latitude (rad),
        shape (n, 6).
    """
    pairs = zip(mean[:, 5].tolist(), mean[:, 1].tolist(), strict=True)
    anomalies = [true_anomaly(anomaly, e) for anomaly, e in pairs]
    # The first point of each revolution is where the orbit is.
    f = np.array(anomalies)[:, None] + math.tau * np.arange(_POINTS) / _POINTS
    a, e, _, _, _, _ = mean.T[:, :, None]
    motion = np.sqrt(GRAVITATIONAL_PARAMETER / a**3)
    root = np.sqrt(1.0 - e * e)
    time_per_anomaly = (root * root / (1.0 + e * np.cos(f))) ** 2 / (motion * root)
    rates = _rates(mean, f)
    periodic = np.stack([_integrated(rate, time_per_anomaly) for rate in rates], axis=-1)
    # A larger orbit is slower: the periodic part of the axis moves the satellite along the orbit.
    periodic[..., 5] += _integrated(-1.5 * motion / a * periodic[..., 0], time_per_anomaly)
    return np.asarray(periodic[:, 0], dtype=np.float64)


def _rates(mean: Array, f: Array) -> tuple[Array, ...]:
    """Rates of the nonsingular elements by J2 at true anomalies f, each of shape (n, points).

    Source: Battin, An Introduction to the Mathematics and Methods of Astrodynamics, ch. 10 (Gauss's equations
    in radial, transverse and normal acceleration).
    """
    a, e, inclination, _, perigee, _ = mean.T[:, :, None]
    latitude = f + perigee
    root = np.sqrt(1.0 - e * e)
    p = a * root * root
    r, h = p / (1.0 + e * np.cos(f)), np.sqrt(GRAVITATIONAL_PARAMETER * p)
    strength = -1.5 * OBLATENESS * GRAVITATIONAL_PARAMETER * EQUATORIAL_RADIUS**2 / r**4
    si, ci, sine, cosine = np.sin(inclination), np.cos(inclination), np.sin(latitude), np.cos(latitude)
    radial = strength * (1.0 - 3.0 * (si * sine) ** 2)
    transverse = strength * si * si * 2.0 * sine * cosine
    normal = strength * 2.0 * si * ci * sine
    ex, ey, turn = e * np.cos(perigee), e * np.sin(perigee), r * sine * ci / si * normal
    along = e * (p * np.cos(f) * radial - (p + r) * np.sin(f) * transverse)
    return (
        2.0 * a * a / h * (e * np.sin(f) * radial + p / r * transverse),
        (p * sine * radial + ((p + r) * cosine + r * ex) * transverse + ey * turn) / h,
        (-p * cosine * radial + ((p + r) * sine + r * ey) * transverse - ex * turn) / h,
        r * cosine * normal / h,
        r * sine * normal / (si * h),
        (-along / (1.0 + root) - 2.0 * root * r * radial - turn) / h,
    )


def _integrated(rate: Array, time_per_anomaly: Array) -> Array:
    """Periodic part of the integral of a rate over time, without its mean over time.

    Args:
        rate: at true anomalies evenly over a revolution, shape (n, points).
        time_per_anomaly: time per true anomaly there, s/rad, likewise.
    """
    duration = np.sum(time_per_anomaly, axis=-1, keepdims=True)
    by_anomaly = (
        rate - np.sum(rate * time_per_anomaly, axis=-1, keepdims=True) / duration
    ) * time_per_anomaly
    spectrum = np.fft.rfft(by_anomaly, axis=-1)
    order = np.arange(spectrum.shape[-1])
    spectrum[..., 1:] /= 1j * order[1:]
    spectrum[..., 0] = spectrum[..., -1] = 0.0
    integral = np.fft.irfft(spectrum, n=rate.shape[-1], axis=-1)
    without_mean: Array = integral - np.sum(integral * time_per_anomaly, axis=-1, keepdims=True) / duration
    return without_mean
