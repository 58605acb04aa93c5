# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flies a scenario under `ros2 launch`: the same processes with the same settings as `satform run`."""

import signal
import sys
from contextlib import ExitStack
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from satform.common.exit_codes import EXIT_DONE, EXIT_ENDED_EARLY
from satform.flight.compile import compile_scenario
from satform.membership.formation import MembershipPlan, is_lost_at, rejoins_after
from satform.scenario import Scenario, load_scenario, save_scenario
from satform.scenario.loader import SCENARIO_FILE
from satform_bringup import BAG_FOLDER, CHECKPOINT_FOLDER, PACKAGE
from satform_bringup.deployment import external_nodes, local_discovery, participant_ports, preflight
from satform_bringup.deployment.node_processes import NodeProcess, processes
from satform_bringup.supervisor.launch_report import refuse_unknown_arguments, result
from satform_bringup.supervisor.run_registry import hold_shell_domain
from satform_bringup.supervisor.supervisor import SHUTDOWN_TIMEOUT
from satform_nodes.runtime.start_parameters import STOPPED_EXIT_CODE

ARGUMENTS = ("scenario", "mode", "rate", "set", "record", "out", "group", "display", "namespace")

_PORTS = ExitStack()
"""Ports that are held for the processes."""

_NAMESPACE = "ros_namespace"
"""Where `PushRosNamespace` leaves a namespace, and nodes look for it."""


def generate_launch_description() -> LaunchDescription:
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "scenario", description="Name of a file in a folder `scenarios`, or path of a YAML file."
            ),
            DeclareLaunchArgument(
                "mode",
                default_value="lockstep",
                choices=["lockstep", "realtime"],
                description="lockstep: a step begins when all commands have arrived; realtime: at its time.",
            ),
            DeclareLaunchArgument(
                "rate",
                default_value="1.0",
                description="Simulated seconds per second of wall-clock time; with mode:=realtime.",
            ),
            DeclareLaunchArgument(
                "set",
                default_value="",
                description="Changes of the scenario, e.g. `timing.duration=600.0`, separated by spaces.",
            ),
            DeclareLaunchArgument(
                "record", default_value="true", choices=["true", "false"], description="Record a bag."
            ),
            DeclareLaunchArgument(
                "out",
                default_value="",
                description="Folder for the scenario as flown and the bag; by default a new one in `runs`.",
            ),
            DeclareLaunchArgument(
                "group",
                default_value="1",
                description="Number of satellites in a process; each has its own node and topics.",
            ),
            DeclareLaunchArgument(
                "display",
                default_value="false",
                choices=["true", "false"],
                description="Publish markers, poses, paths and /tf for RViz and Foxglove.",
            ),
            DeclareLaunchArgument(
                "namespace",
                default_value="",
                description="Namespace of all nodes, topics and services, below one that is pushed.",
            ),
            OpaqueFunction(function=_nodes),
        ]
    )


def _nodes(context: LaunchContext) -> list[Node | LogInfo]:
    refuse_unknown_arguments(sys.argv, Path(__file__).name, ARGUMENTS)
    asked = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    if not asked["group"].isdecimal() or int(asked["group"]) < 1:
        raise RuntimeError(f"group:={asked['group']} is not a number of satellites, 1 or more")
    rate = _rate(asked["rate"]) if asked["mode"] == "realtime" else 0.0
    scenario = load_scenario(_find(asked["scenario"]), asked["set"].split())
    out = _folder(asked["out"], scenario.name)
    if asked["namespace"]:
        pushed = context.launch_configurations.get(_NAMESPACE, "")
        context.launch_configurations[_NAMESPACE] = f"{pushed}/{asked['namespace'].strip('/')}"
    # Two formations in one namespace of a domain would receive each other's messages. Observers find the run
    # by this registration.
    namespace = context.launch_configurations.get(_NAMESPACE, "")
    domain = hold_shell_domain(scenario.name, out, namespace)
    scenario_file = out / SCENARIO_FILE
    save_scenario(scenario, scenario_file)
    bag = out / BAG_FOLDER if asked["record"] == "true" else None
    display = asked["display"] == "true"
    checkpoints = None if scenario.checkpoint_period is None else out / CHECKPOINT_FOLDER
    plan = compile_scenario(scenario)
    started = processes(
        plan, scenario_file, bag, int(asked["group"]), checkpoints, rate=rate, display=display
    )
    preflight.require(len(started))
    preflight.remove_unused_variables()
    count = len(started) + len(plan.external)
    environment = local_discovery.variables(count, len(scenario.satellites), out)
    environment |= preflight.log_variables(out)
    if local_discovery.on_loopback_alone():
        # Ports are held like the domain: as long as this process lives.
        started = _PORTS.enter_context(participant_ports.assigned(started, plan, domain, out))
    flight = _Flight(scenario, plan.membership, bag, environment)
    nodes = [_node(process, flight) for process in started]
    if not plan.external:
        return nodes
    external_nodes.write_environment(out, domain, environment)
    return [LogInfo(msg=external_nodes.awaited(plan, out, namespace)), *nodes]


def _rate(text: str) -> float:
    try:
        rate = float(text)
    except ValueError:
        rate = 0.0
    if not (isfinite(rate) and rate > 0.0):
        raise RuntimeError(f"rate:={text} is not a number of simulated seconds above 0")
    return rate


@dataclass(frozen=True)
class _Flight:
    """What is flown.

    Attributes:
        scenario: with all changes.
        membership: who takes part, by step.
        bag: folder of the bag; None when nothing is recorded.
        environment: more variables of every process.
    """

    scenario: Scenario
    membership: MembershipPlan
    bag: Path | None
    environment: dict[str, str]


def _node(process: NodeProcess, flight: _Flight) -> Node:
    """The process as an action.

    Name and parameters are on its command line, where they are quoted already; launch would write the
    parameters to a file, in which a satellite called `on` became a bool, and give all nodes of a group
    one name. Stopped by SIGINT, which is how launch ends it, it ends with exit code 0.
    """
    launched = replace(process, parameters={**process.parameters, STOPPED_EXIT_CODE: EXIT_DONE})
    return Node(
        package=PACKAGE,
        executable=process.executable,
        exec_name=process.name,
        arguments=launched.arguments(),
        output="screen",
        additional_env=flight.environment | process.environment,
        # As long as `satform run` gives them: a bag is to be closed before anyone is killed.
        sigterm_timeout=str(SHUTDOWN_TIMEOUT),
        sigkill_timeout=str(SHUTDOWN_TIMEOUT),
        on_exit=None if process.optional else partial(_ended, process, flight),
    )


def _ended(
    process: NodeProcess, flight: _Flight, event: Any, context: LaunchContext
) -> Shutdown | list[Node] | list[LogInfo] | None:
    """Log the flight's result when the last process has ended; end all others when one is lost.

    Nodes end by themselves once the plant publishes that the flight is over; a lost one ends it for all.

    One that the scenario has killed does not, and is started again when the scenario brings it back.
    """
    if context.is_shutdown:
        return None
    if event.returncode == EXIT_ENDED_EARLY:
        # The others end by themselves, as after a whole flight, and the bag is closed.
        return None
    if event.returncode == 0:
        last = "plant" if flight.bag is None else "recorder"
        return (
            [LogInfo(msg=line) for line in result(flight.scenario, flight.bag)]
            if process.name == last
            else None
        )
    plan = flight.membership
    if process.name in plan.names and event.returncode == -signal.SIGKILL:
        index = plan.names.index(process.name)
        if any(is_lost_at(plan.events, index, step) for step in plan.events):
            return [_node(process, flight)] if rejoins_after(plan.events, index, 0) else None
    return Shutdown(reason=f"{event.process_name} ended with exit code {event.returncode}")


def _find(scenario: str) -> Path:
    path = Path(scenario)
    if path.is_file():
        return path
    for folder in (Path.cwd(), *Path(__file__).resolve().parents):
        found = folder / "scenarios" / f"{scenario}.yaml"
        if found.is_file():
            return found
    raise RuntimeError(f"there is no scenario {scenario!r}; name one, or the path of a YAML file")


def _folder(out: str, scenario: str) -> Path:
    moment = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    folder = Path(out or f"runs/{scenario}-{moment}").absolute()
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise RuntimeError(f"{folder} is not empty; name another folder with out:=")
    return folder
