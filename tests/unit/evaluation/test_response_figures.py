# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of a response and of a pass, on flights whose figures are known in closed form."""

import dataclasses
import math
from datetime import UTC, datetime

import numpy as np
import pytest

from flights import shortened
from satform.evaluation.passes import PassDistance, PassLightAngle, PassTime
from satform.evaluation.response import Offset, Overshoot, Range, ResponseTime, Ripple
from satform.flight.simulate import simulate
from satform.orbits.sun import days_at, sun_in_lvlh
from satform.record.flight_record import FlightRecord
from satform.record.quantities import QUANTITIES
from satform.scenario import Timing

STEP = 0.01
TIMING = Timing(step=STEP, duration=20.0)


def record_of(position: np.ndarray, velocity: np.ndarray, reference: np.ndarray) -> FlightRecord:
    """A record of satellites a, b, ... that holds these motions, shape (K + 1, N, 3), and no more."""
    flown = simulate(shortened("triangle", 1.0))
    steps, count = len(position) - 1, position.shape[1]
    blank = {}
    for name in QUANTITIES:
        sample = getattr(flown, name)
        rows = steps + len(sample) - flown.steps
        blank[name] = np.full((rows, count, *sample.shape[2:]), np.nan)
    told = {"position": position, "velocity": velocity, "reference_position": reference}
    return dataclasses.replace(flown, satellites=tuple("abc"[:count]), step=STEP, **{**blank, **told})


DAMPING = 0.4
TIMES = np.arange(2001) * STEP


@pytest.fixture(scope="module")
def oscillator() -> FlightRecord:
    """A step from 5 m to 15 m in y of an oscillator of 1 rad/s and a damping of 0.4."""
    turn = math.sqrt(1.0 - DAMPING**2)
    decay = np.exp(-DAMPING * TIMES)
    part = 1.0 - decay * (np.cos(turn * TIMES) + DAMPING / turn * np.sin(turn * TIMES))
    position = np.zeros((2001, 1, 3))
    position[:, 0, 1] = 5.0 + 10.0 * part
    reference = np.zeros((2000, 1, 3))
    reference[:, 0, 1] = 15.0
    return record_of(position, np.zeros_like(position), reference)


def test_overshoot_is_that_of_the_damped_oscillator(oscillator: FlightRecord) -> None:
    expected = 100.0 * math.exp(-math.pi * DAMPING / math.sqrt(1.0 - DAMPING**2))
    for quantity in ("y", "range"):
        found = Overshoot(quantity=quantity, below=100.0).measure(oscillator)
        assert found == pytest.approx(expected, rel=1e-4)


def test_oscillator_peaks_after_half_a_period_and_crosses_before(oscillator: FlightRecord) -> None:
    turn = math.sqrt(1.0 - DAMPING**2)
    peak = ResponseTime(quantity="y", event="peak", below=100.0).measure(oscillator)
    assert peak == pytest.approx(math.pi / turn, abs=STEP)
    crossing = ResponseTime(quantity="y", event="crossing", below=100.0).measure(oscillator)
    assert crossing == pytest.approx((math.pi - math.acos(DAMPING)) / turn, abs=STEP)


def test_settled_means_within_the_band_for_good(oscillator: FlightRecord) -> None:
    found = ResponseTime(quantity="y", event="settled", band=0.05, below=100.0).measure(oscillator)
    off = np.abs(oscillator.position[:-1, 0, 1] - 15.0) / 10.0
    assert off[round(found / STEP) :].max() <= 0.05
    assert off[round(found / STEP) - 1] > 0.05


def test_a_band_belongs_to_settled_and_to_nothing_else() -> None:
    for fields in ({"event": "settled"}, {"event": "peak", "band": 0.1}):
        expectation = ResponseTime(quantity="y", below=1.0, **fields)
        assert "band" in expectation.complaints({"a"}, TIMING)[0]


def test_what_is_never_reached_has_no_time(oscillator: FlightRecord) -> None:
    beyond = np.zeros_like(oscillator.reference_position)
    beyond[:, 0, 1] = 50.0
    far = dataclasses.replace(oscillator, reference_position=beyond)
    assert math.isnan(ResponseTime(quantity="y", event="crossing", below=1.0).measure(far))
    assert math.isnan(ResponseTime(quantity="y", event="settled", band=0.1, below=1.0).measure(far))


def test_offset_and_ripple_of_a_sinusoid_about_a_mean() -> None:
    position = np.zeros((2001, 2, 3))
    position[:, 0, 2] = -3.0 + 0.5 * np.sin(math.pi * TIMES)
    position[:, 1, 2] = 2.0
    still = record_of(position, np.zeros_like(position), np.zeros((2000, 2, 3)))
    assert Offset(axis="z", below=0.0).measure(still) == pytest.approx(-3.0, abs=1e-9)
    assert Ripple(axis="z", below=1.0).measure(still) == pytest.approx(0.5, rel=1e-4)
    assert Ripple(axis="z", below=1.0, satellites=("b",)).measure(still) == 0.0
    assert Range(statistic="maximum", below=9.0).measure(still) == pytest.approx(3.5, rel=1e-4)
    assert Range(statistic="minimum", below=9.0, satellites=("b",)).measure(still) == 2.0


@pytest.fixture(scope="module")
def passing() -> FlightRecord:
    """Satellite a flies past b at 40 m and 300 m/s, nearest between two steps."""
    position, velocity = np.zeros((2001, 2, 3)), np.zeros((2001, 2, 3))
    position[:, 0] = np.stack((0.0 * TIMES, 300.0 * (TIMES - 7.3046), 0.0 * TIMES + 40.0), axis=-1)
    velocity[:, 0, 1] = 300.0
    return record_of(position, velocity, np.zeros((2000, 2, 3)))


def test_a_pass_is_found_between_two_steps(passing: FlightRecord) -> None:
    pair = {"satellites": ("a", "b"), "below": 1e9}
    assert PassDistance(**pair).measure(passing) == pytest.approx(40.0, rel=1e-9)
    assert PassTime(**pair).measure(passing) == pytest.approx(7.3046, abs=1e-9)


def test_a_pass_at_the_edge_of_the_stretch_is_not_sought_outside_it(passing: FlightRecord) -> None:
    late = PassTime(satellites=("a", "b"), below=1e9, after=9.0)
    assert late.measure(passing) == 9.0


def test_light_angle_is_the_sun_s_distance_from_the_one_that_looks(passing: FlightRecord) -> None:
    epoch = datetime(2024, 3, 20, 3, 6, tzinfo=UTC)
    expectation = PassLightAngle(satellites=("a", "b"), below=9.0, epoch=epoch, chief_longitude=0.5)
    sun = sun_in_lvlh(days_at(epoch) + 7.3046 / 86400.0, 0.5)
    assert expectation.measure(passing) == pytest.approx(math.acos(sun[2]), abs=1e-6)
    # At an equinox the sun is in the plane of that date's equator, and a is north of b: the equator has
    # moved since 2000 by precession, 20.04 seconds of arc a year at this place.
    moved = math.radians(20.04 / 3600.0) * days_at(epoch) / 365.25
    assert expectation.measure(passing) == pytest.approx(0.5 * math.pi + moved, abs=1e-3)


def test_at_noon_the_sun_is_overhead_for_a_geostationary_chief() -> None:
    noon = datetime(2024, 4, 15, 12, 0, tzinfo=UTC)
    # On this day the equation of time is zero.
    assert math.degrees(math.acos(sun_in_lvlh(days_at(noon), 0.0)[0])) == pytest.approx(9.8, abs=0.3)
