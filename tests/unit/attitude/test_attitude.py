# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Attitude of a gyrostat that points at a place on the ground and turns its panels to the sun.

The flight follows Long & Hall, whose altitude (279.24 km), target (Cape Canaveral) and settling time
(about 40 s) are printed; the rest of the set-up was chosen, and its figures come from an independent
computation.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from satform.attitude.ground_pointing import (
    AttitudeReference,
    GroundPointingSpec,
    pointing_error,
    pointing_reference,
    sensor_axes,
)
from satform.attitude.gyrostat import AttitudeState, Torques, advance, gravity_gradient_torque, gyrostat
from satform.attitude.mrp_tracking import AttitudeTrackingSpec, attitude_error
from satform.dynamics.linear import multiply
from satform.numeric.modified_rodrigues import (
    direction_cosines,
    mrp_from_direction_cosines,
    mrp_rate,
    relative_mrp,
    short_way,
)
from satform.numeric.stacking import stack
from satform.orbits.earth import GRAVITATIONAL_PARAMETER

BORESIGHT = np.array([1.0, 0.0, 0.0])
PANEL_AXIS = np.array([0.0, 1.0, 0.0])
POINTING = GroundPointingSpec(
    altitude=279.24e3,
    start_latitude=math.radians(25.0),
    start_longitude=math.radians(-90.0),
    heading=math.radians(65.0),
    target_latitude=math.radians(28.5),
    target_longitude=math.radians(-80.5),
    sun=(0.5, -0.6, 0.62),
).build()
ORBIT, SUN = POINTING.orbit, POINTING.sun
STEP = 0.05
DURATION = 65.0


def sight(time):
    return POINTING.line_of_sight(np.asarray(time, dtype=float))


def reference_at(time):
    return POINTING.reference(np.asarray(time, dtype=float))


def first_attitude():
    return (
        replace(POINTING, latitude=math.radians(20.0), longitude=math.radians(-93.0))
        .reference(np.zeros(()))
        .mrp
    )


def gravity_torque(inertia, mrp, time):
    nadir = -ORBIT.position(time).value / np.asarray(ORBIT.radius)[..., None]
    down = multiply(direction_cosines(mrp), nadir)
    return gravity_gradient_torque(inertia, down, ORBIT.radius, GRAVITATIONAL_PARAMETER)


@dataclass(frozen=True)
class Flight:
    """Histories of two flights at once: the nominal one first, the one without initial error second."""

    time: np.ndarray
    mrp_error: np.ndarray
    rate_error: np.ndarray
    boresight_error: np.ndarray
    panel: np.ndarray
    lyapunov: np.ndarray
    wheel_torque: np.ndarray
    wheel_momentum: np.ndarray

    def last_time_above(self, history, level):
        return self.time[np.nonzero(history[:, 0] > level)[0][-1] + 1]

    def at(self, history, time):
        return history[round(time / STEP), 0]


@pytest.fixture(scope="module")
def flight():
    law = AttitudeTrackingSpec().build()
    half_steps = np.arange(2 * round(DURATION / STEP) + 1) * STEP / 2.0
    references, sights = reference_at(half_steps), sight(half_steps).value

    def reference(index):
        return AttitudeReference(
            references.mrp[index],
            references.angular_velocity[index],
            references.angular_acceleration[index],
            references.feasible[index],
        )

    state = law.body.at_rate(
        np.stack((first_attitude(), references.mrp[0])),
        np.stack(([0.01, -0.02, 0.015], references.angular_velocity[0])),
        np.zeros((2, 3)),
    )
    history = []
    for step in range(len(half_steps) // 2):

        def torques(offset, now, step=step):
            index = 2 * step + round(2.0 * offset / STEP)
            external = gravity_torque(law.body.inertia, now.mrp, half_steps[index])
            return Torques(law.wheel_torque(now, reference(index), external), external)

        error = attitude_error(state.mrp, law.body.angular_velocity(state), reference(2 * step))
        matrix = direction_cosines(state.mrp)
        history.append(
            (
                np.linalg.norm(error.mrp, axis=-1),
                np.linalg.norm(error.angular_velocity, axis=-1),
                pointing_error(matrix, BORESIGHT, sights[2 * step]),
                np.abs(matrix @ SUN @ PANEL_AXIS),
                law.lyapunov(state, reference(2 * step)),
                np.abs(torques(0.0, state).wheel),
                np.abs(state.wheel_momentum),
            )
        )
        state = advance(law.body, state, STEP, torques)
    columns = [np.array(column) for column in zip(*history, strict=True)]
    return Flight(np.arange(len(history)) * STEP, *columns)


def test_orbit_at_the_printed_altitude():
    assert ORBIT.mean_motion == pytest.approx(1.16228909e-3, rel=1e-6)
    assert 2.0 * math.pi / ORBIT.mean_motion == pytest.approx(5405.871, rel=1e-6)
    assert np.linalg.norm(sight(0.0).value) == pytest.approx(1078.893e3, rel=1e-5)


def test_reference_at_the_start_is_that_of_the_independent_computation():
    reference = reference_at(0.0)
    expected = np.array([-0.58392946, -0.18309406, 0.01186378])
    assert reference.mrp == pytest.approx(expected, rel=1e-6)
    rate = np.array([-3.82e-6, -2.34227e-3, 1.307e-5])
    assert reference.angular_velocity == pytest.approx(rate, abs=1e-7)


def test_first_attitude_and_its_error_are_those_of_the_independent_computation():
    assert first_attitude() == pytest.approx(np.array([-0.30540234, 0.36524789, 0.52124352]), rel=1e-6)
    law, reference = AttitudeTrackingSpec().build(), reference_at(0.0)
    state = law.body.at_rate(first_attitude(), np.array([0.01, -0.02, 0.015]), np.zeros(3))
    error = attitude_error(state.mrp, law.body.angular_velocity(state), reference)
    size = np.linalg.norm(error.mrp)
    assert size == pytest.approx(0.669680, rel=1e-4)
    assert math.degrees(4.0 * math.atan(size)) == pytest.approx(135.238, rel=1e-4)
    assert np.linalg.norm(error.angular_velocity) == pytest.approx(0.027517, rel=1e-4)
    assert law.lyapunov(state, reference) == pytest.approx(10.408818, rel=1e-5)


@pytest.mark.parametrize(
    ("time", "attitude", "rate"),
    [
        (10, 0.27002, 0.12561),
        (20, 0.073116, 0.039197),
        (30, 0.018833, None),
        (40, 0.0048944, 0.0026248),
        (60, 3.779e-4, 1.877e-4),
    ],
)
def test_errors_decay_as_in_the_independent_computation(flight, time, attitude, rate):
    assert flight.at(flight.mrp_error, time) == pytest.approx(attitude, rel=0.01)
    if rate is not None:
        assert flight.at(flight.rate_error, time) == pytest.approx(rate, rel=0.01)


def test_sensor_is_on_target_in_about_forty_seconds_as_printed(flight):
    assert flight.last_time_above(flight.boresight_error, math.radians(1.0)) == pytest.approx(39.6, abs=0.5)
    assert flight.last_time_above(flight.boresight_error, math.radians(0.1)) == pytest.approx(56.5, abs=0.5)


def test_panel_axis_turns_square_to_the_sun(flight):
    assert flight.last_time_above(flight.panel, 1e-2) == pytest.approx(41.95, abs=0.5)
    assert flight.last_time_above(flight.panel, 1e-3) == pytest.approx(60.7, abs=0.5)


def test_lyapunov_function_falls_by_the_rate_error_alone(flight):
    value = flight.lyapunov[:, 0]
    assert np.all(np.diff(value) < 0.0)
    slope = (8.0 * (value[3:-1] - value[1:-3]) - (value[4:] - value[:-4])) / (12.0 * STEP)
    assert slope == pytest.approx(-40.0 * flight.rate_error[2:-2, 0] ** 2, abs=1e-5)


def test_wheels_need_the_torque_and_momentum_of_the_independent_computation(flight):
    torque, momentum = flight.wheel_torque[:, 0].max(axis=0), flight.wheel_momentum[:, 0].max(axis=0)
    assert torque == pytest.approx(np.array([3.417, 3.621, 8.985]), rel=0.02)
    assert momentum == pytest.approx(np.array([6.284, 5.906, 17.96]), rel=0.02)


def test_satellite_that_starts_on_the_reference_stays_on_it(flight):
    minute = flight.time <= 60.0
    assert flight.mrp_error[minute, 1].max() < 1e-12
    assert flight.rate_error[minute, 1].max() < 1e-12
    assert flight.panel[minute, 1].max() < 1e-12


def test_reference_points_the_boresight_at_the_target_with_the_panels_to_the_sun():
    time = np.linspace(0.0, 300.0, 61)
    matrix = direction_cosines(reference_at(time).mrp)
    assert np.max(pointing_error(matrix, BORESIGHT, sight(time).value)) < 1e-12
    assert np.max(np.abs(matrix @ SUN @ PANEL_AXIS)) < 1e-12


def test_reference_rates_are_the_derivatives_of_the_reference_attitude():
    time, step = np.linspace(0.0, 300.0, 31), 5e-4
    before, now, after = (reference_at(time + shift) for shift in (-step, 0.0, step))
    matrix = direction_cosines(now.mrp)
    slope = (direction_cosines(after.mrp) - direction_cosines(before.mrp)) / (2.0 * step)
    skew = -slope @ np.swapaxes(matrix, -1, -2)
    found = np.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), axis=-1)
    assert now.angular_velocity == pytest.approx(found, abs=1e-8)
    rate_slope = (after.angular_velocity - before.angular_velocity) / (2.0 * step)
    assert now.angular_acceleration == pytest.approx(rate_slope, abs=1e-8)


tilts = st.floats(-1.2, 1.2)


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), tilts)
def test_where_the_panels_cannot_face_the_sun_the_nearest_turn_is_taken_and_reported(direction, tilt):
    sun = np.array(direction)
    line = sight(50.0).value / np.linalg.norm(sight(50.0).value)
    size = np.linalg.norm(sun)
    if size < 0.1 or np.linalg.norm(np.cross(sun / size, line)) < 0.05:
        return
    axis = np.array([math.sin(tilt), math.cos(tilt), 0.0])
    reference = pointing_reference(sight(50.0), sun / size, sensor_axes(BORESIGHT, axis))
    matrix = direction_cosines(reference.mrp)
    assert math.acos(min(1.0, matrix[0] @ line)) < 1e-7
    yaws = Rotation.from_rotvec(np.linspace(0.0, 2.0 * math.pi, 721)[:, None] * BORESIGHT).as_matrix()
    nearest = np.min(np.abs(yaws @ matrix @ (sun / size) @ axis))
    found = abs(axis @ matrix @ (sun / size))
    assert found <= nearest + 1e-9
    assert bool(reference.feasible) == (found < 1e-9)
    assert np.all(np.isfinite(reference.angular_acceleration))


def test_a_panel_axis_along_the_boresight_is_refused_in_words():
    with pytest.raises(ValueError, match="parallel to the boresight"):
        sensor_axes(BORESIGHT, -2.0 * BORESIGHT)


mrps = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)


@given(mrps)
def test_direction_cosines_are_those_of_scipy(mrp):
    assert direction_cosines(mrp) == pytest.approx(Rotation.from_mrp(mrp).as_matrix().T, abs=1e-12)


@given(mrps)
def test_mrps_return_from_the_matrix_by_the_short_way(mrp):
    back = mrp_from_direction_cosines(direction_cosines(mrp))
    assert np.linalg.norm(back) <= 1.0 + 1e-12
    assert direction_cosines(back) == pytest.approx(direction_cosines(mrp), abs=1e-12)
    assert direction_cosines(short_way(mrp)) == pytest.approx(direction_cosines(mrp), abs=1e-12)


@given(mrps, mrps)
def test_relative_attitude_is_the_product_of_the_matrices(mrp, reference):
    relative = relative_mrp(mrp, reference)
    expected = direction_cosines(mrp) @ direction_cosines(reference).T
    assert np.linalg.norm(relative) <= 1.0 + 1e-12
    assert direction_cosines(relative) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("angle", [0.3, 2.0, 3.0])
def test_mrps_about_a_fixed_axis_grow_as_the_tangent_of_a_quarter_angle(angle):
    axis, rate = np.array([2.0, -1.0, 2.0]) / 3.0, 0.7
    slope = mrp_rate(axis * math.tan(angle / 4.0), rate * axis)
    assert slope == pytest.approx(axis * rate / 4.0 / math.cos(angle / 4.0) ** 2, abs=1e-14)


def test_gravity_gradient_is_the_torque_on_the_separate_masses():
    random = np.random.default_rng(2)
    places, masses = random.standard_normal((6, 3)), random.uniform(1.0, 5.0, 6)
    places -= masses @ places / masses.sum()
    inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, places, strict=True))
    down, radius = np.array([2.0, -1.0, 2.0]) / 3.0, 7.0e4
    seen = places - radius * down
    forces = -GRAVITATIONAL_PARAMETER * masses[:, None] * seen / np.linalg.norm(seen, axis=1)[:, None] ** 3
    seen_from_centre = -radius * down
    assert np.allclose(seen - places, seen_from_centre)
    expected = np.cross(places, forces).sum(axis=0)
    found = gravity_gradient_torque(inertia, down, np.asarray(radius), GRAVITATIONAL_PARAMETER)
    assert found == pytest.approx(expected, rel=1e-3, abs=1e-3 * np.linalg.norm(expected))


def spinning(seed, count=8):
    random = np.random.default_rng(seed)
    body = gyrostat(
        np.array([[86.0, 3.0, -2.0], [3.0, 85.0, 4.0], [-2.0, 4.0, 113.0]]), np.array([0.5, 0.6, 0.7])
    )
    state = body.at_rate(
        random.uniform(-0.5, 0.5, (count, 3)),
        random.uniform(-0.1, 0.1, (count, 3)),
        random.uniform(-30.0, 30.0, (count, 3)),
    )
    return body, state


def inertial_momentum(state):
    return np.einsum("nji,nj->ni", direction_cosines(state.mrp), state.momentum)


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_wheel_torques_conserve_the_momentum_in_inertial_space(seed):
    body, state = spinning(seed)
    start = inertial_momentum(state)
    size = np.linalg.norm(state.momentum, axis=-1)
    motors = np.random.default_rng(seed).uniform(-2.0, 2.0, (8, 3))
    for _ in range(200):
        state = advance(body, state, STEP, lambda _time, _now: Torques(motors, np.zeros((8, 3))))
    scale = np.linalg.norm(start, axis=-1).max()
    assert np.linalg.norm(state.momentum, axis=-1) == pytest.approx(size, rel=1e-9)
    assert inertial_momentum(state) == pytest.approx(start, abs=1e-8 * scale)
    assert np.linalg.norm(state.mrp, axis=-1).max() <= 1.0


def kinetic_energy(body, state):
    """Of body and wheels, J, shape (...)."""
    rate = body.angular_velocity(state)
    platform = np.einsum("...i,...ij,...j->...", rate, body.platform_inertia, rate)
    return 0.5 * (platform + np.sum(state.wheel_momentum**2 / body.wheel_inertia, axis=-1))


def test_momentum_and_energy_are_conserved_without_torques():
    body, state = spinning(4)
    start, energy = inertial_momentum(state), kinetic_energy(body, state)
    for _ in range(400):
        state = advance(body, state, STEP, lambda _time, _now: Torques(np.zeros((8, 3)), np.zeros((8, 3))))
    assert inertial_momentum(state) == pytest.approx(start, abs=1e-9 * np.abs(start).max())
    assert kinetic_energy(body, state) == pytest.approx(energy, rel=1e-9)


def test_body_that_turns_over_and_over_is_followed_without_singularity():
    body = gyrostat(np.diag([10.0, 10.0, 10.0]), np.array([0.1, 0.1, 0.1]))
    axis, nothing = np.array([2.0, -1.0, 2.0]) / 3.0, np.zeros(3)
    state = body.at_rate(nothing, 0.9 * axis, nothing)
    for step in range(1, 401):
        state = advance(body, state, STEP, lambda _time, _now: Torques(nothing, nothing))
        assert np.linalg.norm(state.mrp) <= 1.0
        turned = Rotation.from_rotvec(0.9 * STEP * step * axis).as_matrix().T
        assert direction_cosines(state.mrp) == pytest.approx(turned, abs=1e-6)


def test_wheel_speeds_come_back_from_the_momenta():
    body, _ = spinning(0)
    speeds, rate = np.array([10.0, -20.0, 5.0]), np.array([0.1, 0.2, -0.3])
    state = body.at_rate(np.zeros(3), rate, speeds)
    assert body.angular_velocity(state) == pytest.approx(rate, rel=1e-13)
    assert body.wheel_speed(state) == pytest.approx(speeds, rel=1e-13)


@settings(max_examples=4, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(1.0, 50.0), st.floats(5.0, 100.0))
def test_lyapunov_function_never_grows_from_any_attitude_and_rate(seed, attitude_gain, rate_gain):
    law = AttitudeTrackingSpec(attitude_gain=attitude_gain, rate_gain=rate_gain).build()
    random = np.random.default_rng(seed)
    state = law.body.at_rate(
        short_way(random.uniform(-1.0, 1.0, (16, 3))), random.uniform(-0.1, 0.1, (16, 3)), np.zeros((16, 3))
    )
    still = AttitudeReference(
        short_way(random.uniform(-1.0, 1.0, (16, 3))), np.zeros((16, 3)), np.zeros((16, 3)), np.ones(16, bool)
    )
    free = np.zeros((16, 3))
    before = law.lyapunov(state, still)
    for _ in range(150):
        state = advance(
            law.body, state, STEP, lambda _time, now: Torques(law.wheel_torque(now, still, free), free)
        )
        after = law.lyapunov(state, still)
        assert np.all(after <= before * (1.0 + 1e-9))
        before = after


def test_an_impossible_body_is_refused_in_words():
    with pytest.raises(ValueError, match="smallest principal value"):
        AttitudeTrackingSpec(inertia=0.4).build()


def test_one_satellite_and_a_stack_of_them_get_the_same_bits():
    specs = [
        AttitudeTrackingSpec(),
        AttitudeTrackingSpec(attitude_gain=5.0, products_of_inertia=(1.0, 2.0, 3.0)),
    ]
    laws = [spec.build() for spec in specs]
    random = np.random.default_rng(9)
    mrp, momentum, wheels = random.standard_normal((3, 2, 3))
    reference = reference_at(np.array([0.0, 10.0]))
    external = random.standard_normal((2, 3)) * 1e-3
    fleet = stack(laws)
    stacked = fleet.wheel_torque(AttitudeState(mrp, momentum, wheels), reference, external)
    for index, law in enumerate(laws):
        alone_at = reference_at(10.0 * index)
        assert np.array_equal(alone_at.mrp, reference.mrp[index])
        assert np.array_equal(alone_at.angular_acceleration, reference.angular_acceleration[index])
        own = AttitudeState(mrp[index], momentum[index], wheels[index])
        assert np.array_equal(law.wheel_torque(own, alone_at, external[index]), stacked[index])
