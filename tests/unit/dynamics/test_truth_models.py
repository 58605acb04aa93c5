# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from satform.common.spec import specs
from satform.dynamics.cw import propagate
from satform.dynamics.inertial import InertialDynamics
from satform.dynamics.integrators import Adaptive, FixedStep
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.specs import GravitySpec
from satform.dynamics.truth_models import CwDynamicsSpec, CwPerturbedDynamicsSpec, InertialDynamicsSpec
from satform.orbits.chief import as_utc, semi_major_axis_of

DATA = Path(__file__).parents[2] / "data"
MANIFEST = json.loads((DATA / "manifest.json").read_text())
MEAN_MOTION = float(MANIFEST["setups"]["B"]["n_rad_s"])
POSITION = np.array([[5.0, 17.0, 3.0], [-2.0, 1.0, 0.5]])
VELOCITY = np.array([[9e-3, -1.1e-2, 3e-3], [0.0, 4e-3, 1e-3]])


def setting(step=10.0, count=2):
    return DynamicsSetting(mean_motion=MEAN_MOTION, step=step, satellite_count=count, seed=3)


def fly(spec, steps, step=10.0, command=None):
    dynamics = spec.build(setting(step))
    state = dynamics.start(POSITION, VELOCITY)
    held = np.zeros((2, 3)) if command is None else command
    for index in range(steps):
        state = dynamics.advance(state, held, index)
    return dynamics.lvlh(state)


def test_the_truth_models_are_registered():
    assert set(specs("satform.dynamics")) >= {"cw", "linear_j2", "cw_perturbed", "inertial"}


@pytest.mark.parametrize("step", [1.0, 100.0, 3000.0])
def test_cw_is_exact_whatever_its_step(step):
    found = fly(CwDynamicsSpec(), round(6000.0 / step), step)
    expected = propagate(POSITION, VELOCITY, MEAN_MOTION, 6000.0)
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-11)
    np.testing.assert_allclose(found[1], expected[1], rtol=1e-10, atol=1e-14)


@pytest.mark.parametrize("spec", [CwDynamicsSpec, CwPerturbedDynamicsSpec, InertialDynamicsSpec])
def test_a_constant_perturbation_moves_satellites_as_the_same_command_would(spec):
    push = (1e-5, -2e-5, 3e-5)
    half = {"kind": "constant", "acceleration": tuple(0.5 * one for one in push)}
    perturbed = fly(spec(perturbations=(half, half)), 20)
    commanded = fly(spec(), 20, command=np.array([push, push]))
    np.testing.assert_allclose(perturbed[0], commanded[0], rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(perturbed[1], commanded[1], rtol=0.0, atol=1e-10)
    assert np.abs(perturbed[0] - fly(spec(), 20)[0]).max() > 0.1


def test_without_harmonics_the_three_models_agree_about_a_small_orbit():
    cw = fly(CwDynamicsSpec(), 100)
    ideal = fly(CwPerturbedDynamicsSpec(gravity={"degree": 0}, chief_motion="circular"), 100)
    perturbed = fly(CwPerturbedDynamicsSpec(gravity={"degree": 0}), 100)
    inertial = fly(InertialDynamicsSpec(gravity={"degree": 0}), 100)
    np.testing.assert_allclose(ideal[0], cw[0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(perturbed[0], inertial[0], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(inertial[0], cw[0], rtol=0.0, atol=1e-4)


def test_the_scenarios_fields_give_the_reference_setup():
    setup = MANIFEST["setups"]["B"]
    spec = InertialDynamicsSpec(
        chief={
            "inclination": math.radians(setup["inc_deg"]),
            "right_ascension": math.radians(setup["raan_deg"]),
            "argument_of_latitude": math.radians(setup["arg_lat_deg"]),
        },
        frame_rate="orbit_rate",
    )
    rows = np.loadtxt(DATA / "B_ellipse_orekit.csv", delimiter=",", skiprows=1)
    dynamics = spec.build(setting(60.0, count=1))
    hill = np.array(setup["deputies"]["ellipse"]["hill0"], dtype=float)
    state = dynamics.start(hill[None, :3], hill[None, 3:])
    for step in range(60):
        state = dynamics.advance(state, np.zeros((1, 3)), step)
    row = rows[60]
    assert row[0] == 3600.0
    position, velocity = dynamics.lvlh(state)
    assert np.abs(position[0] - row[13:16]).max() < 1e-5
    assert np.abs(velocity[0] - row[16:19]).max() < 1e-8


def test_each_integrator_can_be_chosen_by_name():
    kinds = {"rk4": FixedStep, "rk8": FixedStep, "dop853": Adaptive}
    for kind, expected in kinds.items():
        dynamics = InertialDynamicsSpec(integrator={"kind": kind}).build(setting())
        assert isinstance(dynamics, InertialDynamics)
        assert isinstance(dynamics.integrator, expected)


def test_satellites_of_their_own_shape_are_slowed_by_the_air_each_in_its_own_way():
    heavy, light = {"mass": 1e6}, {"mass": 10.0}
    mean_motion = math.sqrt(3.986004415e14 / 6.7e6**3)
    low = DynamicsSetting(mean_motion=mean_motion, step=10.0, satellite_count=2)
    spec = InertialDynamicsSpec(drag=True, body=heavy, satellite_bodies=(heavy, light), gravity={"degree": 0})
    dynamics = spec.build(low)
    state = dynamics.start(np.zeros((2, 3)), np.zeros((2, 3)))
    for step in range(30):
        state = dynamics.advance(state, np.zeros((2, 3)), step)
    same, slowed = dynamics.lvlh(state)[0]
    assert np.abs(same).max() < 1e-8
    assert slowed[1] < -0.01


@pytest.mark.parametrize(
    ("build", "says"),
    [
        (
            lambda: CwPerturbedDynamicsSpec(chief={"eccentricity": 0.1}, chief_motion="circular"),
            "eccentricity 0.1 does not go with chief_motion: circular",
        ),
        (lambda: GravitySpec(degree=4, order=5), "order 5 is above degree 4"),
        (lambda: GravitySpec(rotation="full", earth_angle=1.0), "earth_angle belongs to rotation: closed"),
        (lambda: GravitySpec(degree=121), "less than or equal to 120"),
    ],
)
def test_fields_that_contradict_each_other_are_refused_with_the_reason(build, says):
    with pytest.raises(ValidationError, match=says):
        build()


def test_a_list_of_bodies_of_the_wrong_length_is_refused():
    with pytest.raises(ValueError, match="satellite_bodies has 1 entries for 2 satellites"):
        InertialDynamicsSpec(satellite_bodies=({},)).build(setting())


def test_a_chief_inside_the_earth_is_refused():
    with pytest.raises(ValueError, match="inside the Earth"):
        InertialDynamicsSpec(chief={"eccentricity": 0.2}).build(setting())


def test_an_epoch_without_time_zone_is_utc_and_others_are_turned_into_it():
    plain = InertialDynamicsSpec.model_validate({"epoch": "2024-05-01T12:00:00"}).epoch
    zoned = InertialDynamicsSpec.model_validate({"epoch": "2024-05-01T14:00:00+02:00"}).epoch
    assert as_utc(plain) == as_utc(zoned)


def test_keplers_third_law_gives_the_reference_radius():
    assert semi_major_axis_of(MEAN_MOTION, MANIFEST["mu"]) == pytest.approx(7e6, rel=1e-15)


def test_a_cw_run_loads_neither_brahe_nor_the_integrators_of_scipy():
    code = "import sys, satform.dynamics.truth_models; print({'brahe', 'scipy.integrate'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
