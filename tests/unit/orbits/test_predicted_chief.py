# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The predicted chief and mean elements beside it, against closed forms and brahe."""

import math

import brahe
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from satform.orbits.chief import KeplerianChief
from satform.orbits.earth import EQUATORIAL_RADIUS, OBLATENESS
from satform.orbits.inertial_motion import NodalElements, elements_between, nodal_elements
from satform.orbits.j2_elements import secular_rates
from satform.orbits.predicted_chief import PredictedChief, moved, nodal_of, short_period_of, state_of

AXIS = 7.0e6
RADIANS = brahe.AngleFormat.RADIANS
CRITICAL = math.acos(math.sqrt(0.2))
"""Inclination at which the theory of Brouwer and Lyddane has no solution."""

inclinations = st.floats(0.1, 3.0)
angles = st.floats(-math.pi, math.pi)


def orbit(eccentricity, inclination, anomaly, axis=AXIS):
    return KeplerianChief(axis, eccentricity, inclination, 0.3, 0.7, anomaly)


def neighbour(chief):
    """An orbit some hundred metres beside another one in every element."""
    offset = 1.0 / chief.semi_major_axis
    return KeplerianChief(
        chief.semi_major_axis,
        chief.eccentricity + 200.0 * offset,
        chief.inclination + 200.0 * offset,
        chief.right_ascension + 300.0 * offset,
        chief.argument_of_perigee + 0.02,
        chief.mean_anomaly - 0.02,
    )


@given(st.floats(0.0, 0.7), inclinations, angles)
def test_a_state_has_the_elements_that_it_was_made_of(eccentricity, inclination, anomaly):
    elements = nodal_of(orbit(eccentricity, inclination, anomaly))
    again = nodal_elements(np.concatenate(state_of(elements)))
    assert elements_between(elements, again) == pytest.approx(np.zeros(6), abs=1e-6)


@given(inclinations, angles)
def test_about_a_circle_the_short_period_effect_is_that_of_closed_form(inclination, argument):
    """Gauss's equations on a circle, integrated by hand; k = 3/2 J2 (R/a)^2."""
    k = 1.5 * OBLATENESS * (EQUATORIAL_RADIUS / AXIS) ** 2
    s2 = math.sin(inclination) ** 2
    found = short_period_of(nodal_of(orbit(0.0, inclination, argument - 0.7)))
    assert found == pytest.approx(
        k
        * np.array(
            [
                AXIS * s2 * math.cos(2.0 * argument),
                (1.0 - 1.25 * s2) * math.cos(argument) + 7.0 / 12.0 * s2 * math.cos(3.0 * argument),
                (1.0 - 1.75 * s2) * math.sin(argument) + 7.0 / 12.0 * s2 * math.sin(3.0 * argument),
                0.25 * math.sin(2.0 * inclination) * math.cos(2.0 * argument),
                0.5 * math.cos(inclination) * math.sin(2.0 * argument),
                -0.5 * (1.0 - 2.5 * s2) * math.sin(2.0 * argument),
            ]
        ),
        rel=1e-9,
        abs=1e-12,
    )


@settings(max_examples=15, deadline=None)
@given(st.floats(0.002, 0.005), st.sampled_from([0.5, 0.9, 1.7, 2.3]), angles)
def test_where_brahe_s_conversion_holds_it_gives_the_same_relative_elements(
    eccentricity, inclination, anomaly
):
    """It includes long-period terms, and takes the periodic ones of osculating elements instead of mean ones.

    Both are of second order in J2 and differ by some decimetres between the two orbits.
    """
    pair = [orbit(eccentricity, inclination, anomaly)]
    pair.append(neighbour(pair[0]))
    chief = PredictedChief.of(pair[0], oblate=True)
    now = chief.at(0.0)
    assert elements_between(nodal_of(pair[0]), now.osculating) == pytest.approx(np.zeros(6), abs=1e-6)
    ours = elements_between(now.mean, chief.mean_beside(now, nodal_of(pair[1])))
    theirs = elements_between(*map(by_brahe, pair))
    assert ours == pytest.approx(theirs, abs=0.5)
    assert np.delete(ours, 1) == pytest.approx(np.delete(theirs, 1), abs=0.2)
    own = elements_between(now.mean, by_brahe(pair[0]))
    assert own == pytest.approx(np.zeros(6), abs=80.0)


def by_brahe(chief):
    method = brahe.MeanElementMethod.BROUWER_LYDDANE
    whole = [
        chief.semi_major_axis,
        chief.eccentricity,
        chief.inclination,
        chief.right_ascension,
        chief.argument_of_perigee,
        math.remainder(chief.mean_anomaly, math.tau),
    ]
    mean = brahe.state_koe_osc_to_mean(np.array(whole), method, RADIANS)
    return nodal_of(KeplerianChief(*(float(part) for part in mean)))


def flown(state, times):
    """States under two-body gravity and J2 by brahe's numerical propagator, shape (K, 6)."""
    # brahe takes the Earth's orientation from the process.
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    config = brahe.ForceModelConfig(
        gravity=brahe.GravityConfiguration(degree=2, order=0),
        frame_transform=brahe.FrameTransformationModel.EARTH_ROTATION_ONLY,
    )
    epoch = brahe.Epoch.from_datetime(2024, 1, 1, 0, 0, 0.0, 0.0, brahe.TimeSystem.UTC)
    precise = brahe.NumericalPropagationConfig.high_precision()
    flight = brahe.NumericalOrbitPropagator(epoch, state, precise, config)
    states = []
    for time in times.tolist():
        flight.propagate_to(epoch + time)
        states.append(flight.current_state())
    return np.array(states)


def ripple(times, values):
    """Standard deviation about a line."""
    return np.std(values - np.outer(times, np.polyfit(times, values, 1)[0]), axis=0)


@pytest.mark.parametrize("inclination", [0.5, CRITICAL, 1.7])
@pytest.mark.parametrize("eccentricity", [0.0, 0.01])
def test_mean_relative_elements_do_not_swing_under_j2(eccentricity, inclination):
    """An osculating circle too, whose eccentricity passes zero once in each orbit."""
    chief = orbit(eccentricity, inclination, 0.1)
    times = np.linspace(60.0, 2.0 * chief.period, 60)
    predicted = PredictedChief.of(chief, oblate=True)
    beside = by_distance(predicted.at(0.0).mean)
    both = [nodal_of(chief), moved(beside, short_period_of(beside))]
    tracks = [flown(np.concatenate(state_of(one)), times) for one in both]
    pairs = [[nodal_elements(state) for state in moment] for moment in zip(*tracks, strict=True)]
    osculating = np.array([elements_between(*pair) for pair in pairs])
    moments = [predicted.at(time) for time in times.tolist()]
    own = [predicted.mean_beside(now, one) for now, (one, _) in zip(moments, pairs, strict=True)]
    others = [predicted.mean_beside(now, other) for now, (_, other) in zip(moments, pairs, strict=True)]
    mean = np.array([elements_between(*pair) for pair in zip(own, others, strict=True)])
    assert np.max(ripple(times, mean)) < 0.01
    assert np.min(ripple(times, osculating)[:4]) > 0.25
    rates = secular_rates(predicted.mean)
    for found, expected in (
        ([one.right_ascension for one in own], rates.right_ascension),
        ([one.mean_argument for one in own], rates.argument_of_perigee + rates.mean_anomaly),
    ):
        slope = np.polyfit(times, np.unwrap(found), 1)[0]
        # Of second order in J2, and a mean motion from a semi-major axis within some metres.
        assert slope == pytest.approx(expected, abs=1e-5 * chief.mean_motion)


def by_distance(mean):
    return NodalElements(
        mean.semi_major_axis,
        mean.inclination + 100.0 / AXIS,
        mean.right_ascension + 300.0 / AXIS,
        mean.eccentricity + np.array([300.0, 100.0]) / AXIS,
        mean.mean_argument + 200.0 / AXIS,
    )


def test_the_predicted_chief_is_where_brahe_propagates_it():
    chief = orbit(0.001, 1.2, 0.4)
    times = np.array([2000.0, 3.0 * chief.period])
    predicted = PredictedChief.of(chief, oblate=True)
    for time, state in zip(times, flown(np.concatenate(state_of(nodal_of(chief))), times), strict=True):
        now = predicted.at(float(time))
        # Along the track by the semi-major axis, which is known to second order in J2 only.
        assert state_of(now.osculating)[0] == pytest.approx(state[:3], abs=600.0)
        normal = now.frame.normal
        momentum = np.cross(state[:3], state[3:])
        assert normal == pytest.approx(momentum / np.linalg.norm(momentum), abs=1e-5)


def test_without_oblateness_the_chief_keeps_to_its_orbit():
    chief = orbit(0.2, 1.2, 0.4)
    predicted = PredictedChief.of(chief, oblate=False)
    later = predicted.at(chief.period)
    assert elements_between(nodal_of(chief), later.osculating) == pytest.approx(np.zeros(6), abs=1e-5)
    assert later.frame.rate[0] == 0.0
    assert predicted.mean_beside(later, later.osculating) is later.osculating
