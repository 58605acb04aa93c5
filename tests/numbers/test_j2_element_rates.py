# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Secular motion of mean elements against brahe's numeric propagation of two orbits under J2 for a month.

A year would take minutes. The epoch is the one at which the Earth's pole is that of the inertial frame.
"""

import math

import brahe
import numpy as np
import pytest

from satform.orbits.chief import KeplerianChief
from satform.orbits.j2_elements import as_array, drifted, element_transition
from satform.orbits.mean_elements import mean_chief, osculating_elements

pytestmark = pytest.mark.unmeasured

RADIANS = brahe.AngleFormat.RADIANS
MONTH = 30 * 86400.0


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
    chief = KeplerianChief(20.0e6, 0.62, 1.1, 0.2, 0.7, 0.3)
    elements = np.array([2e-7, 1e-5, 1e-5, -1e-5, 1e-5, 1e-5])
    satellite = KeplerianChief(*brahe.state_roe_to_oe(as_array(chief), elements, RADIANS).tolist())
    flown, expected = after_a_month(chief), drifted(chief, MONTH)
    node = expected.right_ascension - chief.right_ascension
    perigee = expected.argument_of_perigee - chief.argument_of_perigee
    # What is left is of second order in J2, a thousandth of the drift.
    assert abs(math.remainder(flown.right_ascension - expected.right_ascension, math.tau)) < 1e-3 * abs(node)
    turn = math.remainder(flown.argument_of_perigee - expected.argument_of_perigee, math.tau)
    assert abs(turn) < 2e-3 * abs(perigee)
    assert flown.semi_major_axis == pytest.approx(chief.semi_major_axis, abs=50.0)
    found = brahe.state_oe_to_roe(as_array(flown), as_array(after_a_month(satellite)), RADIANS)
    found[1] = math.remainder(found[1], math.tau)
    moved = element_transition(chief, MONTH) @ elements
    assert np.all(np.abs(moved - elements)[[1, 2, 3, 5]] > 0.1 * 1e-5)
    np.testing.assert_allclose(found, moved, rtol=3e-3, atol=1e-10)
