# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Starting and ending a node's process: scenario, signals, exit codes, one sentence on failure."""

import re
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from satform_msgs.msg import FormationStatus

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_LOST, EXIT_STOPPED
from satform.communication.satellite_groups import SatelliteGroups
from satform.flight.array_exchange import array_complaints
from satform.flight.compile import FormationPlan, compile_scenario
from satform.protocol.formation_view import STOPPED
from satform.scenario import Scenario, ScenarioError, load_scenario
from satform_nodes.runtime import shared_plan
from satform_nodes.runtime.formation_node import NO_SIM_TIME, SIM_TIME, FormationNode
from satform_nodes.runtime.parameters import ParameterError, declare_start
from satform_nodes.runtime.signals import StopRequest
from satform_nodes.runtime.start_parameters import STOPPED_EXIT_CODE
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.node_error import NodeError


def start_timeout(plan: FormationPlan) -> float:
    """Wall-clock time within which all nodes of a formation have to find each other, s.

    Every node learns of every other one, so that large formations take longer. With external satellites it is
    the time that the scenario gives them.
    """
    return plan.timing.external_timeout or 60.0 + len(plan.names)


def plant_timeout(node_timeout: float) -> float:
    """Wall-clock time without a message after which the other nodes count the plant as lost, s.

    Twice the timeout of the plant for a satellite: the plant reports a lost satellite before the other nodes
    time out.

    Args:
        node_timeout: of the scenario, s.
    """
    return 2.0 * node_timeout


def discovery_timeout(plan: FormationPlan) -> float:
    """Wall-clock time that the other nodes wait at the start, longer than the plant does, s."""
    return 1.5 * start_timeout(plan)


_EXIT_CODES = 256
"""How many there are."""

_ACKNOWLEDGED = Duration(seconds=0.1)
"""Wall-clock time between two checks of the subscriptions while acknowledgements are waited for."""


_SOURCE_LINE = re.compile(r", at \S+:\d+")
"""Where in its own sources rcl has met an error."""


def reject_sim_time(node: Node) -> None:
    """Reject `use_sim_time`: simulated time is made by the nodes themselves.

    Raises:
        NodeError: the node was started so.
    """
    if node.get_parameter(SIM_TIME).value:
        raise NodeError(f"{node.get_name()}: {SIM_TIME} is true; {NO_SIM_TIME}", EXIT_BAD_INPUT)


def scenario_and_plan(node: Node) -> tuple[Scenario, FormationPlan]:
    """The scenario that is named by the node's `scenario` parameter, and the plans of its flight's parts.

    Its parameter `groups`, if it has this, may name a file of groups that exchange arrays.

    Raises:
        NodeError: no scenario is named, or it cannot fly, or not by arrays.
    """
    path = str(node.get_parameter("scenario").value)
    if not path:
        raise NodeError(
            f"{node.get_name()} needs the parameter scenario: the path of a scenario file", EXIT_BAD_INPUT
        )
    groups = str(node.get_parameter("groups").value) if node.has_parameter("groups") else ""
    shared = shared_plan.scenario_and_plan(path)
    if shared is not None:
        return (shared[0], _plan_in_groups(node, shared[0], Path(groups))) if groups else shared
    try:
        scenario = load_scenario(path)
    except ScenarioError as error:
        raise NodeError(str(error), EXIT_BAD_INPUT) from None
    return scenario, _plan_in_groups(node, scenario, Path(groups)) if groups else compile_scenario(scenario)


def plan_of(node: Node) -> FormationPlan:
    """The plans of a flight's parts, of the scenario that is named by the node's `scenario` parameter.

    Raises:
        NodeError: as of `scenario_and_plan`.
    """
    return scenario_and_plan(node)[1]


def _plan_in_groups(node: Node, scenario: Scenario, file: Path) -> FormationPlan:
    """The plans of a flight's parts, with groups that exchange arrays.

    Args:
        node: of the flight.
        scenario: what is flown.
        file: of the groups.

    Raises:
        NodeError: there are no such groups, or the scenario cannot be flown by arrays.
    """
    complaints = array_complaints(scenario)
    if complaints:
        raise NodeError(f"{node.get_name()}: {complaints[0]}", EXIT_BAD_INPUT)
    try:
        groups = SatelliteGroups.of_text(file.read_text(encoding="utf-8"), scenario.possible_graph())
    except (OSError, ValueError) as error:
        raise NodeError(f"{node.get_name()}: the file of groups {file} {error}", EXIT_BAD_INPUT) from None
    return compile_scenario(scenario, groups)


def _stopped_exit_code(node: Node) -> int:
    """The exit code of a node that is asked to stop: 130, as of a program that Ctrl-C ends, or as given.

    `ros2 launch` stops a node by SIGINT, and launch_testing then takes 0 alone for success.

    Raises:
        NodeError: what is given is no exit code.
    """
    code = int(declare_start(node, STOPPED_EXIT_CODE))
    if not 0 <= code < _EXIT_CODES:
        raise NodeError(f"{STOPPED_EXIT_CODE} is {code}; it is an exit code, 0 to 255", EXIT_BAD_INPUT)
    return code


def wait_for_acknowledgement(
    publishers: Iterable[Any], present: Callable[[], bool], discovery_timeout: float
) -> bool:
    """Wait until the last messages are acknowledged: a publisher that is destroyed loses them.

    A subscription that was killed never acknowledges, and DDS keeps it matched until its lease ends; so the
    wait also ends when no required subscriber is present.

    Args:
        publishers: with messages that may be unacknowledged.
        present: whether a required subscriber is present.
        discovery_timeout: wall-clock time at most, s.

    Returns:
        False after the timeout.
    """
    end = time.monotonic() + discovery_timeout
    for publisher in publishers:
        while not publisher.wait_for_all_acked(_ACKNOWLEDGED):
            if not present():
                return True
            if time.monotonic() > end:
                return False
    return True


def run(
    name: str,
    fly: Callable[[FormationNode, StepExecutor, StopRequest, SupervisorPipe], int],
    arguments: Sequence[str] | None,
    report: SupervisorPipe,
) -> int:
    """Make a node, let it fly, and take it down again.

    Args:
        name: the node's name; remapping (`__node:=`) changes it.
        fly: does the node's work and returns the exit code.
        arguments: command line; the process's own when None.
        report: pipe to the supervisor.

    Returns:
        The exit code.
    """
    stop = StopRequest()
    # A quantity that is not finite ends the flight with an error; numpy's warnings would add nothing.
    np.seterr(all="ignore")
    code = EXIT_STOPPED
    # rclpy's own handlers would tear the context down in the middle of a step.
    try:
        rclpy.init(
            args=None if arguments is None else list(arguments),
            signal_handler_options=SignalHandlerOptions.NO,
        )
    except RuntimeError as error:
        # Arguments or a parameter file that ROS itself does not understand; there is no logger yet.
        reason = _SOURCE_LINE.sub("", " ".join(str(error).split()))
        sys.stderr.write(f"{name}: ROS cannot be started with these arguments: {reason}\n")
        return EXIT_BAD_INPUT
    try:
        node = FormationNode(name)
        executor = StepExecutor()
        executor.add_node(node)
        try:
            reject_sim_time(node)
            code = _stopped_exit_code(node)
            ended = fly(node, executor, stop, report)
            return code if ended == EXIT_STOPPED else ended
        except NodeError as failure:
            node.get_logger().error(str(failure))
            return failure.code
        except ParameterError as error:
            node.get_logger().error(str(error))
            return EXIT_BAD_INPUT
        finally:
            executor.shutdown(timeout_sec=0.0)
            node.destroy_node()
    except SystemExit as end:
        # Asked to stop a second time.
        if end.code != EXIT_STOPPED:
            raise
        return code
    finally:
        rclpy.try_shutdown()


def exit_code_of(stop: StopRequest, ended: FormationStatus | None) -> int:
    """Exit code of a node's process by the plant's final status.

    Args:
        stop: whether this process was asked to stop.
        ended: the last status; None when there was none.

    Returns:
        3 where the plant has aborted the flight because something was lost.
    """
    if stop.asked:
        return EXIT_STOPPED
    if ended is None or ended.phase != FormationStatus.ABORTED:
        return EXIT_DONE
    return EXIT_DONE if ended.reason == STOPPED or ended.early_end else EXIT_LOST
