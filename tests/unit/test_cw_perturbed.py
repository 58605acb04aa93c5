import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from satform.dynamics.chief import ChiefOrbitSpec, CircularChief
from satform.dynamics.cw import propagate
from satform.dynamics.cw_perturbed import CwPerturbedDynamics
from satform.dynamics.forces import Gravity
from satform.dynamics.integrators import TABLEAUS, exponential_step
from satform.frames import ClosedEarthRotation

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


def test_each_satellite_flies_alone_as_in_company():
    generator = np.random.default_rng(2)
    dynamics = model("B", 10, 10.0)
    position, velocity = 1e3 * generator.normal(size=(50, 3)), generator.normal(size=(50, 3))
    command = 1e-4 * generator.normal(size=(50, 3))
    together = dynamics.start(position, velocity)
    for step in range(3):
        together = dynamics.advance(together, command, step)
    for row in (0, 17, 49):
        one = slice(row, row + 1)
        alone = dynamics.start(position[one], velocity[one])
        for step in range(3):
            alone = dynamics.advance(alone, command[one], step)
        assert alone.motion.tobytes() == together.motion[one].tobytes()
