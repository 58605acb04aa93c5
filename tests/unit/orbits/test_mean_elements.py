# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import math

import brahe
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from satform.orbits.chief import KeplerianChief
from satform.orbits.j2_elements import as_array, drifted, oblate_acceleration
from satform.orbits.mean_elements import mean_chief, osculating_elements

RADIANS = brahe.AngleFormat.RADIANS

angles = st.floats(-math.pi, math.pi)


@st.composite
def orbits(draw: st.DrawFn) -> KeplerianChief:
    e = draw(st.floats(0.0, 0.85))
    perigee = draw(st.floats(6.7e6, 4e7))
    inclination = draw(st.floats(0.1, math.pi - 0.1))
    return KeplerianChief(perigee / (1.0 - e), e, inclination, draw(angles), draw(angles), draw(angles))


def apart(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Differences of two orbits in elements that are defined for circular ones, relative or in rad."""
    vectors = [e * np.array([math.cos(w), math.sin(w)]) for e, w in (first[[1, 4]], second[[1, 4]])]
    turns = [first[3] - second[3], first[4] + first[5] - second[4] - second[5]]
    return np.array(
        [
            (first[0] - second[0]) / second[0],
            *(vectors[0] - vectors[1]),
            first[2] - second[2],
            *(math.remainder(turn, math.tau) for turn in turns),
        ]
    )


@settings(max_examples=40, deadline=None)
@given(orbits())
def test_there_and_back_gives_the_same_orbit(orbit: KeplerianChief) -> None:
    mean = mean_chief(orbit)
    (back,) = osculating_elements(as_array(mean)[None])
    np.testing.assert_allclose(apart(back, as_array(orbit)), 0.0, rtol=0.0, atol=1e-11)
    if orbit.eccentricity > 0.01:
        assert abs(mean.argument_of_perigee - orbit.argument_of_perigee) <= math.pi
    arguments = [own.argument_of_perigee + own.mean_anomaly for own in (mean, orbit)]
    assert arguments[0] == pytest.approx(arguments[1], abs=0.02)


@pytest.mark.parametrize(
    ("eccentricity", "axis_error"), [(0.0005, 2e-6), (0.1, 2e-6), (0.5, 4e-6), (0.8, 4e-6)]
)
def test_mean_elements_of_numeric_motion_under_j2_change_at_the_secular_rates(
    eccentricity: float, axis_error: float
) -> None:
    """What is left over an orbit is of second order in J2, a thousandth of the periodic part."""
    start = KeplerianChief(7.2e6 / (1.0 - eccentricity), eccentricity, 1.1, 0.2, 0.7, 0.3)

    def rate(_time: float, state: np.ndarray) -> np.ndarray:
        pull = -brahe.GM_EARTH / np.linalg.norm(state[:3]) ** 3 * state[:3]
        return np.concatenate((state[3:], pull + oblate_acceleration(state[:3], brahe.GM_EARTH)))

    times = np.linspace(0.0, start.period, 17)
    initial = brahe.state_koe_to_eci(as_array(start), RADIANS)
    flown = solve_ivp(rate, (0.0, times[-1]), initial, "DOP853", times, rtol=1e-12, atol=1e-6).y.T
    osculating = [brahe.state_eci_to_koe(state, RADIANS) for state in flown]
    means = [as_array(mean_chief(KeplerianChief(*one.tolist()))) for one in osculating]
    expected = [as_array(drifted(KeplerianChief(*means[0].tolist()), time)) for time in times.tolist()]
    left = np.max(np.abs([apart(*pair) for pair in zip(means, expected, strict=True)]), axis=0)
    periodic = np.max(np.abs([apart(one, osculating[0]) for one in osculating]), axis=0)
    assert left[0] < axis_error < 5e-3 * periodic[0]
    assert np.all(left[1:5] < 2e-6)
    # A thousandth of the axis' error for each rad, over the orbit.
    assert left[5] < 3.0 * math.pi * axis_error
    assert np.all(periodic[1:4] > 1e-4)


@pytest.mark.parametrize("anomaly", [0.4, 1.5, 2.8])
def test_near_a_circle_they_are_those_of_brouwer_and_lyddane(anomaly: float) -> None:
    """As brahe computes them, for mean anomalies below pi."""
    orbit = np.array([7.2e6, 0.002, 1.1, 0.2, 0.7, anomaly])
    expected = brahe.state_koe_mean_to_osc(orbit, brahe.MeanElementMethod.BROUWER_LYDDANE, RADIANS)
    (found,) = osculating_elements(orbit[None])
    assert np.max(np.abs(apart(expected, orbit))) > 1e-4
    np.testing.assert_allclose(apart(found, expected), 0.0, rtol=0.0, atol=1e-5)
