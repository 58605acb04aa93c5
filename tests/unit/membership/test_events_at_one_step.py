# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every pair of changes of the formation at one step: what is used of whom follows from the order alone."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from satform_msgs.msg import Command, FormationStatus

from formations import formation
from satform.consensus.graph import LineSpec
from satform.flight.compile import compile_scenario
from satform.flight.simulate import simulate
from satform.membership.absence_log import happened
from satform.membership.formation import (
    Event,
    Formation,
    ParameterChanged,
    Plan,
    SatelliteLost,
    SatelliteRejoined,
    TopologyChanged,
)
from satform.protocol.formation_view import FormationView
from satform.record.flight_record import FlightRecord
from satform.record.quantities import QUANTITIES
from satform.scenario import Scenario

BEFORE, STEP = 10, 20
"""Steps at which the other satellite is lost, and at which the pairs happen."""

LINE = LineSpec(kind="line").build(4)
EVENTS: dict[str, Event] = {
    "sat2 lost": SatelliteLost(1, "tested"),
    "sat2 back": SatelliteRejoined(1, 8),
    "sat3 lost": SatelliteLost(2, "tested"),
    "sat3 back": SatelliteRejoined(2, None),
    "graph": TopologyChanged(LINE, "tested"),
    "gain": ParameterChanged(0, "controller.proportional_gain", (0.05,)),
}
PAIRS = list(itertools.permutations(EVENTS, 2))
UNRELATED = [pair for pair in itertools.combinations(EVENTS, 2) if pair[0].split()[0] != pair[1].split()[0]]
LOST_BEFORE = {"all fly": (), "sat2 lost": (1,), "sat3 lost": (2,), "two lost": (1, 2)}


def four() -> Scenario:
    satellites = [{"arc_length": 100.0 * i, "position_error": [2.0 * i, 1.0, -1.0]} for i in range(4)]
    return formation(satellites, 13.0, checkpoint_period=2.0)


def flown(*events: Event, lost_before: Sequence[int] = ()) -> FlightRecord:
    plan: Plan = {STEP: list(events)}
    if lost_before:
        plan[BEFORE] = [SatelliteLost(satellite, "tested") for satellite in lost_before]
    return simulate(four(), events=plan)


def same(first: FlightRecord, second: FlightRecord) -> bool:
    return first.differences(second) == []


def without_announcement(record: FlightRecord, satellite: int, step: int) -> FlightRecord:
    """The record without what a satellite announced for one step, which nobody may have used."""
    changed = {name: getattr(record, name).copy() for name in QUANTITIES}
    changed["arc_length"][step, satellite] = changed["rate"][step, satellite] = np.nan
    return replace(record, **changed)


@pytest.mark.parametrize(("first", "second"), UNRELATED)
@pytest.mark.parametrize("before", LOST_BEFORE.values(), ids=LOST_BEFORE.keys())
def test_what_concerns_different_things_may_come_in_either_order(
    first: str, second: str, before: tuple[int, ...]
) -> None:
    one, other = EVENTS[first], EVENTS[second]
    assert same(flown(one, other, lost_before=before), flown(other, one, lost_before=before))


def test_one_who_is_lost_and_rejoins_is_used_by_its_last_announcement_and_then_by_the_new_ones() -> None:
    whole, lost = flown(), flown(EVENTS["sat2 lost"])
    both = flown(EVENTS["sat2 lost"], SatelliteRejoined(1, None))
    others = [0, 2, 3]
    # At the step itself its neighbours act as if nothing had happened.
    for record in (whole, lost):
        assert np.array_equal(both.acceleration[STEP, others], record.acceleration[STEP, others])
        assert np.array_equal(both.rate[: STEP + 2, others], record.rate[: STEP + 2, others])
    assert np.array_equal(both.arc_length[: STEP + 1], whole.arc_length[: STEP + 1])
    # With its flight plan alone it is at its nominal rate; that is used from the next step on.
    assert both.arc_length[STEP + 1, 1] == pytest.approx(100.0 + 2.0 * 0.5 * (STEP + 1), abs=0.5)
    assert not np.array_equal(both.rate[STEP + 2, others], whole.rate[STEP + 2, others])
    assert not np.array_equal(both.rate[STEP + 2, others], lost.rate[STEP + 2, others])


def test_one_who_rejoins_and_is_lost_has_never_been_back_for_the_others() -> None:
    stays = flown(lost_before=[1])
    gone_again = flown(EVENTS["sat2 back"], EVENTS["sat2 lost"], lost_before=[1])
    assert same(without_announcement(gone_again, 1, STEP), without_announcement(stays, 1, STEP))


def test_lost_back_and_lost_once_more_at_one_step_is_lost() -> None:
    lost, back = EVENTS["sat2 lost"], EVENTS["sat2 back"]
    assert same(flown(lost, back, lost), flown(lost))
    assert same(flown(lost, back, lost, back), flown(lost, back))


def test_a_rejoined_satellite_is_used_from_the_step_after_its_return_on() -> None:
    stays = flown(lost_before=[1])
    back = flown(EVENTS["sat2 back"], lost_before=[1])
    others = [0, 2, 3]
    assert np.array_equal(back.rate[: STEP + 2, others], stays.rate[: STEP + 2, others])
    assert not np.array_equal(back.rate[STEP + 2, others], stays.rate[STEP + 2, others])


class Received:
    """What the plant publishes of a formation, and what a satellite and the reader of a bag make of it."""

    def __init__(self) -> None:
        scenario = four()
        self.names = [satellite.name for satellite in scenario.satellites]
        self.formation, self.view = (
            Formation.of(scenario.membership_plan()),
            FormationView(compile_scenario(scenario)),
        )
        self.statuses: list[FormationStatus] = []

    def happen(self, step: int, event: Event) -> None:
        spoke = isinstance(event, SatelliteLost) and self.formation.is_used_by_neighbours(
            event.satellite, step
        )
        if not self.formation.apply([event], step, self.names):
            return
        listeners, speakers = np.nonzero(self.formation.graph.adjacency)
        status = FormationStatus(
            step=step,
            version=self.formation.number,
            phase=FormationStatus.FLYING,
            satellites=self.names,
            alive=self.formation.alive.tolist(),
            edge_receivers=listeners.tolist(),
            edge_senders=speakers.tolist(),
        )
        seconds, half = divmod(step, 2)
        status.header.stamp.sec, status.header.stamp.nanosec = seconds, half * 500_000_000
        if isinstance(event, SatelliteLost):
            last = Command(step=step - 1 if spoke else 0)
            last.header.frame_id = "lvlh" if spoke else ""
            status.lost, status.final_commands = [self.names[event.satellite]], [last]
        if isinstance(event, SatelliteRejoined):
            status.rejoined = [self.names[event.satellite]]
            status.rejoin_checkpoints = [-1 if event.checkpoint is None else event.checkpoint]
        assert self.view.take(status)
        self.statuses.append(status)


@pytest.mark.parametrize("step", [1, STEP])
@pytest.mark.parametrize("before", LOST_BEFORE.values(), ids=LOST_BEFORE.keys())
@pytest.mark.parametrize("names", [*PAIRS, ("sat2 lost", "sat2 back", "sat2 lost")])
def test_satellites_and_readers_of_a_bag_take_every_pair_as_the_flight_in_one_process_does(
    names: tuple[str, ...], before: tuple[int, ...], step: int
) -> None:
    told = Received()
    if step > BEFORE:
        for satellite in before:
            told.happen(BEFORE, SatelliteLost(satellite, "tested"))
    changing = [EVENTS[name] for name in names if not isinstance(EVENTS[name], ParameterChanged)]
    for event in changing:
        told.happen(step, event)
    for now in (step, step + 1):
        for satellite in range(4):
            expected = told.formation.is_used_by_neighbours(satellite, now)
            assert told.view.is_used_by_neighbours(satellite, now) == expected, (satellite, now)
    again = Formation.of(four().membership_plan())
    for at, events in sorted(happened(told.statuses, [], compile_scenario(four()).membership).items()):
        again.apply(events, at, told.names)
    assert (again.lost_at, again.rejoined_at) == (told.formation.lost_at, told.formation.rejoined_at)
    assert np.array_equal(again.alive, told.formation.alive)
    assert np.array_equal(again.graph.adjacency, told.formation.graph.adjacency)
