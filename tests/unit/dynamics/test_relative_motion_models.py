# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import math

import brahe
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from satform.dynamics import cw
from satform.dynamics.relative_motion_models import CwModel, input_matrix, relative_motion_model
from satform.dynamics.yamanaka_ankersen import YamanakaAnkersenModel
from satform.orbits.chief import ChiefOrbitSpec, KeplerianChief
from satform.orbits.frames import lvlh_frame

MOTION = 1e-4
RADIANS = brahe.AngleFormat.RADIANS

anomalies = st.floats(-math.pi, math.pi)
fractions = st.floats(-2.0, 2.0)


def chief_of(eccentricity: float, anomaly: float) -> KeplerianChief:
    return ChiefOrbitSpec(eccentricity=eccentricity, argument_of_latitude=anomaly).keplerian(MOTION)


def in_two_body_motion(chief: KeplerianChief, start: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Relative state about a chief at times, from two orbits propagated by brahe, shape (n, 6)."""
    # brahe's constant of gravity is a little smaller: the mean motion is what is kept.
    axis = math.cbrt(brahe.GM_EARTH / chief.mean_motion**2)
    mean = math.remainder(chief.mean_anomaly, math.tau)
    state = brahe.state_koe_to_eci(np.array([axis, chief.eccentricity, 0.9, 0.1, 0.0, mean]), RADIANS)
    satellite = lvlh_frame(state[:3], state[3:]).to_inertial(start[:3], start[3:])
    epoch = brahe.Epoch.from_gps_seconds(0.0)
    propagators = [
        brahe.KeplerianPropagator.from_eci(epoch, one, 60.0) for one in (state, np.concatenate(satellite))
    ]
    of_chief, of_satellite = (
        np.array([one.state_eci(epoch + time) for time in times.tolist()]) for one in propagators
    )
    frame = lvlh_frame(of_chief[:, :3], of_chief[:, 3:])
    return np.concatenate(frame.to_lvlh(of_satellite[:, :3], of_satellite[:, 3:]), axis=-1)


@pytest.mark.parametrize("anomaly", [0.0, 1.0, 2.5, 4.0])
@pytest.mark.parametrize(("eccentricity", "distance"), [(0.05, 1e3), (0.3, 1e3), (0.7, 30.0), (0.9, 1.0)])
def test_yamanaka_ankersen_differs_from_two_body_motion_by_the_square_of_the_distance(
    eccentricity: float, distance: float, anomaly: float
) -> None:
    """A tenfold distance makes a hundredfold error over one orbit, and the error is small itself."""
    chief = chief_of(eccentricity, anomaly)
    times = np.linspace(0.0, chief.period, 25)[1:]
    model = YamanakaAnkersenModel(chief)
    transitions = model.transition(np.zeros_like(times), times)
    shape = np.array([0.3, -0.8, 0.5, 0.4 * MOTION, -0.6 * MOTION, 0.2 * MOTION])
    errors = []
    for size in (distance, 10.0 * distance):
        found = in_two_body_motion(chief, size * shape, times)
        errors.append(np.max(np.linalg.norm((found - size * transitions @ shape)[:, :3], axis=-1)))
    assert errors[1] / errors[0] == pytest.approx(100.0, rel=0.05)
    excursion = float(np.max(np.linalg.norm((distance * transitions @ shape)[:, :3], axis=-1)))
    perigee = chief.semi_major_axis * (1.0 - eccentricity)
    assert errors[0] < 10.0 * excursion * excursion / perigee


@settings(max_examples=50, deadline=None)
@given(st.floats(0.0, 0.9), anomalies, fractions, fractions, fractions)
def test_transitions_compose(e: float, anomaly: float, first: float, second: float, third: float) -> None:
    chief = chief_of(e, anomaly)
    begin, middle, end = (share * chief.period for share in (first, second, third))
    model = YamanakaAnkersenModel(chief)
    # In units of an orbit's radian, so that position and velocity are of one size.
    unit = np.repeat([1.0, 1.0 / MOTION], 3)
    whole, after, before = (
        unit[:, None] * model.transition(*pair) / unit
        for pair in ((begin, end), (middle, end), (begin, middle))
    )
    size = np.linalg.norm(after) * np.linalg.norm(before)
    np.testing.assert_allclose(after @ before, whole, rtol=0.0, atol=1e-12 * size)
    assert np.linalg.det(whole) == pytest.approx(1.0, abs=1e-11 * np.linalg.norm(whole) ** 2)


@settings(max_examples=50, deadline=None)
@given(anomalies, fractions, fractions)
def test_about_a_circular_orbit_it_is_clohessy_wiltshire(anomaly: float, start: float, end: float) -> None:
    chief = chief_of(0.0, anomaly)
    times = start * chief.period, end * chief.period
    expected = cw.transition_matrix(MOTION, times[1] - times[0])
    for name in ("yamanaka_ankersen", "cw"):
        found = relative_motion_model(name, chief).transition(*times)
        scale = np.max(np.abs(expected), initial=1.0, axis=1, keepdims=True)
        np.testing.assert_allclose(found / scale, expected / scale, rtol=0.0, atol=2e-11)
        np.testing.assert_allclose(
            relative_motion_model(name, chief).system_matrix(times[0]),
            cw.system_matrices(MOTION)[0],
            rtol=1e-14,
            atol=1e-22,
        )


@settings(max_examples=50, deadline=None)
@given(st.floats(0.0, 0.9), anomalies)
def test_the_system_matrix_is_the_rate_of_the_transition(e: float, anomaly: float) -> None:
    chief = chief_of(e, anomaly)
    model, half = YamanakaAnkersenModel(chief), 1e-4 / MOTION * (1.0 - e) ** 1.5
    rate = (model.transition(0.0, half) - model.transition(0.0, -half)) / (2.0 * half)
    found = model.system_matrix(0.0)
    unit = np.repeat([1.0, 1.0 / MOTION], 3) / MOTION**0.5
    scaled = [unit[:, None] * matrix / unit for matrix in (rate, found)]
    np.testing.assert_allclose(*scaled, rtol=0.0, atol=1e-6 * np.max(np.abs(scaled[1])))


def test_many_times_at_once_are_each_as_alone() -> None:
    model = YamanakaAnkersenModel(chief_of(0.4, 1.0))
    starts, ends = np.array([[0.0, 10.0], [5e3, 6e3]]), np.array([[1e4, 20.0], [0.0, 7e4]])
    whole, rates = model.transition(starts, ends), model.system_matrix(starts)
    assert whole.shape == (2, 2, 6, 6)
    for place in np.ndindex(2, 2):
        np.testing.assert_allclose(
            whole[place], model.transition(starts[place], ends[place]), rtol=1e-14, atol=1e-24
        )
        np.testing.assert_allclose(rates[place], model.system_matrix(starts[place]), rtol=1e-14)


def test_a_held_command_acts_as_in_the_closed_form_about_a_circular_orbit() -> None:
    found = input_matrix(CwModel(MOTION), 100.0, 160.0)
    np.testing.assert_allclose(found, cw.input_matrix(MOTION, 60.0), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("eccentricity", [0.2, 0.7])
def test_a_held_command_about_an_eccentric_orbit_is_the_sum_of_shorter_ones(eccentricity: float) -> None:
    """Quadrature over a step through the perigee against one over a hundred parts of it."""
    model = YamanakaAnkersenModel(chief_of(eccentricity, 0.0))
    edges = np.linspace(-30.0, 30.0, 101)
    parts = model.transition(edges[1:], edges[-1]) @ input_matrix(model, edges[:-1], edges[1:])
    np.testing.assert_allclose(
        input_matrix(model, edges[0], edges[-1]), parts.sum(axis=0), rtol=1e-9, atol=1e-9
    )
