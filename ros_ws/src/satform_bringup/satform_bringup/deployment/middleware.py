# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Fast DDS profile of a run: heartbeats, acknowledgements and transports, as an XML file.

A message can be dropped by a network or by a full queue between two processes. While a step waits for it, no
later message follows by which the reader would detect the gap; the writer's next heartbeat reports it, by
default after 3 s. A reader that joins late and the loss of a writer depend on the heartbeat, too.
The profile also selects the transports.
"""

import os
from pathlib import Path

FILE = "middleware.xml"
"""In a run's folder: settings of the middleware of its processes."""

VARIABLES = ("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE")
"""Under the first name newer versions of the middleware look for the file, under the second all of them."""

HEARTBEAT_OF_A_SATELLITE = 0.01
"""Period of the heartbeats for each satellite of a formation: with the number of writers it grows, s."""

SLOWEST_HEARTBEAT = 3.0
"""The middleware's own period, s."""

RESPONSE_ON_LOOPBACK = 0.05
"""Delay after which a reader acknowledges messages or asks for lost ones, where all processes are on one
machine, s: one acknowledgement is for the messages of several steps then. Each wakes two threads."""

RESPONSE = 0.005
"""The same elsewhere, the middleware's own: what a network loses is asked for soon, s."""

LOOPBACK_ALONE = """
      <builtin>
        <metatrafficUnicastLocatorList>
          <locator><udpv4><address>127.0.0.1</address></udpv4></locator>
        </metatrafficUnicastLocatorList>
        <initialPeersList>
          <locator><udpv4><address>127.0.0.1</address></udpv4></locator>
        </initialPeersList>
      </builtin>
      <userTransports><transport_id>loopback</transport_id></userTransports>
      <useBuiltinTransports>false</useBuiltinTransports>"""
"""Participants call at each other's ports on the loopback interface, and talk through sockets there. The
system takes a socket away with its process, however that ends."""

PATIENT_ANNOUNCEMENTS = """
      <builtin>
        <discovery_config>
          <initialAnnouncements><count>50</count><period><nanosec>100000000</nanosec></period></initialAnnouncements>
          <leaseAnnouncement><sec>1</sec></leaseAnnouncement>
        </discovery_config>
      </builtin>"""
"""Participants bridge losses while they look for each other."""

_ROOM = 4 * 2**20
"""What a socket is to hold until it is read, bytes; the system grants as much of it as it allows."""

PORTS = 100
"""Ports that Fast DDS tries for a participant of a domain on a machine, and at which all are called."""

_PROFILES = """\
<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <transport_descriptors>
    <transport_descriptor>
      <transport_id>loopback</transport_id>
      <type>UDPv4</type>
      <receiveBufferSize>{room}</receiveBufferSize>
      <maxInitialPeersRange>{ports}</maxInitialPeersRange>
      <interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList>
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
  <data_reader profile_name="satform" is_default_profile="true">
    <times>
      <heartbeatResponseDelay><sec>0</sec><nanosec>{response}</nanosec></heartbeatResponseDelay>
    </times>
  </data_reader>
</profiles>
"""


def heartbeat(satellites: int) -> float:
    """Period of the writers' heartbeats in a formation, s."""
    return min(HEARTBEAT_OF_A_SATELLITE * satellites, SLOWEST_HEARTBEAT)


def is_configured() -> bool:
    """Whether the environment names a file of profiles already, which is then left as it is."""
    return any(os.environ.get(name) for name in VARIABLES)


def write_profile(folder: Path, period: float, participant: str = "") -> dict[str, str]:
    """Write the file, unless the environment names one.

    Args:
        folder: of the run; exists.
        period: of the writers' heartbeats, s.
        participant: `LOOPBACK_ALONE`, `PATIENT_ANNOUNCEMENTS`, or nothing.

    Returns:
        Environment variables by which the middleware finds it.

    Raises:
        OSError: the folder cannot be written to.
    """
    if is_configured():
        return {}
    seconds, nanoseconds = divmod(round(period * 1e9), 10**9)
    file = folder.absolute() / FILE
    response = RESPONSE_ON_LOOPBACK if participant == LOOPBACK_ALONE else RESPONSE
    text = _PROFILES.format(
        participant=participant,
        seconds=seconds,
        nanoseconds=nanoseconds,
        response=round(response * 1e9),
        room=_ROOM,
        ports=PORTS,
    )
    file.write_text(text, encoding="utf-8")
    return dict.fromkeys(VARIABLES, str(file))
