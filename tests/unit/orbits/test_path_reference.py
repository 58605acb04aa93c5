# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Desired motion along a curve against derivatives, free motion and the case study's figures."""

import numpy as np
import pytest

from satform.dynamics.cw import acceleration
from satform.numeric.stacking import stack
from satform.orbits.curve_specs import CircleSpec, EllipseSpec, FixedPointSpec
from satform.orbits.path_reference import Path, steady_motion

CASE_1 = EllipseSpec(first_axis=(0.0, 200e3, 0.0), second_axis=(100e3, 0.0, 0.0)).build()
TILTED = EllipseSpec(
    centre=(1e3, 2e3, -5e3), first_axis=(0.0, 75e3, 0.0), second_axis=(30e3, 0.0, 40e3)
).build()
MODES = [("arc_length", 1.0), ("arc_length", 0.75), ("angle", 1.0), ("angle", 0.75)]


@pytest.mark.parametrize(("period", "rate"), [(100.0, 9688.448), (6000.0, 161.474137)])
def test_nominal_rate_of_the_first_case_is_its_perimeter_per_period(period, rate):
    assert Path(CASE_1, np.float64(1.0)).period / period == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize(("period", "rate"), [(100.0, 4844.22411), (6000.0, 80.737069)])
def test_scaled_orbits_of_the_second_case_share_one_rate(period, rate):
    small = EllipseSpec(first_axis=(0.0, 75e3, 0.0), second_axis=(37.5e3, 0.0, 0.0)).build()
    assert Path(small, np.float64(0.75)).period / period == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize(
    ("period", "largest", "jerk"),
    [(100.0, 1877.32, 365.0), (6000.0, 0.521478, 1.69e-3)],
)
def test_constant_speed_on_the_first_case_costs_the_known_acceleration_and_jerk(period, largest, jerk):
    path = Path(CASE_1, np.float64(1.0))
    motion = steady_motion(path, float(path.period) / period)
    assert motion.acceleration_max == pytest.approx(largest, rel=1e-5)
    assert motion.jerk_max == pytest.approx(jerk, rel=2e-3)


def test_largest_jerk_follows_from_the_curvature_and_its_slope():
    path = Path(CASE_1, np.float64(1.0))
    theta = np.linspace(0.0, np.pi, 20001)
    a, b = 200e3, 100e3
    speed = np.hypot(a * np.sin(theta), b * np.cos(theta))
    curvature = a * b / speed**3
    slope = -3.0 * curvature * (a * a - b * b) * np.sin(theta) * np.cos(theta) / speed**3
    expected = 7.0**3 * np.hypot(slope, curvature**2).max()
    assert steady_motion(path, 7.0).jerk_max == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("parameter", "scale"), MODES)
def test_velocity_and_acceleration_are_the_derivatives_of_position(parameter, scale):
    path = Path(TILTED, np.float64(scale), parameter)
    time, small = np.linspace(0.0, 4000.0, 41), 0.01

    def state(t):
        return 3e4 + 150.0 * t + 0.01 * t**2, 150.0 + 0.02 * t, np.full_like(t, 0.02)

    here, ahead, behind = (path.reference(*state(time + shift)) for shift in (0.0, small, -small))
    velocity = (ahead.position - behind.position) / (2.0 * small)
    change = (ahead.velocity - behind.velocity) / (2.0 * small)
    assert here.velocity == pytest.approx(velocity, abs=1e-6)
    assert here.acceleration == pytest.approx(change, abs=1e-8)


@pytest.mark.parametrize(("parameter", "scale"), MODES)
def test_one_period_of_generalised_arc_length_is_one_lap(parameter, scale):
    path = Path(TILTED, np.float64(scale), parameter)
    start, still = np.float64(1234.0), np.float64(0.0)
    after = path.reference(start + 3.0 * path.period, still, still).position
    assert after == pytest.approx(path.reference(start, still, still).position, abs=1e-8)
    assert path.generalised_arc_length(path.angle(start)) == pytest.approx(start, rel=1e-13)


def test_a_two_to_one_ellipse_at_constant_angular_rate_is_free_motion():
    mean_motion = 2.0 * np.pi / 6000.0
    path = Path(CASE_1, np.float64(1.0), "angle")
    rate = path.period / 6000.0
    places = np.linspace(0.0, float(path.period), 50)
    desired = path.reference(places, np.full(50, rate), np.zeros(50))
    free = acceleration(desired.position, desired.velocity, mean_motion)
    assert np.abs(desired.acceleration - free).max() < 1e-12


def test_acceleration_taken_in_the_middle_is_the_mean_over_the_step_to_second_order():
    path = Path(TILTED, np.float64(0.75))
    place, rate, change = np.float64(2e4), np.float64(160.0), np.float64(0.05)
    errors = []
    for duration in (4.0, 2.0):
        later = (place + rate * duration + 0.5 * change * duration**2, rate + change * duration, change)
        gained = path.reference(*later).velocity - path.reference(place, rate, change).velocity
        held = path.at_step(place, rate, change, duration).acceleration
        errors.append(np.linalg.norm(gained / duration - held))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)


def test_acceleration_taken_at_the_start_lags_by_half_a_step_of_jerk():
    path = Path(CASE_1, np.float64(1.0), feedforward_sample="start")
    rate, still, duration = np.float64(9688.448), np.float64(0.0), 0.01
    places = np.linspace(0.0, float(path.period), 721)
    middle = Path(CASE_1, np.float64(1.0)).at_step(places, rate, still, duration).acceleration
    start = path.at_step(places, rate, still, duration).acceleration
    assert np.linalg.norm(middle - start, axis=-1).max() == pytest.approx(365.0 * 0.005, rel=0.01)


def test_position_and_velocity_of_a_step_are_those_at_its_start():
    path = Path(TILTED, np.float64(0.75))
    state = np.float64(2e4), np.float64(160.0), np.float64(0.05)
    step, start = path.at_step(*state, 10.0), path.reference(*state)
    assert np.array_equal(step.position, start.position)
    assert np.array_equal(step.velocity, start.velocity)


@pytest.mark.parametrize(("parameter", "scale"), MODES)
def test_projection_of_a_satellite_on_its_reference_is_the_reference(parameter, scale):
    path = Path(TILTED, np.float64(scale), parameter)
    for laps in (-3.0, 0.0, 0.3, 0.99, 7.4):
        place, rate = np.float64(laps) * path.period, np.float64(81.0)
        desired = path.reference(place, rate, np.float64(0.0))
        found = path.projected(desired.position, desired.velocity, place + 1e4)
        assert found[0] == pytest.approx(place, abs=1e-7)
        assert found[1] == pytest.approx(rate, rel=1e-10)


def test_projection_from_beside_the_orbit_moves_with_the_ray_through_the_centre():
    path = Path(CircleSpec(radius=1000.0, normal=(0, 0, 1), direction=(1, 0, 0)).build(), np.float64(0.5))
    angle, angular_rate = 1.1, 0.01
    for radius in (700.0, 1300.0):
        position = radius * np.array([np.cos(angle), np.sin(angle), 0.2])
        velocity = radius * angular_rate * np.array([-np.sin(angle), np.cos(angle), 0.0])
        place, rate = path.projected(position, velocity, np.float64(0.0))
        assert place == pytest.approx(1000.0 * angle / 0.5, rel=1e-12)
        assert rate == pytest.approx(1000.0 * angular_rate / 0.5, rel=1e-12)


def test_projected_rate_is_the_derivative_of_the_projected_place():
    path = Path(TILTED, np.float64(0.75), "angle")
    start, velocity = np.array([20e3, 50e3, 30e3]), np.array([30.0, -50.0, 20.0])
    near = path.projected(start, velocity, np.float64(0.0))[0]
    places = [path.projected(start + t * velocity, velocity, near)[0] for t in (-0.01, 0.01)]
    rate = path.projected(start, velocity, near)[1]
    assert rate == pytest.approx((places[1] - places[0]) / 0.02, rel=1e-7)


@pytest.mark.parametrize("parameter", ["arc_length", "angle"])
def test_a_fixed_point_asks_for_no_motion(parameter):
    path = Path(FixedPointSpec(position=(10.0, 20.0, 30.0)).build(), np.float64(1.0), parameter)
    desired = path.at_step(np.float64(500.0), np.float64(80.0), np.float64(0.1), 1.0)
    assert np.array_equal(desired.position, [10.0, 20.0, 30.0])
    assert not desired.velocity.any()
    assert not desired.acceleration.any()
    assert steady_motion(path, 80.0).acceleration_max == 0.0
    assert path.projected(np.ones(3), np.ones(3), np.float64(7.0)) == (0.0, 0.0)


@pytest.mark.parametrize("parameter", ["arc_length", "angle"])
def test_one_satellite_and_many_get_the_same_bits(parameter):
    generator = np.random.default_rng(4)
    paths = []
    for _ in range(20):
        b, c, a = generator.uniform(1e3, 1e5, 3)
        curve = EllipseSpec(first_axis=(0.0, a, 0.0), second_axis=(b, 0.0, c)).build()
        paths.append(Path(curve, np.float64(generator.uniform(0.5, 2.0)), parameter))
    place, rate, change = generator.normal(0.0, 1e6, 20), generator.normal(80.0, 5.0, 20), np.full(20, 0.01)
    position, velocity = generator.normal(0.0, 1e5, (20, 3)), generator.normal(0.0, 80.0, (20, 3))
    stacked = stack(paths)
    desired = stacked.at_step(place, rate, change, 0.7)
    projected = stacked.projected(position, velocity, place)
    for i, path in enumerate(paths):
        single = path.at_step(place[i], rate[i], change[i], 0.7)
        for name in ("position", "velocity", "acceleration"):
            assert np.array_equal(getattr(single, name), getattr(desired, name)[i])
        own = path.projected(position[i], velocity[i], place[i])
        assert (own[0], own[1]) == (projected[0][i], projected[1][i])
