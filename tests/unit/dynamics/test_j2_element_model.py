# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import math

import brahe
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from satform.dynamics.j2_element_model import J2ElementModel
from satform.dynamics.relative_motion_models import relative_motion_model
from satform.dynamics.yamanaka_ankersen import YamanakaAnkersenModel
from satform.orbits.chief import KeplerianChief
from satform.orbits.frames import chief_frame
from satform.orbits.j2_elements import as_array, oblate_acceleration

RADIANS = brahe.AngleFormat.RADIANS


def chief_of(eccentricity: float, inclination: float = 1.1) -> KeplerianChief:
    return KeplerianChief(7.2e6 / (1.0 - eccentricity), eccentricity, inclination, 0.2, 0.7, 0.3)


def numeric(start: np.ndarray, times: np.ndarray) -> np.ndarray:
    def rate(_time: float, state: np.ndarray) -> np.ndarray:
        pull = -brahe.GM_EARTH / np.linalg.norm(state[:3]) ** 3 * state[:3]
        return np.concatenate((state[3:], pull + oblate_acceleration(state[:3], brahe.GM_EARTH)))

    return solve_ivp(rate, (0.0, times[-1]), start, "DOP853", times, rtol=3e-13, atol=1e-7).y.T


def relative(chief: np.ndarray, satellite: np.ndarray) -> np.ndarray:
    frame = chief_frame(chief[:3], chief[3:], oblate_acceleration(chief[:3], brahe.GM_EARTH))
    return np.concatenate(frame.to_lvlh(satellite[:3], satellite[3:]))


@pytest.mark.parametrize(("eccentricity", "distance"), [(0.0005, 20.0), (0.1, 20.0), (0.6, 2.0)])
def test_it_follows_numeric_motion_under_j2_twenty_times_as_well_as_the_two_body_model(
    eccentricity: float, distance: float
) -> None:
    chief = chief_of(eccentricity)
    model, two_body = J2ElementModel(chief), YamanakaAnkersenModel(chief)
    start = distance * np.array([0.3, -0.8, 0.5, *(chief.mean_motion * np.array([0.4, -0.6, 0.2]))])
    times = np.linspace(0.0, 3.0 * chief.period, 25)
    state = brahe.state_koe_to_eci(as_array(chief), RADIANS)
    frame = chief_frame(state[:3], state[3:], oblate_acceleration(state[:3], brahe.GM_EARTH))
    satellite = np.concatenate(frame.to_inertial(start[:3], start[3:]))
    flown = np.array(
        [relative(*pair) for pair in zip(numeric(state, times), numeric(satellite, times), strict=True)]
    )
    zero = np.zeros_like(times)
    errors = [
        float(np.max(np.linalg.norm((one.transition(zero, times) @ start - flown)[:, :3], axis=-1)))
        for one in (model, two_body)
    ]
    assert errors[1] > 1e-3 * distance
    assert errors[0] < errors[1] / 20.0


def test_transitions_compose_and_end_where_they_begin() -> None:
    model = J2ElementModel(chief_of(0.3))
    unit = np.repeat([1.0, 1.0 / model.mean.mean_motion], 3)
    begin, middle, end = 500.0, 7000.0, 30000.0

    def scaled(*times: float) -> np.ndarray:
        return unit[:, None] * model.transition(*times) / unit

    whole = scaled(begin, end)
    in_turn = scaled(middle, end) @ scaled(begin, middle)
    np.testing.assert_allclose(in_turn, whole, rtol=0.0, atol=1e-8 * np.max(np.abs(whole)))
    np.testing.assert_allclose(scaled(begin, begin), np.eye(6), rtol=0.0, atol=1e-9)


def test_the_system_matrix_is_near_that_of_two_body_motion_and_not_equal() -> None:
    chief = chief_of(0.3)
    times = np.array([0.0, 4000.0])
    found = relative_motion_model("j2_elements", chief).system_matrix(times)
    expected = YamanakaAnkersenModel(chief).system_matrix(times)
    unit = np.repeat([1.0, 1.0 / chief.mean_motion], 3)
    apart = np.max(np.abs(unit[:, None] * (found - expected) / unit), axis=(1, 2)) / chief.mean_motion
    assert np.all(apart > 1e-4)
    assert np.all(apart < 2e-2)


@pytest.mark.parametrize("inclination", [0.0, 1e-4, math.pi])
def test_an_orbit_in_the_equator_is_refused(inclination: float) -> None:
    with pytest.raises(ValueError, match="leaves the node undefined; use yamanaka_ankersen"):
        relative_motion_model("j2_elements", chief_of(0.1, inclination))
