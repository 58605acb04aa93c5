# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Kalman filters by relative-motion model: consistency on an eccentric chief under J2, and their matrices.

Truth: satellites and chief, each integrated by itself in inertial coordinates, with J2.
"""

import functools
import math
from dataclasses import replace

import brahe
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import chi2

from satform.dynamics.relative_motion_models import RelativeMotionModel, relative_motion_model
from satform.dynamics.stepwise_model import StepwiseModel
from satform.equipment.sensors.relative_motion import Measurement, NavigationSpec
from satform.navigation.kalman_filter import normalised_error_squared, process_model
from satform.navigation.relative_state_filter import Estimator, FilterSpec
from satform.numeric import stacking
from satform.numeric.elementwise import norm
from satform.orbits.chief import ChiefOrbitSpec
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER, OBLATENESS
from satform.orbits.frames import chief_frame
from satform.orbits.j2_elements import as_array

RUNS, STEP, STEPS, UPDATE = 100, 120.0, 200, 2
SENSOR = NavigationSpec(position_noise=1.0, velocity_noise=0.01, update_period=STEP * UPDATE, latency=STEP)
ORBIT = ChiefOrbitSpec(
    eccentricity=0.5, inclination=1.1, right_ascension=0.4, argument_of_perigee=0.7, argument_of_latitude=3.4
)
MEAN_MOTION = 2.0 * math.pi / 28000.0
CHIEF = ORBIT.keplerian(MEAN_MOTION)


@functools.cache
def true_motions(oblateness: float) -> np.ndarray:
    """LVLH motion of satellites that stay within some hundred metres of the chief, (STEPS + 1, RUNS, 6)."""

    def pull(place: np.ndarray) -> np.ndarray:
        radius = norm(place)[..., None]
        lift = 5.0 * (place[..., 2:] / radius) ** 2 - np.array([1.0, 1.0, 3.0])
        added = 1.5 * oblateness * (EQUATORIAL_RADIUS / radius) ** 2 * lift
        return GRAVITATIONAL_PARAMETER * place / radius**3 * (added - 1.0)

    def rate(_time: float, flat: np.ndarray) -> np.ndarray:
        where, how = flat.reshape(2, -1, 3)
        return np.concatenate((how, pull(where))).ravel()

    # Orbits of equal size, so that the satellites stay as near to the chief as they start.
    elements = as_array(CHIEF) + np.zeros((RUNS + 1, 1))
    elements[1:, 1:] += np.random.default_rng(5).normal(size=(RUNS, 5)) * 50.0 / CHIEF.semi_major_axis
    states = brahe.state_koe_to_eci(elements, brahe.AngleFormat.RADIANS)
    times = STEP * np.arange(STEPS + 1)
    flown = solve_ivp(
        rate,
        (0.0, times[-1]),
        np.stack((states[:, :3], states[:, 3:])).ravel(),
        "DOP853",
        times,
        rtol=1e-10,
        atol=1e-5,
    )
    found = []
    for where, how in flown.y.T.reshape(-1, 2, RUNS + 1, 3):
        now = chief_frame(where[0], how[0], pull(where[0]))
        found.append(np.concatenate(now.to_lvlh(where[1:], how[1:]), axis=-1))
    return np.array(found)


@functools.cache
def errors_squared(model: str, oblateness: float = OBLATENESS) -> np.ndarray:
    """NEES of filters of all satellites at each step, with different noise for each, shape (STEPS, RUNS)."""
    estimator = FilterSpec(model=model, acceleration_density=1e-16, innovation_gate=None).build(
        MEAN_MOTION, STEP, SENSOR, CHIEF
    )
    truth = true_motions(oblateness)
    noise = np.random.default_rng(9).normal(size=truth.shape) * np.repeat([1.0, 0.01], 3)
    memory, found = None, []
    for step in range(STEPS):
        # Measured every UPDATE steps, and known a step later.
        taken = max(0, step - 1) // UPDATE * UPDATE
        known = truth[taken] + noise[taken]
        measurement = Measurement(known[:, :3], known[:, 3:], taken)
        if memory is None:
            memory = estimator.start(measurement)
        else:
            memory = estimator.observe(memory, measurement, np.zeros((RUNS, 3)))
        found.append(normalised_error_squared(memory.state - truth[step], memory.covariance))
    return np.array(found)


def outside_band(squared: np.ndarray) -> np.ndarray:
    """Of each step, whether the sum over the runs is outside 99.99 % of chi-square of 6 RUNS degrees."""
    low, high = chi2.ppf([0.00005, 0.99995], 6 * RUNS)
    total = squared.sum(axis=-1)
    return (total < low) | (total > high)


def test_the_filter_by_j2_elements_is_consistent_about_an_eccentric_chief_and_the_others_are_not() -> None:
    assert not outside_band(errors_squared("j2_elements")).any()
    # Until the perigee J2 moves the satellites by less than is known of them.
    assert not outside_band(errors_squared("yamanaka_ankersen")[:120]).any()
    assert outside_band(errors_squared("yamanaka_ankersen")[140:]).all()
    assert outside_band(errors_squared("cw")[20:]).all()


def test_yamanaka_and_ankersen_s_filter_is_consistent_without_j2() -> None:
    assert not outside_band(errors_squared("yamanaka_ankersen", 0.0)).any()


def integrated_response(motion: RelativeMotionModel, begin: float, end: float) -> np.ndarray:
    """Effect of an acceleration held from `begin` to `end`, by Runge-Kutta, (6, 3)."""
    push, count = np.eye(6)[:, 3:], 64
    step = (end - begin) / count
    matrices = motion.system_matrix(np.linspace(begin, end, 2 * count + 1))
    effect = np.zeros((6, 3))
    for first, middle, last in zip(matrices[:-1:2], matrices[1::2], matrices[2::2], strict=True):
        one = first @ effect + push
        two = middle @ (effect + 0.5 * step * one) + push
        three = middle @ (effect + 0.5 * step * two) + push
        four = last @ (effect + step * three) + push
        effect = effect + step / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return effect


# The J2 acceleration changes by 3 J2 (R/r)^2 mu/r^3 STEP^2 = 8e-6 of a command at perigee; it is left out.
@pytest.mark.parametrize(("name", "most"), [("yamanaka_ankersen", 1e-10), ("j2_elements", 1e-5)])
def test_matrices_of_each_period_are_those_of_the_model_whatever_was_asked_for_before(
    name: str, most: float
) -> None:
    motion = relative_motion_model(name, CHIEF)
    for number in (130, 63, 0, 64):
        begin, end = number * STEP, (number + 1) * STEP
        found = StepwiseModel(name, CHIEF, STEP).over(number)
        np.testing.assert_allclose(found.transition, motion.transition(begin, end), rtol=1e-9, atol=1e-12)
        error = np.abs(found.response - integrated_response(motion, begin, end))
        assert error[:3].max() < most * STEP**2
        assert error[3:].max() < most * STEP


def test_process_covariance_about_a_circle_is_that_of_the_circular_model() -> None:
    density = np.array([1e-6, 2e-6, 5e-7])
    circle = replace(CHIEF, eccentricity=0.0)
    steady = process_model("cw", circle.mean_motion, STEP, density).over(0)
    changing = process_model("yamanaka_ankersen", MEAN_MOTION, STEP, density, circle).over(70)
    for name in ("transition", "response", "process"):
        expected = getattr(steady, name)
        np.testing.assert_allclose(getattr(changing, name), expected, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize(("name", "most"), [("cw", 1e-9), ("yamanaka_ankersen", 1e-6), ("j2_elements", 2e-3)])
def test_the_model_over_many_periods_is_that_of_each_of_them_one_after_another(
    name: str, most: float
) -> None:
    # Over each period the response of j2_elements is that of its Kepler motion, over many of them its own.
    first, count = 37, 235  # a revolution
    model = process_model(name, MEAN_MOTION, STEP, np.array([1e-6, 2e-6, 5e-7]), CHIEF)
    transition, response, process = np.eye(6), np.zeros((6, 3)), np.zeros((6, 6))
    for number in range(first, first + count):
        each = model.over(number)
        transition, response = each.transition @ transition, each.transition @ response + each.response
        process = each.transition @ process @ each.transition.T + each.process
    found = model.across(first, count)
    spread = np.sqrt(np.diag(process))
    error = (found.process - process) / spread[:, None] / spread
    assert np.abs(error).max() < most
    for matrix, expected in ((found.transition, transition), (found.response, response)):
        for rows in (slice(0, 3), slice(3, 6)):
            for columns in (slice(0, 3), slice(3, expected.shape[1])):
                if expected[rows, columns].size:
                    scale = np.abs(expected[rows, columns]).max()
                    assert np.abs(matrix[rows, columns] - expected[rows, columns]).max() < most * scale
    one = model.across(first, 1)
    assert all(np.array_equal(getattr(one, part), getattr(model.over(first), part)) for part in vars(one))


@pytest.mark.parametrize("name", ["cw", "yamanaka_ankersen", "j2_elements"])
def test_a_gap_of_a_million_periods_is_one_prediction(name: str) -> None:
    model = process_model(name, MEAN_MOTION, 0.01, np.array([1e-6, 2e-6, 5e-7]), CHIEF)
    assert np.linalg.eigvalsh(model.across(100, 1_000_000).process).min() > 0.0


def test_filters_flown_as_one_have_the_bits_of_each_alone() -> None:
    generator = np.random.default_rng(3)
    alone = [
        FilterSpec(model="yamanaka_ankersen", acceleration_density=density).build(
            MEAN_MOTION, STEP, SENSOR, CHIEF
        )
        for density in (1e-9, 3e-8, 2e-7)
    ]
    together: Estimator = stacking.stack(alone)
    motions, commands = generator.normal(size=(150, 3, 6)), 1e-3 * generator.normal(size=(150, 3, 3))

    def flown(estimator: Estimator, which: slice | int) -> tuple[bytes, bytes]:
        def measured(step: int) -> Measurement:
            taken = max(0, step - 3) // UPDATE * UPDATE
            return Measurement(motions[taken, which, :3], motions[taken, which, 3:], taken)

        memory = estimator.start(measured(0))
        for step in range(1, 150):
            if step == 70:
                memory = estimator.resume(memory, 4, commands[0, which], commands[1, which])
            if not 70 <= step < 74:
                memory = estimator.observe(memory, measured(step), commands[step, which])
        return memory.state.tobytes(), memory.covariance.tobytes()

    whole = flown(together, slice(None))
    for row, own in enumerate(alone):
        single = flown(own, row)
        for all_bytes, bytes_ in zip(whole, single, strict=True):
            assert all_bytes[row * len(bytes_) : (row + 1) * len(bytes_)] == bytes_


def test_a_filter_by_elements_needs_a_plane_of_the_chief_that_has_a_node() -> None:
    spec = FilterSpec(model="j2_elements", acceleration_density=1e-9)
    with pytest.raises(ValueError, match="needs the plane of the chief's orbit"):
        spec.build(MEAN_MOTION, STEP, SENSOR)
    with pytest.raises(ValueError, match="leaves the node undefined"):
        spec.build(MEAN_MOTION, STEP, SENSOR, replace(CHIEF, inclination=0.0))
