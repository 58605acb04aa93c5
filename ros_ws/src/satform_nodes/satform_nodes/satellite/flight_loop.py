# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flight loop of the satellites of one process: discovery, steps, end."""

import resource
from collections.abc import Sequence
from typing import Protocol

from satform_msgs.msg import FormationStatus

from satform.common.exit_codes import EXIT_LOST
from satform.common.name_list import listed
from satform.flight.compile import FormationPlan
from satform.protocol.formation_view import FormationView
from satform.record.early_end import EarlyEnd
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.lifecycle import discovery_timeout, exit_code_of, plant_timeout
from satform_nodes.runtime.signals import StopRequest
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.node_error import NodeError

_KILOBYTE = 1024
"""Unit in which Linux reports the memory of a process, bytes."""


class FlownSteps(Protocol):
    """Steps of a satellite or of a group.

    Attributes:
        view: membership and communication graph, by the status of the plant.
        step: the one that comes next.
        flying: whether it takes part.
    """

    view: FormationView
    step: int
    flying: bool

    @property
    def pulse(self) -> int:
        """Number of messages of the plant."""


class FlownNode(Protocol):
    """What flies: the node of a satellite, or of a group that exchanges arrays.

    Attributes:
        node: of ROS.
        name: of the node.
        plan: of the flight's parts.
        report: pipe to the supervisor.
    """

    node: FormationNode
    name: str
    plan: FormationPlan
    report: SupervisorPipe

    @property
    def steps(self) -> FlownSteps:
        """Its steps."""

    def matched(self) -> bool:
        """Whether all required endpoints are matched."""

    def offer(self) -> None:
        """Publish that it is ready."""

    def retransmit(self) -> None:
        """Publish the last messages again."""

    def command_zero(self) -> None:
        """Publish commands of zero: the plant is lost."""

    def wait_for_acknowledgement(self) -> None:
        """Wait until the last messages are acknowledged, for a bounded time."""

    def report_result(self) -> None:
        """Send figures to the supervisor."""


def fly_all(satellites: Sequence[FlownNode], executor: StepExecutor, stop: StopRequest) -> int:
    """Fly the satellites of one process until the plant publishes the end of the flight.

    Args:
        satellites: with their endpoints made, all on the same executor.
        executor: does the waiting.
        stop: ends the flight of these satellites early.

    Returns:
        The exit code.

    Raises:
        NodeError: discovery or the plant has timed out.
    """
    names = listed([satellite.name for satellite in satellites])
    longest = discovery_timeout(satellites[0].plan)

    def over() -> bool:
        return stop.asked or all(satellite.steps.view.ended for satellite in satellites)

    if not executor.spin_until(
        lambda: all(satellite.matched() for satellite in satellites) or over(), longest
    ):
        sentence = f"{names}: neighbours and plant have not been found within {longest:g} s"
        raise NodeError(sentence, EXIT_LOST)
    for satellite in satellites:
        satellite.offer()
        satellite.report.send("ready", node=satellite.name)
    satellites[0].node.get_logger().info(f"{names}: ready")

    def begun() -> bool:
        return over() or any(satellite.steps.flying for satellite in satellites)

    def retransmit() -> None:
        for satellite in satellites:
            satellite.retransmit()

    def pulse() -> int:
        return sum(satellite.steps.pulse for satellite in satellites)

    # The first state comes when the last of all nodes is ready; the next ones within the timeout.
    timeout = plant_timeout(satellites[0].plan.timing.node_timeout)
    in_time = executor.spin_while(lambda: not begun(), longest, progress=pulse)
    in_time = in_time and executor.spin_while(lambda: not over(), timeout, retransmit, pulse)
    _finish(satellites, in_time=in_time)
    return exit_code_of(stop, satellites[0].steps.view.ended)


def _finish(satellites: Sequence[FlownNode], *, in_time: bool) -> None:
    """Report the result, and wait until the last messages are acknowledged.

    Raises:
        NodeError: the plant is lost.
    """
    for satellite in satellites:
        if in_time:
            satellite.wait_for_acknowledgement()
        else:
            satellite.command_zero()
        satellite.report_result()
    first = satellites[0]
    ended = first.steps.view.ended
    if ended is not None and ended.phase == FormationStatus.ABORTED:
        first.report.send("aborted", reason=ended.reason)
    end = None if ended is None else EarlyEnd.of_message(ended, first.plan.timing.step)
    if end is not None:
        # On a host without the plant no other process knows.
        first.report.send("end_received", end=end.data())
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _KILOBYTE
    first.report.send("memory", process=first.name, bytes=memory)
    if not in_time:
        sentence = f"nothing received from the plant at step {first.steps.step}"
        first.report.send("lost", who=["plant"], step=first.steps.step, reason=sentence)
        names = listed([satellite.name for satellite in satellites])
        raise NodeError(f"{names}: {sentence}; thrusters off, stopping", EXIT_LOST)
