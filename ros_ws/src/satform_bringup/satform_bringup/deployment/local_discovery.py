# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Discovery and transport of the processes of a run on one machine, by sockets on the loopback interface.

They use sockets on the loopback interface alone. Each announces itself at the ports of all participants
there, one by one. An observer with rmw_fastrtps' range LOCALHOST does so at the first 32 of them:
`ros2 topic echo` finds a run without any settings.

The shared memory of that range is not used. There a process that is killed or stopped while it holds a port
can block others or keep them from receiving, its files have to be removed, and a full port loses messages
that many processes send at once.
"""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from satform_bringup.deployment import middleware
from satform_bringup.deployment.environment import restored
from satform_nodes import LEAN

OBSERVER_PORTS = 4
"""Ports that are left to observers."""

MOST = middleware.PORTS - OBSERVER_PORTS
"""Processes that find each other on one machine."""

MAX_FULL_PROCESSES = 34
"""Processes, plant and recorder among them, up to which nodes have everything that a node of ROS 2 has.

Every endpoint is announced to every process, and more than half of a satellite's are those of the services
for its parameters: 64 processes with them take twice as long to start as without.
"""

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
"""Environment variable that sets the range of discovery of a ROS 2 process."""


class DiscoveryError(RuntimeError):
    """There are more processes than can find each other; the message says what to do."""


def variables(processes: int, satellites: int, folder: Path) -> dict[str, str]:
    """What a run's processes need in their environment in order to find each other, and to miss nothing.

    Args:
        processes: of the run.
        satellites: of the formation.
        folder: existing folder of the run; gets the middleware's settings.

    Returns:
        Environment variables; what the environment already says is left as it is.

    Raises:
        DiscoveryError: there are too many.
        OSError: the folder cannot be written to.
    """
    if processes > MOST:
        raise DiscoveryError(
            f"{processes} processes are more than the {MOST} that can discover each other on one machine; "
            f"let satellites share processes with --satellites-per-process {_group_for(processes)} or more"
        )
    period = middleware.heartbeat(satellites)
    lean = {LEAN: "1"} if processes > MAX_FULL_PROCESSES else {}
    if not on_loopback_alone():
        return lean | middleware.write_profile(folder, period)
    profile = middleware.write_profile(
        folder, period, middleware.on_loopback(), response=middleware.RESPONSE_ON_LOOPBACK
    )
    # In this range alone rmw_fastrtps goes by the profile; the deprecated variable would overrule the range.
    return lean | {RANGE: "SYSTEM_DEFAULT", "ROS_LOCALHOST_ONLY": ""} | profile


def on_loopback_alone() -> bool:
    """Whether processes use the loopback interface alone: the environment has no wish of its own."""
    ranged = os.environ.get(RANGE, "LOCALHOST") != "LOCALHOST" or os.environ.get("ROS_STATIC_PEERS")
    return not ranged and not middleware.is_configured()


@contextmanager
def run_environment() -> Iterator[None]:
    """Have this process talk as those of a run do, for the length of the block."""
    with tempfile.TemporaryDirectory() as folder:
        profile = variables(1, 1, Path(folder))
        with restored(profile):
            os.environ.update(profile)
            yield


def _group_for(processes: int) -> int:
    """Satellites to a process that give few enough processes, beside plant and recorder."""
    return -(-processes // (MOST - 2))
