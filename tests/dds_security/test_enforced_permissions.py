# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Cyclone DDS and Fast DDS let nodes do what the keystore permits, and refuse everything else."""

from collections.abc import Callable
from pathlib import Path

import pytest

from changed_keystores import sign_changed
from enforced_access import all_at_once, all_topics, assert_enforced, refused_by
from flights import shipped
from formation_access import Permitted, permitted
from satform.communication.topic_table import KINDS_OF_A_SATELLITE, channels
from satform.flight.compile import topic_plan
from satform.scenario import Scenario
from satform_tools.security.keystore import make
from satform_tools.security.permission_documents import ANY_DOMAIN
from secured_participants import (
    CycloneProgram,
    FastDdsProgram,
    NotBuiltError,
    Participant,
    Participants,
    Program,
    build_cyclone,
    build_fastdds,
)

BASIC = ("state", "arc_length", "command", "tracking", "parameter_changes")
"""Kinds of topics of a satellite without sensors and filters."""

FOUR_DIRECTED = "graph={kind: matrix, rows: [[0,1,0,0],[0,0,1,0],[0,0,0,1],[1,1,0,0]]}"
THREE_DIRECTED = "graph={kind: matrix, rows: [[0,1,0],[0,0,1],[1,0,0]]}"
THREE_HEARD = {"sat1": "sat2", "sat2": "sat3", "sat3": "sat1"}

GRAPHS = {
    "graph={kind: complete}": "two three four, one three four, one two four, one two three",
    "graph={kind: ring}": "two four, one three, two four, one three",
    "graph={kind: line}": "two, one three, two four, three",
    "graph={kind: star}": "two three four, one, one, one",
    FOUR_DIRECTED: "two, three, four, one two",
}
"""For each graph the satellites whose phases the satellites one, two, three and four read."""

NAVIGATION = ("measurements", "truth", "estimate", "navigation_estimate")
ATTITUDE = ("measurements", "attitude", "attitude_estimate")
MOTION = ("state", "motion", "command", "tracking", "parameter_changes")

EQUIPMENT = {
    "bearing_only_swarm": (
        *((FOUR_DIRECTED,), (*BASIC, *NAVIGATION)),
        {"sat1": "sat2", "sat2": "sat3", "sat3": "sat4", "sat4": "sat1 sat2"},
    ),
    "star_tracker_gyro_pointing": ((THREE_DIRECTED,), (*BASIC, *ATTITUDE), THREE_HEARD),
    "thruster_limited": ((THREE_DIRECTED,), (*BASIC, "propulsion"), THREE_HEARD),
    "radio_links_spread": (
        *(("graph={kind: star}",), (*BASIC, "link_conditions")),
        {"sat1": "sat2 sat3 sat4 sat5", **dict.fromkeys(("sat2", "sat3", "sat4", "sat5"), "sat1")},
    ),
    "leo_degree10": (
        *(("publish_orbits=true",), (*BASIC, "orbit_state")),
        {"coasting": "", "sat1": "sat2 sat3", "sat2": "sat1 sat3", "sat3": "sat1 sat2"},
    ),
    "directed_triangle_close": ((), MOTION, THREE_HEARD),
}
"""Scenarios with sensors, thrusters and links: changes, kinds of topics, and who reads whose phase."""


def four_satellites(*changes: str) -> Scenario:
    names = ("one", "two", "three", "four")
    satellites = ", ".join(f"{{name: {name}, curve: {{kind: circle, radius: 1000.0}}}}" for name in names)
    return shipped("triangle", "expect=[]", f"satellites=[{satellites}]", *changes)


def heard(graph: str) -> dict[str, str]:
    return dict(zip(("one", "two", "three", "four"), GRAPHS[graph].split(", "), strict=True))


def all_of_four(
    graph: str,
    program: Program,
    participants: Participants,
    keystore: Path,
    *,
    own_checks: bool,
) -> tuple[dict[str, Permitted], list[Participant]]:
    """What each node of four satellites may do, and all of them once each has tried everything."""
    make(four_satellites(graph), keystore, 30, ANY_DOMAIN)
    nodes = permitted(BASIC, heard(graph))
    return nodes, all_at_once(participants, program, keystore, nodes, own_checks=own_checks)


@pytest.mark.parametrize("graph", GRAPHS)
def test_a_node_is_held_to_its_permissions_by_its_own_dds(
    graph: str, cyclone: CycloneProgram, participants: Participants, tmp_path: Path
) -> None:
    nodes, flying = all_of_four(graph, cyclone, participants, tmp_path / "keystore", own_checks=True)
    assert_enforced(nodes, flying)
    for participant in flying[: len(nodes)]:
        assert set(participant.refused) == refused_by(nodes, participant.name)
        assert set(participant.refused.values()) == {"Not Allowed By Security"}


@pytest.mark.parametrize("kind", ["read", "write"])
def test_such_a_node_would_be_seen_if_the_others_did_not_check_it(
    kind: str, cyclone: CycloneProgram, participants: Participants, tmp_path: Path
) -> None:
    keystore = tmp_path / "keystore"
    make(shipped("triangle", THREE_DIRECTED), keystore, 30, ANY_DOMAIN)
    rule = f"<enable_{kind}_access_control>"
    sign_changed(keystore, keystore / "enclaves" / "governance.p7s", f"{rule}true", f"{rule}false")
    nodes = permitted(BASIC, THREE_HEARD)
    flying = {one.name: one for one in all_at_once(participants, cyclone, keystore, nodes, own_checks=False)}
    # Only sat1 may publish this phase, and of the satellites only sat3 may read it.
    reader, writer = ("sat2", "sat1") if kind == "read" else ("sat3", "sat2")
    assert flying[reader].received["rt/sat1/arc_length", writer] > 0


@pytest.mark.parametrize("graph", [FOUR_DIRECTED, "graph={kind: star}"])
def test_fast_dds_enforces_the_same_documents(
    graph: str, fastdds: FastDdsProgram, participants: Participants, tmp_path: Path
) -> None:
    nodes, flying = all_of_four(graph, fastdds, participants, tmp_path / "keystore", own_checks=True)
    assert_enforced(nodes, flying)
    for participant in flying[: len(nodes)]:
        refused = refused_by(nodes, participant.name)
        assert set(participant.refused) == refused
        reports = participant.log.read_text()
        assert all(f"{topic} topic not found in allow rule" in reports for _, topic in refused)


@pytest.mark.parametrize("graph", GRAPHS)
def test_a_node_that_ignores_its_permissions_is_held_to_them_by_the_others(
    graph: str, cyclone: CycloneProgram, participants: Participants, tmp_path: Path
) -> None:
    nodes, flying = all_of_four(graph, cyclone, participants, tmp_path / "keystore", own_checks=False)
    assert not any(participant.refused for participant in flying)
    assert_enforced(nodes, flying)


@pytest.mark.parametrize("name", EQUIPMENT)
def test_topics_of_equipment_reach_those_who_need_them_and_nobody_else(
    name: str, cyclone: CycloneProgram, participants: Participants, tmp_path: Path
) -> None:
    changes, kinds, readers = EQUIPMENT[name]
    scenario = shipped(name, "expect=[]", *changes)
    make(scenario, tmp_path / "keystore", 30, ANY_DOMAIN)
    nodes = permitted(kinds, readers)
    assert {f"rt{channel.topic}" for channel in channels(topic_plan(scenario))} <= set(all_topics(nodes))
    flying = all_at_once(participants, cyclone, tmp_path / "keystore", nodes, own_checks=False)
    assert_enforced(nodes, flying)


@pytest.mark.parametrize("build", [build_cyclone, build_fastdds])
def test_a_machine_that_cannot_build_the_participants_is_told_apart_from_a_failure(
    build: Callable[[Path], Program], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(NotBuiltError, match="there is no"):
        build(tmp_path)


def test_no_kind_of_topic_is_left_out() -> None:
    assert {*BASIC, *(kind for _, kinds, _ in EQUIPMENT.values() for kind in kinds)} == {
        *KINDS_OF_A_SATELLITE
    }


LINE, RING = "graph={kind: line}", "graph={kind: ring}"
"""Over the ring the first and the fourth satellite read each other too, over neither the first and third."""


@pytest.mark.parametrize(
    ("changes", "further"),
    [
        pytest.param(["graph_schedule=[{at: 100.0, graph: {kind: ring}}]"], None, id="in the scenario"),
        pytest.param([], RING, id="for a service"),
    ],
)
def test_edges_of_all_possible_graphs_are_open_during_the_whole_flight_and_no_others(
    changes: list[str],
    further: str | None,
    cyclone: CycloneProgram,
    participants: Participants,
    tmp_path: Path,
) -> None:
    graph = None if further is None else four_satellites(further).possible_graph()
    make(four_satellites(LINE, *changes), tmp_path / "keystore", 30, ANY_DOMAIN, graph)
    nodes = permitted(BASIC, heard(RING))
    flying = all_at_once(participants, cyclone, tmp_path / "keystore", nodes, own_checks=False)
    assert_enforced(nodes, flying)
