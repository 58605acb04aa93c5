"""How the processes of one run find each other and talk, without ever leaving this machine.

They use sockets on the loopback interface alone. Each calls at the participants' ports there, one by one, as
in rmw_fastrtps' range LOCALHOST, so that `ros2 topic echo` finds them without being told anything; that range
calls at the first 32 ports, a larger run at all that there are.

They do without the shared memory of that range. There a process that is killed or stopped while it holds a
port can leave others waiting or deaf, what it left behind has to be taken away, and a port that is full loses
what many say at once.
"""

import os
from pathlib import Path

from satform_bringup import middleware
from satform_nodes import LEAN

MOST = 100
"""Participants that Fast DDS finds ports for in one domain on one machine."""

LOOKERS = 4
"""Ports beside those of a run's processes, for those who look in."""

FEW = middleware.PORTS_OF_LOCALHOST - LOOKERS
"""Processes up to which the range LOCALHOST would do; the nodes of more are lean."""

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
    lean = {LEAN: "1"} if processes > FEW else {}
    if os.environ.get(RANGE, "LOCALHOST") != "LOCALHOST" or middleware.is_told():
        return lean | middleware.tell(folder, period)
    ports = middleware.PORTS_OF_LOCALHOST if processes <= FEW else MOST + LOOKERS
    told = middleware.tell(folder, period, middleware.LOOPBACK_ALONE, ports)
    return lean | {RANGE: "SYSTEM_DEFAULT"} | told


def _group_for(processes: int) -> int:
    """Satellites to a process that give few enough processes, beside plant and recorder."""
    return -(-processes // (MOST - 2))
