# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The README of the nodes names every parameter, topic and service that they make, and no other."""

import re
from pathlib import Path

import pytest
from rclpy.qos import QoSProfile
from satform_msgs.srv import SetGraph
from std_srvs.srv import Trigger

from flights import shipped
from satform.communication import topic_table
from satform.communication.topic_table import channels, topic_name
from satform.flight.compile import topic_plan
from satform.flight.compile_satellite import parameter_plan
from satform.flight.online_parameters import OnlineParameters
from satform_nodes.plant import services
from satform_nodes.programs import MODULES
from satform_nodes.runtime import diagnostics
from satform_nodes.runtime.start_parameters import PROGRAMS as HELPED
from satform_nodes.runtime.start_parameters import START_PARAMETERS, STOPPED_EXIT_CODE, help_of
from satform_nodes.transport import qos, topic_types

NODES = Path(__file__).resolve().parents[3] / "ros_ws" / "src" / "satform_nodes"
README = (NODES / "README.md").read_text(encoding="utf-8")
PROGRAMS = ("plant", "satellite", "group", "recorder", "display")


def rows(heading: str) -> list[list[str]]:
    """Cells of the table below a heading, without the table's own head."""
    part = README.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    lines = [line for line in part.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def code(cell: str) -> str:
    """What stands in a cell as code."""
    found = re.match(r"`([^`]+)`", cell)
    assert found, cell
    return found[1]


def declared() -> set[tuple[str, str]]:
    """Name of each parameter that nodes are given at the start, with its default."""
    return {
        (name, "" if parameter.default in ("", [""]) else str(parameter.default).lower())
        for name, parameter in START_PARAMETERS.items()
    }


def test_no_parameter_is_declared_past_the_table_of_those_that_are_described() -> None:
    own = {
        program: (NODES / f"{module.replace('.', '/')}.py").read_text(encoding="utf-8")
        for program, module in MODULES.items()
    }
    for name, text in own.items():
        assert "declare_fixed(" not in text, name
        assert text.count("declare_parameter(") == (name == "display_node")


def test_every_parameter_is_described_with_its_default_and_nothing_else_is() -> None:
    own = {(code(row[1]), row[4].lower()) for row in rows("Parameters")}
    single = {(name, default) for name, default in own if "." not in name}
    assert {(name, number(default)) for name, default in single} == {
        (name, number(default)) for name, default in declared()
    }


def number(text: str) -> float | str:
    """A number by its value, however it is written."""
    try:
        return float(text)
    except ValueError:
        return text


def test_every_specification_that_nodes_declare_is_described_and_nothing_else_is() -> None:
    described = {code(row[1]).partition(".")[0] for row in rows("Parameters") if "." in code(row[1])}
    assert described == set(OnlineParameters(parameter_plan(shipped("formation_pointing"), 0)).specs)


def test_a_parameter_is_described_for_the_nodes_that_have_it_only() -> None:
    programs = {
        name: (NODES / f"{MODULES[f'{name}_node'].replace('.', '/')}.py").read_text() for name in PROGRAMS
    }
    # The two programs of satellites share a function for the parameters that both have.
    shared = (NODES / "satform_nodes" / "satellite" / "parameters.py").read_text(encoding="utf-8")
    for name in ("satellite", "group"):
        assert "declare_settings(" in programs[name]
        programs[name] += shared.partition("def declare_settings")[2].partition("\ndef ")[0]
    for row in rows("Parameters"):
        name = code(row[1])
        if "." in name:
            continue
        having = {own for own, text in programs.items() if declares(text, name)}
        assert (set(PROGRAMS) if row[0] == "all" else set(row[0].split(", "))) == having, name
        helped = {own for own in PROGRAMS if name in HELPED[f"{own}_node"].parameters}
        assert helped == having, name


@pytest.mark.parametrize("program", sorted(HELPED))
def test_the_help_of_a_program_explains_each_of_its_parameters(program: str) -> None:
    text = help_of(program)
    assert text.startswith(f"usage: ros2 run satform_nodes {program} --ros-args")
    for name in HELPED[program].parameters:
        (line,) = (line for line in text.splitlines() if line.strip().startswith(f"{name} "))
        assert line.endswith(START_PARAMETERS[name].description)
    assert ("controller.*" in text) == (program in ("satellite_node", "group_node"))


def declares(text: str, name: str) -> bool:
    """Whether a module declares a parameter."""
    if name == "rate":
        return "declare_rate(" in text
    if name == STOPPED_EXIT_CODE:
        # By what runs every node.
        return True
    return bool(re.search(rf'(declare_start|_positive)\(\s*node,\s*"{name}"', text))


OF_SENSORS = {
    "range": "/<satellite>/<ranging>_<target>",
    "imu": "/<satellite>/gyro",
    "orientation": "/<satellite>/star_tracker",
    "fix": "/<satellite>/gnss",
}
"""Names of topics that are called by their sensors, by the kinds of their messages."""

OF_GROUPS = {
    **{kind: f"/<group>/{kind}" for kind in ("group_state", "group_command", "group_tracking")},
    "group_phase": "/<group>/to_<group>/group_phase",
}
"""Names of the topics of groups, by the kinds of their messages."""


def made_topics() -> dict[str, str]:
    """Each topic's name with its type, from the one place where they are."""
    others = [
        value for name, value in vars(topic_table).items() if name.isupper() and str(value).startswith("/")
    ]
    name_of = {name.rpartition("/")[2]: name for name in others} | OF_SENSORS | OF_GROUPS
    return {
        name_of.get(kind, topic_name(kind, "<satellite>")): made.__name__
        for kind, made in topic_types.TYPES.items()
    }


def test_every_topic_is_described_with_its_type_and_nothing_else_is() -> None:
    assert {code(row[0]): code(row[1]).rpartition("/")[2] for row in rows("Topics")} == made_topics()


def profiles() -> dict[str, QoSProfile]:
    """Every QoS profile by its name."""
    return {
        name: value
        for name, value in vars(qos).items()
        if isinstance(value, QoSProfile) and not name.startswith("_")
    }


def test_every_qos_profile_is_described_with_its_values_and_nothing_else_is() -> None:
    assert {(code(row[0]), *row[1:4]) for row in rows("QoS profiles")} == {
        (
            name,
            profile.reliability.name.lower().replace("_", " "),
            profile.durability.name.lower().replace("_", " "),
            str(profile.depth),
        )
        for name, profile in profiles().items()
    }


def test_a_topic_that_is_published_by_its_rhythm_is_described_with_that_profile() -> None:
    described = {code(row[0]): code(row[2]) for row in rows("Topics")}
    assert set(described.values()) <= set(profiles())
    scenario = shipped("noisy_navigation")
    names = [satellite.name for satellite in scenario.satellites]
    checked = 0
    for channel in channels(topic_plan(scenario)):
        own = channel.topic.split("/")[1]
        topic = channel.topic.replace(f"/{own}/", "/<satellite>/") if own in names else channel.topic
        # The recorder and the diagnostics have profiles of their own.
        if topic not in {topic_table.RECORDER_PROGRESS, diagnostics.DIAGNOSTICS}:
            assert profiles()[described[topic]] == qos.PUBLISHER_BY_RHYTHM[channel.rhythm], topic
            checked += 1
    assert checked > 8


def test_every_service_is_described_with_its_type_and_nothing_else_is() -> None:
    types = {services.SET_GRAPH: SetGraph}
    made = {
        value: types.get(value, Trigger).__name__
        for name, value in vars(services).items()
        if name.isupper() and isinstance(value, str)
    }
    assert {code(row[0]): code(row[1]).rpartition("/")[2] for row in rows("Services")} == made
    text = (NODES / "satform_nodes" / "plant" / "services.py").read_text(encoding="utf-8")
    assert text.count("create_service(") == len(made)


def test_every_program_is_described() -> None:
    described = set(re.findall(r"^\| `(\w+_node)` \|", README, flags=re.MULTILINE))
    assert described == {f"{name}_node" for name in PROGRAMS}
