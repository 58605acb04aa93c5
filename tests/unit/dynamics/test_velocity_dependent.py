# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The test plant whose force a law has to learn, against an independent integration."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from satform.dynamics.prescribed_disturbances import HarmonicSpec
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.velocity_dependent import VelocityDependentDynamicsSpec

SPEC = VelocityDependentDynamicsSpec(
    perturbations=(HarmonicSpec(amplitude=0.5, angular_frequency=0.5, phase=(0.0, 1.1, 2.2), phase_step=0.7),)
)


def test_flight_agrees_with_an_independent_integration_of_the_printed_formula() -> None:
    step, command = 0.1, np.array([[0.3, -0.2, 0.1], [0.0, 0.5, -0.4]])
    plant = SPEC.build(DynamicsSetting(1e-3, step, 2))
    state = plant.start(np.zeros((2, 3)), np.array([[2.0, -1.0, 0.5], [-3.0, 0.2, 4.0]]))
    phase = 0.7 * np.arange(2)[:, None] + 1.1 * np.arange(3)

    def rate(time: float, flat: np.ndarray) -> np.ndarray:
        velocity = flat.reshape(2, 2, 3)[1]
        force = -0.2 * velocity + 0.4 * np.sin(1.5 * velocity) + 0.05 * velocity * np.abs(velocity)
        return np.stack((velocity, force + 0.5 * np.sin(0.5 * time + phase) + command)).ravel()

    start = np.stack((state.position, state.velocity)).ravel()
    found = solve_ivp(rate, (0.0, 5.0), start, method="DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
    for number in range(50):
        state = plant.advance(state, command, number)
    position, velocity = plant.lvlh(state)
    assert np.stack((position, velocity)).ravel() == pytest.approx(found, abs=1e-6)


def test_a_step_is_divided_into_parts_no_longer_than_asked() -> None:
    for step, parts in ((0.02, 1), (0.05, 1), (0.1, 2), (0.12, 3)):
        assert SPEC.build(DynamicsSetting(1e-3, step, 1)).parts == parts


def test_without_forces_motion_is_straight_and_commands_act_as_in_free_space() -> None:
    plain = VelocityDependentDynamicsSpec(linear=0.0, wave=0.0, quadratic=0.0)
    plant = plain.build(DynamicsSetting(1e-3, 2.0, 1))
    state = plant.start(np.array([[1.0, 2.0, 3.0]]), np.array([[4.0, 5.0, 6.0]]))
    state = plant.advance(state, np.array([[1.0, 0.0, -1.0]]), 0)
    assert state.position == pytest.approx(np.array([[11.0, 12.0, 13.0]]), rel=1e-12)
    assert state.velocity == pytest.approx(np.array([[6.0, 5.0, 4.0]]), rel=1e-12)
