# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from satform.dynamics.cw import propagate
from satform.dynamics.cw_perturbed import (
    CwPerturbedDynamics,
    PropagatedChiefDynamics,
    differential_central_gravity,
)
from satform.dynamics.integrators import TABLEAUS, FixedStep, exponential_step
from satform.dynamics.orbital_forces import Gravity
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.truth_models import CwDynamicsSpec, CwPerturbedDynamicsSpec, InertialDynamicsSpec
from satform.orbits.chief import ChiefOrbitSpec, CircularChief
from satform.orbits.frames import ClosedEarthRotation

DATA = Path(__file__).parents[1] / "data"
MANIFEST = json.loads((DATA / "manifest.json").read_text())
ROTATION = ClosedEarthRotation(float(MANIFEST["closed_rotation"]["theta0_rad"]))


class Gust:
    """A perturbation that grows in time and differs between satellites."""

    def acceleration(self, step, offset):
        return 1e-8 * (step * 60.0 + offset) * np.array([[1.0, -2.0, 3.0], [0.5, 0.0, -1.0]])


def chief_of(name):
    setup = MANIFEST["setups"][name]
    orbit = ChiefOrbitSpec(
        inclination=math.radians(setup["inc_deg"]),
        right_ascension=math.radians(setup["raan_deg"]),
        argument_of_latitude=math.radians(setup["arg_lat_deg"]),
    )
    return CircularChief(orbit, setup["a_m"], float(setup["n_rad_s"]))


def model(name, degree, period, *, method="rk4", perturbations=()):
    chief = chief_of(name)
    substep = exponential_step(TABLEAUS[method](), chief.mean_motion, period)
    return CwPerturbedDynamics(period, chief, Gravity(degree, degree, ROTATION), substep, 1, perturbations)


@pytest.mark.parametrize("name", ["A", "B", "C"])
def test_the_chiefs_elements_give_the_chiefs_state(name):
    chief, start = chief_of(name), MANIFEST["setups"][name]["chief"]
    position, velocity = chief.orbit.state(chief.mean_motion, MANIFEST["mu"])
    np.testing.assert_allclose(position, np.array(start["r"], dtype=float), rtol=0.0, atol=2e-8)
    np.testing.assert_allclose(velocity, np.array(start["v"], dtype=float), rtol=0.0, atol=1e-11)
    frame = chief.frame(0.0)
    np.testing.assert_allclose(frame.origin_position, position, rtol=0.0, atol=2e-8)
    np.testing.assert_allclose(frame.origin_velocity, velocity, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize(("name", "period"), [("B", 10.0), ("C", 60.0)])
def test_motion_stays_within_ten_micrometres_of_the_reference_file(name, period):
    rows = np.loadtxt(DATA / f"plant_{name}_ellipse.csv", delimiter=",")
    dynamics = model(name, 10, period)
    state = dynamics.start(rows[:1, 1:4], rows[:1, 4:7])
    for step, row in enumerate(rows):
        assert row[0] == step * period
        position, velocity = dynamics.lvlh(state)
        assert np.abs(position[0] - row[1:4]).max() < 1e-5
        assert np.abs(velocity[0] - row[4:7]).max() < 1e-8
        state = dynamics.advance(state, np.zeros((1, 3)), step)


@pytest.mark.parametrize("method", ["rk4", "rk8"])
def test_without_harmonics_any_step_follows_the_closed_form(method):
    dynamics = model("B", 0, 3000.0, method=method)
    position, velocity = np.array([[500.0, 1700.0, 300.0]]), np.array([[0.9, -1.1, 0.3]])
    state = dynamics.start(position, velocity)
    for step in range(3):
        state = dynamics.advance(state, np.zeros((1, 3)), step)
    expected = propagate(position, velocity, dynamics.chief.mean_motion, 9000.0)
    # Central gravity less central gravity is zero; adding it must not move anything.
    np.testing.assert_allclose(dynamics.lvlh(state)[0], expected[0], rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(dynamics.lvlh(state)[1], expected[1], rtol=0.0, atol=1e-10)


def test_commands_and_perturbations_act_as_in_an_independent_integration():
    dynamics = model("B", 4, 60.0, method="rk8", perturbations=(Gust(),))
    n = dynamics.chief.mean_motion
    position = np.array([[500.0, 1700.0, 300.0], [-200.0, 100.0, 50.0]])
    velocity = np.array([[0.9, -1.1, 0.3], [0.0, 0.4, 0.1]])
    command = np.array([[1e-4, 2e-4, -1e-4], [0.0, -1e-4, 3e-4]])

    def rate(time, flat):
        (x, v) = flat.reshape(2, 2, 3)
        linear = np.stack((3 * n * n * x[:, 0] + 2 * n * v[:, 1], -2 * n * v[:, 0], -n * n * x[:, 2]), axis=1)
        gust = 1e-8 * time * np.array([[1.0, -2.0, 3.0], [0.5, 0.0, -1.0]])
        return np.stack((v, linear + command + gust + dynamics.differential_gravity(time, x))).ravel()

    flown = solve_ivp(
        rate, (0.0, 600.0), np.stack((position, velocity)).ravel(), method="DOP853", rtol=1e-12, atol=1e-9
    )
    state = dynamics.start(position, velocity)
    for step in range(10):
        state = dynamics.advance(state, command, step)
    found = np.stack(dynamics.lvlh(state))
    np.testing.assert_allclose(found, flown.y[:, -1].reshape(2, 2, 3), rtol=0.0, atol=1e-8)


def test_differential_gravity_at_the_chief_is_zero_and_grows_with_distance():
    dynamics = model("B", 10, 10.0)
    at = np.array([[0.0, 0.0, 0.0], [1000.0, 0.0, 0.0], [2000.0, 0.0, 0.0]])
    none, near, far = np.linalg.norm(dynamics.differential_gravity(500.0, at), axis=1)
    assert none == 0.0
    assert far / near == pytest.approx(2.0, rel=1e-2)


def assert_each_flies_alone_as_in_company(dynamics, seed, count):
    """A few of many satellites get the same bits when they fly by themselves for three steps."""
    generator = np.random.default_rng(seed)
    position, velocity = 1e3 * generator.normal(size=(count, 3)), generator.normal(size=(count, 3))
    command = 1e-4 * generator.normal(size=(count, 3))
    stacked = dynamics.start(position, velocity)
    for step in range(3):
        stacked = dynamics.advance(stacked, command, step)
    for row in (0, count // 3, count - 1):
        one = slice(row, row + 1)
        single = dynamics.start(position[one], velocity[one])
        for step in range(3):
            single = dynamics.advance(single, command[one], step)
        for found, expected in zip(dynamics.lvlh(single), dynamics.lvlh(stacked), strict=True):
            assert found.tobytes() == expected[one].tobytes()


def test_each_satellite_flies_alone_as_in_company():
    assert_each_flies_alone_as_in_company(model("B", 10, 10.0), 2, 50)


def propagated(name, degree, period, perturbations=()):
    start = MANIFEST["setups"][name]["chief"]
    return PropagatedChiefDynamics(
        period=period,
        gravity=Gravity(degree, degree, ROTATION),
        chief_position=np.array(start["r"], dtype=float),
        chief_velocity=np.array(start["v"], dtype=float),
        integrator=FixedStep(TABLEAUS["rk8"](), period),
        perturbations=perturbations,
    )


@pytest.mark.parametrize(("name", "degree", "period"), [("A", 0, 60.0), ("B", 10, 60.0), ("C", 10, 600.0)])
def test_about_a_propagated_chief_it_follows_orekit_within_a_tenth_of_a_millimetre(name, degree, period):
    rows = np.loadtxt(DATA / f"{name}_ellipse_orekit.csv", delimiter=",", skiprows=1)
    assert rows[1, 0] == period
    dynamics = propagated(name, degree, period)
    state = dynamics.start(rows[:1, 13:16], rows[:1, 19:22])
    for step, row in enumerate(rows):
        assert row[0] == step * period
        position, velocity = dynamics.lvlh(state)
        assert np.abs(position[0] - row[13:16]).max() < 1e-4
        assert np.abs(velocity[0] - row[19:22]).max() < 1e-7
        state = dynamics.advance(state, np.zeros((1, 3)), step)


@pytest.mark.parametrize("inclination", [0.1, 0.9, 1.57])
def test_it_is_truer_than_cw_whatever_the_motion(inclination):
    # A follower on either side, the 2:1 ellipse, a satellite abeam: where J2 cancels and where it does not.
    rate = math.sqrt(MANIFEST["mu"] / 7.0e6**3)
    steps, period = 60, 2.0 * math.tau / rate / 60
    position = np.array([[0.0, 1e3, 0.0], [0.0, -1e3, 0.0], [500.0, 0.0, 0.0], [0.0, 0.0, 1e3]])
    velocity = np.zeros((4, 3))
    velocity[2, 1] = -2.0 * rate * 500.0

    def fly(spec):
        dynamics = spec.build(DynamicsSetting(rate, period, 4))
        state, flown = dynamics.start(position, velocity), []
        for step in range(steps):
            state = dynamics.advance(state, np.zeros((4, 3)), step)
            flown.append(dynamics.lvlh(state)[0])
        return np.array(flown)

    chief = {"inclination": inclination}
    truth = fly(InertialDynamicsSpec(chief=chief, gravity={"degree": 10}))

    def error(spec):
        return np.linalg.norm(fly(spec) - truth, axis=-1).max(axis=0)

    by_cw = error(CwDynamicsSpec())
    assert (error(CwPerturbedDynamicsSpec(chief=chief, gravity={"degree": 2})) < 0.25 * by_cw).all()
    assert (error(CwPerturbedDynamicsSpec(chief=chief, gravity={"degree": 10})) < 1e-5).all()


def test_about_an_eccentric_chief_it_follows_two_body_motion():
    mu, rate = MANIFEST["mu"], math.sqrt(MANIFEST["mu"] / 9.0e6**3)
    orbit = {"eccentricity": 0.2, "argument_of_perigee": 0.5, "argument_of_latitude": 0.9}
    spec = CwPerturbedDynamicsSpec(chief=orbit, gravity={"degree": 0})
    dynamics = spec.build(DynamicsSetting(rate, 60.0, 1))
    position, velocity = np.array([[500.0, -3000.0, 800.0]]), np.array([[0.5, -0.9, 0.3]])
    chief = np.concatenate(spec.chief.state(rate, mu))
    radial, normal = chief[:3], np.cross(chief[:3], chief[3:])
    axes = np.array([radial, np.cross(normal, radial), normal])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    turn = np.array([0.0, 0.0, np.linalg.norm(normal) / (radial @ radial)])
    deputy = chief + np.concatenate((position[0] @ axes, (velocity[0] + np.cross(turn, position[0])) @ axes))

    def kepler(_, state):
        return np.concatenate((state[3:], -mu * state[:3] / np.linalg.norm(state[:3]) ** 3))

    end = [
        solve_ivp(kepler, (0.0, 6000.0), one, method="DOP853", rtol=1e-13, atol=1e-7).y[:, -1]
        for one in (chief, deputy)
    ]
    state = dynamics.start(position, velocity)
    for step in range(100):
        state = dynamics.advance(state, np.zeros((1, 3)), step)
    apart = np.linalg.norm(end[1][:3] - end[0][:3])
    assert np.linalg.norm(dynamics.lvlh(state)[0]) == pytest.approx(apart, abs=1e-4)
    np.testing.assert_allclose(state.motion[0, 0], end[0][:3], rtol=0.0, atol=1e-4)


def test_the_difference_of_central_gravity_keeps_its_digits():
    mu, radius = 3.986004415e14, 7.0e6
    # Nearby it is the gravity gradient, of which subtracting two large vectors leaves few digits.
    near = np.array([[1e-3, 2e-3, -1e-3]])
    gradient = mu / radius**3 * near * np.array([2.0, -1.0, -1.0])
    np.testing.assert_allclose(differential_central_gravity(near, radius, mu), gradient, rtol=1e-9)
    far = np.array([[2e5, -3e5, 1e5]])
    chief = np.array([radius, 0.0, 0.0])
    whole = -mu * (chief + far) / np.linalg.norm(chief + far) ** 3 + mu * chief / radius**3
    np.testing.assert_allclose(differential_central_gravity(far, radius, mu), whole, rtol=1e-13)


def test_about_a_propagated_chief_too_each_satellite_flies_alone_as_in_company():
    assert_each_flies_alone_as_in_company(propagated("B", 4, 10.0), 3, 20)
