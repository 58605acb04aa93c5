# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a satellite's thrusters and sensor do to a flight, and that it is the same however it is flown."""

import math

import numpy as np
import pytest

from flights import satellite_of, satellites_together, shipped, shortened
from satform.control.protocol import Motion
from satform.dynamics.cw import propagate
from satform.evaluation.control_effort import DeltaV
from satform.evaluation.equipment import PropellantUsed, SaturatedSteps
from satform.flight.compile import plant_plan
from satform.flight.plant import Plant
from satform.flight.simulate import simulate
from satform.scenario import ScenarioError

TRUTHS = ("leo_degree10", "geo_degree10", "leo_drag_srp", "triangle_inertial", "truth_j2")
EQUIPPED = ("thruster_limited", "noisy_navigation")
NO_FORCE = np.zeros((3, 3))


def equipped(**equipment: str):
    """The triangle, without disturbance, whose satellites all have the given equipment."""
    changes = [f"satellite_defaults.{name}={text}" for name, text in equipment.items()]
    return shipped("triangle", "dynamics.perturbations=[]", "expect=[]", *changes)


def test_without_sensors_the_satellites_are_told_the_very_truth():
    plant = Plant(plant_plan(shortened("triangle", 10.0)))
    for step in range(3):
        assert plant.measured() is plant.motion()
        assert plant.measured_steps().tolist() == [step] * 3
        plant.advance(NO_FORCE)


def test_measurements_scatter_about_the_truth_as_the_sensor_says():
    sensor = "{position_noise: [1, 2, 3], velocity_noise: 0.1, position_bias: [0, 10, 0]}"
    plant = Plant(plant_plan(equipped(sensor=sensor)))
    errors = []
    for _ in range(1500):
        told, true = plant.measured(), plant.motion()
        errors.append(np.hstack((told.position - true.position, told.velocity - true.velocity)))
        plant.advance(NO_FORCE)
    found = np.array(errors).reshape(-1, 6)
    spread = np.array([1.0, 2.0, 3.0, 0.1, 0.1, 0.1])
    # 4500 independent draws: standard errors of mean and of spread are 1.5 % and 1.1 % of the spread.
    assert np.all(np.abs(found.mean(axis=0) - [0, 10, 0, 0, 0, 0]) < 4.0 * 0.015 * spread)
    np.testing.assert_allclose(found.std(axis=0), spread, rtol=4.0 * 0.011)


def test_a_late_sensor_tells_where_the_satellite_was():
    plant = Plant(plant_plan(equipped(sensor="{update_period: 2.0, latency: 1.5}")))
    truth = []
    for step in range(20):
        truth.append(plant.motion())
        # Every fourth step of 0.5 s a measurement, which arrives three steps later.
        taken = max(0, (step - 3) // 4 * 4)
        assert plant.measured_steps().tolist() == [taken] * 3
        assert plant.measured().position.tobytes() == truth[taken].position.tobytes()
        plant.advance(NO_FORCE)


def test_only_the_satellite_with_a_sensor_is_misled():
    plant = Plant(plant_plan(shipped("triangle", "satellites.1.sensor={position_noise: 5.0}")))
    wrong = np.linalg.norm(plant.measured().position - plant.motion().position, axis=1) > 0.0
    assert wrong.tolist() == [False, True, False]


def test_a_satellites_noise_does_not_depend_on_who_else_has_a_sensor():
    alone = Plant(plant_plan(shipped("triangle", "satellites.1.sensor={position_noise: 5.0}")))
    among = Plant(plant_plan(equipped(sensor="{position_noise: 5.0}")))
    for _ in range(3):
        first = alone.measured().position[1] - alone.motion().position[1]
        second = among.measured().position[1] - among.motion().position[1]
        np.testing.assert_allclose(first, second, rtol=0.0, atol=1e-9)
        alone.advance(NO_FORCE)
        among.advance(NO_FORCE)


def test_the_plant_moves_by_what_the_thrusters_give_and_not_by_what_was_commanded():
    scenario = equipped(thruster="{dry_mass: 100.0, maximum_thrust: 2.0}")
    plant = Plant(plant_plan(scenario))
    start = plant.motion()
    plant.advance(np.array([[1.0, 0.0, 0.0], [0.0, -0.01, 0.0], [0.0, 0.0, 0.0]]))
    given = np.array([[0.02, 0.0, 0.0], [0.0, -0.01, 0.0], [0.0, 0.0, 0.0]])
    position, _ = propagate(start.position, start.velocity, scenario.orbit.rate, 0.5)
    pushed = plant.motion().position - position
    # The turning frame deflects by mean motion times acceleration times t^3 / 3, a micrometre.
    np.testing.assert_allclose(pushed, 0.5 * given * 0.25, rtol=1e-3, atol=1e-6)
    np.testing.assert_array_equal(plant.applied, given)
    assert plant.thrusters.propulsion.saturated_steps.tolist() == [1.0, 0.0, 0.0]


@pytest.fixture(scope="module")
def limited():
    return simulate(shortened("thruster_limited", 1200.0, "satellites.2.thruster.propellant=0.002"))


def test_propellant_follows_the_rocket_equation(limited):
    exhaust_speed = 60.0 * 9.80665
    for column in range(3):
        mass = 12.0 + limited.propellant[:, column]
        expected = mass[0] * np.exp(-limited.delta_v[:, column] / exhaust_speed)
        np.testing.assert_allclose(mass, expected, rtol=1e-12)


def test_an_empty_tank_gives_nothing_more_and_every_refusal_is_counted(limited):
    empty = int(np.argmax(limited.propellant[:, 2] == 0.0))
    assert 0 < empty < limited.steps
    assert not limited.applied_acceleration[empty:, 2].any()
    wanted = np.abs(limited.acceleration[empty:, 2]).max(axis=1) * 12.0 * 2.0 > 2.5e-4
    refused = np.diff(limited.propellant_depleted_steps[empty:, 2])
    assert wanted.sum() > 100
    assert np.all(refused[wanted] == 1.0)


def test_no_thrust_is_above_the_limit_however_much_is_wanted(limited):
    mass = 12.0 + limited.propellant[:-1]
    thrust = limited.applied_acceleration * mass[..., None]
    over = np.abs(limited.acceleration * mass[..., None]).max(axis=2) > 0.01
    np.testing.assert_array_equal(np.diff(limited.saturated_steps, axis=0) == 1.0, over)
    # Size and direction are inexact by 2 % and 10 mrad.
    assert np.abs(thrust).max() < 0.01 * (1.0 + 5.0 * 0.02 + 5.0 * 0.02)


def test_delta_v_is_what_the_thruster_pairs_spend_and_propellant_belongs_to_it(limited):
    spent = DeltaV(below=1.0, satellites=("sat1",)).measure(limited)
    axes = np.abs(limited.applied_acceleration[:, 0]).sum() * 2.0
    assert spent == pytest.approx(axes, rel=1e-12)
    used = PropellantUsed(below=1.0, satellites=("sat1",)).measure(limited)
    assert used == pytest.approx(12.1 * -math.expm1(-axes / (60.0 * 9.80665)), rel=1e-9)


def test_counts_of_a_stretch_are_those_of_its_steps(limited):
    early = SaturatedSteps(below=1e9, satellites=("sat1",), before=40.0).measure(limited)
    late = SaturatedSteps(below=1e9, satellites=("sat1",), after=40.0).measure(limited)
    over = np.abs(limited.acceleration[:, 0]).max(axis=1) * (12.0 + limited.propellant[:-1, 0]) > 0.01
    assert (early, late) == (over[:20].sum(), over[20:].sum())


def test_a_filtering_satellite_flies_by_its_estimate_and_the_others_by_what_they_are_told():
    flown = simulate(shortened("noisy_navigation", 2000.0))
    told = flown.measured_position[:-1] - flown.reference_position
    np.testing.assert_array_equal(flown.estimated_position_error[:, 0], told[:, 0])
    settled = slice(300, None)
    assert np.sqrt(np.mean(flown.navigation_error[settled, 1] ** 2)) > 1.5
    assert np.sqrt(np.mean(flown.estimation_error[settled, 1] ** 2)) < 0.6


def test_an_estimator_starts_from_its_first_measurement():
    scenario = shortened("noisy_navigation", 10.0)
    satellite, plant = satellite_of(scenario, 1), Plant(plant_plan(scenario))
    told = plant.measured()
    own = Motion(told.position[1], told.velocity[1])
    heard = simulate_heard(scenario)
    assert satellite.act(own, heard, 0).motion.position.tobytes() == own.position.tobytes()


def simulate_heard(scenario):
    from satform.communication.messages import encode
    from satform.communication.neighbour_buffer import Received

    others = [satellite_of(scenario, index).announce() for index in (0, 2)]
    return Received.whole(np.array([encode(one) for one in others]), np.array([one.time for one in others]))


@pytest.mark.parametrize("name", [*TRUTHS, *EQUIPPED])
def test_flown_together_or_one_by_one_every_satellite_has_the_same_bits(name):
    step = shipped(name).timing.step
    scenario = shortened(name, 60 * step)
    assert simulate(scenario, stacked=True).differences(simulate(scenario, stacked=False)) == []


def test_satellites_that_are_stacked_with_sensor_filter_and_thruster_have_the_bits_of_each_alone():
    scenario = shortened(
        "triangle",
        60.0,
        "satellite_defaults.sensor={position_noise: 2.0, velocity_noise: 0.02, update_period: 2.0,"
        " latency: 1.0}",
        "satellite_defaults.filter={acceleration_density: 1.0e-4}",
        "satellite_defaults.thruster={dry_mass: 50.0, propellant: 2.0, maximum_thrust: 100.0, arrangement:"
        " single, specific_impulse: 220.0, magnitude_error: 0.01, pointing_error: 0.02}",
        "satellites.1.thruster={dry_mass: 30.0, propellant: 0.2, specific_impulse: 220.0}",
    )
    satellites_together(scenario, range(3))
    assert simulate(scenario, stacked=True).differences(simulate(scenario, stacked=False)) == []


def test_filters_that_are_told_at_different_times_do_not_fly_as_one():
    scenario = shortened("noisy_navigation", 10.0, "satellites.0.filter={acceleration_density: 1.0e-6}")
    with pytest.raises(ValueError, match=r"Estimator\.(update|latency)"):
        satellites_together(scenario, range(3))


def problems_of(*changes: str) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        shipped("triangle", *changes)
    return [str(problem) for problem in caught.value.problems]


def test_a_filter_without_a_sensor_is_refused():
    (problem,) = problems_of("satellite_defaults.filter={acceleration_density: 1.0e-6}")
    assert "satellite_defaults.filter" in problem
    assert "needs a sensor" in problem


def test_a_sensor_off_the_grid_of_steps_is_refused_at_its_field():
    (problem,) = problems_of("satellites.1.sensor={update_period: 0.7}")
    assert "satellites[1].sensor" in problem
    assert "for example 0.5 s" in problem


def test_propellant_can_only_be_expected_of_satellites_with_thrusters():
    (problem,) = problems_of(
        "satellites.0.thruster={dry_mass: 10.0}",
        "expect=[{kind: propellant_used, below: 1.0, source: a test}]",
    )
    assert "sat2, sat3 have no thruster" in problem
