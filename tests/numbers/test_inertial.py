# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import itertools
import json
import math
from datetime import UTC, datetime
from pathlib import Path

import brahe
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from satform.dynamics import orbital_forces
from satform.dynamics.atmosphere import HarrisPriester
from satform.dynamics.cw import HeldInputStep
from satform.dynamics.inertial import InertialDynamics, InertialState
from satform.dynamics.integrators import Adaptive, FixedStep, rk4, rk8
from satform.orbits.chief import ChiefOrbitSpec
from satform.orbits.earth_orientation import without_file
from satform.orbits.frames import ClosedEarthRotation, lvlh_frame
from satform.orbits.time_scales import brahe_epoch

DATA = Path(__file__).parents[1] / "data"
MANIFEST = json.loads((DATA / "manifest.json").read_text())
EARTH = ClosedEarthRotation(float(MANIFEST["closed_rotation"]["theta0_rad"]))
MU = 3.986004415e14
RADIUS = 7e6
MEAN_MOTION = math.sqrt(MU / RADIUS**3)
EPOCH = datetime(2024, 1, 1, tzinfo=UTC)
BOUNDS = {"A": 1e-4, "B": 1e-3, "C": 1e-3}


@pytest.fixture(autouse=True)
def brahes_own_earth_orientation():
    """UT1 = UTC for what brahe itself is asked for here, whatever another test has set."""
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())


def model(degree=0, period=60.0, order=None, chief=None, integrator=None, **options):
    position, velocity = chief or ChiefOrbitSpec(inclination=0.9).state(MEAN_MOTION, MU)
    gravity = orbital_forces.Gravity(degree, degree if order is None else order, EARTH)
    integrator = integrator or FixedStep(rk8(), 60.0)
    model_of_forces = orbital_forces.ForceModel((gravity, *options.pop("forces", ())))
    bodies = options.pop("bodies", ())
    return InertialDynamics(period, model_of_forces, bodies, position, velocity, integrator, **options)


def fly(dynamics, state, steps, command=None):
    count = state.motion.shape[1] - 1
    for step in range(steps):
        state = dynamics.advance(state, np.zeros((count, 3)) if command is None else command, step)
    return state


def state_of(*motions):
    motion = np.array(motions).transpose(1, 0, 2).copy()
    return InertialState(0.0, motion, np.zeros_like(motion))


def kepler(position, velocity, time):
    """Two-body motion in closed form (Lagrange's f and g), in extended precision."""
    position, velocity = position.astype(np.longdouble), velocity.astype(np.longdouble)
    parameter = np.longdouble(MU)
    distance = np.sqrt((position**2).sum())
    semi_major_axis = 1 / (2 / distance - (velocity**2).sum() / parameter)
    mean_motion = np.sqrt(parameter / semi_major_axis**3)
    cosine_part = 1 - distance / semi_major_axis
    sine_part = (position * velocity).sum() / np.sqrt(parameter * semi_major_axis)
    mean = mean_motion * np.longdouble(time)
    angle = mean
    for _ in range(30):
        miss = angle - cosine_part * np.sin(angle) + sine_part * (1 - np.cos(angle)) - mean
        angle -= miss / (1 - cosine_part * np.cos(angle) + sine_part * np.sin(angle))
    f = 1 - semi_major_axis / distance * (1 - np.cos(angle))
    g = np.longdouble(time) - (angle - np.sin(angle)) / mean_motion
    return f * position + g * velocity


@pytest.mark.parametrize("integrator", [FixedStep(rk8(), 60.0), Adaptive(1e-12, 1e-6)], ids=["rk8", "dop853"])
@pytest.mark.parametrize("name", ["A", "B", "C"])
def test_orekits_orbits_are_followed_within_their_bounds(name, integrator):
    setup, bound = MANIFEST["setups"][name], BOUNDS[name]
    rows = np.loadtxt(DATA / f"{name}_ellipse_orekit.csv", delimiter=",", skiprows=1)
    period = rows[-1, 0] - rows[-2, 0]
    starts = [
        [np.array(one["r"], float), np.array(one["v"], float)]
        for one in (setup["chief"], setup["deputies"]["ellipse"])
    ]
    dynamics = model(setup["gravity_degree"], period, integrator=integrator)
    by_time = {round(row[0]): row for row in rows}
    state, compared = state_of(*starts), 0
    for step in range(round(rows[-1, 0] / period) + 1):
        row = by_time.get(round(step * period))
        if row is not None:
            compared += 1
            position, velocity = dynamics.lvlh(state)
            assert np.abs(position[0] - row[13:16]).max() < bound
            assert np.abs(velocity[0] - row[19:22]).max() < 1e-3 * bound
            inertial = np.concatenate((state.motion[0], state.motion[1])).ravel()
            expected = np.concatenate((row[1:4], row[7:10], row[4:7], row[10:13]))
            assert np.abs(inertial - expected).max() < bound
        state = dynamics.advance(state, np.zeros((1, 3)), step)
    assert compared == len(rows)


def test_the_orbit_rate_convention_gives_orekits_other_velocities():
    setup = MANIFEST["setups"]["B"]
    rows = np.loadtxt(DATA / "B_ellipse_orekit.csv", delimiter=",", skiprows=1)[:30]
    starts = [
        [np.array(one["r"], float), np.array(one["v"], float)]
        for one in (setup["chief"], setup["deputies"]["ellipse"])
    ]
    dynamics = model(10, 60.0, exact_rate=False)
    state = state_of(*starts)
    for step, row in enumerate(rows):
        assert np.abs(dynamics.lvlh(state)[1][0] - row[16:19]).max() < 1e-8
        state = dynamics.advance(state, np.zeros((1, 3)), step)
    assert np.abs(rows[:, 16:19] - rows[:, 19:22]).max() > 1e-4


def test_seven_days_of_two_body_motion_stay_within_0_04_mm_of_the_closed_form():
    dynamics = model(period=450.0, integrator=FixedStep(rk8(), 45.0))
    state = dynamics.start(np.array([[500.0, 1732.0, 866.0]]), np.array([[0.93, -1.078, 1.6]]))
    first = state.motion
    absolute, relative = [], []
    for step in range(1344):
        state = dynamics.advance(state, np.zeros((1, 3)), step)
        if step % 10 == 3 or step == 1343:
            chief, deputy = (kepler(first[0, row], first[1, row], state.time) for row in (0, 1))
            absolute += [
                ((state.motion[0, 1] - deputy) ** 2).sum(),
                ((state.motion[0, 0] - chief) ** 2).sum(),
            ]
            relative.append(((state.motion[0, 1] - state.motion[0, 0] - (deputy - chief)) ** 2).sum())
    assert state.time == 7 * 86400.0
    assert math.sqrt(np.mean(absolute)) < 4e-5
    assert math.sqrt(np.mean(relative)) < 1e-5


def test_two_body_motion_conserves_energy_and_angular_momentum():
    dynamics = model(chief=ChiefOrbitSpec(inclination=0.9, eccentricity=0.05).state(MEAN_MOTION, MU))
    start = dynamics.start(np.array([[5e4, 1e5, -2e4]]), np.array([[10.0, -5.0, 3.0]]))
    end = fly(dynamics, start, 200)

    def energy(state):
        return 0.5 * (state.motion[1] ** 2).sum(axis=1) - MU / np.sqrt((state.motion[0] ** 2).sum(axis=1))

    def momentum(state):
        return np.cross(state.motion[0], state.motion[1])

    np.testing.assert_allclose(energy(end), energy(start), rtol=1e-13)
    np.testing.assert_allclose(momentum(end), momentum(start), rtol=1e-13, atol=1e-13 * 5e10)


def test_a_field_symmetric_about_the_axis_conserves_the_axial_momentum_and_energy():
    dynamics = model(degree=2, order=0)
    start = dynamics.start(np.array([[5e2, 1e3, -2e3]]), np.array([[1.0, -0.5, 0.3]]))
    end = fly(dynamics, start, 200)

    def axial_momentum(state):
        (x, y, _), (u, v, _) = state.motion[0].T, state.motion[1].T
        return x * v - y * u

    def energy(state):
        r = np.sqrt((state.motion[0] ** 2).sum(axis=1))
        j2 = 0.484165143790815e-3 * math.sqrt(5.0)
        legendre = 1.5 * (state.motion[0, :, 2] / r) ** 2 - 0.5
        potential = -MU / r * (1.0 - j2 * (6378136.3 / r) ** 2 * legendre)
        return 0.5 * (state.motion[1] ** 2).sum(axis=1) + potential

    np.testing.assert_allclose(axial_momentum(end), axial_momentum(start), rtol=1e-13)
    np.testing.assert_allclose(energy(end), energy(start), rtol=1e-13)
    turned = np.cross(end.motion[0, 0], end.motion[1, 0]) - np.cross(start.motion[0, 0], start.motion[1, 0])
    assert np.linalg.norm(turned) > 1e-3 * 5e10  # the orbit plane does precess


def test_a_small_orbit_tends_to_cw_with_the_square_of_its_size():
    dynamics = model()
    linear = HeldInputStep.over(MEAN_MOTION, 60.0)
    shape = np.array([[0.5, 1.0, 0.8]]), MEAN_MOTION * np.array([[0.5, -1.0, 0.6]])
    errors = []
    for size in (8000.0, 4000.0, 2000.0, 1000.0):
        position, velocity = size * shape[0], size * shape[1]
        state = fly(dynamics, dynamics.start(position, velocity), 97)
        for _ in range(97):
            position, velocity = linear.advance(position, velocity, np.zeros((1, 3)))
        errors.append(np.abs(dynamics.lvlh(state)[0] - position).max())
    rates = [math.log2(large / small) for large, small in itertools.pairwise(errors)]
    assert rates == pytest.approx([2.0, 2.0, 2.0], abs=0.01)


def test_the_leading_departure_from_cw_is_the_second_order_of_gravity():
    dynamics = model(period=1.0, integrator=FixedStep(rk4(), 1.0))
    size = 2e4
    state = fly(dynamics, dynamics.start(np.array([[size, 0.0, 0.0]]), np.zeros((1, 3))), 1)
    rate = dynamics.lvlh(state)[1][0, 0]
    # A satellite at rest a height x above the chief: 3 n^2 x - 3 n^2 x^2/r + 4 n^2 x^3/r^2 - ...
    departure = rate - 3.0 * MEAN_MOTION**2 * size
    assert departure == pytest.approx(-3.0 * MEAN_MOTION**2 * size**2 / RADIUS, rel=0.01)


def test_a_command_held_in_lvlh_moves_a_near_satellite_as_cw_says():
    dynamics = model(period=10.0)
    command = np.array([[2e-6, -1e-6, 3e-6]])
    state = fly(dynamics, dynamics.start(np.zeros((1, 3)), np.zeros((1, 3))), 300, command)
    position, velocity = HeldInputStep.over(MEAN_MOTION, 3000.0).advance(
        np.zeros((1, 3)), np.zeros((1, 3)), command
    )
    found = dynamics.lvlh(state)
    np.testing.assert_allclose(found[0], position, rtol=0.0, atol=1e-5 * np.abs(position).max())
    np.testing.assert_allclose(found[1], velocity, rtol=0.0, atol=1e-5 * np.abs(velocity).max())


@pytest.mark.parametrize("integrator", [FixedStep(rk8(), 60.0), Adaptive(1e-12, 1e-6)], ids=["rk8", "dop853"])
def test_commands_and_perturbations_turn_with_the_chiefs_axes(integrator):
    class Gust:
        def acceleration(self, step, offset):
            return 1e-7 * (step * 60.0 + offset) * np.array([[1.0, -2.0, 3.0]])

    dynamics = model(10, integrator=integrator, perturbations=(Gust(),))
    command = np.array([[1e-3, 2e-3, -1e-3]])
    start = dynamics.start(np.array([[300.0, 1000.0, 200.0]]), np.array([[0.5, -0.6, 0.1]]))
    pull = orbital_forces.Gravity(10, 10, EARTH)

    def rate(time, flat):
        (chief, chief_velocity), (position, velocity) = flat.reshape(2, 2, 3)
        x = chief / np.linalg.norm(chief)
        h = np.cross(chief, chief_velocity)
        z = h / np.linalg.norm(h)
        axes = np.stack((x, np.cross(z, x), z))
        push = axes.T @ (command[0] + 1e-7 * time * np.array([1.0, -2.0, 3.0]))
        gravity = pull.acceleration(time, np.stack((chief, position)), flat, ())
        return np.concatenate((chief_velocity, gravity[0], velocity, gravity[1] + push))

    flown = solve_ivp(
        rate, (0.0, 1200.0), start.motion.transpose(1, 0, 2).ravel(), method="DOP853", rtol=1e-13, atol=1e-7
    )
    expected = flown.y[:, -1].reshape(2, 2, 3).transpose(1, 0, 2)
    found = fly(dynamics, start, 20, command).motion
    assert np.abs(found[0] - expected[0]).max() < 1e-5
    assert np.abs(found[1] - expected[1]).max() < 1e-8


def test_a_keplerian_chief_keeps_to_its_circle_while_satellites_feel_all_forces():
    dynamics = model(10, keplerian_chief=True)
    state = dynamics.start(np.array([[0.0, 1000.0, 0.0]]), np.zeros((1, 3)))
    end = fly(dynamics, state, 100)
    np.testing.assert_allclose(end.motion[0, 0], kepler(*chief_start(dynamics), 6000.0), rtol=0.0, atol=1e-5)
    assert np.linalg.norm(dynamics.lvlh(end)[0]) > 5e3


def chief_start(dynamics):
    return dynamics.chief_position, dynamics.chief_velocity


def test_a_keplerian_chiefs_frame_turns_at_the_mean_motion():
    dynamics = model(10, keplerian_chief=True)
    position, velocity = np.array([[1e3, 2e3, 3e3]]), np.array([[1.0, 2.0, 3.0]])
    frame = lvlh_frame(*chief_start(dynamics))
    np.testing.assert_allclose(frame.rate, [0.0, 0.0, MEAN_MOTION], rtol=1e-14)
    found = dynamics.lvlh(dynamics.start(position, velocity))
    np.testing.assert_allclose(found[0], position, rtol=0.0, atol=5e-9)
    np.testing.assert_allclose(found[1], velocity, rtol=0.0, atol=5e-12)


@pytest.mark.parametrize(
    ("integrator", "count"),
    [(FixedStep(rk8(), 60.0), 100), (FixedStep(rk4(), 10.0), 100), (Adaptive(1e-9, 1e-3), 4)],
)
def test_each_satellite_flies_alone_as_in_company(integrator, count):
    generator = np.random.default_rng(4)
    dynamics = model(10, integrator=integrator)
    position, velocity = 1e3 * generator.normal(size=(count, 3)), generator.normal(size=(count, 3))
    command = 1e-4 * generator.normal(size=(count, 3))
    stacked = dynamics.lvlh(fly(dynamics, dynamics.start(position, velocity), 3, command))
    for row in (0, count // 2, count - 1):
        one = slice(row, row + 1)
        single = dynamics.lvlh(fly(dynamics, dynamics.start(position[one], velocity[one]), 3, command[one]))
        assert single[0].tobytes() == stacked[0][one].tobytes()
        assert single[1].tobytes() == stacked[1][one].tobytes()


BODY = orbital_forces.Body(
    mass=150.0, drag_area=2.0, drag_coefficient=2.2, radiation_area=3.0, reflectivity=1.5
)
LOW_ORBIT = ChiefOrbitSpec(inclination=0.9).state(math.sqrt(MU / 6.778e6**3), MU)


def after_45_minutes(epoch, others):
    model_of_forces = orbital_forces.ForceModel(
        (orbital_forces.Gravity(8, 8, orbital_forces.FullEarthRotation(epoch)), *others)
    )
    dynamics = InertialDynamics(60.0, model_of_forces, (BODY,), *LOW_ORBIT, FixedStep(rk8(), 5.0))
    return fly(dynamics, state_of(LOW_ORBIT), 45, np.zeros((0, 3))).motion[0, 0]


def by_brahe_after_45_minutes(epoch, **others):
    config = brahe.ForceModelConfig(
        gravity=brahe.GravityConfiguration(degree=8, order=8),
        mass=brahe.ParameterSource.value(150.0),
        frame_transform=brahe.FrameTransformationModel.FULL_EARTH_ROTATION,
        **others,
    )
    method = brahe.NumericalPropagationConfig.with_method(brahe.IntegrationMethod.RK4).with_initial_step(2.0)
    peer = brahe.NumericalOrbitPropagator(epoch, np.concatenate(LOW_ORBIT), method, config, np.array([150.0]))
    peer.propagate_to(epoch + 2700.0)
    return peer.current_state()[:3]


def test_brahes_own_propagator_agrees_about_sun_moon_and_sunlight():
    epoch, value = brahe_epoch(EPOCH), brahe.ParameterSource.value
    low = brahe.EphemerisSource.LowPrecision
    peer = by_brahe_after_45_minutes(
        epoch,
        srp=brahe.SolarRadiationPressureConfiguration(value(3.0), value(1.5), brahe.EclipseModel.CONICAL),
        third_body=[
            brahe.ThirdBodyConfiguration(one, low) for one in (brahe.ThirdBody.SUN, brahe.ThirdBody.MOON)
        ],
    )
    others = (orbital_forces.ThirdBodies(epoch, sun=True, moon=True), orbital_forces.SolarPressure(epoch))
    assert np.abs(peer - after_45_minutes(epoch, others)).max() < 1e-4
    assert np.abs(peer - after_45_minutes(epoch, ())).max() > 0.1


def test_brahes_own_propagator_agrees_about_drag_to_one_part_in_a_hundred():
    # brahe's propagator asks for the density at inertial coordinates, here it is asked for in the true
    # equator of date, to which the atmosphere belongs: a tenth of a percent of the density.
    epoch, value = brahe_epoch(EPOCH), brahe.ParameterSource.value
    peer = by_brahe_after_45_minutes(
        epoch,
        drag=brahe.DragConfiguration(brahe.AtmosphericModel.HARRIS_PRIESTER, value(2.0), value(2.2)),
    )
    equator = without_file().inertial_to_equator_of_date(epoch)
    drag = orbital_forces.Drag(HarrisPriester(epoch, equator), equator)
    effect = np.abs(peer - after_45_minutes(epoch, ())).max()
    assert effect > 1.0
    assert np.abs(peer - after_45_minutes(epoch, (drag,))).max() < 1e-2 * effect
