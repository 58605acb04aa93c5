# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from satform.control.feedback_gains import sampled_poles
from satform.control.lqr import design_lqr
from satform.control.periodic_lqr import PeriodicLqr, PeriodicLqrSpec, design_periodic_lqr
from satform.control.periodic_riccati import periodic_gain, product_in_turn
from satform.control.protocol import ControlStep, FlightSetting, Motion
from satform.control.sampled_stability import spectral_radius
from satform.dynamics import cw
from satform.dynamics.relative_motion_models import input_matrix
from satform.dynamics.yamanaka_ankersen import YamanakaAnkersenModel
from satform.numeric import stacking
from satform.orbits.chief import ChiefOrbitSpec, KeplerianChief
from satform.orbits.path_reference import Reference

MOTION = 1e-4
WEIGHTS = ((1e-8,) * 3, (0.0,) * 3, (1.0,) * 3)
NOWHERE = Reference(np.zeros(3), np.zeros(3), np.zeros(3))


def chief_of(eccentricity: float, anomaly: float = 1.0) -> KeplerianChief:
    return ChiefOrbitSpec(eccentricity=eccentricity, argument_of_latitude=anomaly).keplerian(MOTION)


def law_of(eccentricity: float, step: float = 60.0, anomaly: float = 1.0, **fields: object) -> PeriodicLqr:
    spec = PeriodicLqrSpec(position_weight=1e-8, velocity_weight=0.0, command_weight=1.0, **fields)
    return spec.build(FlightSetting(MOTION, step, chief=chief_of(eccentricity, anomaly)))


@pytest.mark.parametrize("count", [1, 2, 7, 12])
def test_periodic_gains_are_those_of_the_cyclic_system_that_scipy_solves(count: int) -> None:
    """A periodic system is a time-invariant one of as many states as the period has steps times its own."""
    draw = np.random.default_rng(count)
    ahead, held = draw.normal(size=(count, 3, 3)), draw.normal(size=(count, 3, 2))
    states = np.array([one @ one.T + np.eye(3) for one in draw.normal(size=(count, 3, 3))])
    commands = np.array([one @ one.T + np.eye(2) for one in draw.normal(size=(count, 2, 2))])
    a, b = np.zeros((3 * count, 3 * count)), np.zeros((3 * count, 2 * count))
    q, r = np.zeros_like(a), np.zeros((2 * count, 2 * count))
    for step in range(count):
        after = (step + 1) % count
        here, there = slice(3 * step, 3 * step + 3), slice(3 * after, 3 * after + 3)
        command = slice(2 * step, 2 * step + 2)
        a[there, here], b[there, command] = ahead[step], held[step]
        q[here, here], r[command, command] = states[step], commands[step]
    cost = solve_discrete_are(a, b, q, r)
    lifted = np.linalg.solve(r + b.T @ cost @ b, b.T @ cost @ a)
    expected = [lifted[2 * k : 2 * k + 2, 3 * k : 3 * k + 3] for k in range(count)]
    found = periodic_gain(ahead, held, states, commands)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.max(np.abs(expected)))


def test_a_system_that_no_command_reaches_and_that_grows_is_refused() -> None:
    grows = np.full((4, 1, 1), 1.5)
    with pytest.raises(ValueError, match="periodic Riccati equation does not converge"):
        periodic_gain(grows, np.zeros((4, 1, 1)), np.ones((4, 1, 1)), np.ones((4, 1, 1)))


def test_a_product_in_turn_has_the_first_matrix_on_the_right() -> None:
    matrices = np.random.default_rng(1).normal(size=(11, 3, 3))
    expected = np.linalg.multi_dot(matrices[::-1])
    np.testing.assert_allclose(product_in_turn(matrices), expected, rtol=1e-12, atol=1e-12)


def test_about_a_circular_orbit_the_gain_is_the_discrete_one_at_every_anomaly() -> None:
    step = math.tau / MOTION / 1000.0
    design = design_periodic_lqr(chief_of(0.0), "yamanaka_ankersen", step, *WEIGHTS)
    ahead, held = cw.transition_matrix(MOTION, step), cw.input_matrix(MOTION, step)
    unit = np.repeat([1.0, 1.0 / MOTION], 3)
    a, b = unit[:, None] * ahead / unit, unit[:, None] * held * MOTION**2
    q, r = np.diag(np.repeat([1.0, 0.0], 3)), np.eye(3) * MOTION**2 / 1e-8
    cost = solve_discrete_are(a, b, q, r)
    expected = MOTION**2 * np.linalg.solve(r + b.T @ cost @ b, b.T @ cost @ a) * unit
    relative = np.max(np.abs((design.gain - expected) * np.array([1.0, 1, 1, MOTION, MOTION, MOTION])))
    assert relative < 1e-8 * np.max(np.abs(expected[:, :3]))


def test_with_short_steps_it_is_nearly_the_continuous_regulator() -> None:
    weights = ((1e-4,) * 3, (0.0,) * 3, (1.0,) * 3)
    design = design_periodic_lqr(chief_of(0.0), "cw", 10.0, *weights)
    expected = design_lqr(MOTION, *weights)
    assert np.max(np.abs(design.gain[:, :, :3] - expected[:, :3])) < 0.05 * np.max(np.abs(expected[:, :3]))


@pytest.mark.parametrize("eccentricity", [0.1, 0.6, 0.85])
def test_the_monodromy_is_what_an_orbit_under_the_law_makes_of_errors(eccentricity: float) -> None:
    chief, step = chief_of(eccentricity), 200.0
    law = law_of(eccentricity, step)
    design = design_periodic_lqr(chief, "yamanaka_ankersen", step, *WEIGHTS)
    model = YamanakaAnkersenModel(chief)
    begins = step * np.arange(design.steps)
    ahead, held = model.transition(begins, begins + step), input_matrix(model, begins, begins + step)
    columns = []
    for column in range(6):
        state = np.eye(6)[column] / (1.0 if column < 3 else 1.0 / MOTION)
        for number in range(design.steps):
            action = law.act(Motion(state[:3], state[3:]), NOWHERE, None, ControlStep(number, step))
            state = ahead[number] @ state + held[number] @ action.acceleration
        columns.append(state * np.repeat([1.0, 1.0 / MOTION], 3))
    flown = np.stack(columns, axis=-1)
    np.testing.assert_allclose(flown, design.monodromy, rtol=0.0, atol=1e-9 * np.max(np.abs(flown)))
    assert spectral_radius(design.monodromy) < 0.2


@pytest.mark.parametrize("eccentricity", [0.0, 0.7])
def test_the_linearisation_decays_over_an_orbit_as_the_loop_does(eccentricity: float) -> None:
    chief, setting = chief_of(eccentricity), FlightSetting(MOTION, 60.0, chief=chief_of(eccentricity))
    spec = PeriodicLqrSpec(position_weight=1e-8, velocity_weight=0.0, command_weight=1.0)
    transition = spec.linearisation(setting)
    design = design_periodic_lqr(chief, "yamanaka_ankersen", 60.0, *WEIGHTS)
    found = sorted(np.abs(np.linalg.eigvals(transition)) ** design.steps)
    expected = sorted(np.abs(np.linalg.eigvals(design.monodromy)))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-12)
    assert all(pole.real < 0.0 for pole in sampled_poles(transition, 60.0))


@pytest.mark.parametrize("eccentricity", [0.0, 0.3, 0.8])
def test_the_feed_forward_holds_a_place_in_the_model(eccentricity: float) -> None:
    """Started on its reference, the satellite leaves it by the error of the held command alone."""
    chief, step = chief_of(eccentricity, 2.0), 60.0
    law, model = law_of(eccentricity, step, 2.0), YamanakaAnkersenModel(chief)
    place = Reference(np.array([30.0, 150.0, -40.0]), np.zeros(3), np.zeros(3))
    begins = step * np.arange(round(chief.period / step))
    ahead, held = model.transition(begins, begins + step), input_matrix(model, begins, begins + step)
    state, worst = np.concatenate((place.position, np.zeros(3))), 0.0
    for number in range(len(begins)):
        action = law.act(Motion(state[:3], state[3:]), place, None, ControlStep(number, step))
        state = ahead[number] @ state + held[number] @ action.acceleration
        worst = max(worst, float(np.linalg.norm(state[:3] - place.position)))
    assert worst < 1e-3 * 150.0


def test_many_laws_in_one_give_the_bits_of_each() -> None:
    alone = [law_of(e, anomaly=a) for e, a in ((0.0, 0.5), (0.3, -2.0), (0.8, 3.0))]
    together = stacking.stack(alone)
    draw = np.random.default_rng(3)
    states = draw.normal(size=(3, 5, 3))
    for number in (0, 1, 700, 12345):
        step = ControlStep(number, 60.0)
        whole = together.act(
            Motion(states[:, 0], states[:, 1]),
            Reference(states[:, 2], states[:, 3], states[:, 4]),
            None,
            step,
        )
        for row, law in enumerate(alone):
            one = states[row]
            single = law.act(Motion(one[0], one[1]), Reference(one[2], one[3], one[4]), None, step)
            np.testing.assert_array_equal(whole.acceleration[row], single.acceleration)


def test_without_a_known_chief_it_is_about_a_circular_one() -> None:
    spec = PeriodicLqrSpec(position_weight=1e-8, velocity_weight=0.0)
    law = spec.build(FlightSetting(MOTION, 60.0))
    assert law.eccentricity == 0.0
    assert law.mean_motion == pytest.approx(MOTION, rel=1e-15)


def test_a_step_of_much_of_an_orbit_is_refused() -> None:
    with pytest.raises(ValueError, match=r"more than 1/16 of the orbit of 62831\.9 s"):
        law_of(0.3, 4000.0)


def test_a_loop_that_does_not_decay_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Gains of no effect leave the free motion, which drifts."""
    monkeypatch.setattr(
        "satform.control.periodic_lqr.periodic_gain", lambda ahead, *_rest: np.zeros((len(ahead), 3, 6))
    )
    with pytest.raises(ValueError, match=r"does not decay over the 571 steps of an orbit of ecc"):
        law_of(0.37, 110.0)
