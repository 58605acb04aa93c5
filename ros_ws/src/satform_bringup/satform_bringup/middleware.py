"""What the middleware of a run is told beyond its defaults: a file of profiles, as Fast DDS reads it.

A message that was dropped on its way, by a network or by a full queue between two processes, has no successor
by which its loss would show while a step waits for it; only the writer's next heartbeat tells, by default
after 3 s. A reader that comes anew, or a writer that is killed, depends on it in the same way.
"""

import os
from pathlib import Path

FILE = "middleware.xml"
"""In a run's folder: what the middleware of its processes was told."""

VARIABLES = ("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE")
"""Under the first name newer versions of the middleware look for the file, under the second all of them."""

HEARTBEAT_OF_A_SATELLITE = 0.01
"""Period of the heartbeats for each satellite of a formation: with the number of writers it grows, s."""

SLOWEST_HEARTBEAT = 3.0
"""The middleware's own period, s."""

SHARED_MEMORY_ALONE = """
      <userTransports><transport_id>shared_memory</transport_id></userTransports>
      <useBuiltinTransports>false</useBuiltinTransports>"""
"""Participants find each other and talk through shared memory, on this machine."""

PATIENT_ANNOUNCEMENTS = """
      <builtin>
        <discovery_config>
          <initialAnnouncements><count>50</count><period><nanosec>100000000</nanosec></period></initialAnnouncements>
          <leaseAnnouncement><sec>1</sec></leaseAnnouncement>
        </discovery_config>
      </builtin>"""
"""Participants bridge losses while they look for each other."""

_PROFILES = """\
<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <transport_descriptors>
    <transport_descriptor>
      <transport_id>shared_memory</transport_id>
      <type>SHM</type>
    </transport_descriptor>
  </transport_descriptors>
  <participant profile_name="satform" is_default_profile="true">
    <rtps>{participant}
    </rtps>
  </participant>
  <data_writer profile_name="satform" is_default_profile="true">
    <times>
      <heartbeatPeriod><sec>{seconds}</sec><nanosec>{nanoseconds}</nanosec></heartbeatPeriod>
    </times>
  </data_writer>
</profiles>
"""


def heartbeat(satellites: int) -> float:
    """Period of the writers' heartbeats in a formation, s."""
    return min(HEARTBEAT_OF_A_SATELLITE * satellites, SLOWEST_HEARTBEAT)


def is_told() -> bool:
    """Whether the environment names a file of profiles already, which is then left as it is."""
    return any(os.environ.get(name) for name in VARIABLES)


def tell(folder: Path, period: float, participant: str = "") -> dict[str, str]:
    """Write the file, unless the environment names one.

    Args:
        folder: of the run; exists.
        period: of the writers' heartbeats, s.
        participant: `SHARED_MEMORY_ALONE`, `PATIENT_ANNOUNCEMENTS`, or nothing.

    Returns:
        Environment variables by which the middleware finds it.

    Raises:
        OSError: the folder cannot be written to.
    """
    if is_told():
        return {}
    seconds, nanoseconds = divmod(round(period * 1e9), 10**9)
    file = folder.absolute() / FILE
    text = _PROFILES.format(participant=participant, seconds=seconds, nanoseconds=nanoseconds)
    file.write_text(text, encoding="utf-8")
    return dict.fromkeys(VARIABLES, str(file))
