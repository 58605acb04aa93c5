# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Secular motion of mean elements against numeric motion of two orbits under J2, for a month and a year.

The epoch is the one at which the Earth's pole is that of the inertial frame but for nutation.
"""

import math

import brahe
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from j2_motion import J2Motion
from satform.orbits.chief import KeplerianChief, mean_anomaly, true_anomaly
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER, OBLATENESS
from satform.orbits.j2_elements import as_array, drifted, element_transition
from satform.orbits.mean_elements import mean_chief, osculating_elements

pytestmark = pytest.mark.unmeasured

RADIANS = brahe.AngleFormat.RADIANS
MONTH, YEAR = 30 * 86400.0, 365.25 * 86400.0
CHIEF = KeplerianChief(20.0e6, 0.62, 1.1, 0.2, 0.7, 0.3)
ELEMENTS = np.array([2e-7, 1e-5, 1e-5, -1e-5, 1e-5, 1e-5])


def after_a_month(mean: KeplerianChief) -> KeplerianChief:
    """Mean elements of an orbit, given by mean ones, that was propagated with osculating ones."""
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    (osculating,) = osculating_elements(as_array(mean)[None])
    osculating[3:] = np.remainder(osculating[3:], math.tau)
    epoch = brahe.Epoch.from_datetime(2000, 1, 1, 12, 0, 0.0, 0.0, brahe.TimeSystem.UTC)
    propagator = brahe.NumericalOrbitPropagator(
        epoch,
        brahe.state_koe_to_eci(osculating, RADIANS),
        brahe.NumericalPropagationConfig.with_method(brahe.IntegrationMethod.RKN1210),
        brahe.ForceModelConfig(gravity=brahe.GravityConfiguration(degree=2, order=0)),
    )
    propagator.propagate_to(epoch + MONTH)
    return mean_chief(
        KeplerianChief(*brahe.state_eci_to_koe(propagator.current_state()[:6], RADIANS).tolist())
    )


def test_mean_and_relative_elements_drift_as_numeric_ones_do_for_a_month() -> None:
    satellite = KeplerianChief(*brahe.state_roe_to_oe(as_array(CHIEF), ELEMENTS, RADIANS).tolist())
    flown, expected = after_a_month(CHIEF), drifted(CHIEF, MONTH)
    node = expected.right_ascension - CHIEF.right_ascension
    perigee = expected.argument_of_perigee - CHIEF.argument_of_perigee
    # What is left is of second order in J2, a thousandth of the drift.
    assert abs(math.remainder(flown.right_ascension - expected.right_ascension, math.tau)) < 1e-3 * abs(node)
    turn = math.remainder(flown.argument_of_perigee - expected.argument_of_perigee, math.tau)
    assert abs(turn) < 2e-3 * abs(perigee)
    assert flown.semi_major_axis == pytest.approx(CHIEF.semi_major_axis, abs=50.0)
    found = brahe.state_oe_to_roe(as_array(flown), as_array(after_a_month(satellite)), RADIANS)
    found[1] = math.remainder(found[1], math.tau)
    moved = element_transition(CHIEF, MONTH) @ ELEMENTS
    assert np.all(np.abs(moved - ELEMENTS)[[1, 2, 3, 5]] > 0.1 * 1e-5)
    np.testing.assert_allclose(found, moved, rtol=3e-3, atol=1e-10)


def moving(parameter: float = GRAVITATIONAL_PARAMETER) -> J2Motion:
    """Chief and satellite at time zero."""
    satellite = brahe.state_roe_to_oe(as_array(CHIEF), ELEMENTS, RADIANS)
    rows = osculating_elements(np.array([as_array(CHIEF), satellite]))
    rows[:, 5] = [true_anomaly(mean, e) for mean, e in rows[:, [5, 1]].tolist()]
    return J2Motion(rows, (parameter, OBLATENESS, EQUATORIAL_RADIUS))


def osculating_now(motion: J2Motion) -> list[KeplerianChief]:
    rows = motion.keplerian()
    rows[:, 5] = [mean_anomaly(true, e) for true, e in rows[:, [5, 1]].tolist()]
    return [KeplerianChief(*row) for row in rows.tolist()]


def states(motion: J2Motion) -> np.ndarray:
    rows = np.array([as_array(own) for own in osculating_now(motion)])
    rows[:, 3:] = np.remainder(rows[:, 3:], math.tau)
    return brahe.state_koe_to_eci(rows, RADIANS)


def test_the_motion_of_the_year_is_that_of_newtons_equations_for_three_revolutions() -> None:
    # The conversion between elements and states has this constant of the Earth.
    mu, duration = brahe.GM_EARTH, 3.0 * CHIEF.period
    motion = moving(mu)

    def rate(_time: float, state: np.ndarray) -> np.ndarray:
        place, radius = state[:3], float(np.linalg.norm(state[:3]))
        lift = 5.0 * (place[2] / radius) ** 2 - np.array([1.0, 1.0, 3.0])
        added = 1.5 * OBLATENESS * (EQUATORIAL_RADIUS / radius) ** 2 * lift
        return np.concatenate((state[3:], mu * place / radius**3 * (added - 1.0)))

    starts = states(motion)
    motion.advance_to(duration)
    for start, end in zip(starts, states(motion), strict=True):
        flown = solve_ivp(rate, (0.0, duration), start, "DOP853", rtol=3e-14, atol=1e-7)
        assert np.linalg.norm(flown.y[:3, -1] - end[:3]) < 1e-3


def test_mean_and_relative_elements_drift_as_numeric_ones_do_for_a_year() -> None:
    motion = moving()
    before = motion.constants_of_motion()
    motion.advance_to(YEAR)
    np.testing.assert_allclose(motion.constants_of_motion(), before, rtol=1e-11)
    flown, satellite = (mean_chief(own) for own in osculating_now(motion))
    expected = drifted(CHIEF, YEAR)
    node = expected.right_ascension - CHIEF.right_ascension
    assert node < -1.0
    assert abs(math.remainder(flown.right_ascension - expected.right_ascension, math.tau)) < 1e-4 * abs(node)
    # The perigee hardly turns at this inclination; what is left of its rate is of second order in J2.
    turn = math.remainder(flown.argument_of_perigee - expected.argument_of_perigee, math.tau)
    assert abs(turn) < 1e-4 * abs(node)
    along = expected.mean_anomaly - CHIEF.mean_anomaly
    assert abs(math.remainder(flown.mean_anomaly - expected.mean_anomaly, math.tau)) < 2e-6 * along
    found = brahe.state_oe_to_roe(as_array(flown), as_array(satellite), RADIANS)
    found[1] = math.remainder(found[1], math.tau)
    moved = element_transition(CHIEF, YEAR) @ ELEMENTS
    assert np.all(np.abs(moved - ELEMENTS)[[1, 2, 3, 5]] > 1e-5)
    np.testing.assert_allclose(found, moved, rtol=3e-3, atol=1e-10)
