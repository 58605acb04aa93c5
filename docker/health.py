"""Whether a formation's part in this container is alive: some process listens for DDS discovery.

Every DDS participant holds a UDP port that follows from its domain and its number, for as long as it
is there, also while it waits for the others. A container has a network of its own, so that a port of
that kind is one of ours.
"""

import os
import sys
from pathlib import Path

FIRST_PORT, PORTS_OF_A_DOMAIN, DISCOVERY = 7400, 250, 10
PARTICIPANTS = 120
"""As many as have ports in a domain."""


def discovery_ports(table: str, domain: int | None = None) -> list[int]:
    """Ports in a table of UDP sockets on which a DDS participant waits to be found.

    Args:
        table: as in `/proc/net/udp`.
        domain: DDS domain; any when None.

    Returns:
        The ports, in order.
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
