# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who flies and who hears whom: losses, returns and changes of the graph, numbered for everyone alike."""

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from formations import formation
from satform.consensus.graph import CompleteSpec, LineSpec, NoneSpec
from satform.membership.formation import (
    Formation,
    GraphChangeSpec,
    SatelliteLost,
    SatelliteRejoined,
    TopologyChanged,
    has_individual_events,
    merge_plans,
    possible_graph,
)
from satform.scenario import Scenario

NAMES = ("sat1", "sat2", "sat3")


def scenario(count: int = 3, **other: Any) -> Scenario:
    return formation([{} for _ in range(count)], 100.0, **{"graph": {"kind": "line"}, **other})


def test_at_the_start_everybody_flies_on_the_scenario_s_graph() -> None:
    start = Formation.of(scenario().membership_plan())
    assert start.number == 0
    assert start.alive.all()
    # Eigenvalues of a line of three are 0, 1 and 3.
    assert start.connectivity == pytest.approx(1.0)
    assert start.linked(1, [0, 2]).tolist() == [1.0, 1.0]
    assert start.linked(0, [1, 2]).tolist() == [1.0, 0.0]


def test_a_loss_is_a_numbered_state_with_step_and_reason() -> None:
    state = Formation.of(scenario().membership_plan())
    assert state.apply([SatelliteLost(0, "sat1 is gone")], 7, NAMES)
    assert (state.number, state.step, state.reason) == (1, 7, "sat1 is gone")
    assert state.alive.tolist() == [False, True, True]
    assert state.lost_at == {0: 7}


def test_connectivity_is_that_of_the_graph_of_those_that_fly() -> None:
    state = Formation.of(scenario().membership_plan())
    state.apply([SatelliteLost(0, "")], 1, NAMES)
    # A line of two has the eigenvalues 0 and 2.
    assert state.connectivity == pytest.approx(2.0)
    middle = Formation.of(scenario().membership_plan())
    middle.apply([SatelliteLost(1, "")], 1, NAMES)
    assert middle.connectivity == pytest.approx(0.0)
    middle.apply([SatelliteLost(0, ""), SatelliteLost(2, "")], 2, NAMES)
    assert middle.connectivity == 0.0


def test_what_happens_in_one_step_is_one_new_state() -> None:
    state = Formation.of(scenario().membership_plan())
    events = [
        SatelliteLost(0, "first"),
        SatelliteLost(1, "second"),
        TopologyChanged(CompleteSpec().build(3), "third"),
    ]
    assert state.apply(events, 3, NAMES)
    assert (state.number, state.reason) == (1, "first; second; third")
    assert state.graph.neighbours(0) == (1, 2)


def test_who_is_lost_is_not_lost_again_and_who_flies_does_not_return() -> None:
    state = Formation.of(scenario().membership_plan())
    state.apply([SatelliteLost(0, "once")], 3, NAMES)
    assert not state.apply([SatelliteLost(0, "twice"), SatelliteRejoined(1, None)], 5, NAMES)
    assert (state.number, state.step) == (1, 3)
    assert state.apply([SatelliteRejoined(0, None)], 6, NAMES)
    assert (state.number, state.reason) == (2, "sat1 is back")
    assert state.alive.all()


LOST = {"kind": "satellite_lost", "satellite": "sat2", "at": 10.2, "rejoin_at": 20.0, "memory": "plan"}


def test_a_scenario_s_plan_has_each_event_at_its_step() -> None:
    plan = (
        scenario(faults=[LOST], graph_schedule=[{"at": 20.0, "graph": {"kind": "none"}}, {"at": 5.0, **ADD}])
        .membership_plan()
        .events
    )
    assert {step: [type(event) for event in events] for step, events in plan.items()} == {
        10: [TopologyChanged],
        21: [SatelliteLost],
        40: [TopologyChanged, SatelliteRejoined],
    }
    assert list(plan) == [10, 21, 40]


ADD = {"add": [["sat1", "sat3"]], "remove": [["sat2", "sat1"]]}


def test_edges_that_come_and_go_build_on_the_graph_before() -> None:
    plan = (
        scenario(graph_schedule=[{"at": 5.0, **ADD}, {"at": 6.0, "add": [["sat2", "sat1"]]}])
        .membership_plan()
        .events
    )
    first, second = plan[10][0], plan[12][0]
    assert isinstance(first, TopologyChanged)
    assert isinstance(second, TopologyChanged)
    # An edge is named by listener and speaker.
    assert first.graph.neighbours(0) == (1, 2)
    assert first.graph.neighbours(1) == (2,)
    assert second.graph.neighbours(0) == (1, 2)
    assert second.graph.neighbours(1) == (0, 2)


def test_the_possible_graph_has_every_edge_that_there_is_at_some_time() -> None:
    own = scenario(
        graph={"kind": "none"}, graph_schedule=[{"at": 5.0, **ADD}, {"at": 9.0, "remove": [["sat1", "sat3"]]}]
    )
    possible = possible_graph(own.communication_graph(), own.membership_plan().events)
    assert possible.edges == ((2, 0),)
    assert own.possible_graph().edges == ((2, 0),)


def test_an_early_change_that_is_listed_late_comes_first_all_the_same() -> None:
    listed = [{"at": 9.0, "remove": [["sat1", "sat2"]]}, {"at": 5.0, "graph": {"kind": "complete"}}]
    plan = scenario(graph_schedule=listed).membership_plan().events
    final = plan[18][0]
    assert isinstance(final, TopologyChanged)
    assert final.graph.neighbours(0) == (2,)
    assert final.graph.neighbours(1) == (0, 2)


def test_plans_are_merged_step_by_step_and_say_whether_somebody_is_lost() -> None:
    first, second = (
        {3: [TopologyChanged(NoneSpec().build(2), "")]},
        {3: [SatelliteLost(0, "")], 5: [SatelliteRejoined(0, None)]},
    )
    whole = merge_plans(first, second)
    assert [type(event) for event in whole[3]] == [TopologyChanged, SatelliteLost]
    assert has_individual_events(whole)
    assert not has_individual_events(first)
    assert len(first[3]) == 1


def test_a_return_that_happened_overrules_the_one_that_was_planned() -> None:
    first = {5: [SatelliteRejoined(0, 4), SatelliteRejoined(1, 4)], 6: [SatelliteRejoined(0, 4)]}
    assert merge_plans(first, {5: [SatelliteRejoined(0, 2)]}) == {
        5: [SatelliteRejoined(1, 4), SatelliteRejoined(0, 2)],
        6: [SatelliteRejoined(0, 4)],
    }
    assert first[5] == [SatelliteRejoined(0, 4), SatelliteRejoined(1, 4)]


def test_a_graph_change_may_name_any_topology_that_exists_for_so_many() -> None:
    change = GraphChangeSpec.model_validate({"at": 1.0, "graph": {"kind": "star", "centre": 2}})
    assert change.applied(LineSpec().build(3), NAMES).neighbours(2) == (0, 1)
    wrong = GraphChangeSpec.model_validate({"at": 1.0, "graph": {"kind": "star", "centre": 3}})
    with pytest.raises(ValueError, match="numbered 0 to 2"):
        wrong.applied(LineSpec().build(3), NAMES)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({}, "nothing changes: give a graph, or edges to add or remove"),
        ({"add": [["sat1", "sat2"]], "remove": [["sat1", "sat2"]]}, "cannot both come and go"),
    ],
)
def test_a_change_that_changes_nothing_definite_is_refused(fields: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValidationError, match=sentence):
        GraphChangeSpec.model_validate({"at": 1.0, **fields})


def test_a_mask_of_those_alive_belongs_to_one_formation_only() -> None:
    first, second = Formation.of(scenario().membership_plan()), Formation.of(scenario().membership_plan())
    first.apply([SatelliteLost(0, "")], 1, NAMES)
    assert np.array_equal(second.alive, [True, True, True])
