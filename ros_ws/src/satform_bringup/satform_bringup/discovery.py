"""How the processes of one run find each other, without ever leaving this machine.

rmw_fastrtps' range LOCALHOST calls at the first 32 participant ports of the loopback interface, one by one:
later participants are never called. Shared memory has a port on which all participants of a domain listen, so
larger runs use that transport alone. It cannot leave the machine, and needs no server and no port.

Smaller runs keep the range LOCALHOST, in which `ros2 topic echo` finds them without being told anything.
"""

import os
from pathlib import Path

MOST_ON_LOOPBACK = 28
"""Processes that find each other in the range LOCALHOST, with a few to spare for those who look in."""

MOST = 100
"""Participants that Fast DDS finds ports for in one domain on one machine."""

PROFILE_FILE = "discovery.xml"
"""In a run's folder, where a run is too large for LOCALHOST: give it to whoever wants to look in."""

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PROFILE = "FASTRTPS_DEFAULT_PROFILES_FILE"

_SHARED_MEMORY_ALONE = """\
<?xml version="1.0" encoding="UTF-8"?>
<!-- Participants find each other and talk through shared memory alone, on this machine. -->
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <transport_descriptors>
    <transport_descriptor>
      <transport_id>shared_memory</transport_id>
      <type>SHM</type>
    </transport_descriptor>
  </transport_descriptors>
  <participant profile_name="this_machine" is_default_profile="true">
    <rtps>
      <userTransports><transport_id>shared_memory</transport_id></userTransports>
      <useBuiltinTransports>false</useBuiltinTransports>
    </rtps>
  </participant>
</profiles>
"""


class DiscoveryError(RuntimeError):
    """There are more processes than can find each other; the message says what to do."""


def variables(processes: int, folder: Path) -> dict[str, str]:
    """What a run's processes need in their environment in order to find each other.

    Args:
        processes: of the run.
        folder: existing folder of the run; a large run's profile is written there.

    Returns:
        Environment variables; none where the range LOCALHOST does, or where the environment already says how
        processes are to find each other.

    Raises:
        DiscoveryError: there are too many.
        OSError: the folder cannot be written to.
    """
    if processes > MOST:
        raise DiscoveryError(
            f"{processes} processes are more than the {MOST} that find each other on one machine; "
            f"let satellites share processes with --group {_group_for(processes)} or more"
        )
    told = os.environ.get(RANGE, "LOCALHOST") != "LOCALHOST" or PROFILE in os.environ
    if processes <= MOST_ON_LOOPBACK or told:
        return {}
    profile = folder.absolute() / PROFILE_FILE
    profile.write_text(_SHARED_MEMORY_ALONE, encoding="utf-8")
    return {RANGE: "SYSTEM_DEFAULT", PROFILE: str(profile)}


def _group_for(processes: int) -> int:
    """Satellites to a process that give few enough processes, beside plant and recorder."""
    return -(-processes // (MOST - 2))
