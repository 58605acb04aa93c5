# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Sliding-mode tracking under two-body motion and oblateness, against independently computed figures."""

import math

import numpy as np
import pytest

from satform.control.protocol import ControlStep, FlightSetting, Motion
from satform.control.sliding_mode import SlidingModeSpec
from satform.dynamics import cw, orbital_forces
from satform.dynamics.inertial import InertialDynamics
from satform.dynamics.integrators import FixedStep, rk4
from satform.numeric import stacking
from satform.orbits.chief import ChiefOrbitSpec
from satform.orbits.curve_specs import EllipseSpec
from satform.orbits.frames import ClosedEarthRotation, lvlh_frame
from satform.orbits.path_reference import Path, Reference

pytestmark = pytest.mark.unmeasured

PERIOD = 6000.0
MEAN_MOTION = 2.0 * math.pi / PERIOD
STEP = 0.5
SETTLED = 600.0
CENTRES = [(0.0, 0.0, 0.0), (0.0, 0.0, 1e5), (0.0, 1e5, 0.0), (0.0, 0.0, -1e5)]
SEMI_MAJOR = [200e3, 100e3, 75e3, 100e3]


def paths():
    return [
        Path(
            EllipseSpec(
                centre=centre, first_axis=(0.0, size, 0.0), second_axis=(size / 2.0, 0.0, 0.0)
            ).build(),
            scale=np.array(1.0),
        )
        for centre, size in zip(CENTRES, SEMI_MAJOR, strict=True)
    ]


def truth(degree):
    gravity = orbital_forces.ForceModel((orbital_forces.Gravity(degree, 0, ClosedEarthRotation(0.0)),))
    position, velocity = ChiefOrbitSpec(inclination=math.pi / 4.0).state(
        MEAN_MOTION, orbital_forces.gravitational_parameter()
    )
    return InertialDynamics(
        STEP, gravity, (), position, velocity, FixedStep(rk4(), STEP), keplerian_chief=True, exact_rate=False
    )


def disturbance(dynamics, state, position, velocity):
    """What the truth adds to the CW equations, from the accelerations in inertial space."""
    at, chief = state.motion[0, 1:], state.motion[0, 0]
    own = dynamics.forces.acceleration(state.time, at, at, ())
    central = -orbital_forces.gravitational_parameter() * chief / np.linalg.norm(chief) ** 3
    relative = lvlh_frame(chief, state.motion[1, 0]).vector_to_lvlh(own - central)
    turning = np.array([0.0, 0.0, MEAN_MOTION])
    relative -= 2.0 * np.cross(turning, velocity) + np.cross(turning, np.cross(turning, position))
    return np.linalg.norm(relative - cw.acceleration(position, velocity, MEAN_MOTION), axis=1)


@pytest.fixture(scope="module")
def flight():
    """Largest disturbance, largest error and mean command of each satellite over a settled lap."""
    path = stacking.stack(paths())
    controller = SlidingModeSpec(boundary_layer=0.1).build(FlightSetting(mean_motion=MEAN_MOTION, step=STEP))
    dynamics = truth(2)
    rate = path.curve.perimeter / PERIOD
    still = np.zeros(4)
    start = path.reference(still, rate, still)
    state = dynamics.start(start.position, start.velocity)
    steps = round((PERIOD + SETTLED) / STEP)
    desired = path.at_step(rate * (STEP * np.arange(steps))[:, None], rate, still, STEP)
    disturbances, errors, commands = [], [], []
    for step in range(steps):
        position, velocity = dynamics.lvlh(state)
        reference = Reference(desired.position[step], desired.velocity[step], desired.acceleration[step])
        command = controller.act(
            Motion(position, velocity), reference, None, ControlStep(step, STEP)
        ).acceleration
        if step * STEP >= SETTLED:
            errors.append(np.linalg.norm(position - reference.position, axis=1))
            commands.append(np.linalg.norm(command, axis=1))
            if step % 20 == 0:
                disturbances.append(disturbance(dynamics, state, position, velocity))
        state = dynamics.advance(state, command, step)
    return np.max(disturbances, axis=0), np.max(errors, axis=0), np.mean(commands, axis=0)


def test_the_disturbance_of_truth_is_that_of_the_independent_computation(flight):
    np.testing.assert_allclose(flight[0], [0.01076, 0.01006, 0.01253, 0.01447], rtol=0.02)


def test_the_tracking_error_under_truth_is_that_of_the_independent_computation(flight):
    np.testing.assert_allclose(flight[1], [0.972, 0.903, 1.127, 1.304], rtol=0.05)


def test_the_mean_command_under_truth_is_that_of_the_independent_computation(flight):
    assert flight[2][0] == pytest.approx(0.0937, rel=0.05)


def test_without_oblateness_only_the_second_order_of_gravity_disturbs():
    dynamics = truth(0)
    path = paths()[0]
    largest = 0.0
    for lap in np.linspace(0.0, 1.0, 200, endpoint=False):
        xi = path.curve.perimeter * lap
        reference = path.reference(xi, path.curve.perimeter / PERIOD, np.zeros(()))
        state = dynamics.start(reference.position[None], reference.velocity[None])
        found = disturbance(dynamics, state, reference.position[None], reference.velocity[None])
        largest = max(largest, float(found[0]))
    assert largest == pytest.approx(0.00922, rel=0.02)
