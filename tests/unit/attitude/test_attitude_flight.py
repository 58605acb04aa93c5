# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Attitude in flight: wheels with limits, pointing at another satellite, and what a scenario may ask for."""

from dataclasses import replace

import numpy as np
import pytest

from flights import satellite_of, shipped, shortened
from satform.attitude.ground_pointing import AttitudeReference, CircularOrbit
from satform.attitude.guidance import Attitude, PointingReference
from satform.attitude.mrp_tracking import AttitudeTrackingSpec
from satform.attitude.satellite_pointing import SatellitePointingSpec, inertial_line, to_inertial
from satform.attitude.wheels import Turning, Wheels
from satform.common.spec import specs
from satform.communication.neighbour_buffer import Received
from satform.consensus.arc_length import NeighbourPhases
from satform.control.protocol import Motion
from satform.dynamics.linear import multiply
from satform.evaluation.attitude import AttitudeSettling, PointingError, WheelMomentum, WheelSaturation
from satform.evaluation.evaluate import judge
from satform.flight.compile import plant_plan
from satform.flight.compile_satellite import flight_plan
from satform.flight.plant import Plant
from satform.flight.simulate import simulate
from satform.numeric import stacking
from satform.numeric.modified_rodrigues import direction_cosines
from satform.orbits.path_reference import Reference
from satform.scenario import ScenarioError

FREE = Wheels(np.array([np.inf]), np.array([np.inf]))
LIMITED = Wheels(np.array([0.2]), np.array([5.0]))


def turning(wheels: Wheels = FREE, step: float = 0.05, parts: int = 1) -> Turning:
    """The satellite of the Cape Canaveral scenario on its own, without the Earth's torque."""
    orientation = flight_plan(shipped("attitude_cape_canaveral"), 0).orientation
    assert orientation is not None
    return Turning([0], stacking.stack([replace(orientation, gravity_gradient=False)]), wheels, step, parts)


def inertial_momentum(group: Turning) -> np.ndarray:
    state = group.state.attitude
    return np.swapaxes(direction_cosines(state.mrp), -1, -2)[0] @ state.momentum[0]


def test_wheels_turn_the_body_without_changing_the_whole_momentum() -> None:
    group, random = turning(), np.random.default_rng(3)
    before = inertial_momentum(group)
    for step in range(1200):
        group.advance(random.uniform(-3.0, 3.0, (1, 3)), step)
    assert inertial_momentum(group) == pytest.approx(before, rel=1e-9)
    assert np.abs(group.state.attitude.wheel_momentum).max() > 1.0


def test_a_wheel_s_momentum_grows_by_the_torque_that_it_is_given() -> None:
    group = turning()
    start = group.state.attitude.wheel_momentum.copy()
    for step in range(40):
        group.advance(np.array([[0.5, -1.0, 0.25]]), step)
    grown = group.state.attitude.wheel_momentum - start
    assert grown == pytest.approx(2.0 * np.array([[0.5, -1.0, 0.25]]), rel=1e-12)


def test_a_torque_beyond_the_limit_is_cut_and_counted() -> None:
    applied, torque_saturated_steps, momentum_saturated_steps = LIMITED.applied(
        np.array([[0.1, -0.7, 0.3]]), np.zeros((1, 3)), 0.05
    )
    assert applied.tolist() == [[0.1, -0.2, 0.2]]
    assert torque_saturated_steps.tolist() == [True]
    assert momentum_saturated_steps.tolist() == [False]


def test_a_full_wheel_takes_no_more_but_gives_back() -> None:
    full = np.array([[5.0, -5.0, 4.999]])
    applied, _, momentum_saturated_steps = LIMITED.applied(np.array([[0.1, 0.1, 0.1]]), full, 0.05)
    assert applied == pytest.approx(np.array([[0.0, 0.1, 0.02]]), abs=1e-12)
    assert momentum_saturated_steps.tolist() == [True]
    applied, _, momentum_saturated_steps = LIMITED.applied(np.array([[-0.1, -0.1, 0.0]]), full, 0.05)
    assert applied == pytest.approx(np.array([[-0.1, 0.0, 0.0]]), abs=1e-12)


def test_sub_steps_approach_the_same_attitude_by_the_fourth_order() -> None:
    ends = []
    for parts in (1, 2, 64):
        group = turning(step=4.0, parts=parts)
        for step in range(5):
            group.advance(np.array([[0.4, -0.2, 0.3]]), step)
        ends.append(group.state.attitude.mrp)
    coarse, fine = (np.abs(end - ends[-1]).max() for end in ends[:2])
    assert 8.0 < coarse / fine < 40.0


ORBIT = CircularOrbit(
    radial=np.array([0.6, 0.0, 0.8]),
    transverse=np.array([0.0, 1.0, 0.0]),
    radius=np.asarray(7e6),
    mean_motion=np.asarray(1e-3),
)


def moving(time: float, speed: float) -> Reference:
    """A motion in LVLH with its first two derivatives in closed form."""
    angle = speed * time
    place = 1e4 * np.array([np.cos(angle), 2.0 * np.sin(angle), 0.5 * np.cos(angle) + 1.0])
    return Reference(
        place,
        1e4 * speed * np.array([-np.sin(angle), 2.0 * np.cos(angle), -0.5 * np.sin(angle)]),
        -1e4 * speed * speed * np.array([np.cos(angle), 2.0 * np.sin(angle), 0.5 * np.cos(angle)]),
    )


def line_at(time: float):
    return inertial_line(moving(time, 2e-3), moving(time, -3e-3), ORBIT, np.asarray(time))


def test_line_of_sight_turns_as_its_differences_say() -> None:
    time, apart = 700.0, 0.5
    before, now, after = (line_at(time + offset) for offset in (-apart, 0.0, apart))
    assert now.rate == pytest.approx((after.value - before.value) / (2.0 * apart), rel=1e-5)
    assert now.acceleration == pytest.approx((after.rate - before.rate) / (2.0 * apart), rel=1e-4, abs=1e-6)


def test_lvlh_axes_point_outward_ahead_and_along_the_normal() -> None:
    time = 1234.0
    place = ORBIT.position(np.asarray(time))
    normal = np.cross(ORBIT.radial, ORBIT.transverse)
    vector = np.array([3.0, -2.0, 5.0])
    outward = place.value / np.linalg.norm(place.value)
    ahead = place.rate / np.linalg.norm(place.rate)
    expected = vector[0] * outward + vector[1] * ahead + vector[2] * normal
    assert to_inertial(vector, ORBIT, np.asarray(time)) == pytest.approx(expected, rel=1e-12)


def test_the_wanted_attitude_has_the_boresight_on_the_other_satellite_and_the_panels_to_the_sun() -> None:
    pointing = SatellitePointingSpec(target="sat2", sun=(0.3, -0.2, 1.0)).build(1e-3, 7e6)
    own, other = moving(300.0, 2e-3), moving(300.0, -3e-3)
    wanted = pointing.reference(own, other, np.asarray(300.0))
    matrix = direction_cosines(wanted.mrp)
    sight = multiply(matrix, to_inertial(other.position - own.position, pointing.orbit, np.asarray(300.0)))
    assert sight / np.linalg.norm(sight) == pytest.approx(np.array([1.0, 0.0, 0.0]), abs=1e-9)
    assert multiply(matrix, pointing.sun)[1] == pytest.approx(0.0, abs=1e-9)


def test_satellites_with_attitude_fly_with_the_same_bits_together_and_one_by_one() -> None:
    scenario = shortened("formation_pointing", 20.0)
    assert simulate(scenario).differences(simulate(scenario, stacked=False)) == []


def test_a_satellite_without_attitude_flies_beside_one_that_has_one() -> None:
    scenario = shortened("formation_pointing", 5.0)
    bare = scenario.satellites[2].model_copy(update={"attitude": None})
    mixed = scenario.model_copy(update={"satellites": (*scenario.satellites[:2], bare)})
    record, whole = simulate(mixed), simulate(scenario)
    assert np.isnan(record.mrp[:, 2]).all()
    assert np.array_equal(record.mrp[:, :2], whole.mrp[:, :2])
    assert np.array_equal(record.position, whole.position)


@pytest.mark.unmeasured
def test_the_limits_of_the_wheels_hold_all_through_a_flight() -> None:
    record = simulate(shortened("attitude_limited_wheels", 60.0))
    moved = np.diff(record.wheel_momentum[:, 0], axis=0) / record.step
    assert np.abs(moved).max() <= 0.25 * (1.0 + 1e-9)
    assert np.abs(record.wheel_torque).max() > 3.0
    assert record.torque_saturated_steps[-1, 0] == np.count_nonzero(
        (np.abs(record.wheel_torque[:, 0]) > 0.25).any(axis=1)
    )


def test_figures_of_attitude_are_unknown_where_nobody_has_one() -> None:
    record = simulate(shortened("triangle", 5.0))
    for expectation in (
        PointingError(below=1.0),
        AttitudeSettling(quantity="panel_to_sun", level=0.1, below=1.0),
        WheelMomentum(below=1.0),
        WheelSaturation(limit="torque", below=1.0),
    ):
        assert not judge([expectation], record)[0].met
    assert Plant(plant_plan(shortened("triangle", 5.0))).attitude() is None


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("satellites.0.attitude.pointing.target=nobody", "there is no satellite nobody to point at"),
        ("graph={kind: none}", "pointing at sat2 needs it as an in-neighbour"),
        ("satellites.0.attitude.pointing.sun=[0, 0, 0]", "sun needs a direction"),
        ("satellites.0.attitude.controller.wheel_inertia=200.0", "inertias have to be positive"),
        (
            "satellites.0.attitude.pointing={kind: ground_pointing, altitude: 3.0e5, start_latitude: 0,"
            " start_longitude: 0, heading: 0, target_latitude: 0, target_longitude: 0}",
            "has a mean motion of",
        ),
    ],
)
def test_an_attitude_that_cannot_be_flown_is_refused_in_words(change: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        shortened("formation_pointing", 5.0, change)


def test_every_figure_of_attitude_is_registered() -> None:
    mine = {
        kind
        for kind, spec in specs("satform.metrics").items()
        if spec.__module__ == "satform.evaluation.attitude"
    }
    assert len(mine) == 10


def test_gains_of_the_attitude_change_in_flight_from_the_next_step_on() -> None:
    scenario = shortened("attitude_cape_canaveral", 5.0)
    satellite, plant = satellite_of(scenario, 0), Plant(plant_plan(scenario))
    told = plant.attitude()
    assert told is not None
    own = Attitude(told.mrp[0], told.angular_velocity[0], told.wheel_momentum[0])
    motion = Motion(plant.motion().position[0], plant.motion().velocity[0])
    nobody = Received.whole(np.zeros((0, 2)), np.zeros(0))
    first = satellite.act(motion, nobody, None, own).wheel_torque
    again = satellite_of(scenario, 0)
    again.use_attitude_controller(AttitudeTrackingSpec(attitude_gain=28.0))
    stronger = again.act(motion, nobody, None, own).wheel_torque
    assert first is not None
    assert stronger is not None
    # Twice the gain adds 14 N m times an error of 0.67.
    assert np.linalg.norm(stronger - first) == pytest.approx(14.0 * 0.66968, rel=1e-3)


CAPE = ("satellites[0].attitude.mrp=null", "satellites[0].attitude.angular_velocity=null")
"""Changes with which the satellite of the Cape Canaveral scenario starts on its target."""


def test_an_attitude_can_start_as_pointed_at_another_place_on_the_ground() -> None:
    place = ("initial_target_latitude=0.3", "initial_target_longitude=-1.3")
    changes = [f"satellites[0].attitude.pointing.{field}" for field in place]
    orientation = flight_plan(shipped("attitude_cape_canaveral", *CAPE, *changes), 0).orientation
    assert orientation is not None
    pointing, start = orientation.pointing, orientation.start
    elsewhere = replace(pointing, latitude=0.3, longitude=-1.3)
    body = direction_cosines(start.mrp)
    sight = body @ elsewhere.line_of_sight(np.zeros(())).value
    assert sight / np.linalg.norm(sight) == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
    assert (body @ pointing.sun)[1] == pytest.approx(0.0, abs=1e-9)
    # The boresight stays on the place: the line of sight does not turn in the body.
    line = elsewhere.line_of_sight(np.zeros(()))
    turning = body @ line.rate - np.cross(orientation.law.body.angular_velocity(start), body @ line.value)
    assert turning[1:] == pytest.approx([0.0, 0.0], abs=1e-6)
    # In flight the target is the one of the pointing.
    assert (pointing.latitude, pointing.longitude) == (0.49741883681838395, -1.4049900478554354)


def test_an_attitude_that_starts_at_another_satellite_turns_to_its_target() -> None:
    changes = [
        "satellites[0].attitude.pointing.initial_target=sat3",
        "satellites[0].attitude.wheel_torque_limit=2.0",
    ]
    record = simulate(shortened("formation_pointing", 90.0, *changes))
    body = direction_cosines(record.mrp[0, 0])
    apart = record.reference_position[0, 2] - record.reference_position[0, 0]
    sight = body @ (apart / np.linalg.norm(apart))
    assert sight == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
    toward = record.reference_position[0, 1] - record.reference_position[0, 0]
    angle = np.arccos(float(apart @ toward / np.linalg.norm(apart) / np.linalg.norm(toward)))
    assert angle > 0.3
    # What is recorded is taken with the satellites' true positions, which are off by some hundred metres.
    assert record.pointing_error[0, 0] == pytest.approx(angle, abs=0.02)
    assert record.pointing_error[-1, 0] < 0.02
    # The others start on their targets.
    assert record.pointing_error[0, 1:] == pytest.approx([0.0, 0.0], abs=0.02)


@pytest.mark.parametrize(
    ("scenario", "changes", "said"),
    [
        (
            "attitude_cape_canaveral",
            ["satellites[0].attitude.pointing.initial_target_latitude=0.3"],
            "give both initial_target_latitude and initial_target_longitude",
        ),
        (
            "attitude_cape_canaveral",
            [
                "satellites[0].attitude.pointing.initial_target_latitude=0.3",
                "satellites[0].attitude.pointing.initial_target_longitude=0.3",
            ],
            "mrp and an initial target of the pointing both give the attitude at the start",
        ),
        (
            "formation_pointing",
            ["satellites[0].attitude.pointing.initial_target=sat1"],
            "sat1 is not another satellite; there are sat2, sat3",
        ),
        (
            "formation_pointing",
            ["satellites[0].attitude.pointing.initial_target=sat9"],
            "sat9 is not another satellite",
        ),
    ],
)
def test_a_start_of_an_attitude_that_is_not_clear_is_refused(
    scenario: str, changes: list[str], said: str
) -> None:
    with pytest.raises(ScenarioError, match=said):
        shipped(scenario, *changes)


def left_by_the_hold(sample: str, step: float) -> float:
    """Largest attitude error of the Cape Canaveral satellite that starts on its target, over 60 s."""
    changes = [*CAPE, f"timing.step={step}", f"satellites[0].feedforward_sample={sample}"]
    record = simulate(shortened("attitude_cape_canaveral", 60.0, *changes))
    return float(np.max(record.attitude_error))


@pytest.mark.unmeasured
def test_torque_taken_at_the_middle_of_the_hold_leaves_an_error_of_second_order() -> None:
    first = [left_by_the_hold("start", step) for step in (0.8, 0.4)]
    second = [left_by_the_hold("midpoint", step) for step in (0.8, 0.4)]
    assert first[0] / first[1] == pytest.approx(2.0, rel=0.05)
    assert second[0] / second[1] == pytest.approx(4.0, rel=0.15)
    assert second[0] < 0.1 * first[0]


def test_the_angular_acceleration_towards_a_satellite_is_that_of_the_middle_of_the_hold() -> None:
    scenario = shipped("formation_pointing")
    plans = [
        flight_plan(scenario, index, [other for other in range(3) if other != index]) for index in range(3)
    ]
    own, other, orientation = plans[0], plans[1], plans[0].orientation
    assert orientation is not None
    step, rate, shape = 30.0, own.nominal_rate, np.zeros(2)
    phase = other.arc_length - other.phase_offset
    states = NeighbourPhases(shape + phase, shape + rate, shape, shape + 1.0)
    still = np.zeros_like(rate)

    def at(time: float) -> AttitudeReference:
        return orientation.pointing.reference(
            own.path.reference(own.arc_length + time * rate, rate, still),
            other.path.reference(other.arc_length + time * rate, rate, still),
            np.asarray(time),
        )

    desired = own.path.at_step(own.arc_length, rate, still, step)
    held = PointingReference(orientation, step, 60.0, "midpoint").at(0, desired, states)
    begin, middle = at(0.0), at(0.5 * step)
    assert held.mrp == pytest.approx(begin.mrp, abs=1e-12)
    assert held.angular_velocity == pytest.approx(begin.angular_velocity, abs=1e-12)
    change = np.linalg.norm(middle.angular_acceleration - begin.angular_acceleration)
    assert np.linalg.norm(held.angular_acceleration - middle.angular_acceleration) < 0.03 * change
    undelayed = own.path.reference(own.arc_length, rate, still)
    start = PointingReference(orientation, step, 60.0, "start").at(0, undelayed, states)
    assert start.angular_acceleration == pytest.approx(begin.angular_acceleration, abs=1e-15)
