# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What `check` and `show` say about links, changes of the graph, losses and checkpoints."""

from typing import Any

import pytest

from formations import formation
from satform.scenario import Scenario
from satform_tools.check.disturbances import describe_schedule, disturbance_warnings

GENTLE = {"tracking_gain": 1e-3, "coupling_gain": 1e-6, "rate_gain": 1e-3}


def scenario(**other: Any) -> Scenario:
    law = {**GENTLE, "neighbour_values": "extrapolate", **other.pop("consensus", {})}
    return formation([{} for _ in range(3)], 1000.0, **{"consensus": law, **other})


SPLIT = {"at": 100.0, "graph": {"kind": "none"}}
LOST = {"kind": "satellite_lost", "satellite": "sat2", "at": 100.0}


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        (
            {"links": {"default": {"delay": 50.0, "jitter": 5.0, "period": 10.0}}},
            "neighbour_timeout: 60 s is shorter than the largest message age of 65 s",
        ),
        (
            # Three satellites that all hear each other bear 1311.6 s with these gains, extrapolating.
            {"links": {"default": {"delay": 1312.0}}, "consensus": {"neighbour_timeout": 1e4}},
            "beyond the delay margin of 1311.58 s",
        ),
        (
            # 1e-3 / (1e-3 + 1e-6 * 2 * 50) of the rate is left.
            {"links": {"default": {"delay": 50.0}}, "consensus": {"neighbour_values": "hold"}},
            "slows the formation down to about 90.9 % of its rate",
        ),
        (
            {"graph": {"kind": "line"}, "links": {"edges": [{"sender": "sat1", "receiver": "sat3"}]}},
            "the graph has no edge from sat1 to sat3",
        ),
        (
            {"graph_schedule": [SPLIT]},
            "from 100 s on (the scenario changes the graph) the flying satellites are not",
        ),
        (
            {"graph": {"kind": "line"}, "faults": [LOST]},
            "from 100 s on (sat2 is killed by the scenario) the flying satellites are not connected",
        ),
        (
            {"graph": {"kind": "none"}, "graph_schedule": [{"at": 10.0, "add": [["sat1", "sat2"]]}]},
            "the union of all its graphs is not connected",
        ),
        ({"checkpoint_period": 10.0}, "checkpoints are written, but no satellite rejoins from one"),
        (
            {"faults": [{**LOST, "rejoin_at": 200.0}], "checkpoint_period": 150.0},
            "before its first checkpoint at 150 s; it rejoins from its flight plan",
        ),
        (
            {"faults": [{**LOST, "rejoin_at": 2000.0, "memory": "plan"}]},
            "sat2 rejoins at 2000 s, after the flight's end",
        ),
    ],
)
def test_what_is_unwise_is_said_in_one_sentence(fields: dict[str, Any], sentence: str) -> None:
    found = disturbance_warnings(scenario(**fields))
    assert len(found) == 1
    assert sentence in found[0]


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"links": {"default": {"loss": 0.9, "delay": 50.0, "jitter": 10.0}}},
        {"links": {"default": {"delay": 1311.0}}, "consensus": {"neighbour_timeout": 1311.0}},
        {"graph_schedule": [SPLIT, {"at": 500.0, "graph": {"kind": "line"}}]},
        {"graph": {"kind": "none"}},
        {"faults": [LOST]},
        {"faults": [{**LOST, "rejoin_at": 200.0}], "checkpoint_period": 50.0},
        {"checkpoint_period": 10.0, "tolerated_losses": 1},
    ],
)
def test_nothing_is_said_of_what_is_wise(fields: dict[str, Any]) -> None:
    assert disturbance_warnings(scenario(**fields)) == []


def test_graphs_that_are_connected_only_together_are_no_cause_for_warning() -> None:
    first, second = ([["sat1", "sat2"], ["sat2", "sat1"]], [["sat2", "sat3"], ["sat3", "sat2"]])
    changes = [
        {"at": 100.0 * place, "add": (second, first)[place % 2], "remove": (first, second)[place % 2]}
        for place in range(1, 10)
    ]
    rows = [[0, 0, 0], [0, 0, 1], [0, 1, 0]]
    assert (
        disturbance_warnings(scenario(graph={"kind": "matrix", "rows": rows}, graph_schedule=changes)) == []
    )


def test_every_planned_state_is_described_with_its_connectivity() -> None:
    planned = scenario(
        faults=[{**LOST, "rejoin_at": 300.0, "memory": "plan"}],
        graph_schedule=[{"at": 200.0, "graph": {"kind": "line"}}],
    )
    states = describe_schedule(planned)
    assert [(state.at, state.flying, state.edges, state.connected) for state in states] == [
        (100.0, 2, 2, True),
        (200.0, 2, 0, False),
        (300.0, 3, 4, True),
    ]
    # Eigenvalues: two in a pair 0 and 2; nobody linked 0 and 0; a line of three 0, 1 and 3.
    assert [state.connectivity for state in states] == pytest.approx([2.0, 0.0, 1.0])
