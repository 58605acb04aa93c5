# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Processes of a run use the loopback interface only; satellites with lean nodes fly the same bits."""

import json
from pathlib import Path

import pytest

from flights import shortened
from flown import assert_as_in_one_process, flown, processes_of
from satform.scenario import parse_scenario
from satform_bringup.deployment import local_discovery, participant_ports
from satform_tools.bench.scaling import ring
from satform_tools.cli import main as cli
from satform_tools.report import trace as flight_trace
from satform_tools.report.plots import trace as trace_plot
from satform_tools.run import output_folders

pytestmark = pytest.mark.unmeasured

LOOPBACK = "0100007F"
"""127.0.0.1, as the system's table of sockets has it."""

SCENARIO = ("triangle", 50.0)


@pytest.fixture(autouse=True)
def untold(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (local_discovery.RANGE, "ROS_STATIC_PEERS"):
        monkeypatch.delenv(name, raising=False)


def sockets_of(process: int) -> set[str]:
    """Numbers of a process's sockets."""
    links = [str(entry.readlink()) for entry in Path(f"/proc/{process}/fd").iterdir()]
    return {link[len("socket:[") : -1] for link in links if link.startswith("socket:[")}


def test_no_process_binds_to_another_interface_or_uses_shared_memory(tmp_path: Path) -> None:
    addresses: dict[str, set[str]] = {}
    shared: list[str] = []

    def look(_done: int, _all: int) -> None:
        if addresses:
            return
        table = [line.split() for line in Path("/proc/net/udp").read_text().splitlines()[1:]]
        for name, process in processes_of(tmp_path).items():
            own = sockets_of(process)
            addresses[name] = {row[1].partition(":")[0] for row in table if row[9] in own}
            shared.extend(
                line
                for line in Path(f"/proc/{process}/maps").read_text().splitlines()
                if "/fastrtps_" in line
            )

    _, bag = flown(shortened(*SCENARIO), tmp_path, look)
    assert set(addresses) == {"plant", "recorder", "sat1", "sat2", "sat3"}
    assert all(bound == {LOOPBACK} for bound in addresses.values()), addresses
    assert shared == []
    assert_as_in_one_process(bag)


def test_a_flight_of_lean_nodes_has_the_bits_of_the_in_process_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(local_discovery, "MAX_FULL_PROCESSES", 1)
    flight, bag = flown(shortened(*SCENARIO), tmp_path)
    assert not flight.lost, flight.reason
    assert_as_in_one_process(bag)


def test_processes_of_a_larger_run_have_the_ports_at_which_their_partners_call_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(participant_ports, "FEWEST_PROCESSES", 9)
    bound: dict[str, set[int]] = {}

    def look(_done: int, _all: int) -> None:
        if bound:
            return
        table = [line.split() for line in Path("/proc/net/udp").read_text().splitlines()[1:]]
        for name, process in processes_of(tmp_path).items():
            own = sockets_of(process)
            bound[name] = {int(row[1].partition(":")[2], 16) for row in table if row[9] in own}

    flight, bag = flown(parse_scenario(ring(7, 200).to_json()), tmp_path, look)
    assert not flight.lost, flight.reason
    assert_as_in_one_process(bag)
    nodes = json.loads((tmp_path / "processes.json").read_text())["nodes"]
    assert (
        {node["name"] for node in nodes} == set(bound) == {"plant", "recorder", *(f"s{i}" for i in range(7))}
    )
    for node in nodes:
        profile = Path(node["environment"]["FASTDDS_DEFAULT_PROFILES_FILE"]).read_text()
        port = int(
            profile.partition("<metatrafficUnicastLocatorList>")[2].partition("<port>")[2].partition("<")[0]
        )
        assert port in bound[node["name"]]


def test_a_profiled_run_leaves_its_trace_for_viewers_and_as_a_picture(tmp_path: Path) -> None:
    out = tmp_path / "run"
    words = ["--set", "timing.duration=100.0", "--set", "expect=[]", "--profile", "--out", str(out)]
    assert cli.main(["run", "triangle", *words]) == 0
    spans = flight_trace.spans(out / output_folders.TRACE)
    assert {"plant", "recorder", "sat1", "sat2", "sat3"} == {span.process for span in spans}
    assert '"traceEvents"' in (out / flight_trace.FILE).read_text()[:100]
    # There is none where a busy machine had some command said twice.
    assert (out / trace_plot.FILE).exists() == bool(flight_trace.parts(spans))
