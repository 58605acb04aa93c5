# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Program of several satellites in one process: each with its topics, or a group that exchanges arrays."""

import sys
from collections.abc import Sequence
from multiprocessing.connection import Connection

from satform.common.exit_codes import EXIT_BAD_INPUT
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.lifecycle import plan_of, reject_sim_time, run
from satform_nodes.runtime.parameters import declare_start
from satform_nodes.runtime.signals import StopRequest
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.satellite.array_group import ArrayGroup
from satform_nodes.satellite.batched_step import batch_satellites
from satform_nodes.satellite.flight_loop import fly_all
from satform_nodes.satellite.node import SatelliteNode
from satform_nodes.satellite.parameters import SatelliteSettings, declare_settings
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.node_error import NodeError

LARGEST_FULL_GROUP = 32
"""Largest number of satellites in a process with parameter services and warnings of incompatible QoS.

A process announces all its endpoints to all others at each new endpoint, and more than half of the endpoints
are parameter services; each event handler of incompatible QoS is polled by the executor. Above this number
nodes are lean: a large formation would hardly start otherwise.
"""


def fly(node: FormationNode, executor: StepExecutor, stop: StopRequest, report: SupervisorPipe) -> int:
    """Make a node for each satellite of the group, and fly them on one executor."""
    recorded, checkpoints, rate = declare_settings(node)
    names = declare_start(node, "satellites")
    declare_start(node, "groups")
    plan = plan_of(node)
    if plan.groups is not None:
        if rate > 0.0:
            raise NodeError("groups that exchange arrays fly in lockstep, not with a rate", EXIT_BAD_INPUT)
        group = ArrayGroup(node, executor, plan, plan.groups, report, recorded=recorded)
        return fly_all([group], executor, stop)
    if not any(names):
        sentence = f"{node.get_name()} needs the parameter satellites: names from the scenario"
        raise NodeError(sentence, EXIT_BAD_INPUT)
    satellites = []
    for name in names:
        own = FormationNode(name, log_topic=False, lean=len(names) > LARGEST_FULL_GROUP)
        reject_sim_time(own)
        executor.add_node(own)
        settings = SatelliteSettings(name, recorded, checkpoints, single=len(names) == 1, rate=rate)
        satellites.append(SatelliteNode(own, executor, plan, settings, report))
    batch_satellites(satellites, plan)
    try:
        return fly_all(satellites, executor, stop)
    finally:
        for satellite in satellites:
            satellite.node.destroy_node()


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Fly a group of satellites; entry point of the executable `group_node`."""
    return run("group", fly, arguments, SupervisorPipe(pipe))


if __name__ == "__main__":
    sys.exit(main())
