"""How the processes of one run find each other, without ever leaving this machine.

rmw_fastrtps' range LOCALHOST calls at the first 32 participant ports of the loopback interface, one by one:
later participants are never called. Shared memory has a port on which all participants of a domain listen, so
larger runs use that transport alone. It cannot leave the machine, and needs no server and no port.

Smaller runs keep the range LOCALHOST, in which `ros2 topic echo` finds them without being told anything.
"""

import os
from pathlib import Path

from satform_bringup import middleware

MOST_ON_LOOPBACK = 28
"""Processes that find each other in the range LOCALHOST, with a few to spare for those who look in."""

MOST = 100
"""Participants that Fast DDS finds ports for in one domain on one machine."""

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
"""Environment variable by which a ROS 2 process is told how far to look."""


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
            f"{processes} processes are more than the {MOST} that find each other on one machine; "
            f"let satellites share processes with --group {_group_for(processes)} or more"
        )
    period = middleware.heartbeat(satellites)
    told = os.environ.get(RANGE, "LOCALHOST") != "LOCALHOST" or middleware.is_told()
    if processes <= MOST_ON_LOOPBACK or told:
        return middleware.tell(folder, period)
    return {RANGE: "SYSTEM_DEFAULT"} | middleware.tell(folder, period, middleware.SHARED_MEMORY_ALONE)


def _group_for(processes: int) -> int:
    """Satellites to a process that give few enough processes, beside plant and recorder."""
    return -(-processes // (MOST - 2))
