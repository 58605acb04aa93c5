# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Long steps by collocation against brahe's propagator, closed forms, and the fixed-step integrator."""

import math
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import brahe
import numpy as np
import pytest

from satform.dynamics import coasting
from satform.dynamics.coasting import CoastingDynamics, CoastingState
from satform.dynamics.cw_error import two_body
from satform.dynamics.inertial import InertialDynamics
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.stacked_models import StackedDynamics
from satform.dynamics.truth_models import InertialDynamicsSpec
from satform.numeric.elementwise import Array
from satform.orbits.time_scales import brahe_epoch

EPOCH = datetime(2024, 1, 1, tzinfo=UTC)
RADIUS = 6.878137e6
RATE = math.sqrt(3.986004415e14 / RADIUS**3)
POSITION = np.array([[100.0, 200.0, 300.0], [-100.0, -500.0, 50.0]])
VELOCITY = np.array([[0.1, -0.2, 0.3], [0.0, 0.1, 0.0]])


def dynamics(period: float, count: int = 2, rate: float = RATE, **fields: Any) -> Any:
    spec = {"chief": {"inclination": 0.9}, "integrator": {"kind": "collocation"}, "epoch": EPOCH, **fields}
    setting = DynamicsSetting(mean_motion=rate, step=period, satellite_count=count)
    return InertialDynamicsSpec.model_validate(spec).build(setting)


def fly(model: Any, state: Any, commands: Array) -> Any:
    for step, command in enumerate(commands):
        state = model.advance(state, command, step)
    return state


def by_brahe(starts: Array, seconds: float, *, drag: bool, method: Any) -> Array:
    """Final positions; the Earth turns about the inertial z axis alone."""
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    value, low = brahe.ParameterSource.value, brahe.EphemerisSource.LowPrecision
    harris: Any = brahe.AtmosphericModel.HARRIS_PRIESTER
    config = brahe.ForceModelConfig(
        gravity=brahe.GravityConfiguration(degree=20, order=20),
        mass=value(100.0),
        frame_transform=brahe.FrameTransformationModel.EARTH_ROTATION_ONLY,
        drag=brahe.DragConfiguration(harris, value(1.0), value(2.2)) if drag else None,
        third_body=[
            brahe.ThirdBodyConfiguration(one, low) for one in (brahe.ThirdBody.SUN, brahe.ThirdBody.MOON)
        ],
    )
    epoch, ends = brahe_epoch(EPOCH), []
    for start in starts:
        peer = brahe.NumericalOrbitPropagator(epoch, start, method, config, np.array([100.0]))
        peer.propagate_to(epoch + seconds)
        ends.append(peer.current_state()[:3])
    return np.array(ends)


@pytest.mark.parametrize("period", [60.0, 1200.0])
def test_a_day_of_coasting_is_brahes_to_a_millimetre(period: float) -> None:
    # brahe's RKN1210 is 46 m away from its other methods in this day, since drag depends on the velocity; so
    # it is its method of order 8, with steps of 30 s.
    tight = brahe.NumericalPropagationConfig.with_method(brahe.IntegrationMethod.RKF78)
    tight = tight.with_rel_tol(1e-13).with_abs_tol(1e-9).with_initial_step(30.0).with_max_step(30.0)
    model = dynamics(period, gravity={"degree": 20}, drag=True, sun=True, moon=True)
    start = model.start(POSITION, VELOCITY)
    end = fly(model, start, np.zeros((round(86400.0 / period), 2, 3)))
    starts = np.concatenate((start.motion[0, 1:], start.motion[1, 1:]), axis=1)
    peer = by_brahe(starts, 86400.0, drag=True, method=tight)
    assert end.time == 86400.0
    assert np.linalg.norm(end.motion[0, 1:] - peer, axis=1).max() < 1e-3


def test_a_day_without_drag_is_that_of_brahes_integrator_of_order_12_to_a_millimetre() -> None:
    model = dynamics(1200.0, gravity={"degree": 20}, sun=True, moon=True)
    start = model.start(POSITION, VELOCITY)
    end = fly(model, start, np.zeros((72, 2, 3)))
    starts = np.concatenate((start.motion[0, 1:], start.motion[1, 1:]), axis=1)
    peer = by_brahe(starts, 86400.0, drag=False, method=brahe.NumericalPropagationConfig.high_precision())
    assert np.linalg.norm(end.motion[0, 1:] - peer, axis=1).max() < 1e-3


@pytest.mark.parametrize(
    ("radius", "eccentricity", "step", "bound"), [(7e6, 0.0, 1200.0, 1e-4), (26.6e6, 0.7, 600.0, 1e-3)]
)
def test_two_body_motion_is_the_closed_form_at_every_control_period(
    radius: float, eccentricity: float, step: float, bound: float
) -> None:
    rate = math.sqrt(3.986004415e14 / radius**3)
    chief = {"inclination": 0.9, "eccentricity": eccentricity}
    integrator = {"kind": "collocation", "maximum_step": step}
    model = dynamics(50.0, 1, rate, chief=chief, gravity={"degree": 0}, integrator=integrator)
    # The closed form has the gravitational parameter of WGS 84.
    state = start = model.start(POSITION[:1], VELOCITY[:1])
    scale = math.sqrt(3.986004418e14 / 3.986004415e14)
    steps = round(math.tau / rate / 50.0)
    reached = two_body(
        start.motion[0, 1], scale * start.motion[1, 1], 50.0 / scale * np.arange(1.0, steps + 1.0)
    )
    assert reached is not None
    for step_number in range(steps):
        state = model.advance(state, np.zeros((1, 3)), step_number)
        assert np.abs(state.motion[0, 1] - reached[0][step_number]).max() < bound


@pytest.mark.parametrize("commanded", [False, True])
def test_a_chief_and_satellites_that_do_not_converge_go_by_the_fixed_step_integrator(commanded: bool) -> None:
    # A step of ten revolutions, far above what a scenario may give.
    fixed = dynamics(100.0, integrator={"kind": "rk8", "maximum_step": 45.0})
    model = dynamics(100.0)
    assert isinstance(model, CoastingDynamics)
    assert model.collocation is not None
    model = replace(model, collocation=replace(model.collocation, maximum_step=5e4))
    commands = np.zeros((5, 2, 3))
    commands[:, 1] = (1e-4, 0.0, -1e-4) if commanded else 0.0
    expected = fly(fixed, fixed.start(POSITION, VELOCITY), commands)
    reached = fly(model, model.start(POSITION, VELOCITY), commands)
    assert np.array_equal(reached.motion, expected.motion)
    assert np.array_equal(reached.remainder, expected.remainder)


def test_commands_are_flown_as_by_the_fixed_step_integrator() -> None:
    options: dict[str, Any] = {"gravity": {"degree": 8}, "drag": True}
    fixed = dynamics(60.0, integrator={"kind": "rk8", "maximum_step": 10.0}, **options)
    model = dynamics(60.0, **options)
    commands = np.zeros((90, 2, 3))
    commands[7, 0], commands[8, 0], commands[31, 1] = (1e-3, 2e-3, -1e-3), (0.0, 1e-3, 0.0), (0.0, -2e-3, 0.0)
    commands[60:70] = 1e-4
    assert isinstance(model, CoastingDynamics)
    expected = fixed.lvlh(fly(fixed, fixed.start(POSITION, VELOCITY), commands))
    found = model.lvlh(fly(model, model.start(POSITION, VELOCITY), commands))
    np.testing.assert_allclose(found[0], expected[0], rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(found[1], expected[1], rtol=0.0, atol=1e-7)


def test_a_perturbation_acts_also_where_nothing_is_commanded() -> None:
    options = {"perturbations": [{"kind": "constant", "acceleration": [1e-6, 2e-6, 0.0]}]}
    fixed = dynamics(60.0, integrator={"kind": "rk8", "maximum_step": 30.0}, **options)
    model, still = dynamics(60.0, **options), np.zeros((20, 2, 3))
    expected = fixed.lvlh(fly(fixed, fixed.start(POSITION, VELOCITY), still))
    found = model.lvlh(fly(model, model.start(POSITION, VELOCITY), still))
    np.testing.assert_allclose(found[0], expected[0], rtol=0.0, atol=1e-5)


def test_a_keplerian_chief_keeps_to_its_orbit() -> None:
    model = dynamics(100.0, 1, chief_motion="keplerian", gravity={"degree": 4})
    end = fly(model, model.start(POSITION[:1], VELOCITY[:1]), np.zeros((60, 1, 3)))
    assert np.linalg.norm(end.motion[0, 0]) == pytest.approx(RADIUS, abs=1e-4)
    assert abs(np.linalg.norm(end.motion[0, 1]) - RADIUS) > 100.0


def many(count: int) -> tuple[Any, Array, Array, Array]:
    generator = np.random.default_rng(8)
    model = dynamics(200.0, count, gravity={"degree": 5}, drag=True, body={"drag_area": 3.0})
    commands = np.zeros((20, count, 3))
    pushed = generator.random((20, count)) < 0.1
    commands[pushed] = 1e-3 * generator.normal(size=(int(pushed.sum()), 3))
    return model, 2e3 * generator.normal(size=(count, 3)), generator.normal(size=(count, 3)), commands


def alone(model: Any, row: int) -> Any:
    return replace(model, bodies=(model.bodies[0], model.bodies[1 + row]))


def test_each_satellite_flies_alone_as_in_company() -> None:
    model, position, velocity, commands = many(12)
    whole = fly(model, model.start(position, velocity), commands)
    for row in (0, 5, 11):
        one = slice(row, row + 1)
        other = alone(model, row)
        single = fly(other, other.start(position[one], velocity[one]), commands[:, one])
        assert single.motion[:, 0].tobytes() == whole.motion[:, 0].tobytes()
        assert single.motion[:, 1].tobytes() == whole.motion[:, 1 + row].tobytes()


def test_satellites_that_fly_on_without_others_keep_their_motion() -> None:
    model, position, velocity, commands = many(6)
    half = fly(model, model.start(position, velocity), commands[:9])
    whole = half
    kept, state = StackedDynamics(model).keep(half, np.array([1, 4]))
    assert isinstance(state, CoastingState)
    for step in range(9, 20):
        whole = model.advance(whole, commands[step], step)
        state = kept.advance(state, commands[step][[1, 4]], step)
    assert state.motion.tobytes() == whole.motion[:, [0, 2, 5]].tobytes()


def test_a_satellite_whose_iteration_does_not_converge_flies_by_the_fixed_step_integrator() -> None:
    # It falls to within 800 km of the Earth's centre, with the chief high above.
    rate = math.sqrt(3.986004415e14 / 4.2164e7**3)
    integrator = {"kind": "collocation", "maximum_step": 7200.0, "thrust_step": 20.0}
    options: dict[str, Any] = {"gravity": {"degree": 0}, "integrator": integrator}
    model = dynamics(600.0, 1, rate, **options)
    fixed = dynamics(600.0, 1, rate, **{**options, "integrator": {"kind": "rk8", "maximum_step": 20.0}})
    start = model.start(np.array([[-3.5e7, 0.0, 0.0]]), np.array([[0.0, -2300.0, 0.0]]))
    state = model.advance(start, np.zeros((1, 3)), 0)
    assert [list(arc.rows) for arc in state.arcs] == [[0]]
    expected = InertialDynamics.advance(fixed, start, np.zeros((1, 3)), 0)
    np.testing.assert_allclose(state.motion[0, 1], expected.motion[0, 1], rtol=0.0, atol=1e-6)


def test_a_step_that_is_too_long_for_the_chief_is_refused_in_a_sentence() -> None:
    with pytest.raises(ValueError, match="30000 s is too long for collocation, whose steps are at most 5676"):
        dynamics(60.0, 1, integrator={"kind": "collocation", "maximum_step": 3e4})


def test_nothing_is_computed_anew_while_everybody_coasts(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    iterate = coasting.accelerations
    monkeypatch.setattr(coasting, "accelerations", lambda *given: calls.append(given) or iterate(*given))
    model = dynamics(60.0, gravity={"degree": 2})
    fly(model, model.start(POSITION, VELOCITY), np.zeros((60, 2, 3)))
    assert len(calls) == 3
