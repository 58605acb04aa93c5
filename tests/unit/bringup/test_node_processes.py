# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which processes fly a scenario, what they are told, and the domain that they are given."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from flights import shipped
from satform.flight.compile import compile_scenario
from satform_bringup.deployment import domain_lock as domains
from satform_bringup.deployment.domain_lock import FIRST, LAST, DomainError, on_domain, own_domain
from satform_bringup.deployment.node_processes import NodeProcess, processes

FILE = Path("/somewhere/scenario.json")


def told(nodes: list[NodeProcess]) -> list[tuple[str, str, dict[str, Any]]]:
    return [(node.name, node.executable, node.parameters) for node in nodes]


def test_the_triangle_is_a_plant_three_satellites_and_a_recorder() -> None:
    common = {"scenario": str(FILE), "recorded": True}
    assert told(processes(compile_scenario(shipped("triangle")), FILE, Path("/runs/bag"))) == [
        ("plant", "plant_node", {**common, "recorder_needed": True}),
        ("sat1", "satellite_node", {**common, "satellite": "sat1"}),
        ("sat2", "satellite_node", {**common, "satellite": "sat2"}),
        ("sat3", "satellite_node", {**common, "satellite": "sat3"}),
        ("recorder", "recorder_node", {"scenario": str(FILE), "bag": "/runs/bag"}),
    ]


def test_without_a_bag_nobody_records_and_nobody_waits_for_a_recorder() -> None:
    nodes = processes(compile_scenario(shipped("triangle")), FILE, None)
    assert [node.name for node in nodes] == ["plant", "sat1", "sat2", "sat3"]
    assert all(node.parameters["recorded"] is False for node in nodes)


def test_a_display_is_the_one_process_that_the_flight_does_without() -> None:
    nodes = processes(compile_scenario(shipped("triangle")), FILE, Path("/runs/bag"), display=True)
    assert told(nodes)[-1] == ("display", "display_node", {"scenario": str(FILE)})
    assert [node.name for node in nodes if node.optional] == ["display"]
    assert nodes[:-1] == processes(compile_scenario(shipped("triangle")), FILE, Path("/runs/bag"))


@pytest.fixture
def ros_domain() -> Iterator[int]:
    with own_domain() as domain:
        yield domain


def as_a_node_reads_them(process: NodeProcess, domain: int) -> tuple[str, dict[str, Any]]:
    """Name and parameters of a node that is started with the process's arguments."""
    context = rclpy.Context()
    rclpy.init(
        args=process.arguments(),
        context=context,
        domain_id=domain,
        signal_handler_options=SignalHandlerOptions.NO,
    )
    try:
        node = Node(
            "unnamed",
            context=context,
            start_parameter_services=False,
            enable_rosout=False,
            automatically_declare_parameters_from_overrides=True,
        )
        values = {name: node.get_parameter(name).value for name in process.parameters}
        name = node.get_name()
        node.destroy_node()
    finally:
        rclpy.shutdown(context=context)
    return name, values


@pytest.mark.parametrize("name", ["sat1", "on", "null", "true", "n", "inf", "e1", "x_0", "rosout", "a" * 40])
def test_a_satellite_of_an_awkward_name_is_told_just_that_name(name: str, ros_domain: int) -> None:
    process = NodeProcess(name, "satellite_node", {"satellite": name, "recorded": True})
    assert as_a_node_reads_them(process, ros_domain) == (name, {"satellite": name, "recorded": True})


@pytest.mark.parametrize(
    "path",
    [
        "/a folder/with spaces.json",
        "/with \"quotes\" and 'others'",
        "/back\\slash: # and {braces} [brackets]",
        "/naïve/Übung/衛星/🛰️",
        "/%s/$HOME/*",
        "/line\nbreak\tand tab",
        "123",
        "1e5",
        "0x10",
        "~",
        "",
    ],
)
def test_a_path_reaches_the_node_letter_by_letter(path: str, ros_domain: int) -> None:
    process = NodeProcess("plant", "plant_node", {"scenario": path, "recorded": False})
    assert as_a_node_reads_them(process, ros_domain)[1] == {"scenario": path, "recorded": False}


@pytest.fixture
def no_domain_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """A user without a domain, on a machine on which nobody else flies."""
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    monkeypatch.setattr(domains, "ABSTRACT", f"\0test processes {os.getpid()}/")
    monkeypatch.setattr(domains, "domains_with_participants", set)


@pytest.mark.usefixtures("no_domain_set")
def test_two_holders_get_different_domains() -> None:
    with own_domain() as one, own_domain() as other:
        assert one != other
        assert {one, other} <= set(range(1, 102))


@pytest.mark.usefixtures("no_domain_set")
def test_a_domain_is_free_again_once_its_holder_has_ended() -> None:
    with own_domain() as one:
        pass
    with own_domain() as other:
        assert other == one


@pytest.mark.usefixtures("no_domain_set")
def test_a_holder_that_fails_gives_its_domain_back() -> None:
    with pytest.raises(ZeroDivisionError), own_domain() as one:
        raise ZeroDivisionError
    with own_domain() as other:
        assert other == one


@pytest.mark.usefixtures("no_domain_set")
def test_when_all_domains_are_held_the_next_one_is_told_so() -> None:
    with ExitStack() as stack:
        held = {stack.enter_context(own_domain()) for _ in range(FIRST, LAST + 1)}
        assert held == set(range(FIRST, LAST + 1))
        with pytest.raises(RuntimeError, match="99 runs are under way already"), own_domain():
            pass


@pytest.mark.usefixtures("no_domain_set")
@pytest.mark.parametrize("given", ["0", "42", "101"])
def test_a_domain_that_is_set_is_taken_unless_another_run_has_it(
    monkeypatch: pytest.MonkeyPatch, given: str
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", given)
    with own_domain() as one:
        assert one == int(given)
        with (
            pytest.raises(DomainError, match=f"ROS_DOMAIN_ID={given} is in use by another run"),
            own_domain(),
        ):
            pass


@pytest.mark.usefixtures("no_domain_set")
def test_a_program_started_on_a_domain_shares_it_with_its_starter() -> None:
    with own_domain() as one:
        with on_domain(one), own_domain() as other:
            assert other == one
        assert "ROS_DOMAIN_ID" not in os.environ


@pytest.mark.usefixtures("no_domain_set")
@pytest.mark.parametrize("given", ["²", "-1", "lab", "233"])
def test_what_is_no_domain_is_refused_with_a_sentence(monkeypatch: pytest.MonkeyPatch, given: str) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", given)
    with pytest.raises(DomainError, match="is not a DDS domain; it is a number from 0 to 232"), own_domain():
        pass


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_to_the_terminal_before_a_node_has_left_it_is_not_the_node_s(number: signal.Signals) -> None:
    script = f"""
import os, signal
from satform_bringup.supervisor import process_server
if os.fork() == 0:
    signal.pthread_sigmask(signal.SIG_BLOCK, process_server._TERMINAL_SIGNALS)
    os.kill(os.getpid(), {int(number)})
    process_server._leave_terminal()
    print("flies", os.getsid(0) == os.getpid(), flush=True)
    os._exit(0)
print("ends with", os.wait()[1], flush=True)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:2] == ["flies True", "ends with 0"], done.stderr
