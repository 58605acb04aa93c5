# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a satellite does with a neighbour's value that is late, and with one that it never received."""

import functools

import numpy as np
import pytest

from flights import satellite_of, shortened
from satform.communication.neighbour_buffer import Received
from satform.consensus.arc_length import NeighbourPhases
from satform.consensus.graph import CompleteSpec
from satform.flight.compile_satellite import flight_plan
from satform.flight.satellite import Satellite
from satform.flight.simulate import simulate
from satform.membership.formation import Plan, TopologyChanged
from satform.numeric.modified_rodrigues import direction_cosines
from satform.record.flight_record import FlightRecord

STEADY = (
    "timing.step=1.0",
    *(f"satellites.{index}.arc_length=0.0" for index in range(3)),
    *(f"satellites.{index}.position_error=[0.0, 0.0, 0.0]" for index in range(3)),
)
"""A formation that agrees and is on its orbits from the start."""


@functools.cache
def steady(duration: float, *changes: str) -> FlightRecord:
    return simulate(shortened("formation_pointing", duration, *STEADY, *changes))


@pytest.mark.parametrize(
    "late",
    [
        ("links={default: {delay: 20.0}}",),
        ("links={default: {loss: 0.9}}", "seed=4"),
        ("consensus.arc_length_source=projected",),
    ],
)
def test_pointing_at_a_satellite_does_not_depend_on_how_old_its_phase_is(late: tuple[str, ...]) -> None:
    # Late values were off by rate times age, 1600 m of 100 km or 1.6e-2 rad at 20 s.
    on_time = steady(50.0).pointing_error
    assert steady(50.0, "consensus.neighbour_values=extrapolate", *late).pointing_error == pytest.approx(
        on_time, abs=2e-6
    )


def test_a_late_phase_is_extrapolated_by_its_stamp_and_rate() -> None:
    orientation = flight_plan(shortened("formation_pointing", 1.0), 0).orientation
    assert orientation is not None
    target = orientation.target
    assert target is not None
    phase, rate = np.array([0.0, 5000.0, 0.0]), np.array([0.0, 80.0, 0.0])
    known = np.ones(3)
    place = int(target.row)
    early = NeighbourPhases(np.roll(phase, place - 1), np.roll(rate, place - 1), np.full(3, 100.0), known)
    later = NeighbourPhases(
        np.roll(phase + 20.0 * rate, place - 1), np.roll(rate, place - 1), np.full(3, 120.0), known
    )
    old, is_known = target.reference(early, 120.0, 60.0)
    new, _ = target.reference(later, 120.0, 60.0)
    assert is_known
    assert old.position == pytest.approx(new.position, abs=1e-9)
    assert old.velocity == pytest.approx(new.velocity, abs=1e-12)


SILENT = ("links={default: {loss: 1.0}}", "consensus.neighbour_timeout=5.0")


def test_before_the_first_message_the_flight_plan_says_where_the_target_is() -> None:
    early = slice(0, 5)
    assert steady(120.0, *SILENT).pointing_error[early] == pytest.approx(
        steady(50.0).pointing_error[early], abs=2e-6
    )


def test_a_target_of_which_nothing_counts_leaves_the_satellite_at_rest_with_its_panels_to_the_sun() -> None:
    record = steady(160.0, *SILENT)
    sun = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
    matrix = direction_cosines(record.mrp[-1])
    assert np.abs(matrix[:, 0] @ sun).max() < 2e-3
    assert np.abs(matrix[:, 1] @ sun).max() < 2e-3
    assert np.abs(record.angular_velocity[-1]).max() < 1e-3


def test_a_silent_target_gives_the_same_bits_to_satellites_flown_together_and_one_by_one() -> None:
    scenario = shortened("formation_pointing", 20.0, *STEADY, *SILENT)
    assert simulate(scenario, stacked=True).digest() == simulate(scenario, stacked=False).digest()


def test_a_satellite_without_a_word_of_the_one_it_follows_coasts_and_learns_nothing() -> None:
    satellite = satellite_of(shortened("directed_triangle", 1.0), 1)
    own = satellite.plan.start
    nothing = Received(np.zeros((1, 6)), np.zeros(1), np.zeros(1), np.ones(1), complete=False)
    for _ in range(50):
        decision = satellite.act(own, nothing)
        assert not np.any(decision.acceleration)
        # A neighbour of which nothing is known is not one at the chief's place.
        assert np.array_equal(decision.reference.position, own.position)
    assert not np.any(satellite.state.memory.weights)
    assert not np.any(satellite.state.memory.disturbance)


CYCLE = "graph={kind: matrix, rows: [[0, 1, 0], [0, 0, 1], [1, 0, 0]]}"
"""Each receives the one that it points at, and nobody else."""


@pytest.mark.parametrize("stacked", [True, False], ids=["stacked", "one by one"])
def test_who_is_pointed_at_does_not_change_with_those_who_are_heard_besides(stacked: bool) -> None:
    scenario = shortened("formation_pointing", 60.0, *STEADY, CYCLE)
    more: Plan = {20: [TopologyChanged(CompleteSpec().build(3), "a service call")]}
    # sat1 comes before sat3, at which sat2 points, in the list of those whom sat2 may hear.
    found = simulate(scenario, stacked=stacked, events=more).pointing_error
    assert found == pytest.approx(simulate(scenario).pointing_error, abs=2e-6)


def test_a_satellite_in_flight_finds_its_target_in_a_longer_list_of_neighbours() -> None:
    satellite = Satellite(flight_plan(shortened("formation_pointing", 1.0, CYCLE), 1), 1)
    satellite.rearrange([None, 0])
    satellite.find_target([0, 2])
    orientation = satellite.plan.orientation
    assert orientation is not None
    assert orientation.target is not None
    assert int(orientation.target.row) == 1


def test_a_flight_over_lossy_links_meets_new_neighbours_stacked_as_it_does_one_by_one() -> None:
    scenario = shortened("ring_six", 15.0, "links={default: {loss: 0.3}}")
    more: Plan = {10: [TopologyChanged(CompleteSpec().build(6), "a service call")]}
    stacked = simulate(scenario, events=more)
    assert stacked.digest() == simulate(scenario, stacked=False, events=more).digest()
    assert stacked.digest() != simulate(scenario).digest()
