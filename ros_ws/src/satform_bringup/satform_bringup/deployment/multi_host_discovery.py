# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Discovery between the hosts of a flight: by address, without multicast."""

import difflib
import hashlib
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from satform.scenario import Scenario
from satform.scenario.deployment import HostSpec
from satform_bringup.deployment import middleware
from satform_bringup.deployment.domain_lock import HIGHEST_SECURED, own_domain

FIRST_SHARED, LAST_SHARED = 215, HIGHEST_SECURED
"""Domains for flights on several machines, apart from those that a flight on one machine takes.

Their ports lie above those that Linux gives to outgoing connections.
"""

_PARTICIPANTS = 32
"""Processes that the middleware looks for at each address."""

HEARTBEAT = 0.02
"""Period of the writers' heartbeats where messages may be lost on their way, s."""


class PeerError(RuntimeError):
    """A host cannot take its part; the message says why."""


def find_host(scenario: Scenario, name: str) -> HostSpec:
    """One host of a scenario.

    Raises:
        PeerError: the scenario has none of that name.
    """
    if not scenario.hosts:
        raise PeerError(
            f"the scenario {scenario.name} does not say which host runs which nodes; give it a field hosts, "
            "such as [{name: alpha, address: 192.168.1.10, runs: [plant, recorder]}, ...]"
        )
    known = {host.name: host for host in scenario.hosts}
    if name in known:
        return known[name]
    close = difflib.get_close_matches(name, known, n=1)
    meant = f"did you mean {close[0]}?" if close else f"there are {', '.join(known)}"
    raise PeerError(f"there is no host {name} in the scenario {scenario.name}; {meant}")


def judge(scenario: Scenario) -> HostSpec:
    """The host that runs the recorder, and so has what a flight is judged by."""
    return next(host for host in scenario.hosts if "recorder" in host.runs)


def require_own_address(host: HostSpec) -> None:
    """Go on only on the machine that has the host's address.

    Raises:
        PeerError: it is another machine's, or no machine's.
    """
    try:
        address = socket.gethostbyname(host.address)
    except OSError:
        raise PeerError(f"{host.address}, the address of host {host.name}, is not known here") from None
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, 0))
        except OSError:
            raise PeerError(
                f"this machine does not have {host.address}, the address of host {host.name} in the "
                "scenario; give the name of this machine's host to --host, or correct the address"
            ) from None


@contextmanager
def flight_domain(scenario: Scenario, host: HostSpec | None, namespace: str = "") -> Iterator[int]:
    """Hold the DDS domain of a flight on this machine.

    Args:
        scenario: what is flown.
        host: the part that this machine has; None when it runs everything.
        namespace: of all nodes and topics; flights in different ones may share a domain.

    Yields:
        `ROS_DOMAIN_ID` if it is set; else one that is free on this machine or, with several hosts,
        the one on which all that have the same scenario agree.

    Raises:
        DomainError: the domain is no domain, or another run on this machine holds it.
    """
    with own_domain(None if host is None else agreed_domain(scenario), namespace) as number:
        yield number


def agreed_domain(scenario: Scenario) -> int:
    """The domain that follows from what is flown and where, the same on every host.

    Hosts with different scenarios seldom agree by chance, and then do not find each other: better
    than to fly half of one scenario with half of another.
    """
    meaning = scenario.digest() + "".join(host.model_dump_json() for host in scenario.hosts)
    number = int.from_bytes(hashlib.sha256(meaning.encode()).digest()[:8], "big")
    return FIRST_SHARED + number % (LAST_SHARED - FIRST_SHARED + 1)


def variables(scenario: Scenario, host: HostSpec | None, folder: Path) -> dict[str, str]:
    """Environment variables by which the nodes of a host find those of the others.

    Args:
        scenario: what is flown.
        host: the part that this machine has; None when it runs everything.
        folder: of the run; gets the middleware's settings.

    Returns:
        Values by name; none when nobody else is to be found.

    Raises:
        OSError: the folder cannot be written to.
    """
    if host is None:
        return {}
    others = [other.address for other in scenario.hosts if other.name != host.name]
    asked_for = [address for address in os.environ.get("ROS_STATIC_PEERS", "").split(";") if address]
    return middleware.write_profile(folder, HEARTBEAT, middleware.PATIENT_ANNOUNCEMENTS) | {
        # The local machine and the static peers, and nobody else: SUBNET would add multicast, OFF drops
        # the peers too, SYSTEM_DEFAULT does not look at them.
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_STATIC_PEERS": ";".join(dict.fromkeys([*others, *asked_for])),
        # Deprecated, but where it is 1 the peers are not looked at.
        "ROS_LOCALHOST_ONLY": "",
    }


def step_reported(event: dict[str, Any], last_step: int) -> int:
    """The step in a node's event, on a host without the plant.

    Args:
        event: what a satellite or the recorder reported.
        last_step: of the scenario.

    Returns:
        The step; 0 when the event has none.
    """
    if event["event"] == "recorded":
        return last_step if event["complete"] else 0
    return int(event["step"]) if event["event"] == "satellite" else 0


def ports(domain: int) -> tuple[int, int]:
    """First and last UDP port that a firewall between the hosts has to let through.

    Args:
        domain: DDS domain.

    Returns:
        By the DDS standard's formula: of the first process's discovery, and of the last one's data.
    """
    base = 7400 + 250 * domain
    return base + 10, base + 11 + 2 * (_PARTICIPANTS - 1)


def in_words(scenario: Scenario, host: HostSpec, domain: int) -> str:
    """What a host is about to do, for the person who has started it."""
    first, last = ports(domain)
    others = ", ".join(
        f"{other.name} ({other.address})" for other in scenario.hosts if other.name != host.name
    )
    return (
        f"host {host.name} ({host.address}) runs {', '.join(host.runs)}, with {others or 'nobody else'}: "
        f"DDS domain {domain}, UDP ports {first} to {last}, scenario {scenario.digest()[:12]}, "
        f"judged on {judge(scenario).name}"
    )
