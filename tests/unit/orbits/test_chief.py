# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import math
from pathlib import Path

import brahe
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from satform.control.protocol import FlightSetting
from satform.flight.compile_satellite import flight_setting
from satform.orbits.chief import ChiefOrbitSpec, true_anomaly
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.kepler import eccentric_anomaly, mean_from_eccentric
from satform.scenario.loader import load_scenario

ROOT = Path(__file__).parents[3]
RADIANS = brahe.AngleFormat.RADIANS

angles = st.floats(-math.tau, math.tau)
orbits = st.builds(
    ChiefOrbitSpec,
    inclination=st.floats(0.0, math.pi),
    right_ascension=angles,
    argument_of_latitude=angles,
    eccentricity=st.floats(0.0, 0.95),
    argument_of_perigee=angles,
)


@settings(max_examples=60, deadline=None)
@given(orbits, st.floats(0.0, 1e6))
def test_elements_give_the_state_that_brahe_propagates_to(spec: ChiefOrbitSpec, time: float) -> None:
    motion = 1e-4
    chief = spec.keplerian(motion)
    assert chief.mean_motion == pytest.approx(motion, rel=1e-15)
    elements = np.array(
        [
            chief.semi_major_axis,
            chief.eccentricity,
            chief.inclination,
            chief.right_ascension,
            chief.argument_of_perigee,
            chief.mean_anomaly_at(time) % math.tau,
        ]
    )
    state = brahe.state_koe_to_eci(elements, RADIANS)
    scale = chief.semi_major_axis
    # brahe rounds the constant of gravity otherwise: only positions are compared to the last digits.
    assert chief.radius(time) == pytest.approx(float(np.linalg.norm(state[:3])), abs=1e-11 * scale)
    later = ChiefOrbitSpec(
        inclination=spec.inclination,
        right_ascension=spec.right_ascension,
        eccentricity=spec.eccentricity,
        argument_of_perigee=spec.argument_of_perigee,
        argument_of_latitude=math.remainder(chief.true_anomaly(time) + spec.argument_of_perigee, math.tau),
    )
    np.testing.assert_allclose(
        later.state(motion, GRAVITATIONAL_PARAMETER)[0], state[:3], rtol=0.0, atol=1e-9 * scale
    )


@settings(max_examples=60, deadline=None)
@given(orbits)
def test_true_anomaly_at_the_start_is_the_one_that_was_given(spec: ChiefOrbitSpec) -> None:
    chief = spec.keplerian(1e-3)
    given_anomaly = spec.argument_of_latitude - spec.argument_of_perigee
    assert chief.true_anomaly(0.0) == pytest.approx(given_anomaly, abs=2e-12)


def test_anomalies_grow_by_a_revolution_in_a_period() -> None:
    chief = ChiefOrbitSpec(eccentricity=0.7, argument_of_latitude=2.0).keplerian(1e-3)
    for time in (0.0, 100.0, 4000.0):
        ahead = chief.true_anomaly(time + 3.0 * chief.period) - chief.true_anomaly(time)
        assert ahead == pytest.approx(3.0 * math.tau, abs=1e-11)


@pytest.mark.parametrize("eccentricity", [1e-12, 0.3, 0.98, 0.9999, 1.0 - 1e-9, math.nextafter(1.0, 0.0)])
def test_anomalies_are_solved_for_every_eccentricity(eccentricity: float) -> None:
    for mean in (0.0, 5e-324, 1e-300, 1e-12, 1e-5, 0.03, 1.0, 3.0, math.pi, -1e-12, -2.0):
        found = eccentric_anomaly(mean, eccentricity)
        assert abs(found) <= math.pi
        assert mean_from_eccentric(found, eccentricity) == pytest.approx(mean, rel=4e-15, abs=1e-310)
        half = math.tan(0.5 * true_anomaly(mean, eccentricity)) if abs(mean) < 3.1 else None
        if half is not None and abs(mean) > 1e-13 and eccentricity < 1.0 - 1e-10:
            expected = math.sqrt((1.0 + eccentricity) / (1.0 - eccentricity)) * math.tan(0.5 * found)
            assert half == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(("mean", "eccentricity"), [(0.1, 1.0), (0.1, math.nan), (math.nan, 0.1)])
def test_no_anomaly_of_what_is_no_ellipse(mean: float, eccentricity: float) -> None:
    with pytest.raises(ValueError, match="no true anomaly for eccentricity"):
        true_anomaly(mean, eccentricity)


def test_laws_know_the_chief_of_the_dynamics() -> None:
    scenario = load_scenario(ROOT / "scenarios" / "triangle.yaml")
    assert flight_setting(scenario, 0).chief is None
    inertial = {"kind": "inertial", "chief": {"eccentricity": 0.05, "argument_of_latitude": 0.3}}
    setting = flight_setting(scenario.with_(dynamics=inertial), 0)
    assert isinstance(setting, FlightSetting)
    expected = ChiefOrbitSpec(eccentricity=0.05, argument_of_latitude=0.3).keplerian(scenario.orbit.rate)
    assert setting.chief == expected
