# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Inertial states and relative elements of a record, against the truth model, brahe and definitions."""

import math
from typing import Any

import brahe
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import satform as sf
from flights import shipped, shortened
from satform.flight.compile import compile_scenario
from satform.flight.truth import truth_model
from satform.orbits.inertial_motion import RELATIVE_ELEMENTS, relative_elements, unperturbed
from satform.record.archive import load_record, save_record
from satform.record.tables import columns, unit_of
from satform.scenario import Scenario

RADIANS: Any = brahe.AngleFormat.RADIANS


def states_of(scenario: Scenario, record: sf.FlightRecord) -> np.ndarray:
    """The truth model's own inertial motion in the recorded flight, shape (K + 1, 2, 1 + N, 3)."""
    dynamics: Any = truth_model(scenario)
    plan = compile_scenario(scenario).plant
    state = dynamics.start(plan.start.position, plan.start.velocity)
    found = [state.motion]
    for step in range(record.steps):
        state = dynamics.advance(state, record.applied_acceleration[step], step)
        found.append(state.motion)
    return np.array(found)


@pytest.mark.parametrize(
    "changes",
    [
        (),
        ("dynamics.frame_rate=orbit_rate",),
        ("dynamics.chief_motion=keplerian", "dynamics.chief.eccentricity=0.02"),
        ("dynamics.integrator={kind: dop853}", "dynamics.moon=true", "dynamics.gravity.rotation=full"),
    ],
)
def test_inertial_states_are_those_of_the_truth_model(changes: tuple[str, ...]) -> None:
    scenario = shortened("triangle_inertial", 4.0, *changes)
    record = sf.simulate(scenario)
    motion = states_of(scenario, record)
    assert record.chief is not None
    # Nobody else's motion nor any command acts on a chief, to the last bit.
    assert np.array_equal(record.chief.position, motion[:, 0, 0])
    assert np.array_equal(record.chief.velocity, motion[:, 1, 0])
    # Distances of 1e5 m and axes of unit length, each rounded to 1e-16.
    assert np.allclose(record.inertial_position, motion[:, 0, 1:], rtol=0.0, atol=1e-8)
    assert np.allclose(record.inertial_velocity, motion[:, 1, 1:], rtol=0.0, atol=1e-10)


def test_a_chief_of_the_relative_model_is_that_of_the_model_in_inertial_space() -> None:
    fields = {"kind": "cw_perturbed", "chief": {"inclination": 0.9}, "gravity": {"degree": 10}}
    integrator = {"kind": "rk4", "maximum_step": 10.0}
    scenario = shortened("triangle_inertial", 20.0)
    other = scenario.with_(
        dynamics=sf.CwPerturbedDynamicsSpec.model_validate({**fields, "integrator": integrator})
    )
    first, second = sf.simulate(scenario).chief, sf.simulate(other).chief
    assert first is not None
    assert second is not None
    assert np.allclose(first.position, second.position, rtol=0.0, atol=1e-7)
    assert not second.nominal


def test_the_ideal_chief_keeps_to_its_circle_as_brahe_propagates_it() -> None:
    scenario = shortened("triangle_inertial", 600.0, "timing.step=60.0")
    circular = sf.CwPerturbedDynamicsSpec(
        chief=sf.ChiefOrbitSpec(inclination=0.9), chief_motion="circular", gravity=sf.GravitySpec(degree=2)
    )
    record = sf.simulate(scenario.with_(dynamics=circular))
    chief = record.chief
    assert chief is not None
    start = np.concatenate((chief.position[0], chief.velocity[0]))
    utc: Any = brahe.TimeSystem.UTC
    zero = brahe.Epoch.from_datetime(2024, 1, 1, 0, 0, 0.0, 0.0, utc)
    propagator = brahe.KeplerianPropagator.from_eci(zero, start, 60.0)
    end = propagator.state_eci(zero + record.steps * record.step)
    assert np.allclose(chief.position[-1], end[:3], rtol=0.0, atol=1e-4)


def test_without_a_date_there_are_no_inertial_states_and_the_sentence_says_so() -> None:
    record = sf.simulate(shortened("triangle", 3.0))
    assert record.chief is None
    assert record.orbital_quantities() == {}
    with pytest.raises(ValueError, match="its truth model has no date"):
        _ = record.inertial_position


def test_a_record_without_its_scenario_says_how_to_give_it_one(tmp_path: Any) -> None:
    scenario = shortened("triangle_inertial", 3.0)
    flown = sf.simulate(scenario)
    save_record(flown, tmp_path / "record.npz")
    record = load_record(tmp_path / "record.npz")
    with pytest.raises(ValueError, match=r"see satform\.with_chief"):
        _ = record.relative_elements
    whole = sf.with_chief(record, scenario)
    assert np.array_equal(whole["sat2"].relative_elements, flown.relative_elements[:, 1])
    assert np.array_equal(whole.first(2).inertial_velocity, flown.inertial_velocity[:3])


def test_tables_have_the_inertial_states_and_relative_elements_with_their_units() -> None:
    record = sf.simulate(shortened("triangle_inertial", 3.0))
    table = columns(record.satellites, record.time, record.orbital_quantities())
    assert list(table)[-6:] == [f"relative_elements_{name}" for name in RELATIVE_ELEMENTS]
    assert unit_of("relative_elements_dlambda") == "m"
    assert unit_of("chief_velocity_z") == "m/s"
    assert np.array_equal(table["relative_elements_dix"].reshape(4, 3), record.relative_elements[..., 4])
    assert np.array_equal(table["inertial_position_y"].reshape(4, 3), record.inertial_position[..., 1])


angles = st.floats(-3.0, 3.0)
offsets = st.tuples(*[st.floats(-1e-3, 1e-3)] * 6)


@given(
    eccentricity=st.floats(1e-3, 0.7),
    inclination=st.floats(0.1, 3.0),
    # brahe 1.8 takes the difference of two nodes without regard to the whole turn between 0 and 2 pi.
    node=st.floats(0.1, 6.0),
    perigee=angles,
    anomaly=angles,
    offset=offsets,
)
def test_relative_elements_are_those_of_brahe(
    eccentricity: float, inclination: float, node: float, perigee: float, anomaly: float, offset: Any
) -> None:
    own = np.array([2.0e7, eccentricity, inclination, node, perigee, anomaly])
    other = own + np.array([1e6, 0.1, 1.0, 1.0, 1.0, 1.0]) * np.array(offset)
    states = [
        brahe.state_koe_to_eci(np.remainder(one, [1e9, 1.0, *[math.tau] * 4]), RADIANS)
        for one in (own, other)
    ]
    found = relative_elements(*states) / own[0]
    expected = np.array(brahe.state_eci_to_roe(*states, RADIANS))
    # brahe gives angles from 0 to one turn.
    expected[[1, 4, 5]] = np.remainder(expected[[1, 4, 5]] + math.pi, math.tau) - math.pi
    # brahe's eccentricity comes from its square, and loses half of the digits as it becomes small.
    assert found == pytest.approx(expected, rel=0.0, abs=1e-11 / eccentricity)


@given(st.floats(0.1, 3.0), angles, angles, offsets)
def test_relative_elements_of_a_circular_chief_are_those_that_made_the_states(
    inclination: float, node: float, latitude: float, offset: Any
) -> None:
    da, dlambda, dex, dey, dix, diy = offset
    axis, turned = 7.0e6, diy / math.sin(inclination)
    chief = [axis, 0.0, inclination, node, 0.0, latitude]
    perigee = math.atan2(dey, dex)
    mean = latitude + dlambda - turned * math.cos(inclination) - perigee
    deputy = [axis * (1.0 + da), math.hypot(dex, dey), inclination + dix, node + turned, perigee, mean]
    turn = [1e9, 1.0, *[math.tau] * 4]
    states = [brahe.state_koe_to_eci(np.remainder(one, turn), RADIANS) for one in (chief, deputy)]
    # The definition of D'Amico 2010; micrometres are what is left of the digits of 7000 km.
    assert relative_elements(*states) == pytest.approx(axis * np.array(offset), rel=0.0, abs=2e-6)


def test_relative_elements_of_an_equatorial_chief_are_not_defined() -> None:
    state = np.array([7.0e6, 0.0, 0.0, 0.0, 7.5e3, 0.0])
    assert np.isnan(relative_elements(state, state)).all()


def test_an_unperturbed_chief_is_the_point_mass_chief_of_the_truth_model() -> None:
    scenario = shipped(
        "triangle_inertial", "timing.duration=600.0", "expect=[]", "dynamics.chief_motion=keplerian",
        "dynamics.chief.eccentricity=0.05", "timing.step=60.0",
    )  # fmt: skip
    frames = truth_model(scenario).chief_frames(10)
    assert frames is not None
    assert scenario.chief is not None
    found = unperturbed(scenario.chief, 60.0 * np.arange(11))
    # The laws' GM is that of WGS 84, the truth's that of EGM2008: 2.5e-10 of the distance, and rk4's error.
    assert np.allclose(found.origin_position, frames.origin_position, rtol=0.0, atol=1e-2)
    assert np.allclose(found.rate, frames.rate, rtol=1e-8, atol=1e-15)


def test_a_linear_model_has_the_inertial_states_of_the_orbit_that_the_scenario_gives() -> None:
    orbit = (
        "{kind: keplerian, semi_major_axis: 7.0e6, eccentricity: 0.0, inclination: 0.9, mean_anomaly: 1.0}"
    )
    date = "2024-05-06T07:08:09Z"
    changes = ["satellites[*].position_error=[0.0, 0.0, 0.0]"]
    scenario = shortened("triangle", 2.0, f"orbit={{chief: {orbit[:-1]}, epoch: {date}}}}}", *changes)
    chief = sf.simulate(scenario).chief
    assert chief is not None
    assert chief.nominal
    assert chief.epoch.isoformat() == "2024-05-06T07:08:09+00:00"
    expected = brahe.state_koe_to_eci(np.array([7.0e6, 0.0, 0.9, 0.0, 0.0, 1.0]), RADIANS)
    # The laws' GM is that of WGS 84, brahe's that of EGM2008.
    assert chief.position[0] == pytest.approx(expected[:3], abs=1e-2)
