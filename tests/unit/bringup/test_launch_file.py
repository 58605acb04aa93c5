# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The launch file starts what `satform run` starts; with ROS 2's own launch where that is installed."""

import importlib.util
import os
import subprocess
import sys
import types
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from flights import SCENARIOS, shipped
from satform.bag import reader as bag_reader
from satform.flight.compile import compile_scenario
from satform.flight.simulate import simulate
from satform.scenario import ScenarioError, load_scenario
from satform_bringup.deployment.node_processes import NodeProcess, processes

FILE = SCENARIOS.parent / "ros_ws" / "src" / "satform_bringup" / "launch" / "scenario.launch.py"


class Made:
    """Stands for an action: what it was made with."""

    def __init__(self, *positional: Any, **named: Any) -> None:
        self.positional = positional
        self.named = named


@dataclass
class Context:
    """The part of a launch context that a launch file's arguments are read from."""

    launch_configurations: dict[str, str] = field(default_factory=dict)
    is_shutdown: bool = False


@dataclass
class Configuration:
    """Stands for `LaunchConfiguration`."""

    name: str

    def perform(self, context: Any) -> str:
        return str(context.launch_configurations[self.name])


def stand_ins() -> dict[str, types.ModuleType]:
    """The few names of `launch` and `launch_ros` that the file uses."""
    names: dict[str, dict[str, Any]] = {
        "launch": {"LaunchContext": Context, "LaunchDescription": lambda entities: entities},
        "launch.actions": {
            "DeclareLaunchArgument": Made,
            "LogInfo": Made,
            "OpaqueFunction": Made,
            "Shutdown": Made,
        },
        "launch.substitutions": {"LaunchConfiguration": Configuration},
        "launch_ros": {},
        "launch_ros.actions": {"Node": Made},
    }
    modules = {}
    for name, contents in names.items():
        modules[name] = types.ModuleType(name)
        vars(modules[name]).update(contents)
    return modules


@pytest.fixture
def launch_file(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The file as a module, its actions recorded instead of made."""
    # Not `launch`, which may be found as the folder that the file is in.
    if importlib.util.find_spec("launch_ros") is None:
        for name, module in stand_ins().items():
            monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location("scenario_launch", FILE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name in ("DeclareLaunchArgument", "LogInfo", "Node", "OpaqueFunction", "Shutdown"):
        monkeypatch.setattr(module, name, Made)
    monkeypatch.setattr(module, "LaunchDescription", lambda entities: entities)
    monkeypatch.setattr(module, "LaunchConfiguration", Configuration)
    # It would hold the shell's domain until the tests are over.
    monkeypatch.setattr(module, "hold_shell_domain", lambda *_: 0)
    return module


def launched(launch_file: Any, **given: str) -> list[dict[str, Any]]:
    """What each node is made with when the file is launched with these arguments."""
    *arguments, opaque = launch_file.generate_launch_description()
    known = {argument.positional[0]: argument.named.get("default_value") for argument in arguments}
    assert set(given) <= set(known)
    function: Callable[[Context], list[Made]] = opaque.named["function"]
    return [node.named for node in function(Context({**known, **given}))]


def told(nodes: list[dict[str, Any]]) -> list[tuple[str, str, str, list[str]]]:
    return [(node["package"], node["executable"], node["exec_name"], node["arguments"]) for node in nodes]


def expected(nodes: list[NodeProcess]) -> list[tuple[str, str, str, list[str]]]:
    stopped = ["-p", "stopped_exit_code:=0"]
    return [("satform_nodes", node.executable, node.name, [*node.arguments(), *stopped]) for node in nodes]


@pytest.mark.parametrize(("name", "group"), [("triangle", 1), ("ring_six", 4)])
def test_every_process_of_a_run_is_a_node_of_the_launch_and_no_other(
    name: str, group: int, launch_file: Any, tmp_path: Path
) -> None:
    nodes = launched(launch_file, scenario=name, out=str(tmp_path), group=str(group))
    wanted = processes(compile_scenario(shipped(name)), tmp_path / "scenario.json", tmp_path / "bag", group)
    assert told(nodes) == expected(wanted)
    assert load_scenario(tmp_path / "scenario.json") == shipped(name)


def test_a_launch_flies_in_lockstep_and_takes_changes_as_a_run_does(launch_file: Any, tmp_path: Path) -> None:
    changes = ("timing.duration=60.0", "expect=[]")
    launched(launch_file, scenario="triangle", mode="lockstep", set=" ".join(changes), out=str(tmp_path))
    assert load_scenario(tmp_path / "scenario.json") == shipped("triangle", *changes)


def test_whoever_starts_an_external_satellite_finds_the_launch_by_a_file_of_its_folder(
    launch_file: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(launch_file, "hold_shell_domain", lambda *_: 17)
    external = "satellites[sat2].external=true"
    message, *nodes = launched(launch_file, scenario="triangle", out=str(tmp_path), set=external)
    assert [node["exec_name"] for node in nodes] == ["plant", "sat1", "sat3", "recorder"]
    file = tmp_path / "environment.sh"
    wanted = "waiting up to 120 s for the node /sat2, which somebody else starts; in the shell that does"
    assert message["msg"] == f"{wanted}: . {file}"
    sourced = subprocess.run(
        ["sh", "-c", f'. "{file}"; env'], capture_output=True, text=True, check=True, env={"PATH": os.defpath}
    )
    found = dict(line.split("=", 1) for line in sourced.stdout.splitlines())
    of_a_node = {name: value for name, value in nodes[0]["additional_env"].items() if name != "ROS_LOG_DIR"}
    assert (
        found.items()
        >= {"ROS_DOMAIN_ID": "17", **{name: value for name, value in of_a_node.items() if value}}.items()
    )


def test_in_real_time_every_node_is_told_the_rate(launch_file: Any, tmp_path: Path) -> None:
    nodes = launched(launch_file, scenario="triangle", mode="realtime", rate="20", out=str(tmp_path))
    wanted = processes(
        compile_scenario(shipped("triangle")), tmp_path / "scenario.json", tmp_path / "bag", rate=20.0
    )
    assert told(nodes) == expected(wanted)


def test_without_a_record_there_is_no_recorder(launch_file: Any, tmp_path: Path) -> None:
    nodes = launched(launch_file, scenario="triangle", out=str(tmp_path), record="false")
    assert told(nodes) == expected(
        processes(compile_scenario(shipped("triangle")), tmp_path / "scenario.json", None)
    )


def test_a_display_that_ends_does_not_end_the_launch(launch_file: Any, tmp_path: Path) -> None:
    nodes = launched(launch_file, scenario="triangle", out=str(tmp_path), display="true")
    file, bag = tmp_path / "scenario.json", tmp_path / "bag"
    assert told(nodes) == expected(processes(compile_scenario(shipped("triangle")), file, bag, display=True))
    assert [node["exec_name"] for node in nodes if node["on_exit"] is None] == ["display"]


def test_a_scenario_may_be_a_path_and_its_flight_gets_a_folder_of_its_own(
    launch_file: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text((SCENARIOS / "triangle.yaml").read_text())
    launched(launch_file, scenario="mine.yaml")
    (folder,) = (tmp_path / "runs").iterdir()
    assert folder.name.startswith("triangle-")
    assert load_scenario(folder / "scenario.json") == shipped("triangle")


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"scenario": "triangel"}, "there is no scenario 'triangel'"),
        ({"group": "0"}, "group:=0 is not a number of satellites"),
        ({"group": "two"}, "group:=two is not a number of satellites"),
        ({"mode": "realtime", "rate": "0"}, "rate:=0 is not a number of simulated seconds above 0"),
        ({"mode": "realtime", "rate": "fast"}, "rate:=fast is not a number"),
        ({"set": "timing.stepp=1"}, "there is no such field; did you mean step"),
        ({"out": str(SCENARIOS)}, "is not empty; name another folder"),
    ],
)
def test_what_cannot_be_launched_is_a_sentence(
    given: dict[str, str], sentence: str, launch_file: Any, tmp_path: Path
) -> None:
    with pytest.raises((RuntimeError, ScenarioError), match=sentence):
        launched(launch_file, **{"scenario": "triangle", "out": str(tmp_path), **given})


def test_a_lost_process_ends_the_launch_and_one_that_is_done_does_not(
    launch_file: Any, tmp_path: Path
) -> None:
    for node in launched(launch_file, scenario="triangle", out=str(tmp_path)):
        if node["exec_name"] != "recorder":
            done = types.SimpleNamespace(returncode=0, process_name="sat1-2")
            assert node["on_exit"](done, Context()) is None
        end = node["on_exit"](types.SimpleNamespace(returncode=-9, process_name="sat1-2"), Context())
        assert end.named == {"reason": "sat1-2 ended with exit code -9"}
        early = types.SimpleNamespace(returncode=4, process_name="plant-1")
        assert node["on_exit"](early, Context()) is None
        # What ends while everything is shut down is not reported as the cause.
        stopped = types.SimpleNamespace(returncode=130, process_name="sat1-2")
        assert node["on_exit"](stopped, Context(is_shutdown=True)) is None


def test_a_satellite_that_the_scenario_kills_is_started_again_when_the_scenario_brings_it_back(
    launch_file: Any, tmp_path: Path
) -> None:
    nodes = launched(launch_file, scenario="satellite_lost_and_rejoined", out=str(tmp_path))
    (lost,) = {fault.satellite for fault in shipped("satellite_lost_and_rejoined").faults}
    killed = types.SimpleNamespace(returncode=-9, process_name="any")
    for node in nodes:
        told = node["on_exit"](killed, Context())
        if node["exec_name"] == lost:
            (again,) = told
            assert again.named["arguments"] == node["arguments"]
        else:
            assert told.named["reason"] == "any ended with exit code -9"


def test_every_argument_says_what_it_is(launch_file: Any) -> None:
    *arguments, _ = launch_file.generate_launch_description()
    names = [argument.positional[0] for argument in arguments]
    assert names == ["scenario", "mode", "rate", "set", "record", "out", "group", "display", "namespace"]
    assert all(argument.named["description"] for argument in arguments)


def ended(nodes: list[dict[str, Any]], name: str) -> list[str]:
    """What the launch says when a process has ended well."""
    (node,) = (node for node in nodes if node["exec_name"] == name)
    done = types.SimpleNamespace(returncode=0, process_name=f"{name}-1")
    return [info.named["msg"] for info in node["on_exit"](done, Context()) or ()]


def test_the_launch_says_the_flights_result_when_the_bag_is_closed(
    launch_file: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Without blanks, which part one change from the next.
    spread = '{"kind":"arc_length_spread","at":100.0,"value":48000.0,"relative":0.1,"regression":true}'
    changes = f"timing.duration=100.0 expect=[{spread}]"
    nodes = launched(launch_file, scenario="triangle", out=str(tmp_path), set=changes)
    scenario = load_scenario(tmp_path / "scenario.json")
    flown = types.SimpleNamespace(record=simulate(scenario), complete=True)
    monkeypatch.setattr(bag_reader, "read_bag", lambda folder: flown if folder == tmp_path / "bag" else None)
    *verdicts, conclusion = ended(nodes, "recorder")
    assert conclusion == "result: As expected: 1 of 1 met"
    assert len(verdicts) == 1
    assert all(verdict.startswith("met: ") for verdict in verdicts)
    flown.complete = False
    assert ended(nodes, "recorder") == ["result: not judged: 200 of 200 steps are in the bag"]
    for name in ("plant", "sat1"):
        assert ended(nodes, name) == []


def test_the_launch_counts_the_expectations_that_a_shorter_flight_is_not_judged_by(
    launch_file: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nodes = launched(launch_file, scenario="triangle", out=str(tmp_path), set="timing.duration=1.0")
    scenario = load_scenario(tmp_path / "scenario.json")
    excluded = len(shipped("triangle").expect)
    assert (len(scenario.expect), len(scenario.omitted_expectations)) == (0, excluded)
    flown = types.SimpleNamespace(record=simulate(scenario), complete=True)
    monkeypatch.setattr(bag_reader, "read_bag", lambda _folder: flown)
    assert ended(nodes, "recorder") == [
        f"result: Flown to the end and not judged: {excluded} expectations need a longer flight"
    ]


def test_the_launch_says_why_a_flight_ended_early(
    launch_file: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    changes = "satellite_defaults.controller.reaching_gain=5.0 timing.duration=100.0 expect=[]"
    nodes = launched(launch_file, scenario="triangle", out=str(tmp_path), set=changes)
    scenario = load_scenario(tmp_path / "scenario.json")
    flown = types.SimpleNamespace(record=simulate(scenario), complete=True)
    assert flown.record.early_end is not None
    monkeypatch.setattr(bag_reader, "read_bag", lambda _folder: flown)
    assert ended(nodes, "recorder")[-1] == (
        f"result: ENDED EARLY after step 9 of 200: {flown.record.early_end.sentence}"
    )


def test_without_a_bag_the_launch_says_that_nothing_was_judged(launch_file: Any, tmp_path: Path) -> None:
    nodes = launched(launch_file, scenario="triangle", out=str(tmp_path), record="false")
    assert ended(nodes, "plant") == ["result: not judged, since nothing was recorded"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["ros2", "launch", "satform_bringup", FILE.name, "scenario:=triangle", "mod:=realtime"],
            "mod:=; did",
        ),
        (
            ["ros2", "launch", str(FILE), "speed:=3"],
            "speed:=; there are display, group, mode, namespace, out",
        ),
    ],
)
def test_an_argument_that_the_launch_file_does_not_have_is_refused(
    words: list[str], sentence: str, launch_file: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(RuntimeError, match=sentence):
        launched(launch_file, scenario="triangle", out=str(tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_a_launch_file_that_includes_this_one_may_have_arguments_of_its_own(
    launch_file: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["ros2", "launch", "fleet", "fleet.launch.py", "ships:=3"])
    assert launched(launch_file, scenario="triangle", out=str(tmp_path))


def test_a_namespace_that_the_launch_pushes_or_is_given_is_held_instead_of_the_whole_domain(
    launch_file: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held: list[str] = []
    monkeypatch.setattr(launch_file, "hold_shell_domain", lambda *given: held.append(given[2]))
    *arguments, opaque = launch_file.generate_launch_description()
    known = {argument.positional[0]: argument.named.get("default_value") for argument in arguments}
    asked = ({}, {"ros_namespace": "/f1"}, {"namespace": "f2"}, {"ros_namespace": "/f", "namespace": "/f3/"})
    for number, pushed in enumerate(asked):
        given = {**known, "scenario": "triangle", "out": str(tmp_path / str(number)), **pushed}
        opaque.named["function"](Context(given))
    assert held == ["", "/f1", "/f2", "/f/f3"]
