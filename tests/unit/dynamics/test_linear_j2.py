# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear relative motion under J2 against secular rates of the orbit and against inertial propagation."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp

from satform.dynamics.linear_j2 import CrossTrack, InPlaneStep, J2Rates
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.truth_models import CwDynamicsSpec, InertialDynamicsSpec, LinearJ2DynamicsSpec
from satform.orbits.chief import ChiefOrbitSpec

MU, RADIUS, J2 = 3.986004418e14, 6378137.0, 1.08262668e-3
SEMI_MAJOR_AXIS = 7.0e6
MEAN_MOTION = math.sqrt(MU / SEMI_MAJOR_AXIS**3)
PERIOD = math.tau / MEAN_MOTION
STRENGTH = J2 * (RADIUS / SEMI_MAJOR_AXIS) ** 2


def fly(dynamics, position, velocity, steps, command=None):
    state = dynamics.start(position, velocity)
    held = np.zeros_like(position) if command is None else command
    flown = []
    for step in range(steps):
        state = dynamics.advance(state, held, step)
        flown.append(dynamics.lvlh(state)[0].copy())
    return np.array(flown)


def build(inclination, step, latitude=0.0, count=1, **fields):
    spec = LinearJ2DynamicsSpec(
        chief={"inclination": inclination, "argument_of_latitude": latitude}, **fields
    )
    return spec.build(DynamicsSetting(MEAN_MOTION, step, count))


def equations(rates, latitude, command):
    """Right-hand side of the equations as the paper has them, for scipy."""

    def rate(time, state):
        x, _, z, vx, vy, vz = state
        ax = 2.0 * rates.orbit_rate * vy + rates.stiffness * x + command[0]
        ay = -2.0 * rates.orbit_rate * vx + command[1]
        # z = X sin u - Y cos u, with X held by gravity and Y drifting in proportion to X.
        u, k, w = latitude + rates.latitude_rate * time, rates.latitude_rate, rates.plane_rate
        plane = np.linalg.solve(
            [[math.sin(u), -math.cos(u)], [(k - w) * math.cos(u), k * math.sin(u)]], [z, vz]
        )
        drift = plane[0] * (-k * k * math.sin(u) + 2.0 * k * w * math.sin(u)) + plane[1] * k * k * math.cos(u)
        return [vx, vy, vz, ax, ay, drift + command[2]]

    return rate


@pytest.mark.parametrize("step", [1.0, 60.0, 3000.0])
def test_any_step_follows_the_equations_integrated_by_scipy(step):
    command = np.array([1e-5, -2e-5, 3e-5])
    dynamics = build(0.9, step, latitude=0.4)
    start = np.array([300.0, -500.0, 200.0, 0.1, -0.7, 0.3])
    steps = round(6000.0 / step)
    flown = fly(dynamics, start[None, :3], start[None, 3:], steps, command[None])[-1, 0]
    expected = solve_ivp(
        equations(dynamics.rates, 0.4, command), (0.0, 6000.0), start, method="DOP853", rtol=1e-12, atol=1e-9
    )
    np.testing.assert_allclose(flown, expected.y[:3, -1], rtol=0.0, atol=2e-6)


def test_without_oblateness_it_is_the_cw_solution():
    # Far away oblateness is nothing: its rates fall with the square of the radius.
    far = math.sqrt(MU / 7.0e12**3)
    setting = DynamicsSetting(far, 0.01 / far, 1)
    position, velocity = np.array([[300.0, -500.0, 200.0]]), np.array([[0.1, -0.7, 0.3]]) * far / 1e-3
    cw = fly(CwDynamicsSpec().build(setting), position, velocity, 600)
    linear = fly(LinearJ2DynamicsSpec().build(setting), position, velocity, 600)
    np.testing.assert_allclose(linear, cw, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("inclination", [0.1, 0.9, 1.57])
def test_the_eccentricity_vector_turns_at_the_secular_rate_of_the_perigee(inclination):
    # Vallado, secular effects of J2: the argument of perigee drifts by 3/4 n J2 (R/a)^2 (5 cos^2 i - 1)
    # against the node, so that the argument of latitude outruns the radial oscillation by as much.
    rates = J2Rates.of(MEAN_MOTION, inclination)
    radial = math.sqrt(4.0 * rates.orbit_rate**2 - rates.stiffness)
    perigee = 0.75 * MEAN_MOTION * STRENGTH * (5.0 * math.cos(inclination) ** 2 - 1.0)
    assert rates.latitude_rate - radial == pytest.approx(perigee, abs=2e-6 * MEAN_MOTION)


@pytest.mark.parametrize("inclination", [0.5, 0.9, 1.57])
def test_orbit_planes_drift_apart_by_the_difference_of_their_nodal_rates(inclination):
    # Vallado: the node drifts by -3/2 n J2 (R/a)^2 cos i. A satellite whose plane is inclined by more
    # crosses the chief's plane at its node at first, and 15 revolutions later by sin i times the
    # difference of the nodes away from it.
    more = 1000.0 / SEMI_MAJOR_AXIS
    rates = J2Rates.of(MEAN_MOTION, inclination)
    revolutions = 15.0 * math.tau / rates.latitude_rate
    z, _, _, _ = CrossTrack(rates, 0.0).transition(0.0, revolutions)
    start = np.array([0.0, 1000.0 * (rates.latitude_rate - rates.plane_rate)])
    assert z == pytest.approx(1.0, abs=1e-9)
    end = CrossTrack(rates, 0.0).transition(0.0, revolutions)[1] * start[1]

    def node(i):
        return -1.5 * MEAN_MOTION * STRENGTH * math.cos(i)

    apart = (node(inclination + more) - node(inclination)) * revolutions
    assert end == pytest.approx(-SEMI_MAJOR_AXIS * math.sin(inclination) * apart, rel=1e-3)


def mean_circular_start(inclination, latitude, node=0.0):
    """Inertial state on the orbit whose mean is the circle: first-order short-period terms of J2.

    The forced solution of the CW equations under the periodic part of the J2 acceleration, of twice the
    argument of latitude: K/4 cos 2u radially, K/8 sin 2u along-track, K = J2 R^2 sin^2 i / a.
    """
    k = J2 * RADIUS**2 * math.sin(inclination) ** 2 / SEMI_MAJOR_AXIS
    rates = J2Rates.of(MEAN_MOTION, inclination)
    orbit = ChiefOrbitSpec(inclination=inclination, right_ascension=node, argument_of_latitude=latitude)
    ahead = k / 8.0 * math.sin(2.0 * latitude) / SEMI_MAJOR_AXIS
    radial, transverse, _ = orbit.axes(latitude + ahead)
    radius = SEMI_MAJOR_AXIS + k / 4.0 * math.cos(2.0 * latitude)
    speed = rates.orbit_rate * radius + MEAN_MOTION * k / 4.0 * math.cos(2.0 * latitude)
    return radius * radial, -MEAN_MOTION * k / 2.0 * math.sin(2.0 * latitude) * radial + speed * transverse


@pytest.mark.parametrize("degree", [2, 10])
@pytest.mark.parametrize("inclination", [0.5, 0.9, 1.57])
def test_separated_nodes_follow_inertial_propagation_where_cw_does_not(inclination, degree):
    # The two planes cross at the poles of the orbit: purely cross-track motion at the frequency k.
    steps, step = 480, 4.0 * PERIOD / 480
    gravity = {"degree": degree, "order": 0 if degree == 2 else degree}
    spec = InertialDynamicsSpec(gravity=gravity, integrator={"kind": "rk8", "maximum_step": 60.0})
    chief_position, chief_velocity = mean_circular_start(inclination, 0.0)
    truth = replace(
        spec.build(DynamicsSetting(MEAN_MOTION, step, 1)),
        chief_position=chief_position,
        chief_velocity=chief_velocity,
    )
    apart = 1000.0 / (SEMI_MAJOR_AXIS * math.sin(inclination))
    # Back by cos i times the node's turn, so that the satellite is abeam of the chief.
    deputy = mean_circular_start(inclination, -apart * math.cos(inclination), node=apart)
    frame = truth._frame(0.0, chief_position, chief_velocity)
    position, velocity = (part[None] for part in frame.to_lvlh(*deputy))
    expected = fly(truth, position, velocity, steps)[:, 0, 2]
    setting = DynamicsSetting(MEAN_MOTION, step, 1)
    linear = LinearJ2DynamicsSpec(chief={"inclination": inclination}).build(setting)
    found = fly(linear, position, velocity, steps)[:, 0, 2]
    textbook = fly(CwDynamicsSpec().build(setting), position, velocity, steps)[:, 0, 2]
    missed, by_cw = np.abs(found - expected).max(), np.abs(textbook - expected).max()
    assert missed < 8.0
    assert missed < 0.7 * by_cw


def test_perturbations_act_as_the_same_command_would():
    push = (1e-5, -2e-5, 3e-5)
    position, velocity = np.array([[300.0, -500.0, 200.0]]), np.array([[0.1, -0.7, 0.3]])
    perturbed = build(0.9, 30.0, perturbations=({"kind": "constant", "acceleration": push},))
    one = fly(perturbed, position, velocity, 20)
    other = fly(build(0.9, 30.0), position, velocity, 20, np.array([push]))
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9)


def test_each_satellite_flies_alone_as_in_company():
    generator = np.random.default_rng(5)
    position, velocity = 1e3 * generator.normal(size=(20, 3)), generator.normal(size=(20, 3))
    command = 1e-4 * generator.normal(size=(20, 3))
    push = tuple(1e-6 * generator.normal(size=3))
    dynamics = build(0.9, 10.0, count=20, perturbations=({"kind": "constant", "acceleration": push},))
    stacked = fly(dynamics, position, velocity, 3, command)
    single = build(0.9, 10.0, perturbations=({"kind": "constant", "acceleration": push},))
    for row in (0, 7, 19):
        one = slice(row, row + 1)
        assert (
            fly(single, position[one], velocity[one], 3, command[one]).tobytes() == stacked[:, one].tobytes()
        )


def test_an_eccentric_mean_orbit_is_refused():
    with pytest.raises(ValidationError, match="linear_j2 is about a circular mean orbit"):
        LinearJ2DynamicsSpec(chief={"eccentricity": 0.1})


def test_in_plane_motion_leaves_the_orbit_normal_alone():
    step = InPlaneStep.over(J2Rates.of(MEAN_MOTION, 0.9), 60.0)
    position, velocity = step.advance(np.array([[1.0, 2.0, 3.0]]), np.ones((1, 3)), np.ones((1, 3)))
    assert position[0, 2] == velocity[0, 2] == 0.0
