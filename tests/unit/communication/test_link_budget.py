# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Equations of link budgets against worked examples, simulated receivers and closed forms."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad

from satform.common.physical_constants import SPEED_OF_LIGHT
from satform.communication.antennas import ArraySpec, BeamSpec, IsotropicSpec, factor
from satform.communication.link_budget import (
    BIT_ERROR_RATES,
    LEAST_ERROR_RATE,
    beam_gain,
    bit_energy_ratio,
    bit_error_rate,
    decibels,
    free_space_loss,
    message_loss,
    photons_per_bit,
    pointing_factor,
    required_ratio,
)
from satform.communication.physical_links import RadioSpec
from satform.numeric.elementwise import Array

AHEAD = np.array([1.0, 0.0, 0.0])


def test_voyager_at_neptune() -> None:
    # Downlink of Voyager 2 as P. Karn worked it (sci.space, 28 August 1989) after J. H. Yuen, Deep Space
    # Telecommunications Systems Engineering: 11.04 dBW, 48.13 and 73.8 dBi, 4.416e9 km, 8415 MHz, 10 K, 21.6
    # kbit/s.
    loss = float(decibels(free_space_loss(np.asarray(4.416e12), 8.415e9)))
    assert loss == pytest.approx(303.85, abs=5e-3)
    received = 11.04 + 48.13 + 73.8 - loss
    assert received == pytest.approx(-170.88, abs=5e-3)
    link = RadioSpec(
        frequency=8.415e9,
        power=factor(11.04),
        antenna=IsotropicSpec(peak_gain=48.13),
        receive_antenna=IsotropicSpec(peak_gain=73.8),
        noise_temperature=10.0,
        rate=21.6e3,
    )
    ratio = link.ratio(np.asarray(4.416e12), AHEAD, -AHEAD)
    assert float(decibels(ratio)) == pytest.approx(4.38, abs=1e-2)
    assert ratio == pytest.approx(bit_energy_ratio(np.asarray(factor(received)), 10.0, 21.6e3), rel=1e-12)


def test_free_space_loss_in_the_units_of_handbooks() -> None:
    # INTELSAT Earth Station Technology Handbook (1994): 92.5 + 20 log10 (f R) with GHz and km.
    for frequency, distance in ((2.2, 40.0), (14.0, 38000.0), (32.0, 5.0)):
        loss = decibels(free_space_loss(np.asarray(1e3 * distance), 1e9 * frequency))
        assert float(loss) == pytest.approx(92.5 + 20.0 * math.log10(frequency * distance), abs=0.06)


@pytest.mark.parametrize(
    ("modulation", "ratio"),
    [("bpsk", 9.59), ("qpsk", 9.59), ("dpsk", 10.34), ("fsk", 12.60), ("fsk_noncoherent", 13.35)],
)
def test_required_ratio_for_one_error_in_100_000_bits(modulation: str, ratio: float) -> None:
    # From Q(x) = 1e-5 at x = 4.26489 (tables of the normal distribution) and ln(5e4).
    assert 10.0 * math.log10(required_ratio(modulation, 1e-5)) == pytest.approx(ratio, abs=6e-3)


@pytest.mark.parametrize(
    ("detection", "photons"), [("ook", 10.0), ("heterodyne_psk", 18.0), ("homodyne_psk", 9.0)]
)
def test_quantum_limits_of_one_error_in_a_thousand_million_bits(detection: str, photons: float) -> None:
    # G. P. Agrawal, Fiber-Optic Communication Systems: 10 photons of direct, 18 of heterodyne, 9 of homodyne
    # detection for a bit error rate of 1e-9.
    assert required_ratio(detection, 1e-9) == pytest.approx(photons, abs=0.05)


# Receivers of simulated signals in white noise, of N0 = 1, which count the wrong bits.

SYMBOLS = 100_000


def noise(generator: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    return (generator.standard_normal(shape) + 1j * generator.standard_normal(shape)) * math.sqrt(0.5)


def count_bpsk(ratio: float, generator: np.random.Generator) -> float:
    bits = generator.integers(0, 2, SYMBOLS)
    received = (2.0 * bits - 1.0) * math.sqrt(ratio) + noise(generator, (SYMBOLS,))
    return float(np.mean((received.real > 0.0) != bits))


def count_dpsk(ratio: float, generator: np.random.Generator) -> float:
    bits = generator.integers(0, 2, SYMBOLS)
    phase = np.cumprod(np.concatenate(([1], 1 - 2 * bits)))
    received = phase * math.sqrt(ratio) + noise(generator, (SYMBOLS + 1,))
    return float(np.mean(((received[1:] * received[:-1].conj()).real < 0.0) != bits))


def count_fsk(ratio: float, generator: np.random.Generator, *, coherent: bool) -> float:
    bits = generator.integers(0, 2, SYMBOLS)
    tones = noise(generator, (SYMBOLS, 2))
    tones[np.arange(SYMBOLS), bits] += math.sqrt(ratio)
    found = tones.real if coherent else np.abs(tones)
    return float(np.mean((found[:, 1] > found[:, 0]) != bits))


def count_nearest(points: np.ndarray, bits: int, ratio: float, generator: np.random.Generator) -> float:
    """Points are in the order of their labels; the nearest one is decided for."""
    points = points * math.sqrt(bits * ratio / np.mean(np.abs(points) ** 2))
    sent = generator.integers(0, len(points), SYMBOLS)
    received = points[sent] + noise(generator, (SYMBOLS,))
    decided = np.argmin(np.abs(received[:, None] - points), axis=1)
    return sum(int(number).bit_count() for number in (sent ^ decided)) / (bits * SYMBOLS)


def gray(number: int) -> int:
    return number ^ (number >> 1)


def psk8_points() -> np.ndarray:
    points = np.empty(8, dtype=complex)
    for place in range(8):
        points[gray(place)] = np.exp(2j * math.pi * place / 8.0)
    return points


def qam16_points() -> np.ndarray:
    points = np.empty(16, dtype=complex)
    for column in range(4):
        for row in range(4):
            points[4 * gray(column) + gray(row)] = complex(2 * column - 3, 2 * row - 3)
    return points


@pytest.mark.parametrize(
    ("modulation", "decibel", "count"),
    [
        ("bpsk", 4.0, count_bpsk),
        ("qpsk", 4.0, lambda ratio, numbers: count_nearest(np.array([1, 1j, -1j, -1]), 2, ratio, numbers)),
        ("dpsk", 5.0, count_dpsk),
        ("fsk", 6.0, lambda ratio, numbers: count_fsk(ratio, numbers, coherent=True)),
        ("fsk_noncoherent", 7.0, lambda ratio, numbers: count_fsk(ratio, numbers, coherent=False)),
        ("psk8", 7.0, lambda ratio, numbers: count_nearest(psk8_points(), 3, ratio, numbers)),
        ("qam16", 3.0, lambda ratio, numbers: count_nearest(qam16_points(), 4, ratio, numbers)),
        ("qam16", 8.0, lambda ratio, numbers: count_nearest(qam16_points(), 4, ratio, numbers)),
    ],
)
def test_bit_error_rates_are_those_of_simulated_receivers(
    modulation: str, decibel: float, count: Callable[[float, np.random.Generator], float]
) -> None:
    ratio = factor(decibel)
    counted = count(ratio, np.random.default_rng(7))
    rate = float(bit_error_rate(modulation, np.asarray(ratio)))
    # Four standard deviations of the count, and half a percent for the approximation of psk8.
    assert counted == pytest.approx(rate, abs=4.0 * math.sqrt(rate / SYMBOLS), rel=5e-3)


def test_all_modulations_are_tested_and_guess_without_a_signal() -> None:
    for name in BIT_ERROR_RATES:
        rates = bit_error_rate(name, np.array([0.0, 1.0, 10.0, 100.0]))
        assert rates[0] == pytest.approx(0.5 if name != "psk8" else 1.0 / 3.0, abs=1e-12)
        assert (np.diff(rates) < 0.0).all()


def test_a_message_is_lost_with_any_wrong_bit() -> None:
    assert message_loss(np.array([0.0, 0.5]), 10) == pytest.approx([0.0, 1.0 - 2.0**-10])
    # So small that 1 - (1 - rate)^bits would lose its digits.
    assert float(message_loss(np.asarray(1e-18), 1000)) == pytest.approx(1e-15, rel=1e-12)


def test_the_gain_of_a_laser_beam_conserves_its_power() -> None:
    divergence = 1e-3

    def through_ring(angle: float) -> float:
        # Source of the profile: a Gaussian beam has 1/e^2 of its intensity at half the divergence.
        return beam_gain(divergence) * math.exp(-8.0 * (angle / divergence) ** 2) * 0.5 * math.sin(angle)

    assert quad(through_ring, 0.0, 10.0 * divergence, epsabs=0.0)[0] == pytest.approx(1.0, rel=1e-6)


def test_the_pointing_factor_is_the_mean_over_the_jitter() -> None:
    divergence, offset, jitter = 20e-6, 4e-6, 3e-6
    generator = np.random.default_rng(3)
    errors = generator.standard_normal((200_000, 2)) * jitter + [offset, 0.0]
    intensity = np.exp(-8.0 * (errors**2).sum(axis=1) / divergence**2)
    deviation = intensity.std() / math.sqrt(len(errors))
    assert pointing_factor(divergence, offset, jitter) == pytest.approx(intensity.mean(), abs=4.0 * deviation)
    assert pointing_factor(divergence, 0.5 * divergence, 0.0) == pytest.approx(math.exp(-2.0))


def test_photons_of_a_known_power() -> None:
    # One watt at 1550 nm is 7.80e18 photons a second.
    assert float(photons_per_bit(np.asarray(1.0), 1550e-9, 1.0)) == pytest.approx(7.803e18, rel=1e-3)


# Antennas


def directions(angles: Array) -> Array:
    """Unit vectors at angles from the x axis towards y, shape (K, 3)."""
    return np.stack((np.cos(angles), np.sin(angles), np.zeros_like(angles)), axis=-1)


def test_a_linear_array_has_the_array_factor_of_textbooks() -> None:
    count, frequency = 16, 8.4e9
    spacing = 0.5 * SPEED_OF_LIGHT / frequency
    steered = math.radians(25.0)
    array = ArraySpec(
        elements=tuple((0.0, spacing * number, 0.0) for number in range(count)),
        element_exponent=0.0,
        beams=((math.cos(steered), math.sin(steered), 0.0),),
    )
    angles = np.radians(np.linspace(-80.0, 80.0, 641))
    psi = math.pi * (np.sin(angles) - math.sin(steered))
    with np.errstate(invalid="ignore", divide="ignore"):
        factor_of_array = np.sin(0.5 * count * psi) / (count * np.sin(0.5 * psi))
    factor_of_array[np.abs(psi) < 1e-12] = 1.0
    gain = array.gain(directions(angles), frequency)
    # An element without directivity in front has the gain 2: it radiates into half of the space.
    assert gain == pytest.approx(2.0 * count * factor_of_array**2, abs=1e-9)
    first_sidelobe = gain[
        (angles > steered + math.radians(9.0)) & (angles < steered + math.radians(14.0))
    ].max()
    assert float(decibels(first_sidelobe / gain.max())) == pytest.approx(-13.1, abs=0.2)
    assert array.gain(directions(np.array([math.pi])), frequency)[0] == 0.0


def test_several_beams_and_a_following_one() -> None:
    elements = tuple((0.0, 0.05 * column, 0.05 * row) for column in range(4) for row in range(4))
    axes = [(1.0, 0.3, 0.0), (1.0, -0.3, 0.1)]
    single = [ArraySpec(elements=elements, beams=(axis,)) for axis in axes]
    both = ArraySpec(elements=elements, beams=tuple(axes))
    towards = directions(np.radians(np.linspace(-60.0, 60.0, 25)))
    expected = np.maximum(*(array.gain(towards, 2.2e9) for array in single))
    assert both.gain(towards, 2.2e9) == pytest.approx(expected)
    following = ArraySpec(elements=elements, scan_limit=math.radians(45.0))
    angles = np.radians([0.0, 30.0, 44.0, 46.0])
    assert following.gain(directions(angles), 2.2e9) == pytest.approx(
        16 * 4.0 * np.cos(angles) * [1.0, 1.0, 1.0, 0.0]
    )


@pytest.mark.parametrize("exponent", [0.0, 1.0, 3.5])
def test_an_element_conserves_power(exponent: float) -> None:
    element = ArraySpec(elements=((0.0, 0.0, 0.0),), element_exponent=exponent)

    def ring(angle: float) -> float:
        return float(element.gain(directions(np.array([angle])), 1e9)[0]) * 0.5 * math.sin(angle)

    assert quad(ring, 0.0, 0.5 * math.pi)[0] == pytest.approx(1.0, rel=1e-8)


def test_a_beam_has_half_its_gain_at_half_its_beamwidth_and_a_floor() -> None:
    beam = BeamSpec(peak_gain=15.0, beamwidth=math.radians(30.0), boresight=(0.0, 2.0, 0.0), floor=-10.0)
    angles = np.radians([90.0, 90.0 - 15.0, 90.0 + 15.0, -90.0])
    gain = decibels(beam.gain(directions(angles), 1e9))
    assert gain == pytest.approx([15.0, 12.0, 12.0, -10.0], abs=0.011)


def test_a_mismatch_enters_the_budget_at_both_ends() -> None:
    fields = {"frequency": 2.2e9, "power": 0.1, "rate": 1e5}
    matched = RadioSpec(**fields)
    # 25 - 40j ohm on 50 ohm: 1 - |(-25 - 40j) / (75 - 40j)|^2 = 1 - 2225 / 7225 of the power at each end.
    mismatched = RadioSpec(**fields, antenna=IsotropicSpec(impedance=(25.0, -40.0)))
    ratios = [link.ratio(np.asarray(1e4), AHEAD, -AHEAD) for link in (matched, mismatched)]
    assert ratios[1] / ratios[0] == pytest.approx((5000.0 / 7225.0) ** 2, rel=1e-12)
    with pytest.raises(ValueError, match="an antenna without resistance takes no power"):
        IsotropicSpec(impedance=(0.0, 10.0))
    with pytest.raises(ValueError, match=r"boresight .* has no direction"):
        BeamSpec(peak_gain=1.0, beamwidth=1.0, boresight=(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"floor -20 dBi is above peak_gain -25 dBi"):
        BeamSpec(peak_gain=-25.0, beamwidth=1.0)
    with pytest.raises(ValueError, match=r"elements: two are at \[0.0, 0.05, 0.0\]"):
        ArraySpec(elements=((0.0, 0.05, 0.0), (0.0, 0.0, 0.0), (0.0, 0.05, 0.0)))


@pytest.mark.parametrize("modulation", sorted(BIT_ERROR_RATES))
def test_the_smallest_error_rate_has_a_required_ratio(modulation: str) -> None:
    ratio = required_ratio(modulation, LEAST_ERROR_RATE)
    assert float(bit_error_rate(modulation, np.asarray(ratio))) == pytest.approx(LEAST_ERROR_RATE, rel=1e-6)


def test_no_power_at_all_is_minus_infinity_in_decibels() -> None:
    assert decibels(np.array([0.0, 1e-300, 1.0])).tolist() == pytest.approx([-math.inf, -3000.0, 0.0])
