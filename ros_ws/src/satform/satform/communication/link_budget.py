# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Equations of a link budget: free-space loss, bit error rates by modulation, loss of messages.

The radio and optical links of a scenario, which use them, are in `physical_links`.

Ratios are factors, not decibels, unless a name or docstring says so.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Literal, TypeAlias

import numpy as np

from satform.common.physical_constants import BOLTZMANN, PLANCK, SPEED_OF_LIGHT
from satform.numeric.elementwise import Array

Modulation: TypeAlias = Literal["bpsk", "qpsk", "dpsk", "fsk", "fsk_noncoherent", "psk8", "qam16"]
Detection: TypeAlias = Literal["ook", "heterodyne_psk", "homodyne_psk"]

LEAST_ERROR_RATE = 1e-15
"""Smallest bit error rate of which the required ratio can be asked."""


def free_space_loss(distance: Array, frequency: float) -> Array:
    """Power between isotropic antennas that is lost: (4 pi d f / c)^2.

    Args:
        distance: m, shape (...).
        frequency: Hz.

    Returns:
        A factor, shape (...).

    Source: Friis (1946), A Note on a Simple Transmission Formula.
    """
    ratio = distance * (4.0 * math.pi * frequency / SPEED_OF_LIGHT)
    return np.asarray(ratio * ratio)


def bit_energy_ratio(received: Array, noise_temperature: float, rate: float) -> Array:
    """Energy of a bit over the noise density, Eb/N0 = P / (k T R).

    Args:
        received: power, W, shape (...).
        noise_temperature: of the receiving system, K.
        rate: bit/s.
    """
    return np.asarray(received / (BOLTZMANN * noise_temperature * rate))


def photons_per_bit(received: Array, wavelength: float, rate: float) -> Array:
    """Mean number of photons that arrive in the time of a bit.

    Args:
        received: power, W, shape (...).
        wavelength: m.
        rate: bit/s.
    """
    return np.asarray(received * (wavelength / (PLANCK * SPEED_OF_LIGHT * rate)))


def beam_gain(divergence: float) -> float:
    """Gain of a Gaussian beam along its axis: 32 / divergence^2.

    Args:
        divergence: full angle between the directions of 1/e^2 of the intensity, rad.
    """
    return 32.0 / (divergence * divergence)


def pointing_factor(divergence: float, offset: float, jitter: float) -> float:
    """Mean of the intensity of a Gaussian beam at a target, over that on its axis.

    The pointing has a constant offset, and a normal jitter of equal size about both axes. With the half angle
    w the intensity at the angle a is exp(-2 a^2 / w^2); its mean is that over a Rice distribution.

    Args:
        divergence: full angle between the directions of 1/e^2 of the intensity, rad.
        offset: rad.
        jitter: standard deviation about each axis, rad.
    """
    half = 0.5 * divergence
    widened = 1.0 + 4.0 * (jitter / half) ** 2
    return math.exp(-2.0 * (offset / half) ** 2 / widened) / widened


def _tail(argument: Array) -> Array:
    """Q(x): probability that a standard normal number is larger than x."""
    from scipy.special import erfc  # noqa: PLC0415  slow to import, and few scenarios need it

    return np.asarray(0.5 * erfc(argument / math.sqrt(2.0)))


def _qam16(ratio: Array) -> Array:
    """Exact for Gray coding: three distances of two independent amplitudes (Cho and Yoon 2002)."""
    step = np.sqrt(0.8 * ratio)
    return np.asarray(0.75 * _tail(step) + 0.5 * _tail(3.0 * step) - 0.25 * _tail(5.0 * step))


BIT_ERROR_RATES: dict[str, Callable[[Array], Array]] = {
    "bpsk": lambda ratio: _tail(np.sqrt(2.0 * ratio)),
    "qpsk": lambda ratio: _tail(np.sqrt(2.0 * ratio)),
    "dpsk": lambda ratio: np.asarray(0.5 * np.exp(-ratio)),
    "fsk": lambda ratio: _tail(np.sqrt(ratio)),
    "fsk_noncoherent": lambda ratio: np.asarray(0.5 * np.exp(-0.5 * ratio)),
    # Of two neighbours on the circle, Gray coded: the usual approximation, at most half.
    "psk8": lambda ratio: np.minimum(
        np.asarray(2.0 / 3.0 * _tail(np.sqrt(6.0 * ratio) * math.sin(math.pi / 8.0))), 0.5
    ),
    "qam16": _qam16,
    # Photons per bit, limited by shot noise; on-off keying has none in half of the bits.
    "ook": lambda photons: np.asarray(0.5 * np.exp(-2.0 * photons)),
    "heterodyne_psk": lambda photons: _tail(np.sqrt(2.0 * photons)),
    "homodyne_psk": lambda photons: _tail(np.sqrt(4.0 * photons)),
}
"""Bit error rate without coding from Eb/N0, or from the mean number of photons per bit of optical detection.

Source: J. G. Proakis, Digital Communications; of optical detection G. P. Agrawal, Fiber-Optic Communication
Systems, section 10.
"""


def bit_error_rate(modulation: str, ratio: Array) -> Array:
    """Bit error rate without coding.

    Args:
        modulation: a key of `BIT_ERROR_RATES`.
        ratio: Eb/N0, or photons per bit, shape (...).
    """
    return BIT_ERROR_RATES[modulation](np.asarray(ratio, dtype=np.float64))


def message_loss(error_rate: Array, bits: int) -> Array:
    """Probability that at least one of a message's bits is wrong: 1 - (1 - BER)^bits.

    Args:
        error_rate: of a bit, shape (...).
        bits: of a message.
    """
    return np.asarray(-np.expm1(bits * np.log1p(-error_rate)))


@cache
def required_ratio(modulation: str, error_rate: float) -> float:
    """Eb/N0, or photons per bit, at which a modulation has a bit error rate.

    Args:
        modulation: a key of `BIT_ERROR_RATES`.
        error_rate: between `LEAST_ERROR_RATE` and 0.3.
    """
    from scipy.optimize import brentq  # noqa: PLC0415  slow to import, and few scenarios need it

    def excess(decibels: float) -> float:
        rate = float(bit_error_rate(modulation, np.asarray(10.0 ** (0.1 * decibels))))
        return math.log(max(rate, 1e-3 * LEAST_ERROR_RATE)) - math.log(error_rate)

    return float(10.0 ** (0.1 * float(brentq(excess, -40.0, 40.0, xtol=1e-12))))


def decibels(ratio: Array) -> Array:
    """10 log10 of a ratio of powers; minus infinity of zero."""
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 * np.log10(ratio))
