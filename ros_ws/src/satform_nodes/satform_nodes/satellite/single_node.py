# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Program of one satellite in a process of its own: makes its node and flies until the flight ends."""

import sys
from collections.abc import Sequence
from multiprocessing.connection import Connection

from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.lifecycle import plan_of, run
from satform_nodes.runtime.parameters import declare_start
from satform_nodes.runtime.signals import StopRequest
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.satellite.flight_loop import fly_all
from satform_nodes.satellite.node import SatelliteNode
from satform_nodes.satellite.parameters import SatelliteSettings, declare_settings
from satform_nodes.transport.executor import StepExecutor


def fly(node: FormationNode, executor: StepExecutor, stop: StopRequest, report: SupervisorPipe) -> int:
    """Make the node of the satellite, and fly until the flight has ended."""
    recorded, checkpoints, rate = declare_settings(node)
    name = declare_start(node, "satellite")
    plan = plan_of(node)
    settings = SatelliteSettings(name, recorded, checkpoints, single=True, rate=rate)
    return fly_all([SatelliteNode(node, executor, plan, settings, report)], executor, stop)


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Fly one satellite; entry point of the executable `satellite_node`."""
    return run("satellite", fly, arguments, SupervisorPipe(pipe))


if __name__ == "__main__":
    sys.exit(main())
