# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Fast DDS profile of a run: heartbeats, acknowledgements and transports, as an XML file.

A message can be dropped by a network or by a full queue between two processes. While a step waits for it, no
later message follows by which the reader would detect the gap; the writer's next heartbeat reports it, by
default after 3 s. A reader that joins late and the loss of a writer depend on the heartbeat, too.
The profile also selects the transports.
"""

import os
from collections.abc import Sequence
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

ADDRESS = "127.0.0.1"
"""Of the loopback interface."""

PATIENT_ANNOUNCEMENTS = """
      <builtin>
        <discovery_config>
          <initialAnnouncements><count>50</count><period><nanosec>100000000</nanosec></period></initialAnnouncements>
          <leaseAnnouncement><sec>1</sec></leaseAnnouncement>
        </discovery_config>
      </builtin>"""
"""Participants bridge losses while they look for each other."""

_ROOM = 4 * 2**20
"""What a socket is to hold until it is read, bytes; the system grants as much of it as it allows.

A process that announces its endpoints to one that it has discovered sends heartbeats to all that it knows.
There are fewer of them if the socket by which it sends holds more.
"""

PORTS = 100
"""Ports that Fast DDS tries for a participant of a domain on a machine, and at which all are called."""

_LOOPBACK = """
      <builtin>
        <metatrafficUnicastLocatorList>{own}</metatrafficUnicastLocatorList>
        <initialPeersList>{called}</initialPeersList>
      </builtin>
      <userTransports><transport_id>loopback</transport_id></userTransports>
      <useBuiltinTransports>false</useBuiltinTransports>"""

_PROFILES = """\
<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <transport_descriptors>
    <transport_descriptor>
      <transport_id>loopback</transport_id>
      <type>UDPv4</type>
      <sendBufferSize>{room}</sendBufferSize>
      <receiveBufferSize>{room}</receiveBufferSize>
      <maxInitialPeersRange>{ports}</maxInitialPeersRange>
      <interfaceWhiteList><address>{address}</address></interfaceWhiteList>
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


def on_loopback(own: int | None = None, called: Sequence[int] = ()) -> str:
    """Settings of a participant that calls others on the loopback interface, and talks through sockets there.

    The system takes a socket away with its process, however that ends.

    Args:
        own: UDP port on which it is called, or the next free one; None for the first free one.
        called: ports that it calls; none for those of all participants.
    """
    found = "".join(map(_locator, called)) or _locator(None)
    return _LOOPBACK.format(own=_locator(own), called=found)


def _locator(port: int | None) -> str:
    number = "" if port is None else f"<port>{port}</port>"
    return f"<locator><udpv4>{number}<address>{ADDRESS}</address></udpv4></locator>"


def write_profile(
    folder: Path, period: float, participant: str = "", *, response: float = RESPONSE, name: str = FILE
) -> dict[str, str]:
    """Write the file, unless the environment names one.

    Args:
        folder: of the run; exists.
        period: of the writers' heartbeats, s.
        participant: settings by `on_loopback`, `PATIENT_ANNOUNCEMENTS`, or nothing.
        response: delay of the readers' acknowledgements, s.
        name: of the file.

    Returns:
        Environment variables by which the middleware finds it.

    Raises:
        OSError: the folder cannot be written to.
    """
    if is_configured():
        return {}
    seconds, nanoseconds = divmod(round(period * 1e9), 10**9)
    file = folder.absolute() / name
    text = _PROFILES.format(
        participant=participant,
        seconds=seconds,
        nanoseconds=nanoseconds,
        response=round(response * 1e9),
        room=_ROOM,
        address=ADDRESS,
        ports=PORTS,
    )
    file.write_text(text, encoding="utf-8")
    return dict.fromkeys(VARIABLES, str(file))
