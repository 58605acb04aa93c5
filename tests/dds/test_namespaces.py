# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A pushed namespace moves nodes and topics: two formations fly in one domain, each by itself."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from rosbags.rosbag2 import Reader

import rosbag2_format
from flights import shortened
from flown import assert_as_in_one_process
from satform.bag.reader import read_bag
from satform.communication.topic_table import OF_ALL_NAMESPACES, in_namespace
from satform.flight.compile import compile_scenario
from satform_bringup.deployment.node_processes import NodeProcess, processes

pytestmark = pytest.mark.unmeasured

SPACES = ("/f1", "/fleet/f2")


def satform(*words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "satform_tools", *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_two_formations_in_one_domain_fly_the_bits_of_each_alone(domain: int, tmp_path: Path) -> None:
    assert os.environ["ROS_DOMAIN_ID"] == str(domain)
    scenario = tmp_path / "scenario.json"
    scenario.write_text(shortened("triangle", 150.0).to_json())
    runs = [
        satform("run", str(scenario), "--namespace", space, "--out", str(tmp_path / f"run{number}"))
        for number, space in enumerate(SPACES)
    ]
    for run in runs:
        out, err = run.communicate(timeout=120)
        assert run.returncode == 0, out + err
    for number, space in enumerate(SPACES):
        folder = tmp_path / f"run{number}" / "bag"
        bag = read_bag(folder)
        assert_as_in_one_process(bag)
        assert f"{space}/sat1/state" in bag.messages
        assert all(topic in OF_ALL_NAMESPACES or topic.startswith(f"{space}/") for topic in bag.messages)
        rosbag2_format.read(folder)


def test_who_looks_on_finds_the_formation_in_its_namespace(domain: int, tmp_path: Path) -> None:
    flying = satform(
        *("run", "triangle", "--mode", "realtime", "--rate", "20", "--set", "timing.duration=2000.0"),
        *("--set", "expect=[]", "--namespace", "f1", "--out", str(tmp_path / "run")),
    )
    try:
        topics = satform("topics", "--json", "--timeout", "60")
        out, err = topics.communicate(timeout=180)
        assert topics.returncode == 0, err
        there = {entry["topic"]: entry for entry in json.loads(out)}
        assert there["/f1/sat1/state"]["publishers"] == 1
        assert there["/f1/sat1/state"]["subscriptions"] == 2
        assert "/sat1/state" not in there
        watched = satform("watch", "--once", "--json", "--namespace", "f1")
        out, err = watched.communicate(timeout=180)
        assert watched.returncode == 0, err
        assert [entry["name"] for entry in json.loads(out)["satellites"]] == ["sat1", "sat2", "sat3"]
        elsewhere = satform("watch", "--once", "--namespace", "f2", "--timeout", "1")
        _, err = elsewhere.communicate(timeout=180)
        assert elsewhere.returncode == 2
        assert f"no formation is flying on domain {domain} in the namespace /f2" in err
        stopped = satform("call", "/f1/formation/stop")
        stopped.communicate(timeout=180)
        assert stopped.returncode == 0
        flying.communicate(timeout=180)
    finally:
        flying.kill()
        flying.communicate()


class Remapped(NodeProcess):
    """A process on whose command line topics are remapped."""

    def arguments(self) -> list[str]:
        return [*super().arguments(), "-r", "/sat1/state:=/lab/sat1_state", "-r", "sat2/command:=thrust"]


def test_a_remapped_topic_is_recorded_under_the_name_that_it_really_has(
    fleet: object, tmp_path: Path
) -> None:
    scenario = shortened("triangle", 100.0)
    file = tmp_path / "scenario.json"
    file.write_text(scenario.to_json())
    nodes = [
        Remapped(node.name, node.executable, node.parameters)
        for node in processes(compile_scenario(scenario), file, tmp_path / "bag")
    ]
    for process in fleet(nodes):  # type: ignore[operator]
        assert process.wait(60) == 0
    with Reader(tmp_path / "bag") as reader:
        topics = {connection.topic for connection in reader.connections}
    assert {"/lab/sat1_state", "/thrust"} <= topics
    assert not {"/sat1/state", "/sat2/command"} & topics
    assert_as_in_one_process(read_bag(tmp_path / "bag"))


@pytest.mark.parametrize(
    ("topic", "full"),
    [("/sat1/state", "/f1/sat1/state"), ("/clock", "/clock"), ("/diagnostics", "/diagnostics")],
)
def test_what_ros_itself_fixes_is_not_moved(topic: str, full: str) -> None:
    assert in_namespace(topic, "/f1") == full
    assert in_namespace(topic, "/") == topic
