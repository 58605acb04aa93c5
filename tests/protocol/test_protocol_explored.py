# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""No order of messages, losses, restarts, pauses and other graphs breaks an invariant of the protocol."""

import os

import pytest
from protocol_explorer import Explorer, Outcome
from protocol_processes import PlantProcess
from protocol_search import CompiledExplorer
from protocol_transitions import State

from formations import formation
from satform.scenario import Scenario

LONG = "SATFORM_LONG_TESTS"
"""Environment variable: when set, the bounds of docs/protocol.md are explored too."""

CHECKPOINTS = 0.5
"""Simulated time between two checkpoints, s: one at each step."""


def flight(satellites: int, steps: int) -> Scenario:
    """A complete graph of satellites, in which each message changes what its receiver computes."""
    own = [{"arc_length": 100.0 * i, "position_error": [10.0 * i, 5.0, -3.0]} for i in range(satellites)]
    return formation(own, 0.5 * steps, checkpoint_period=CHECKPOINTS)


def assert_nothing_found(outcome: Outcome) -> None:
    history = "\n  ".join(outcome.history)
    assert not outcome.violation, f"{outcome.violation}, after\n  {history}"
    assert outcome.ends


@pytest.mark.parametrize(("satellites", "steps", "disturbances"), [(2, 3, 1), (3, 2, 0)], ids=str)
def test_no_reachable_state_breaks_an_invariant(satellites: int, steps: int, disturbances: int) -> None:
    outcome = CompiledExplorer(flight(satellites, steps), budget=disturbances).explore()
    assert_nothing_found(outcome)
    assert outcome.complete


@pytest.mark.skipif(LONG not in os.environ, reason=f"NOT TESTED: takes minutes; set {LONG}=1")
@pytest.mark.parametrize(
    ("satellites", "steps", "disturbances", "cuts"),
    [(2, 4, 1, False), (2, 3, 2, False), (2, 4, 2, False), (3, 3, 1, True), (3, 4, 1, True)],
)
def test_no_reachable_state_of_the_documented_bounds_breaks_an_invariant(
    satellites: int, steps: int, disturbances: int, cuts: bool
) -> None:
    outcome = CompiledExplorer(flight(satellites, steps), budget=disturbances, cuts=cuts).explore()
    assert_nothing_found(outcome)
    assert outcome.complete


@pytest.mark.parametrize("reduced", [True, False])
def test_the_compiled_search_visits_the_same_states(reduced: bool) -> None:
    found = []
    for kind in (Explorer, CompiledExplorer):
        explorer = kind(flight(2, 2), budget=1, faults=("kill", "delay", "silent"), reduced=reduced)
        outcome = explorer.explore()
        ends = {position_at(plant) for plant in explorer.ended_plants()}
        found.append((outcome.states, outcome.transitions, outcome.ends, ends))
    assert found[0] == found[1]


def test_orders_that_are_left_out_lead_to_no_other_end() -> None:
    ends: list[set[bytes]] = []
    for reduced, cuts in ((False, False), (True, False), (True, True)):
        explorer = CompiledExplorer(flight(2, 2), budget=1, reduced=reduced, cuts=cuts)
        assert_nothing_found(explorer.explore())
        ends.append({position_at(plant) for plant in explorer.ended_plants()})
    assert ends[0] == ends[1] == ends[2]


@pytest.mark.skipif(LONG not in os.environ, reason=f"NOT TESTED: takes minutes; set {LONG}=1")
@pytest.mark.parametrize(("satellites", "steps", "disturbances"), [(2, 3, 1), (2, 2, 2)])
def test_orders_that_are_left_out_lead_to_no_other_end_of_longer_flights(
    satellites: int, steps: int, disturbances: int
) -> None:
    ends: list[set[bytes]] = []
    for reduced, cuts in ((False, False), (True, True)):
        explorer = CompiledExplorer(
            flight(satellites, steps), budget=disturbances, reduced=reduced, cuts=cuts
        )
        assert_nothing_found(explorer.explore())
        ends.append({position_at(plant) for plant in explorer.ended_plants()})
    assert ends[0] == ends[1]


def position_at(plant: PlantProcess) -> bytes:
    formation_then = plant.membership.formation
    return plant.steps.plant.motion().position.tobytes() + formation_then.alive.tobytes()


def test_random_flights_of_four_satellites_with_three_disturbances_break_no_invariant() -> None:
    walks = 10_000 if LONG in os.environ else 40
    assert_nothing_found(CompiledExplorer(flight(4, 4), budget=3).walk(seed=1, walks=walks))


def flown_on(explorer: Explorer, state: State) -> PlantProcess:
    """The plant at the end of a flight that goes on by the first of the possible actions."""
    while not explorer.over(state):
        state = explorer.after(state, explorer.actions(state)[0])
    (plant,) = explorer.ended_in([state])
    return plant


STARTED = ("deliver status sat1", "deliver status sat2", "deliver state sat1", "deliver state sat2")
"""Two satellites have the state of the first step."""

ANNOUNCED = (*STARTED, "deliver announcement sat1 to sat2", "deliver announcement sat2 to sat1")
"""Both have acted in it."""

LOST_BEFORE_ITS_FIRST_STATE = (
    *ANNOUNCED,
    "deliver command sat1",
    "kill sat1 (left: 0 of announcement sat1 to sat2)",
    "deliver lost",
    "deliver command sat2",
    "deliver status sat2",
    "restart sat1",
    "deliver status sat1",
    "deliver status sat1",
    "deliver ready sat1",
    "deliver state sat2",
    "deliver command sat2",
    "deliver status sat1",
    "deliver status sat2",
    "silent sat1",
    "deliver status sat1",
    "deliver announcement sat2 to sat1",
    "deliver state sat1",
)
"""A history that the explorer has found: a satellite flew on though it knew that it was lost."""


def test_a_satellite_that_is_lost_again_before_its_first_state_offers_itself_again() -> None:
    explorer = Explorer(flight(2, 4), budget=2)
    state = explorer.follow(LOST_BEFORE_ITS_FIRST_STATE)
    assert "deliver ready sat1" in {explorer.described(action) for action in explorer.actions(state)}


REPORTED_LATE = (
    *ANNOUNCED,
    "deliver announcement sat1 to sat2",
    "deliver announcement sat2 to sat1",
    "deliver command sat1",
    "deliver command sat2",
    "silent sat1",
    "deliver status sat1",
    "restart sat1",
    "deliver status sat1",
)
"""A satellite that was declared lost ends, and is started again before the plant has read of its end."""


def test_the_end_of_a_process_that_is_read_late_does_not_count_against_the_next_one() -> None:
    explorer = Explorer(flight(2, 4), budget=1)
    state = explorer.follow((*REPORTED_LATE, "deliver ready sat1"))
    assert "deliver lost" not in {explorer.described(action) for action in explorer.actions(state)}
    plant = flown_on(explorer, state)
    assert plant.membership.formation.alive.tolist() == [True, True]


READY_BEFORE_THE_LOSS = (
    *STARTED,
    "deliver announcement sat2 to sat1",
    "deliver announcement sat1 to sat2",
    "deliver command sat1",
    "kill sat1 (left: 1 of announcement sat1 to sat2)",
    "restart sat1",
    "deliver ready sat1",
    "deliver lost",
)
"""A satellite is started again so soon that the plant rejects its readiness as that of a second process."""


def test_a_satellite_that_was_ready_before_its_loss_took_effect_rejoins() -> None:
    explorer = Explorer(flight(2, 4), budget=1)
    state = explorer.follow(READY_BEFORE_THE_LOSS)
    plant = flown_on(explorer, state)
    assert plant.membership.formation.alive.tolist() == [True, True]
    assert plant.membership.formation.rejoined_at == {0: 2}


LOST_TWICE_WITH_AN_UNFLOWN_CHECKPOINT = (
    *ANNOUNCED,
    "deliver announcement sat1 to sat2",
    "deliver command sat1",
    "deliver command sat2",
    "deliver state sat1",
    "deliver state sat2",
    "silent sat2",
    "deliver status sat2",
    "restart sat2",
    "deliver status sat2",
    "deliver status sat2",
    "deliver ready sat2",
    "kill sat2 (left: 1 of ready sat2, 0 of announcement sat2 to sat1, 0 of command sat2)",
    "deliver status sat1",
    "deliver command sat1",
    "deliver status sat1",
    "deliver lost",
    "deliver status sat1",
    "deliver ready sat2",
    "deliver state sat1",
    "deliver command sat1",
    "deliver status sat1",
    "deliver state sat1",
)
"""A history that the explorer has found: a satellite stored a checkpoint after a command that did not arrive,
came back from its flight plan, was lost before it flew, and its offer was read once more. Its checkpoint
counted then."""


def test_a_checkpoint_of_before_the_return_that_was_not_flown_does_not_count_after_a_second_loss() -> None:
    explorer = Explorer(flight(2, 4), budget=2)
    state = explorer.follow(LOST_TWICE_WITH_AN_UNFLOWN_CHECKPOINT)
    flown_on(explorer, state)
