# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flights by the readings of sensors, against an independent Kalman filter and against geometry."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from formations import formation
from satform import ScenarioError, simulate
from satform.equipment.random_streams import SENSOR_STREAM, channel_number
from satform.flight.checkpoint import restore, save
from satform.flight.compile import compile_scenario
from satform.flight.satellite import Satellite
from satform.membership.formation import SatelliteLost, SatelliteRejoined
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.satellite_navigation import NavigationInput
from satform.numeric.seeded_numbers import SeededNormals
from satform.record.archive import load_record, save_record
from satform.scenario import Scenario
from satform.scenario.navigation_checks import navigation_of

STEP, RATE = 0.5, 2.0 * np.pi / 6000.0
DENSITY = 1e-8
FILTER = {
    "kind": "extended",
    "acceleration_density": DENSITY,
    "initial_position_error": 1.0,
    "initial_velocity_error": 0.005,
}
GNSS = {"kind": "gnss", "position_noise": 2.0, "velocity_noise": 0.05}
LASER = {"kind": "laser_ranging", "range_noise": 0.2}
CAMERA = {"kind": "bearing_camera", "targets": ["sat2"], "angle_noise": 1e-4}
RANGING = {"kind": "radio_ranging", "range_noise": 0.1, "range_rate_noise": 1e-3}


def alone(sensors: list[dict[str, Any]], duration: float = 20.0, **navigation: Any) -> Scenario:
    """One satellite that flies by its sensors."""
    own = {"sensors": sensors, "navigation": {**FILTER, "estimates": "own", **navigation}}
    return formation([own], duration)


def three(duration: float = 8.0, navigation: dict[str, Any] | None = None, **other: Any) -> Scenario:
    """Three satellites that range to each other and exchange estimates; one has a receiver."""
    satellites = [
        {"arc_length": 0.0, "sensors": [GNSS, {**RANGING, "targets": ["sat2", "sat3"]}]},
        {"arc_length": 300.0, "sensors": [{**RANGING, "targets": ["sat1"]}]},
        {
            "arc_length": 700.0,
            "sensors": [{"kind": "radio_ranging", "targets": ["sat1"], "range_noise": 0.5}],
        },
    ]
    shared = {"exchange": "covariance_intersection", "neighbour_acceleration_density": 1.0}
    whole = {**FILTER, **shared, **(navigation or {})}
    return formation([{**own, "navigation": whole} for own in satellites], duration, **other)


@pytest.mark.parametrize(("estimates", "asked"), [("own", {1}), ("formation", {0, 1, 2})])
def test_a_navigation_asks_only_for_the_starts_that_it_estimates(estimates: str, asked: set[int]) -> None:
    own = {"sensors": [GNSS], "navigation": {**FILTER, "estimates": estimates}}
    scenario, found = formation([own] * 3, 1.0), set()

    def start(member: int) -> NDArray[np.float64]:
        found.add(member)
        return np.zeros(6)

    assert navigation_of(scenario, 1, start) is not None
    assert found == asked


def linear_filter(
    prior: GaussianEstimate, readings: np.ndarray, applied: np.ndarray, variance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Textbook Kalman filter of one satellite with measured motion, by matrices; estimates of all steps."""
    dynamics = np.zeros((9, 9))
    dynamics[:3, 3:6], dynamics[3:6, 6:] = np.eye(3), np.eye(3)
    dynamics[3, 0], dynamics[5, 2], dynamics[3, 4], dynamics[4, 3] = (
        3 * RATE**2,
        -(RATE**2),
        2 * RATE,
        -2 * RATE,
    )
    whole = expm(dynamics * STEP)
    transition, response = whole[:6, :6], whole[:6, 6:]
    spectrum = np.zeros((6, 6))
    spectrum[3:, 3:] = DENSITY * np.eye(3)
    free = dynamics[:6, :6]
    block = expm(np.block([[-free, spectrum], [np.zeros((6, 6)), free.T]]) * STEP)
    process = block[6:, 6:].T @ block[:6, 6:]
    mean, covariance = prior.mean, prior.covariance
    means, covariances = [], []
    for step, reading in enumerate(readings):
        if step > 0:
            mean = transition @ mean + response @ applied[step - 1]
            covariance = transition @ covariance @ transition.T + process
        if np.isfinite(reading).all():
            gain = covariance @ np.linalg.inv(covariance + np.diag(variance))
            mean, covariance = mean + gain @ (reading - mean), (np.eye(6) - gain) @ covariance
        means.append(mean)
        covariances.append(covariance)
    return np.array(means), np.array(covariances)


def own_estimate(record: Any, column: int = 0) -> np.ndarray:
    """Estimated position and velocity of a satellite at each step, from errors and references."""
    position = record.estimated_position_error[:, column] + record.reference_position[:, column]
    velocity = record.estimated_velocity_error[:, column] + record.reference_velocity[:, column]
    return np.concatenate((position, velocity), axis=-1)


def test_a_filter_on_a_receiver_is_the_textbook_kalman_filter() -> None:
    scenario = alone([GNSS])
    record = simulate(scenario)
    prior = compile_scenario(scenario).satellite(0).navigation.prior
    readings = record.navigation.readings[:-1, 0]
    variance = np.repeat([4.0, 0.0025], 3)
    means, covariances = linear_filter(prior, readings, record.applied_acceleration[:, 0], variance)
    np.testing.assert_allclose(own_estimate(record), means, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(record.estimate_covariance[:, 0], covariances, rtol=1e-6, atol=1e-13)


def test_late_readings_are_worked_in_at_the_step_at_which_they_were_taken() -> None:
    scenario = alone([{**GNSS, "latency": 2.0, "period": 1.0}])
    record = simulate(scenario)
    late, applied = 4, record.applied_acceleration[:, 0]
    prior = compile_scenario(scenario).satellite(0).navigation.prior
    arrived = record.navigation.readings[:, 0]
    assert np.isnan(arrived[:late]).all()
    assert np.isfinite(arrived[late::2]).all()
    assert np.isnan(arrived[late + 1 :: 2]).all()
    variance = np.repeat([4.0, 0.0025], 3)
    for step in (0, 3, 4, 5, 20, 39):
        known = np.full((step + 1, 6), np.nan)
        if step >= late:
            known[: step + 1 - late] = arrived[late : step + 1]
        means, _ = linear_filter(prior, known, applied, variance)
        np.testing.assert_allclose(own_estimate(record)[step], means[-1], rtol=1e-8, atol=1e-9)


def test_innovations_of_late_readings_are_those_of_the_textbook_kalman_filter() -> None:
    scenario = alone([{**GNSS, "latency": 2.0, "period": 1.0}])
    record = simulate(scenario)
    late, variance = 4, np.repeat([4.0, 0.0025], 3)
    prior = compile_scenario(scenario).satellite(0).navigation.prior
    readings = record.navigation.readings[late:-1, 0]
    for taken in (2, 8, 34):
        before = readings[: taken + 1].copy()
        before[taken] = np.nan
        means, covariances = linear_filter(prior, before, record.applied_acceleration[:, 0], variance)
        off = readings[taken] - means[-1]
        expected = off @ np.linalg.solve(covariances[-1] + np.diag(variance), off)
        # It stays until the next reading arrives.
        found = record.innovation[taken + late : taken + late + 2, 0]
        np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_readings_are_the_true_geometry_with_their_drawn_errors() -> None:
    scenario = three()
    record = simulate(scenario)
    first, second = (np.concatenate((record.position, record.velocity), -1)[:, column] for column in (0, 1))
    apart = first - second
    distance = np.linalg.norm(apart[:, :3], axis=-1)
    drawn = SeededNormals(scenario.seed, SENSOR_STREAM, [channel_number(1, 0)], 2)
    errors = np.array([drawn.at(step)[0] for step in range(record.steps + 1)])
    expected = np.stack((distance, np.sum(apart[:, :3] * apart[:, 3:], -1) / distance), -1)
    found = record.navigation.readings[:, 1, :2]
    # Light takes 4 us over a kilometre, in which satellites move by micrometres.
    np.testing.assert_allclose(found - errors * [0.1, 1e-3], expected, rtol=0.0, atol=2e-5)
    assert np.isnan(record.navigation.readings[:, 1, 2:]).all()


def test_a_satellite_with_navigation_does_not_get_its_true_motion() -> None:
    record = simulate(three(duration=5.0))
    assert np.isnan(record.measured_position).all()
    assert np.isnan(record.measured_velocity).all()
    error = np.abs(own_estimate(record) - np.concatenate((record.position, record.velocity), -1)[:-1, 0])
    assert error[0, :3].max() > 0.01


def test_estimates_are_consistent_and_neighbours_share_a_receiver() -> None:
    """Mean normalised error squared of 6 numbers; covariance intersection is cautious, so below 6 too."""
    scenario = three(duration=10.0)
    errors = []
    for seed in range(4):
        record = simulate(scenario.with_(seed=seed))
        error = own_estimate(record, 1)[-1] - np.concatenate((record.position, record.velocity), -1)[-2, 1]
        errors.append(error @ np.linalg.solve(record.estimate_covariance[-1, 1], error))
        # Its own sensor measures a range alone, and its start was known to 1 m an axis.
        assert np.trace(record.estimate_covariance[-1, 1, :3, :3]) < 2.0
    assert 0.5 < np.mean(errors) < 9.0


def test_without_readings_the_covariance_grows_over_a_gap_and_shrinks_afterwards() -> None:
    scenario = three(duration=10.0, navigation={"exchange": "none"}, checkpoint_period=2.0)
    events = {
        10: [SatelliteLost(1, "a test")],
        16: [SatelliteRejoined(1, 8)],
    }
    record = simulate(scenario, events=events)
    spread = record.estimate_covariance[:, 1, :3, :3].trace(axis1=-2, axis2=-1)
    assert np.isnan(spread[10:16]).all()
    assert np.isnan(record.navigation.mean[10:16, 1]).all()
    assert np.isfinite(own_estimate(record, 1)[16:]).all()
    # The plant drew readings meanwhile; what arrived before the loss is in the checkpoint.
    assert spread[16] > spread[9]
    others = record.navigation.mean[:, [0, 2]]
    assert np.isfinite(others).all()


def test_a_satellite_that_remembers_nothing_begins_again_with_an_honest_covariance() -> None:
    scenario = three(duration=10.0, navigation={"exchange": "none"})
    events = {10: [SatelliteLost(1, "a test")], 16: [SatelliteRejoined(1, None)]}
    record = simulate(scenario, events=events)
    true = np.concatenate((record.position, record.velocity), -1)[:-1, 1]
    error = (own_estimate(record, 1) - true)[16:, :3]
    spread = np.sqrt(record.estimate_covariance[16:, 1, :3, :3].trace(axis1=-2, axis2=-1))
    assert (np.linalg.norm(error, axis=-1) < 4.0 * spread).all()


def test_a_restored_satellite_flies_on_with_the_same_bits() -> None:
    plan = compile_scenario(three()).satellite(0, [1, 2])
    navigation = plan.navigation
    graph = three().communication_graph()

    def inputs(step: int) -> NavigationInput:
        readings = np.random.default_rng(step).normal(size=10)
        readings[step % 10] = np.nan
        return NavigationInput(readings, np.zeros((0, 94)), graph)

    memory = navigation.observe(navigation.start(), inputs(0), None)
    for step in range(1, 6):
        memory = navigation.observe(memory, inputs(step), np.full(3, 1e-4))
    satellite, fresh = Satellite(plan, 2), Satellite(plan, 2)
    satellite.state = replace(satellite.state, navigation=memory, step=6)
    restore(fresh, save(satellite))
    both = [navigation.observe(own.state.navigation, inputs(6), np.zeros(3)) for own in (satellite, fresh)]
    assert both[0].mean.tobytes() == both[1].mean.tobytes()
    assert both[0].covariance_of_all.tobytes() == both[1].covariance_of_all.tobytes()


@pytest.mark.parametrize(
    "other",
    [
        {"links": {"default": {"loss": 0.3, "delay": 1.0}}},
        {"graph_schedule": [{"at": 2.0, "graph": {"kind": "line"}}, {"at": 4.0, "graph": {"kind": "ring"}}]},
    ],
    ids=["lossy links", "switching graph"],
)
def test_estimates_are_exchanged_over_links_and_graphs_that_change(
    other: dict[str, Any], tmp_path: Any
) -> None:
    scenario = three(**other)
    record = simulate(scenario)
    assert record.early_end is None
    again = simulate(scenario, stacked=False)
    assert record.differences(again) == []
    # A record in a file is the same.
    save_record(record, tmp_path / "record.npz")
    assert record.differences(load_record(tmp_path / "record.npz")) == []
    truth = np.concatenate((record.position, record.velocity), -1)[:-1]
    error = record.navigation.mean.reshape(record.steps, 3, 3, 6) - truth[:, None]
    spread = np.sqrt(record.estimate_covariance[-1, :, :3, :3].trace(axis1=-2, axis2=-1))
    own = np.array([np.linalg.norm(error[-1, column, column, :3]) for column in range(3)])
    assert (own < 4.0 * spread).all()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"satellites[sat1].navigation.estimates": "own"}, "measures the motion relative to sat2"),
        ({"satellites[sat2].sensors": []}, "no sensor of the satellite measures motion"),
        ({"satellites[sat2].navigation.exchange": "none"}, "either all satellites do or none"),
        ({"satellites[sat2].sensor": {"position_noise": 1.0}}, "leave out sensor"),
        ({"satellites[sat2].navigation.references": ["sat9"]}, "there is no satellite sat9"),
        ({"satellites[sat2].sensors": [{**RANGING, "targets": ["sat9"]}]}, "there is no satellite sat9"),
        ({"satellites[sat1].sensors": [{**GNSS, "latency": 1.0}]}, "estimates are exchanged without one"),
        ({"satellites[sat1].sensors": [{**GNSS, "period": 0.7}]}, "whole number"),
        (
            {
                "satellites[sat1].sensors": [
                    {"kind": "bearing_camera", "targets": ["sat2"], "angle_noise": 1e-4}
                ]
            },
            "needs the Sun",
        ),
    ],
)
def test_what_cannot_navigate_is_refused_in_a_sentence(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ScenarioError, match=sentence):
        three().with_(changes)


def test_too_many_satellites_for_one_filter_are_refused() -> None:
    one = {"sensors": [GNSS], "navigation": FILTER}
    with pytest.raises(ValueError, match="estimates 10 satellites at most"):
        formation([{**one, "arc_length": 100.0 * index} for index in range(11)], 5.0)
