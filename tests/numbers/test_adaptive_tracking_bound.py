# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Adaptive tracking: its flight by an independent implementation, its proved bound, and approximators."""

import math

import numpy as np
import pytest

from flights import shipped
from satform.control.adaptive_tracking import AdaptiveTrackingSpec, decay_margin, ultimate_bounds
from satform.control.protocol import ControlStep, FlightSetting, Motion
from satform.flight.simulate import simulate
from satform.orbits.path_reference import Reference

STEP, FREQUENCY, PHASES = 0.05, 0.5, np.array([0.0, 1.1, 2.2])
LEAKAGE, RATE, SLOPE = 0.01, 10.0, 0.2
TURN, MEAN_MOTION = 2.0 * math.pi / 100.0, 2.0 * math.pi / 6000.0
START_ERROR = np.array([5.0, -4.0, 3.0])


def unknown_force(velocity):
    """The dependence on the velocity of `velocity_dependent` with its default numbers."""
    return -0.2 * velocity + 0.4 * np.sin(1.5 * velocity) + 0.05 * velocity * np.abs(velocity)


def unknown(time, velocity):
    return unknown_force(velocity) + 0.5 * np.sin(FREQUENCY * time + PHASES)


def gravity(position, velocity, n=MEAN_MOTION):
    x, _, z = np.moveaxis(position, -1, 0)
    vx, vy, _ = np.moveaxis(velocity, -1, 0)
    return np.stack((3 * n * n * x + 2 * n * vy, -2 * n * vx, -n * n * z), axis=-1)


def desired(time):
    """Position, velocity and acceleration on the ellipse of the scenario."""
    first, second = np.array([0.0, 40.0, 0.0]), np.array([30.0, 0.0, 20.0])
    cosine, sine = math.cos(TURN * time), math.sin(TURN * time)
    return (
        first * cosine + second * sine,
        TURN * (second * cosine - first * sine),
        -TURN * TURN * (first * cosine + second * sine),
    )


def moved(position, velocity, command, time, drift):
    """Position and velocity a step later by the classical Runge-Kutta method, the command held."""

    def slope(offset, place, speed):
        return speed, drift(place, speed) + unknown(time + offset, speed) + command

    p1, v1 = slope(0.0, position, velocity)
    p2, v2 = slope(STEP / 2, position + STEP / 2 * p1, velocity + STEP / 2 * v1)
    p3, v3 = slope(STEP / 2, position + STEP / 2 * p2, velocity + STEP / 2 * v2)
    p4, v4 = slope(STEP, position + STEP * p3, velocity + STEP * v3)
    return (
        position + STEP / 6 * (p1 + 2 * p2 + 2 * p3 + p4),
        velocity + STEP / 6 * (v1 + 2 * v2 + 2 * v3 + v4),
    )


def patches(velocity, phase, _filtered):
    """Three patches of velocities within 3 m/s, three of the phase, affine models; shape (12, 3)."""
    third = 2.0 * math.pi / 3.0
    of_velocity = [(np.clip(velocity, -3.0, 3.0) - centre) / 3.0 for centre in (-3.0, 0.0, 3.0)]
    of_phase = [math.remainder(phase - third * k, 2.0 * math.pi) / third + np.zeros(3) for k in range(3)]
    rows = []
    for offsets in (of_velocity, of_phase):
        hats = [np.where(np.abs(x) < 1.0, 0.5 + 0.5 * np.cos(math.pi * x), 0.0) for x in offsets]
        rows += hats + [hat * x for hat, x in zip(hats, offsets, strict=True)]
    return np.array(rows)


def fuzzy_sets(velocity, _phase, filtered):
    """Seven Gaussian sets of the velocity, normalised, and the smoothed sign; shape (8, 3)."""
    members = np.exp(-((velocity - np.arange(-3.0, 4.0)[:, None]) ** 2))
    return np.vstack((members / members.sum(axis=0), np.tanh(filtered / 0.05)))


def by_equations(functions, rates, duration):
    """Largest error after 100 s, largest command and final position of a flight by the page's equations."""
    p, v, _ = desired(0.0)
    position, velocity = p + START_ERROR, v.copy()
    weights = values = np.zeros((len(rates), 3))
    integral, worst, most = np.zeros(3), 0.0, 0.0
    for k in range(round(duration / STEP)):
        time = k * STEP
        p, v, _ = desired(time)
        _, _, a = desired(time + STEP / 2)
        error, rate = position - p, velocity - v
        filtered = rate + 2 * SLOPE * error + SLOPE**2 * integral
        grown = (1 - STEP * LEAKAGE) * weights + STEP * np.array(rates)[:, None] * values * filtered
        weights = np.clip(grown, -2.0, 2.0)
        values = functions(velocity + STEP / 2 * a, FREQUENCY * (time + STEP / 2), filtered)
        known = gravity(position + STEP / 2 * velocity, velocity + STEP / 2 * a)
        command = a - known - 2 * SLOPE * rate - SLOPE**2 * error - filtered - (weights * values).sum(axis=0)
        integral = integral + STEP * error
        if time >= 100.0:
            worst = max(worst, float(np.linalg.norm(error)))
        most = max(most, float(np.linalg.norm(command)))
        position, velocity = moved(position, velocity, command, time, gravity)
    return worst, most, position


FLOWN = {
    "patches": (patches, [10.0] * 12, 0.04586, 7.7562, 0.02176),
    "fuzzy_sets": (fuzzy_sets, [10.0] * 7 + [2.5], 0.05832, 5.0679, 0.04470),
    "no_adaptation": (patches, [0.0] * 12, 1.72602, 3.0270, 1.15694),
}
"""Of the scenario's satellites: functions, rates, largest error (m), command (m/s^2), mean error (m)."""


def test_the_scenario_flies_as_the_equations_say():
    flight = simulate(shipped("adaptive_tracking"))
    for name, (functions, rates, error, command, mean) in FLOWN.items():
        worst, most, position = by_equations(functions, rates, 150.0)
        flown = flight[name]
        misses = np.linalg.norm(flown.position[:-1] - flown.reference_position, axis=-1)
        assert flown.position[-1] == pytest.approx(position, abs=1e-7)
        assert (float(misses[2000:].max()), worst) == pytest.approx((worst, error), rel=1e-3)
        assert math.sqrt((misses[2000:] ** 2).mean()) == pytest.approx(mean, rel=1e-3)
        commands = np.linalg.norm(flown.acceleration, axis=-1)
        assert (float(commands.max()), most) == pytest.approx((most, command), rel=1e-3)


def weights_for(law, largest_velocity):
    """Weights (12, 3) that approximate the force and the sinusoid of each axis, and what they leave, m/s^2.

    By the page's equations on a grid of velocities and phases, the weights kept small.
    """
    velocity = np.linspace(-largest_velocity, largest_velocity, 81)
    phase = np.linspace(0.0, 2.0 * math.pi, 48, endpoint=False)
    grid = [(v, theta) for v in velocity for theta in phase]
    values = np.array([patches(np.full(3, v), theta, None)[:, 0] for v, theta in grid])
    wanted = np.array([unknown_force(v) + 0.5 * np.sin(theta + PHASES) for v, theta in grid])
    weights = np.linalg.solve(values.T @ values + 0.1 * np.eye(values.shape[1]), values.T @ wanted)
    return weights, float(np.max(np.abs(values @ weights - wanted)))


def test_the_error_stays_within_its_proved_bound_and_the_lyapunov_function_falls_as_proved():
    spec = AdaptiveTrackingSpec(
        weight_rate=RATE, weight_limit=2.0, leakage_rate=LEAKAGE, angular_frequency=FREQUENCY
    )
    law = spec.build(FlightSetting(MEAN_MOTION, STEP))
    ideal, left = weights_for(law, 2.7)
    random, count = np.random.default_rng(4), 12
    p, v, _ = desired(0.0)
    position = p + 5.0 * random.standard_normal((count, 3))
    velocity = v + random.standard_normal((count, 3))
    memory = law.start(Motion(position, velocity))
    margin, ideal = decay_margin(law), ideal.T
    filtered, used, errors, distances, hastes = [], [], [], [], []
    for k in range(4000):
        time = k * STEP
        p, v, _ = desired(time)
        action = law.act(
            Motion(position, velocity),
            Reference(p, v, desired(time + STEP / 2)[2]),
            memory,
            ControlStep(k, STEP),
        )
        memory = action.memory
        filtered.append(action.sliding_variable)
        used.append(((memory.weights - ideal) * memory.values).sum(axis=-1))
        distances.append(((memory.weights - ideal) ** 2).sum(axis=-1) / RATE)
        errors.append(position - p)
        before = velocity - v
        position, velocity = moved(position, velocity, action.acceleration, time, gravity)
        hastes.append((velocity - desired(time + STEP)[1] - before) / STEP)
    s, learnt = np.array(filtered), np.array(distances)
    # What acts on the filtered error beside feedback and weights, from its own change.
    residual = (s[1:] - (1.0 - STEP) * s[:-1]) / STEP + np.array(used)[:-1]
    settled, haste = 2000, float(np.abs(np.array(hastes)[2000:]).max())
    # The approximation, the velocity's change within a step by the error, and that of the error itself.
    steepest = 0.2 + 0.4 * 1.5 + 0.1 * 2.7
    declared = left + (0.5 * steepest + SLOPE) * STEP * haste + 1e-3
    assert 0.01 < float(np.abs(residual[settled:]).max()) <= declared < 0.06

    push = declared + LEAKAGE * STEP * math.sqrt(12 * 2.0) * 2.0
    energy = 0.5 * (1.0 + STEP * margin) * s**2 + 0.5 * learnt
    growth = 0.5 * push**2 / margin + 0.5 * LEAKAGE * (ideal**2).sum(axis=-1) / RATE
    decay = min(margin / (1.0 + STEP * margin), LEAKAGE)
    allowed = (1.0 - decay * STEP) * energy[settled:-1] + STEP * growth
    assert np.all(energy[settled + 1 :] <= allowed + 1e-12)

    for axis in range(3):
        bounds = ultimate_bounds(law, declared, ideal[axis], haste)
        assert bounds.filtered_error == pytest.approx(
            math.sqrt(2.0 * growth[axis] / decay / (1.0 + STEP * margin)), rel=1e-9
        )
        late, missed = s[settled:, :, axis], np.array(errors)[settled:, :, axis]
        assert np.abs(late).max() < bounds.filtered_error < 1.0
        assert np.sqrt((late**2).mean(axis=0)).max() < bounds.mean_filtered_error < 0.2
        assert np.abs(missed).max() < bounds.position_error
        assert np.sqrt((missed**2).mean(axis=0)).max() < bounds.mean_position_error < 0.5


PATCHES = {"kind": "partition_of_unity"}
CONSTANT = {**PATCHES, "velocity_patches": 4, "phase_patches": 4, "local_model": "constant"}
GRID = {"kind": "fuzzy_sets", "phase_sets": 7, "disturbance_rate": 0.0}
COMPARED = {
    "four and four constant patches": (CONSTANT, 8, 0.0530, 0.0232),
    "three affine patches of the velocity": ({**PATCHES, "phase_patches": 0}, 6, 0.1031, 0.0753),
    "seven by seven fuzzy sets": (GRID, 49, 0.2576, 0.1665),
}


@pytest.mark.parametrize("name", COMPARED)
def test_further_approximators_of_the_page_have_the_parameters_and_errors_that_it_says(name):
    fields, count, largest, mean = COMPARED[name]
    spec = AdaptiveTrackingSpec(
        weight_rate=RATE, weight_limit=2.0, angular_frequency=FREQUENCY, approximation=fields
    )
    law = spec.build(FlightSetting(MEAN_MOTION, STEP))
    assert int(np.count_nonzero(law.approximator.rates)) == count
    p, v, _ = desired(0.0)
    position, velocity = p + START_ERROR, v
    memory, misses = law.start(Motion(position, velocity)), []
    for k in range(4000):
        time = k * STEP
        p, v, _ = desired(time)
        action = law.act(
            Motion(position, velocity),
            Reference(p, v, desired(time + STEP / 2)[2]),
            memory,
            ControlStep(k, STEP),
        )
        memory = action.memory
        misses.append(float(np.linalg.norm(position - p)))
        position, velocity = moved(position, velocity, action.acceleration, time, gravity)
    late = np.array(misses[2000:])
    assert (late.max(), math.sqrt((late**2).mean())) == pytest.approx((largest, mean), rel=0.02)
