# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Processes of a large run call their partners' ports and those of programs that are no part of the run."""

import socket
from pathlib import Path
from xml.etree import ElementTree

import pytest

from satform.flight.compile import FormationPlan, compile_scenario
from satform.scenario import parse_scenario
from satform_bringup.deployment import middleware, participant_ports
from satform_bringup.deployment.node_processes import NodeProcess, processes
from satform_nodes import EDGES_OF_SCENARIO
from satform_tools.bench.scaling import ring

DOMAIN = 231
"""Has no flight on one machine and none on several."""

ALL = range(7400 + 250 * DOMAIN + 10, 7400 + 250 * DOMAIN + 210, 2)
"""Discovery ports of 100 participants by the formula of RTPS 2.2, section 9.6.1.1."""


@pytest.fixture(autouse=True)
def without_profile(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(participant_ports, "FEWEST_PROCESSES", 9)
    for name in middleware.VARIABLES:
        monkeypatch.delenv(name, raising=False)


@pytest.fixture(scope="module")
def plan() -> FormationPlan:
    """Ten satellites on a ring, each of which receives from the one before and the one after."""
    return compile_scenario(parse_scenario(ring(10, 5).to_json()))


def started(plan: FormationPlan, group: int = 1, *, display: bool = False) -> list[NodeProcess]:
    return processes(plan, Path("scenario.json"), Path("bag"), group, display=display)


def ports(node: NodeProcess) -> tuple[int, set[int]]:
    """Own port and the ports that are called, from a process's profile."""
    tree = ElementTree.parse(node.environment[middleware.VARIABLES[0]])  # noqa: S314 - written by the code
    found = {
        part: [int(entry.text or 0) for entry in element.iter() if entry.tag.endswith("}port")]
        for part in ("metatrafficUnicastLocatorList", "initialPeersList")
        for element in tree.iter()
        if element.tag.endswith("}" + part)
    }
    (own,) = found["metatrafficUnicastLocatorList"]
    assert len(set(found["initialPeersList"])) == len(found["initialPeersList"])
    return own, set(found["initialPeersList"])


def test_satellites_call_plant_recorder_neighbours_and_foreign_programs(
    plan: FormationPlan, tmp_path: Path
) -> None:
    with participant_ports.assigned(started(plan), plan, DOMAIN, tmp_path) as nodes:
        own = {node.name: ports(node)[0] for node in nodes}
        called = {node.name: ports(node)[1] for node in nodes}
    assert len(set(own.values())) == len(nodes) == 12
    assert set(own.values()) <= set(ALL)
    foreign = set(ALL) - set(own.values())
    for index in range(10):
        neighbours = {f"s{(index - 1) % 10}", f"s{(index + 1) % 10}"}
        partners = {own[name] for name in {"plant", "recorder"} | neighbours}
        assert called[f"s{index}"] == partners | foreign
    assert called["plant"] == set(ALL) - {own["plant"]}
    assert [node.name for node in nodes if EDGES_OF_SCENARIO in node.environment] == ["plant"]


def test_observers_find_the_lowest_ports_free_and_call_everyone(plan: FormationPlan, tmp_path: Path) -> None:
    nodes = started(plan, display=True)
    with participant_ports.assigned(nodes, plan, DOMAIN, tmp_path) as nodes:
        own = {node.name: ports(node)[0] for node in nodes}
        assert ports(nodes[-1])[1] == set(ALL) - {own["display"]}
    assert min(own.values()) >= ALL[2]


def test_a_port_that_another_program_has_is_not_given_to_a_process(
    plan: FormationPlan, tmp_path: Path
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as program:
        program.bind(("127.0.0.1", ALL[5]))
        with participant_ports.assigned(started(plan), plan, DOMAIN, tmp_path) as nodes:
            assert ALL[5] not in {ports(node)[0] for node in nodes}
            assert all(ALL[5] in ports(node)[1] for node in nodes)


def test_two_runs_in_a_domain_have_no_port_in_common(plan: FormationPlan, tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("first", "second")]
    for folder in folders:
        folder.mkdir()
    with (
        participant_ports.assigned(started(plan), plan, DOMAIN, folders[0]) as first,
        participant_ports.assigned(started(plan), plan, DOMAIN, folders[1]) as second,
    ):
        assert not {ports(node)[0] for node in first} & {ports(node)[0] for node in second}


def test_a_group_of_satellites_calls_the_neighbours_of_each(tmp_path: Path) -> None:
    plan = compile_scenario(parse_scenario(ring(20, 5).to_json()))
    with participant_ports.assigned(started(plan, 2), plan, DOMAIN, tmp_path) as nodes:
        own = {node.name: ports(node)[0] for node in nodes}
        called = ports(next(node for node in nodes if node.name == "group3"))[1]
    groups = {name: port for name, port in own.items() if name.startswith("group")}
    assert {name for name, port in groups.items() if port in called} == {"group2", "group4"}


def test_small_runs_and_those_without_enough_ports_are_left_as_they_are(
    plan: FormationPlan, tmp_path: Path
) -> None:
    small = started(plan)[:8]
    with participant_ports.assigned(small, plan, DOMAIN, tmp_path) as nodes:
        assert nodes == small
    # The last domain has 63 ports, of which two are left free.
    many = [NodeProcess(f"s{index}", "satellite_node") for index in range(62)]
    with participant_ports.assigned(many, plan, 232, tmp_path) as nodes:
        assert nodes == many
    assert list(tmp_path.iterdir()) == []
