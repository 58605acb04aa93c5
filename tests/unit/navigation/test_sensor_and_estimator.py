# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from satform.dynamics.cw import HeldInputStep
from satform.equipment.random_streams import NAVIGATION_STREAM
from satform.equipment.sensors.relative_motion import Measurement, NavigationSpec
from satform.navigation.kalman_filter import (
    Estimate,
    KalmanFilter,
    normalised_error_squared,
    process_covariance,
    process_model,
)
from satform.navigation.relative_state_filter import Estimator, FilterSpec
from satform.numeric.seeded_numbers import SeededNormals

MEAN_MOTION = 2.0 * math.pi / 6000.0
STEP = 10.0
NOISE = np.array([5.0, 4.0, 6.0, 0.05, 0.04, 0.06])
DENSITY = np.array([1e-6, 2e-6, 5e-7])


def cw_kalman_filter(mean_motion, step, noise, density):
    return KalmanFilter(process_model("cw", mean_motion, step, density), noise**2)


def told(spec, truth, seed=1):
    """The measurement known at each step of a true motion, shape (steps, 6)."""
    sensor = spec.build(STEP)
    noise = SeededNormals(seed, NAVIGATION_STREAM, [0], 6)
    memory = sensor.start(truth[0, :3], truth[0, 3:], noise.at(0)[0])
    known = [memory.delivered]
    for step in range(1, len(truth)):
        memory = sensor.measure(memory, truth[step, :3], truth[step, 3:], step, noise.at(step)[0])
        known.append(memory.delivered)
    return known


def numbered(steps):
    return np.arange(steps, dtype=float)[:, None] * np.ones(6)


def test_a_perfect_sensor_tells_the_truth_to_the_last_bit():
    truth = np.random.default_rng(0).normal(size=(5, 6))
    for step, measurement in enumerate(told(NavigationSpec(), truth)):
        assert measurement.position.tobytes() == truth[step, :3].tobytes()
        assert measurement.velocity.tobytes() == truth[step, 3:].tobytes()
        assert measurement.step == step


def test_noise_has_the_spread_and_bias_the_size_that_were_asked_for():
    spec = NavigationSpec(
        position_noise=(1.0, 2.0, 3.0), velocity_noise=0.1, position_bias=(10.0, 0.0, -5.0), velocity_bias=0.3
    )
    known = told(spec, np.zeros((20_000, 6)))
    errors = np.array([np.concatenate((one.position, one.velocity)) for one in known])
    spread = np.array([1.0, 2.0, 3.0, 0.1, 0.1, 0.1])
    np.testing.assert_allclose(errors.std(axis=0), spread, rtol=0.03)
    assert (
        np.abs(errors.mean(axis=0) - [10.0, 0.0, -5.0, 0.3, 0.3, 0.3]) < 5 * spread / math.sqrt(20_000)
    ).all()
    white = (errors - errors.mean(axis=0)) / spread
    assert np.abs((white[1:] * white[:-1]).mean(axis=0)).max() < 5 / math.sqrt(20_000)


def test_between_updates_the_last_measurement_stays():
    known = told(NavigationSpec(update_period=30.0), numbered(8))
    assert [one.position[0] for one in known] == [0, 0, 0, 3, 3, 3, 6, 6]
    assert [one.step for one in known] == [0, 0, 0, 3, 3, 3, 6, 6]


def test_a_late_measurement_arrives_after_the_latency_with_its_own_step():
    known = told(NavigationSpec(latency=20.0), numbered(6))
    assert [one.step for one in known] == [0, 0, 0, 1, 2, 3]
    assert [one.position[2] for one in known] == [0, 0, 0, 1, 2, 3]
    known = told(NavigationSpec(latency=40.0, update_period=30.0), numbered(12))
    assert [one.step for one in known] == [0, 0, 0, 0, 0, 0, 0, 3, 3, 3, 6, 6]


@pytest.mark.parametrize("field", ["update_period", "latency"])
def test_times_that_are_no_whole_control_periods_are_refused_with_a_better_one(field):
    with pytest.raises(ValueError, match="for example 20 s"):
        NavigationSpec(**{field: 24.0}).build(STEP)


def test_process_covariance_is_that_of_van_loans_matrix_exponential():
    n = MEAN_MOTION
    dynamics = np.zeros((6, 6))
    dynamics[:3, 3:] = np.eye(3)
    dynamics[3, 0], dynamics[5, 2], dynamics[3, 4], dynamics[4, 3] = 3 * n * n, -n * n, 2 * n, -2 * n
    spectrum = np.zeros((6, 6))
    spectrum[3:, 3:] = np.diag(DENSITY)
    for duration in (1.0, 600.0):
        block = expm(np.block([[-dynamics, spectrum], [np.zeros((6, 6)), dynamics.T]]) * duration)
        expected = block[6:, 6:].T @ block[:6, 6:]
        found = process_covariance(n, duration, DENSITY)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-15)


def covariance_after(filter_, start, steps):
    estimate = filter_.start(Measurement(start[:3], start[3:], 0))
    for _ in range(steps):
        estimate = filter_.predict(estimate, np.zeros(3), 0)
    return estimate


def test_prediction_follows_the_riccati_free_covariance_equation():
    n = MEAN_MOTION
    filter_ = cw_kalman_filter(n, STEP, NOISE, DENSITY)
    dynamics = np.zeros((6, 6))
    dynamics[:3, 3:] = np.eye(3)
    dynamics[3, 0], dynamics[5, 2], dynamics[3, 4], dynamics[4, 3] = 3 * n * n, -n * n, 2 * n, -2 * n
    spectrum = np.zeros((6, 6))
    spectrum[3:, 3:] = np.diag(DENSITY)

    def rate(_, flat):
        covariance = flat.reshape(6, 6)
        return (dynamics @ covariance + covariance @ dynamics.T + spectrum).ravel()

    expected = solve_ivp(
        rate, (0.0, 500.0), np.diag(NOISE**2).ravel(), rtol=1e-11, atol=1e-13, method="DOP853"
    )
    found = covariance_after(filter_, np.ones(6), 50).covariance
    np.testing.assert_allclose(found.ravel(), expected.y[:, -1], rtol=1e-7, atol=1e-9)


def test_an_update_is_the_weighted_mean_of_two_independent_opinions():
    filter_ = cw_kalman_filter(MEAN_MOTION, STEP, NOISE, DENSITY)
    predicted = covariance_after(filter_, np.arange(6.0), 3)
    measured = Measurement(np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 0.3]), 3)
    updated, _ = filter_.update(predicted, measured)
    information = np.linalg.inv(predicted.covariance) + np.diag(1.0 / NOISE**2)
    weighted = (
        np.linalg.solve(predicted.covariance, predicted.state) + np.array([1, 2, 3, 0.1, 0.2, 0.3]) / NOISE**2
    )
    np.testing.assert_allclose(updated.covariance, np.linalg.inv(information), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(updated.state, np.linalg.solve(information, weighted), rtol=1e-9, atol=1e-12)


def monte_carlo(believed: KalmanFilter, runs=200, steps=40, seed=2):
    """Mean normalised error squared over many flights with the noise of NOISE and DENSITY."""
    generator = np.random.default_rng(seed)
    root = np.linalg.cholesky(process_covariance(MEAN_MOTION, STEP, DENSITY))
    step = HeldInputStep.over(MEAN_MOTION, STEP)
    truth = generator.normal(size=(runs, 6)) * np.array([1e3, 1e3, 1e3, 1.0, 1.0, 1.0])

    def measured(at):
        noisy = truth + NOISE * generator.normal(size=truth.shape)
        return Measurement(noisy[:, :3], noisy[:, 3:], at)

    estimate = believed.start(measured(0))
    total = []
    for at in range(1, steps + 1):
        command = 1e-3 * generator.normal(size=(runs, 3))
        position, velocity = step.advance(truth[:, :3], truth[:, 3:], command)
        truth = np.concatenate((position, velocity), axis=1) + generator.normal(size=(runs, 6)) @ root.T
        estimate, _ = believed.update(believed.predict(estimate, command, at - 1), measured(at))
        total.append(normalised_error_squared(estimate.state - truth, estimate.covariance))
    return np.array(total)


def test_the_filters_errors_are_as_large_as_it_believes():
    consistent = monte_carlo(cw_kalman_filter(MEAN_MOTION, STEP, NOISE, DENSITY))
    # At one instant the 200 flights are independent: their sum is chi-square of 1200 degrees.
    for at in (0, 10, 39):
        assert abs(consistent[at].sum() - 1200.0) < 4.0 * math.sqrt(2400.0)
    assert consistent.mean() == pytest.approx(6.0, rel=0.05)


def test_a_filter_that_believes_in_too_little_disturbance_is_found_out():
    assert monte_carlo(cw_kalman_filter(MEAN_MOTION, STEP, NOISE, DENSITY / 30.0))[-1].mean() > 8.0
    assert monte_carlo(cw_kalman_filter(MEAN_MOTION, STEP, 3.0 * NOISE, DENSITY))[-1].mean() < 4.0


def flown(steps, seed=3):
    generator = np.random.default_rng(seed)
    command = 1e-3 * generator.normal(size=(steps, 3))
    step = HeldInputStep.over(MEAN_MOTION, STEP)
    truth = [np.array([100.0, 200.0, -300.0, 0.1, -0.2, 0.3])]
    for one in command:
        truth.append(np.concatenate(step.advance(truth[-1][:3], truth[-1][3:], one)))
    return np.array(truth), command


def test_a_late_measurement_gives_the_estimate_that_an_early_one_would_carried_to_now():
    truth, command = flown(30)
    spec = {"position_noise": 5.0, "velocity_noise": 0.05, "update_period": 30.0}
    estimator = Estimator(cw_kalman_filter(MEAN_MOTION, STEP, np.repeat([5.0, 0.05], 3), DENSITY))
    estimates = {}
    for latency in (0.0, 50.0):
        known = told(NavigationSpec(**spec, latency=latency), truth)
        memory = estimator.start(known[0])
        for step in range(1, 31):
            memory = estimator.observe(memory, known[step], command[step - 1])
            estimates[latency, step] = memory.state
    carried = Estimate(estimates[0.0, 24], np.eye(6))
    for step in range(24, 29):
        carried = estimator.filter.predict(carried, command[step], step)
    np.testing.assert_allclose(estimates[50.0, 29], carried.state, rtol=1e-12)


def test_without_disturbance_the_estimate_of_now_closes_in_on_the_truth_despite_latency():
    truth, command = flown(200)
    spec = NavigationSpec(position_noise=5.0, velocity_noise=0.05, update_period=20.0, latency=40.0)
    estimator = FilterSpec(acceleration_density=1e-14).build(MEAN_MOTION, STEP, spec)
    known = told(spec, truth)
    memory = estimator.start(known[0])
    for step in range(1, 201):
        memory = estimator.observe(memory, known[step], command[step - 1])
    assert np.abs(memory.state[:3] - truth[200, :3]).max() < 2.5
    raw = np.array([one.position for one in known]) - truth[:, :3]
    assert np.abs(raw[-50:]).max() > 10.0


def test_a_satellites_estimate_has_the_same_bits_alone_as_in_company():
    generator = np.random.default_rng(6)
    filter_ = cw_kalman_filter(MEAN_MOTION, STEP, NOISE, DENSITY)
    measured, command = generator.normal(size=(4, 30, 6)), generator.normal(size=(4, 30, 3))

    def run(which):
        estimate = filter_.start(Measurement(measured[0, which, :3], measured[0, which, 3:], 0))
        for step in range(1, 4):
            estimate = filter_.predict(estimate, command[step, which], step - 1)
            now = Measurement(measured[step, which, :3], measured[step, which, 3:], step)
            estimate, _ = filter_.update(estimate, now)
        return estimate

    stacked = run(slice(None))
    for index in range(30):
        single = run(index)
        assert single.state.tobytes() == stacked.state[index].tobytes()
        assert single.covariance.tobytes() == stacked.covariance[index].tobytes()


def test_a_filter_that_would_believe_in_perfect_measurements_is_refused():
    with pytest.raises(ValueError, match="noise of zero"):
        FilterSpec(acceleration_density=1e-9).build(MEAN_MOTION, STEP, NavigationSpec(velocity_noise=0.1))


def test_the_covariance_stays_symmetric_and_positive_where_measurements_are_far_better_than_the_start():
    # Twelve orders of magnitude between what is known before and after: the plain form loses definiteness.
    filter_ = cw_kalman_filter(MEAN_MOTION, STEP, np.repeat([1e-6, 1e-9], 3), np.full(3, 1e-18))
    estimate = Estimate(np.zeros(6), np.diag([1e12] * 3 + [1e6] * 3))
    nothing = Measurement(np.zeros(3), np.zeros(3), 0)
    for _ in range(300):
        estimate, _ = filter_.update(filter_.predict(estimate, np.zeros(3), 0), nothing)
        assert np.array_equal(estimate.covariance, estimate.covariance.T)
        scale = np.sqrt(np.diag(estimate.covariance))
        assert np.all(np.linalg.eigvalsh(estimate.covariance / scale / scale[:, None]) > 0.0)


def test_the_innovations_are_those_of_the_whole_measurement_at_once():
    generator = np.random.default_rng(3)
    filter_ = cw_kalman_filter(MEAN_MOTION, STEP, NOISE, DENSITY)
    predicted = filter_.predict(filter_.start(Measurement(np.ones(3), np.zeros(3), 0)), np.zeros(3), 0)
    measured = generator.normal(size=6) * 10.0
    updated, squared = filter_.update(predicted, Measurement(measured[:3], measured[3:], 1))
    # Bar-Shalom, Li & Kirubarajan, ch. 5.2: S = H P H' + R with H the identity.
    innovation, spread = measured - predicted.state, predicted.covariance + np.diag(NOISE**2)
    assert squared == pytest.approx(innovation @ np.linalg.solve(spread, innovation), rel=1e-9)
    gain = predicted.covariance @ np.linalg.inv(spread)
    assert updated.state == pytest.approx(predicted.state + gain @ innovation, rel=1e-9)


def estimated(outliers, steps=60, **spec):
    """Memories of a filter of a satellite that stands on the truth, with some measurements that are off."""
    sensor = NavigationSpec(position_noise=1.0, velocity_noise=0.01)
    estimator = FilterSpec(acceleration_density=1e-8, **spec).build(MEAN_MOTION, STEP, sensor)
    memories = [estimator.start(Measurement(np.zeros(3), np.zeros(3), 0))]
    for step in range(1, steps):
        position = np.array([0.0, outliers.get(step, 0.0), 0.0])
        now = Measurement(position, np.zeros(3), step)
        memories.append(estimator.observe(memories[-1], now, np.zeros(3)))
    return memories


def test_an_outlier_is_rejected_by_the_gate_and_without_it_pulls_the_estimate_away():
    gated = estimated({40: 500.0})
    assert np.abs(gated[40].state).max() < 1e-9
    assert float(gated[40].rejected) == 1.0
    # The covariance is the predicted one, as nothing was learnt.
    assert float(gated[40].covariance[1, 1]) > float(gated[39].covariance[1, 1])
    assert np.abs(estimated({40: 500.0}, innovation_gate=None)[40].state[1]) > 10.0


def test_a_filter_that_rejects_measurement_after_measurement_starts_anew_from_the_last():
    memories = estimated(dict.fromkeys(range(40, 60), 500.0), max_consecutive_rejections=4)
    assert np.abs(memories[42].state[1]) < 1e-9
    assert memories[43].state[1] == pytest.approx(500.0)
    assert memories[43].covariance[1, 1] == pytest.approx(1.0)
    assert float(memories[59].rejected) == 4.0
    assert memories[59].state[1] == pytest.approx(500.0, abs=1e-6)


def test_after_a_gap_one_measurement_beyond_the_gate_is_enough_to_start_anew():
    sensor = NavigationSpec(position_noise=1.0, velocity_noise=0.01)
    estimator = FilterSpec(acceleration_density=1e-12).build(MEAN_MOTION, STEP, sensor)
    still = np.zeros(3)
    memory = estimator.resume(estimator.start(Measurement(still, still, 0)), 20, still, still)
    far = Measurement(np.array([0.0, 1e4, 0.0]), still, 21)
    memory = estimator.observe(memory, far, still)
    assert memory.state[1] == pytest.approx(1e4)


def test_a_filter_fed_by_what_was_applied_does_not_mind_that_the_command_was_clipped():
    truth, measurements = [np.zeros(6)], []
    step = HeldInputStep.over(MEAN_MOTION, STEP)
    applied = np.array([1e-4, 0.0, 0.0])
    for _ in range(100):
        truth.append(np.concatenate(step.advance(truth[-1][:3], truth[-1][3:], applied)))
    measurements = [Measurement(state[:3], state[3:], number) for number, state in enumerate(truth)]
    estimator = FilterSpec(acceleration_density=1e-12).build(
        MEAN_MOTION, STEP, NavigationSpec(position_noise=1.0, velocity_noise=0.01)
    )
    memory = estimator.start(measurements[0])
    for now in measurements[1:]:
        memory = estimator.observe(memory, now, applied)
    assert memory.state == pytest.approx(truth[-1], abs=1e-9)
