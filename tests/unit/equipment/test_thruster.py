# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from pydantic import ValidationError

from satform.equipment.random_streams import THRUSTER_STREAM
from satform.equipment.thruster import ERRORS_PER_STEP, STANDARD_GRAVITY, ThrusterFault, ThrusterSpec
from satform.numeric import stacking
from satform.numeric.seeded_numbers import SeededNormals

STEP = 0.5
NO_ERROR = np.zeros(ERRORS_PER_STEP)


def fire(spec, command, errors=NO_ERROR, steps=1):
    thruster = spec.build(STEP)
    propulsion = thruster.start()
    for _ in range(steps):
        given, propulsion = thruster.fire(propulsion, np.asarray(command, dtype=float), errors)
    return given, propulsion


def test_an_ideal_thruster_gives_every_command_to_the_last_bit():
    command = np.random.default_rng(0).normal(size=(100, 3))
    for arrangement in ("per_axis", "single"):
        thruster = stacking.stack([ThrusterSpec(dry_mass=97.3, arrangement=arrangement).build(0.7)] * 100)
        given, propulsion = thruster.fire(thruster.start(), command, np.zeros((100, 4)))
        assert given.tobytes() == command.tobytes()
        assert not propulsion.saturated_steps.any()
        assert not propulsion.below_minimum_impulse_steps.any()


@pytest.mark.parametrize("arrangement", ["per_axis", "single"])
def test_velocity_gained_and_propellant_burnt_obey_the_rocket_equation(arrangement):
    spec = ThrusterSpec(dry_mass=80.0, propellant=20.0, specific_impulse=220.0, arrangement=arrangement)
    _, propulsion = fire(spec, [0.0, -0.6, 0.0], steps=500)
    gained = 500 * 0.6 * STEP
    assert propulsion.delta_v == pytest.approx(gained, rel=1e-13)
    left = 100.0 * math.exp(-gained / (220.0 * STANDARD_GRAVITY)) - 80.0
    assert propulsion.propellant == pytest.approx(left, rel=1e-12)


def test_thrusters_on_three_axes_burn_for_each_axis_and_a_single_one_for_the_length():
    command = [0.3, -0.4, 1.2]
    spec = {"dry_mass": 80.0, "propellant": 20.0, "specific_impulse": 220.0}
    _, three = fire(ThrusterSpec(**spec), command)
    _, one = fire(ThrusterSpec(**spec, arrangement="single"), command)
    assert three.delta_v == pytest.approx(1.9 * STEP, rel=1e-14)
    assert one.delta_v == pytest.approx(1.3 * STEP, rel=1e-14)


def test_a_command_above_the_limit_is_clipped_and_counted():
    command = [0.03, -0.04, 0.0]
    given, propulsion = fire(ThrusterSpec(dry_mass=100.0, maximum_thrust=3.5), command, steps=4)
    np.testing.assert_allclose(given, [0.03, -0.035, 0.0], rtol=1e-14)
    assert propulsion.saturated_steps == 4
    given, propulsion = fire(ThrusterSpec(dry_mass=100.0, maximum_thrust=2.5, arrangement="single"), command)
    np.testing.assert_allclose(given, [0.015, -0.02, 0.0], rtol=1e-14)
    assert propulsion.saturated_steps == 1
    _, propulsion = fire(ThrusterSpec(dry_mass=100.0, maximum_thrust=5.0), command)
    assert propulsion.saturated_steps == 0


def test_the_lighter_the_tank_the_more_the_largest_thrust_accelerates():
    full = ThrusterSpec(dry_mass=50.0, propellant=50.0, specific_impulse=200.0, maximum_thrust=1.0)
    empty = ThrusterSpec(dry_mass=50.0, maximum_thrust=1.0)
    assert fire(full, [1.0, 0.0, 0.0])[0][0] == pytest.approx(0.01)
    assert fire(empty, [1.0, 0.0, 0.0])[0][0] == pytest.approx(0.02)


def test_an_impulse_below_the_smallest_is_withheld_and_counted():
    spec = ThrusterSpec(dry_mass=100.0, minimum_impulse=0.5)
    given, propulsion = fire(spec, [0.0099, 0.01, -0.02], steps=3)
    assert given.tolist() == [0.0, 0.01, -0.02]
    assert propulsion.below_minimum_impulse_steps == 3
    assert propulsion.saturated_steps == 0
    _, propulsion = fire(spec, [0.0, 0.0, 0.0])
    assert propulsion.below_minimum_impulse_steps == 0


def test_a_shortest_pulse_is_a_smallest_impulse_at_full_thrust():
    spec = ThrusterSpec(dry_mass=100.0, maximum_thrust=5.0, minimum_pulse=0.02)
    given, _ = fire(spec, [1.9e-3, 2.1e-3, 0.0])
    assert given.tolist() == [0.0, 2.1e-3, 0.0]


def test_impulses_are_whole_multiples_of_the_quantum_and_within_the_limit():
    spec = ThrusterSpec(dry_mass=100.0, impulse_quantum=0.2, maximum_thrust=1.1)
    given, propulsion = fire(spec, [0.0059, -0.0061, 0.02])
    # 0.5 s on 100 kg: the quantum is 0.004 m/s^2, and the limit of 0.011 holds two of them.
    np.testing.assert_allclose(given, [0.004, -0.008, 0.008], rtol=1e-13)
    assert propulsion.saturated_steps == 1
    given, propulsion = fire(spec, [0.0019, 0.0, 0.0])
    assert given.tolist() == [0.0, 0.0, 0.0]
    assert propulsion.below_minimum_impulse_steps == 1


def test_an_empty_tank_gives_its_last_and_then_nothing_and_says_so():
    spec = ThrusterSpec(dry_mass=80.0, propellant=0.1, specific_impulse=220.0)
    thruster = spec.build(STEP)
    propulsion, gained = thruster.start(), 0.0
    for _ in range(10):
        given, propulsion = thruster.fire(propulsion, np.array([1.0, 0.0, 0.0]), NO_ERROR)
        gained += given[0] * STEP
    assert propulsion.propellant == 0.0
    assert gained == pytest.approx(220.0 * STANDARD_GRAVITY * math.log(80.1 / 80.0), rel=1e-12)
    assert propulsion.delta_v == pytest.approx(gained, rel=1e-12)
    assert given.tolist() == [0.0, 0.0, 0.0]
    # 2.696 m/s are in the tank: five whole half-metres, then part of one.
    assert propulsion.propellant_depleted_steps == 5


def test_errors_of_size_and_direction_have_the_spread_that_was_asked_for():
    spec = ThrusterSpec(dry_mass=100.0, magnitude_error=0.02, pointing_error=0.01)
    count = 20_000
    thruster = stacking.stack([spec.build(STEP)] * count)
    errors = SeededNormals(11, THRUSTER_STREAM, range(count), 4).at(0)
    command = np.broadcast_to(np.array([0.0, 0.6, -0.8]), (count, 3))
    given, _ = thruster.fire(thruster.start(), command, errors)
    length = np.linalg.norm(given, axis=1)
    assert length.mean() == pytest.approx(1.0, abs=5 * 0.02 / math.sqrt(count))
    assert length.std() == pytest.approx(0.02, rel=0.03)
    across, out = given[:, 0] / length, given @ np.array([0.0, 0.8, 0.6]) / length
    assert across.std() == pytest.approx(0.01, rel=0.03)
    assert out.std() == pytest.approx(0.01, rel=0.03)
    assert abs(np.mean(across * out)) < 5 * 1e-4 / math.sqrt(count)


def test_a_wrong_direction_does_not_change_the_length():
    spec = ThrusterSpec(dry_mass=100.0, pointing_error=0.2)
    given, _ = fire(spec, [0.3, 0.4, 1.2], np.array([0.5, 1.0, -2.0, 0.7]))
    assert np.linalg.norm(given) == pytest.approx(1.3, rel=1e-14)
    assert not np.allclose(given, [0.3, 0.4, 1.2], atol=0.1)


def test_a_satellites_thrust_has_the_same_bits_alone_as_in_company():
    generator = np.random.default_rng(8)
    specs = [
        ThrusterSpec(
            dry_mass=50.0 + index,
            propellant=0.001 * index,
            specific_impulse=200.0,
            maximum_thrust=20.0 if index % 3 else None,
            minimum_impulse=0.1 * (index % 4),
            impulse_quantum=0.05 * (index % 2),
            arrangement="single" if index % 5 else "per_axis",
            magnitude_error=0.05,
            pointing_error=0.05,
        )
        for index in range(40)
    ]
    together = stacking.stack([spec.build(STEP) for spec in specs])
    company, command = together.start(), generator.normal(size=(5, 40, 3))
    errors = generator.normal(size=(5, 40, 4))
    for step in range(5):
        given, company = together.fire(company, command[step], errors[step])
    for index, spec in enumerate(specs):
        thruster = spec.build(STEP)
        propulsion = thruster.start()
        for step in range(5):
            alone, propulsion = thruster.fire(propulsion, command[step, index], errors[step, index])
        assert alone.tobytes() == given[index].tobytes()
        for field in (
            "propellant",
            "delta_v",
            "saturated_steps",
            "below_minimum_impulse_steps",
            "propellant_depleted_steps",
        ):
            assert (
                np.asarray(getattr(propulsion, field)).tobytes() == getattr(company, field)[index].tobytes()
            )
    assert company.propellant_depleted_steps.any()
    assert company.saturated_steps.any()
    assert company.below_minimum_impulse_steps.any()


def test_random_numbers_depend_on_satellite_and_step_and_not_on_company_or_order():
    all_of_them = SeededNormals(5, THRUSTER_STREAM, range(10), 4)
    one = SeededNormals(5, THRUSTER_STREAM, [7], 4)
    later = all_of_them.at(700).copy()
    first = all_of_them.at(0).copy()
    assert one.at(0).tobytes() == first[7:8].tobytes()
    assert one.at(700).tobytes() == later[7:8].tobytes()
    assert all_of_them.at(700).tobytes() == later.tobytes()
    assert not np.array_equal(SeededNormals(6, THRUSTER_STREAM, [7], 4).at(0), first[7:8])
    assert len(np.unique(np.concatenate((first, later)))) == 80


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"minimum_impulse": 0.1, "minimum_pulse": 0.1, "maximum_thrust": 1.0}, "not both"),
        ({"minimum_pulse": 0.1}, "maximum_thrust"),
        ({"propellant": 1.0}, "specific_impulse"),
    ],
)
def test_contradicting_fields_are_refused_with_the_reason(fields, says):
    with pytest.raises(ValidationError, match=says):
        ThrusterSpec(dry_mass=100.0, **fields)


def test_a_pulse_longer_than_the_control_period_is_refused():
    with pytest.raises(ValueError, match="no command could ever be flown"):
        ThrusterSpec(dry_mass=100.0, maximum_thrust=1.0, minimum_pulse=0.6).build(STEP)


def burning(steps, command, **fault):
    """Applied acceleration of each step and the propulsion at the end, the last steps under a fault."""
    spec = ThrusterSpec(dry_mass=50.0, propellant=0.01, specific_impulse=100.0, maximum_thrust=0.5)
    thruster, applied = spec.build(1.0), []
    propulsion = thruster.start()
    begin = fault.pop("begin")
    for step in range(steps):
        wrong = None
        if step >= begin:
            wrong = ThrusterFault(*(np.asarray(fault.get(name, sound)) for name, sound in SOUND))
        asked = np.array(command if step < begin else (0.0, 0.0, 0.0))
        given, propulsion = thruster.fire(propulsion, asked, NO_ERROR, wrong)
        applied.append(given)
    return np.array(applied), propulsion


SOUND = (("factor", 1.0), ("stuck", 0.0))


def test_a_stuck_thruster_spends_what_it_applies_and_stops_with_the_empty_tank():
    applied, propulsion = burning(900, (0.0, 0.01, 0.0), begin=1, stuck=1.0)
    # Tsiolkovsky: all that the tank is good for, and no more, however long the valve is open.
    capacity = 100.0 * STANDARD_GRAVITY * math.log(50.01 / 50.0)
    assert applied.sum() == pytest.approx(capacity, rel=1e-9)
    assert float(propulsion.delta_v) == pytest.approx(capacity, rel=1e-9)
    assert float(propulsion.propellant) == pytest.approx(0.0, abs=1e-15)
    assert not applied[-1].any()
    assert float(propulsion.propellant_depleted_steps) > 0.0


def test_a_stuck_thruster_keeps_its_thrust_and_not_its_acceleration():
    applied, _ = burning(15, (0.0, 0.005, 0.0), begin=1, stuck=1.0)
    mass, expected = 50.01, []
    thrust = 0.005 * mass
    for _ in range(15):
        expected.append(thrust / mass)
        mass -= thrust / (100.0 * STANDARD_GRAVITY)
    assert applied[:, 1] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("factor", "expected"), [(0.0, 0.0), (0.25, 0.0025), (1.5, 0.5 / 50.0), (10.0, 0.5 / 50.0)]
)
@pytest.mark.parametrize("arrangement", ["per_axis", "single"])
def test_a_factor_is_paid_for_and_never_lifts_thrust_above_what_the_hardware_gives(
    factor, expected, arrangement
):
    spec = ThrusterSpec(
        dry_mass=40.0, propellant=10.0, specific_impulse=100.0, maximum_thrust=0.5, arrangement=arrangement
    )
    thruster = spec.build(1.0)
    fault = ThrusterFault(np.asarray(factor), np.asarray(0.0))
    asked = np.array([0.0, 0.01, 0.0])
    given, propulsion = thruster.fire(thruster.start(), asked, NO_ERROR, fault)
    assert given == pytest.approx(np.array([0.0, expected, 0.0]), rel=1e-12)
    assert float(propulsion.delta_v) == pytest.approx(expected, rel=1e-12)
    burnt = 50.0 * -math.expm1(-expected / (100.0 * STANDARD_GRAVITY))
    assert 10.0 - float(propulsion.propellant) == pytest.approx(burnt, rel=1e-9, abs=1e-15)
