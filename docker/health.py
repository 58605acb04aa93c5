# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Health check of a container: healthy while a process in it listens for DDS discovery.

Every DDS participant binds a UDP port that follows from its domain and participant number, also while it
waits for the other nodes. A container has its own network, so such a port belongs to the flight.
"""

import os
import sys
from pathlib import Path

FIRST_PORT, PORTS_OF_A_DOMAIN, DISCOVERY = 7400, 250, 10
PARTICIPANTS = 120
"""Participants of a domain that have ports."""


def discovery_ports(table: str, domain: int | None = None) -> list[int]:
    """Find the DDS discovery ports in a table of UDP sockets.

    Args:
        table: text in the form of `/proc/net/udp`.
        domain: DDS domain; None for any.

    Returns:
        The bound discovery ports, ascending.
    """
    bound = {int(row.split()[1].rpartition(":")[2], 16) for row in table.splitlines()[1:] if row.strip()}
    return sorted(port for port in bound if _is_discovery(port, domain))


def _is_discovery(port: int, domain: int | None) -> bool:
    number, offset = divmod(port - FIRST_PORT, PORTS_OF_A_DOMAIN)
    of_the_domain = 0 <= number <= 232 if domain is None else number == domain
    participant, odd = divmod(offset - DISCOVERY, 2)
    return of_the_domain and not odd and 0 <= participant < PARTICIPANTS


if __name__ == "__main__":
    given = os.environ.get("ROS_DOMAIN_ID", "")
    found = discovery_ports(Path("/proc/net/udp").read_text(), int(given) if given.isdigit() else None)
    sys.stdout.write(
        f"DDS discovery on UDP {', '.join(map(str, found))}\n" if found else "no DDS participant\n"
    )
    sys.exit(not found)
