# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Truth models given by formulas, and gravity beside a velocity-dependent force, against closed forms."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from flights import shortened
from satform.dynamics import cw
from satform.dynamics.formula_model import FormulaDynamicsSpec
from satform.dynamics.prescribed_disturbances import ConstantSpec, HarmonicSpec
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.velocity_dependent import VelocityDependentDynamicsSpec
from satform.flight.simulate import simulate
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.scenario import ScenarioError

MOTION = 1.1e-3
RADIUS = math.cbrt(GRAVITATIONAL_PARAMETER / MOTION**2)
START = (
    np.array([[100.0, -200.0, 50.0], [-30.0, 10.0, 400.0]]),
    np.array([[0.2, 0.1, -0.3], [-1.0, 0.5, 0.0]]),
)
NOTHING = np.zeros((2, 3))


def flown(spec, duration, step=10.0, start=START, command=NOTHING):
    plant = spec.build(DynamicsSetting(MOTION, step, len(start[0])))
    state = plant.start(*start)
    for number in range(round(duration / step)):
        state = plant.advance(state, command, number)
    return np.concatenate(plant.lvlh(state), axis=-1)


def test_damped_oscillators_move_as_in_closed_form():
    spec = FormulaDynamicsSpec(
        acceleration=(
            "-stiffness*x - 2*damping*vx",
            "-stiffness*y - 2*damping*vy",
            "-stiffness*z - 2*damping*vz",
        ),
        constants=({"name": "stiffness", "value": 0.01}, {"name": "damping", "value": 0.02}),
        maximum_step=0.5,
    )
    time = 120.0
    frequency = math.sqrt(0.01 - 0.02**2)
    cosine, sine = math.cos(frequency * time), math.sin(frequency * time) / frequency
    position, velocity = START
    expected = math.exp(-0.02 * time) * (position * cosine + (velocity + 0.02 * position) * sine)
    assert flown(spec, time)[:, :3] == pytest.approx(expected, abs=1e-5)


def test_a_force_of_time_alone_is_integrated_over_steps_and_parts():
    spec = FormulaDynamicsSpec(acceleration=("0.5*cos(0.1*t)", "n*t", "1"), maximum_step=1.0)
    time = 300.0
    position, velocity = START
    grown = [0.5 / 0.01 * (1.0 - math.cos(0.1 * time)), MOTION * time**3 / 6.0, 0.5 * time**2]
    assert flown(spec, time)[:, :3] == pytest.approx(position + velocity * time + grown, abs=1e-3, rel=1e-9)


CW_TEXTS = ("3*n**2*x + 2*n*vy", "-2*n*vx", "-n**2*z")


@pytest.mark.parametrize(
    "spec",
    [
        FormulaDynamicsSpec(acceleration=CW_TEXTS, maximum_step=5.0),
        FormulaDynamicsSpec(acceleration=("0", "0", "0"), gravity="cw", maximum_step=5.0),
        VelocityDependentDynamicsSpec(linear=0.0, wave=0.0, quadratic=0.0, gravity="cw", maximum_step=5.0),
    ],
    ids=["written", "added", "velocity_dependent"],
)
def test_linear_gravity_moves_satellites_as_cw_does(spec):
    command = np.array([[1e-4, 0.0, -2e-4], [0.0, 3e-4, 0.0]])
    expected = np.zeros((2, 6))
    for row in range(2):
        state = np.concatenate((START[0][row], START[1][row]))
        free, held = cw.transition_matrix(MOTION, 2000.0), cw.input_matrix(MOTION, 2000.0)
        expected[row] = free @ state + held @ command[row]
    assert flown(spec, 2000.0, command=command) == pytest.approx(expected, abs=1e-5)


def test_drag_beside_linear_gravity_is_a_linear_system():
    spec = VelocityDependentDynamicsSpec(
        linear=-2e-3, wave=0.0, quadratic=0.0, gravity="cw", maximum_step=5.0
    )
    state, _ = cw.system_matrices(MOTION)
    state = state.copy()
    state[3:, 3:] -= 2e-3 * np.eye(3)
    moved = expm(1500.0 * state)
    expected = np.stack([moved @ np.concatenate((START[0][row], START[1][row])) for row in range(2)])
    assert flown(spec, 1500.0) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(
    "spec",
    [
        FormulaDynamicsSpec(acceleration=("0", "0", "0"), gravity="point_mass", maximum_step=5.0),
        VelocityDependentDynamicsSpec(
            linear=0.0, wave=0.0, quadratic=0.0, gravity="point_mass", maximum_step=5.0
        ),
    ],
    ids=["formula", "velocity_dependent"],
)
def test_satellites_on_circular_orbits_of_the_chief_s_radius_stay_on_them(spec):
    # One 100 km ahead in the chief's plane, at rest in LVLH; one in a plane that is tilted by 0.02 rad.
    lead, tilt, time = 1e5 / RADIUS, 0.02, 2000.0
    ahead = RADIUS * np.array([math.cos(lead) - 1.0, math.sin(lead), 0.0])

    def tilted(angle):
        inertial = RADIUS * np.array(
            [math.cos(angle), math.sin(angle) * math.cos(tilt), math.sin(angle) * math.sin(tilt)]
        )
        turn = np.array(
            [[math.cos(angle), math.sin(angle), 0.0], [-math.sin(angle), math.cos(angle), 0.0], [0, 0, 1]]
        )
        return turn @ inertial - [RADIUS, 0.0, 0.0]

    # At the node: the speed is the chief's, turned by the tilt about the radius.
    speed = MOTION * RADIUS
    across = np.array([0.0, speed * (math.cos(tilt) - 1.0), speed * math.sin(tilt)])
    end = flown(spec, time, start=(np.stack((ahead, np.zeros(3))), np.stack((np.zeros(3), across))))
    assert end[0, :3] == pytest.approx(ahead, abs=1e-4)
    assert end[0, 3:] == pytest.approx(np.zeros(3), abs=1e-7)
    assert end[1, :3] == pytest.approx(tilted(MOTION * time), abs=1e-4)


def test_the_force_of_velocity_dependent_can_be_written_as_formulas():
    perturbations = (
        HarmonicSpec(amplitude=0.1, angular_frequency=0.5),
        ConstantSpec(acceleration=(0.1, 0.0, 0.2)),
    )
    own = VelocityDependentDynamicsSpec(perturbations=perturbations)
    texts = tuple(f"-0.2*v{axis} + 0.4*sin(1.5*v{axis}) + 0.05*v{axis}*abs(v{axis})" for axis in "xyz")
    written = FormulaDynamicsSpec(acceleration=texts, perturbations=perturbations, maximum_step=0.05)
    assert flown(written, 5.0, step=0.1) == pytest.approx(flown(own, 5.0, step=0.1), rel=1e-12, abs=1e-12)


def test_one_satellite_and_many_have_the_same_bits():
    spec = FormulaDynamicsSpec(
        acceleration=("-1e-6*x*abs(vx)", "tanh(y/100)*1e-3", "exp(-t/1000)*sin(z)"), gravity="point_mass"
    )
    together = flown(spec, 100.0)
    for row in range(2):
        single = flown(
            spec, 100.0, start=(START[0][row : row + 1], START[1][row : row + 1]), command=NOTHING[:1]
        )
        assert np.array_equal(single[0], together[row])


MODEL = "dynamics={kind: formula, acceleration: ['3*n**2*x + 2*n*vy', '-2*n*vx', '-n**2*z']}"


def test_a_scenario_flies_its_own_truth_model():
    own = simulate(shortened("triangle", 60.0, MODEL, "dynamics.maximum_step=0.5"))
    known = simulate(shortened("triangle", 60.0, "dynamics={kind: cw}"))
    assert own.position == pytest.approx(known.position, abs=1e-6)


@pytest.mark.parametrize(
    ("model", "said"),
    [
        ("{kind: formula, acceleration: ['q', '0', '0']}", r"acceleration\[0\].*there is no quantity 'q'"),
        ("{kind: formula, acceleration: ['0', '0', 'x**y']}", r"acceleration\[2\].*an exponent is"),
        ("{kind: formula, acceleration: ['0', '0']}", "acceleration"),
        (
            "{kind: formula, acceleration: ['0', '0', '0'], constants: [{name: vx, value: 1.0}]}",
            r"constants\[0\].name.*the name 'vx' is taken",
        ),
        (
            "{kind: formula, acceleration: ['0', '0', '0'], "
            "constants: [{name: a, value: 1.0}, {name: a, value: 2.0}]}",
            r"constants.*name.*the name 'a' is taken",
        ),
        (
            "{kind: formula, acceleration: ['0', '0', '0'], constants: [{name: lambda, value: 1.0}]}",
            r"constants\[0\].name.*'lambda' is a keyword of Python",
        ),
        (
            "{kind: formula, acceleration: ['0', '0', '0'], constants: [{name: is, value: 1.0}]}",
            r"constants\[0\].name.*'is' is a keyword of Python",
        ),
    ],
)
def test_a_model_that_cannot_be_read_is_refused_with_its_field(model, said):
    with pytest.raises(ScenarioError, match=said):
        shortened("triangle", 60.0, f"dynamics={model}")
