# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flights whose satellites know their attitudes by star trackers and gyros alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flights import shortened
from satform.attitude.guidance import Attitude
from satform.communication.neighbour_buffer import Received
from satform.communication.topic_table import satellite_channels
from satform.consensus.graph import CompleteSpec
from satform.flight.checkpoint import restore, save
from satform.flight.compile import topic_plan
from satform.flight.compile_satellite import flight_plan
from satform.flight.satellite import Satellite
from satform.flight.simulate import simulate
from satform.navigation.satellite_navigation import NavigationInput
from satform.record.archive import load_record, save_record
from satform.record.quantities import ATTITUDE_ESTIMATES
from satform.scenario import Scenario, ScenarioError

NAME = "star_tracker_gyro_pointing"
DENSITY = (
    "{kind: multiplicative_extended, initial_attitude_error: 0.5 deg, angular_acceleration_density: 1.0e-11}"
)
GYRO = "{kind: gyro, angle_random_walk: 1.0e-5, rate_random_walk: 1.0e-8, turn_on_bias: 0.003 deg/s"
LATE = f"{GYRO}, latency: 2.0, outages: [{{begin: 16.0, end: 40.0}}]}}"
LATE_GYRO = [f"satellites.sat1.attitude.filter={DENSITY}", f"satellite_defaults.sensors.0={LATE}"]
LATE_GYRO.append(f"satellites.sat3.attitude.filter={DENSITY}")
"""Satellites 1 and 3 have a gyro whose readings are late, and which is out for a while."""


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return shortened(NAME, 12.0)


def flown(
    scenario: Scenario, mrp: np.ndarray, steps: range, satellite: Satellite, out: range = range(0)
) -> list[np.ndarray]:
    """Wheel torques of the first satellite, which gets some readings and no message of a neighbour.

    There is no reading of the gyro at the steps of `out`.
    """
    graph = CompleteSpec().build(3)
    nobody = Received(np.zeros((2, 2)), np.zeros(2), np.zeros(2), np.zeros(2), complete=False)
    torques = []
    for step in steps:
        rate = np.full(3, np.nan if step in out else 1e-3)
        readings = np.concatenate((rate, mrp if step % 2 else np.full(3, np.nan)))
        sensed = NavigationInput(readings, np.empty((0, 1)), graph)
        unknown = np.full(3, np.nan)
        attitude = Attitude(unknown, unknown, np.array([0.1, 0.2, 0.3]))
        decision = satellite.act(satellite.plan.start, nobody, attitude=attitude, sensed=sensed)
        assert decision.wheel_torque is not None
        torques.append(decision.wheel_torque)
    return torques


def test_wheels_are_commanded_without_the_true_attitude_and_a_checkpoint_goes_on_with_the_same_bits(
    scenario: Scenario,
) -> None:
    plan = flight_plan(scenario, 0)
    assert plan.orientation is not None
    mrp = plan.orientation.start.mrp
    whole = Satellite(plan, 2)
    torques = flown(scenario, mrp, range(9), whole)
    assert np.isfinite(torques).all()
    first = Satellite(plan, 2)
    flown(scenario, mrp, range(5), first)
    second = Satellite(plan, 2)
    restore(second, save(first))
    assert np.array_equal(flown(scenario, mrp, range(5, 9), second), torques[5:])


def test_a_checkpoint_in_an_outage_of_a_late_gyro_goes_on_with_the_same_bits() -> None:
    scenario = shortened(NAME, 12.0, *LATE_GYRO)
    plan, out = flight_plan(scenario, 0), range(4, 9)
    assert plan.orientation is not None
    mrp = plan.orientation.start.mrp
    whole, first, second = (Satellite(plan, 2) for _ in range(3))
    torques = flown(scenario, mrp, range(14), whole, out)
    assert np.isfinite(torques).all()
    flown(scenario, mrp, range(7), first, out)
    assert first.state.attitude is not None
    assert np.isnan(first.state.attitude.memory.rates[-1]).all()
    restore(second, save(first))
    assert np.array_equal(flown(scenario, mrp, range(7, 14), second, out), torques[7:])
    assert save(second) == save(whole)


def test_satellites_point_by_star_tracker_alone_while_the_gyro_is_out() -> None:
    """The wheels turn the body to its target meanwhile; a filter without their momentum errs by 0.05 rad."""
    record = simulate(shortened(NAME, 50.0, *LATE_GYRO))
    late = [0, 2]
    assert (record.attitude_estimation_error[8:, late] < 5e-4).all()
    assert record.attitude_error_squared[16:, late].mean() < 6.0
    assert (record.pointing_error[36:, late] < 0.01).all()


def test_the_rigid_body_accelerates_as_by_eulers_equation(scenario: Scenario) -> None:
    plan, step = flight_plan(scenario, 0), 0.5
    assert plan.orientation is not None
    free = replace(plan.orientation, gravity_gradient=False)
    inertia = free.law.body.platform_inertia
    rate, wheels, torque = (
        np.array([3e-2, -2e-2, 1e-2]),
        np.array([2.0, -1.0, 3.0]),
        np.array([0.2, 0.1, -0.1]),
    )

    def turned(time: float, turning: np.ndarray) -> np.ndarray:
        momentum = inertia @ turning + wheels + time * torque
        return np.linalg.solve(inertia, np.cross(momentum, turning) - torque)

    flown = solve_ivp(turned, (0.0, step), rate, rtol=1e-12, atol=1e-15).y[:, -1]
    found = free.acceleration(Attitude(np.zeros(3), rate, wheels), wheels + step * torque, np.zeros(()), step)
    expected = (flown - rate) / step
    assert found == pytest.approx(expected, abs=1e-3 * float(np.abs(expected).max()))


def test_the_record_holds_the_estimates_and_is_read_again(scenario: Scenario, tmp_path: Path) -> None:
    record = simulate(scenario)
    assert record.estimated_mrp.shape == (12, 3, 3)
    assert np.isfinite(record.attitude_covariance).all()
    assert (record.attitude_estimation_error[8:] < 1e-3).all()
    assert record.attitude_error_squared.shape == (12, 3)
    path = tmp_path / "record.npz"
    save_record(record, path)
    assert load_record(path).differences(record) == []
    alone = simulate(shortened("formation_pointing", 2.0))
    assert all(len(getattr(alone, name)) == 0 for name in ATTITUDE_ESTIMATES)


def test_estimates_are_published_by_satellites_with_a_filter_of_their_attitude(scenario: Scenario) -> None:
    kinds = {channel.kind: channel for channel in satellite_channels(topic_plan(scenario), 0)}
    assert kinds["attitude_estimate"].publishers == ("sat1",)
    assert kinds["attitude_estimate"].subscribers == ("recorder",)
    others = satellite_channels(topic_plan(shortened("formation_pointing", 2.0)), 0)
    assert "attitude_estimate" not in {channel.kind for channel in others}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (["satellites.sat1.attitude.filter=null"], "has a gyro and no attitude.filter that uses it"),
        (["satellites.sat1.sensors=[{kind: gyro, turn_on_bias: 0.1}]"], "which have 1 and 0"),
        (LATE_GYRO[1:], "a gyro with latency .* give the filter an angular_acceleration_density"),
        (["satellite_defaults.sensors=[]", "satellites.sat2.sensors=[]"], "which have 0 and 0"),
    ],
)
def test_sensors_and_filter_that_do_not_fit_are_refused(changes: list[str], sentence: str) -> None:
    with pytest.raises(ScenarioError, match=sentence):
        shortened(NAME, 12.0, *changes)
