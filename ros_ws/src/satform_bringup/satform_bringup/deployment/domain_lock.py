# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Locks of DDS domains: each run on a machine holds a domain of its own, which no other run can hold.

The running flights of a user are listed by `supervisor.run_registry`.
"""

import errno
import os
import pwd
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from satform_bringup.deployment.environment import restored

FIRST, LAST = 1, 99
"""Domains whose ports lie below those that Linux gives to outgoing connections."""

HIGHEST = 232
"""The last domain that DDS has ports for."""

HIGHEST_SECURED = 230
"""The last domain that both Fast DDS and Cyclone DDS take in the documents of DDS security.

Cyclone DDS refuses a governance document, and with it the whole keystore, that names a higher one.
"""

ABSTRACT = "\0satform/domain/"
"""Beginning of the abstract socket names by which domains are held."""

_BACKLOG = 8
"""Connections of processes that query the holder of a domain."""

_CREDENTIALS = struct.Struct("3i")
"""Linux's `struct ucred`: process, user, group."""

_FIRST_PORT, _PORTS_OF_A_DOMAIN, _FIRST_OF_PARTICIPANTS = 7400, 250, 10

_LAST_PORT = 65535
"""Of UDP."""

_HELD = "SATFORM_HOLDS_DOMAIN"
"""Environment variable for child processes: the domain that this process holds for them."""

_VARIABLES = ("ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", _HELD)


class DomainError(RuntimeError):
    """No domain can be had; the message says which was wanted and who has it."""


@contextmanager
def own_domain(agreed: int | None = None, namespace: str = "") -> Iterator[int]:
    """Hold a domain for the length of a run.

    Args:
        agreed: with other machines, to be taken unless the environment sets another; None for any.
        namespace: of all nodes and topics of the run; runs in different ones may share a domain.

    Yields:
        `ROS_DOMAIN_ID` from the environment if it is set; else the one that was agreed; else a number
        that no other run on this machine holds.

    Raises:
        DomainError: the domain that is set is held by another run or is none; or all are held.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "") or ("" if agreed is None else str(agreed))
    wanted = [_number(text)] if text else _in_order()
    if text and os.environ.get(_HELD) == text:
        yield wanted[0]
        return
    for number in wanted:
        lock = hold(number, namespace)
        if lock is not None:
            try:
                yield number
            finally:
                os.close(lock)
            return
    if text:
        raise DomainError(
            f"ROS_DOMAIN_ID={text} is in use by another run on this machine{_in_words(wanted[0])}, and both "
            "would receive each other's messages; wait for it to end, set another one, "
            + ("or unset it to use a free domain" if agreed is None else "the same on every host")
        )
    raise DomainError(f"{len(wanted)} runs are under way already; wait for one to end")


@contextmanager
def on_domain(number: int) -> Iterator[None]:
    """Set this process's environment for a domain that it holds, and restore it in the end."""
    with restored(_VARIABLES):
        enter_domain(number)
        yield


def enter_domain(number: int) -> None:
    """Set this process's environment for a domain that is held for it."""
    os.environ["ROS_DOMAIN_ID"] = os.environ[_HELD] = str(number)
    stay_on_this_machine()


def stay_on_this_machine() -> None:
    """Have nodes found on this machine only, unless the environment sets another range."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")


def shell_domain() -> int | None:
    """The domain that `ROS_DOMAIN_ID` names; None when it is not set.

    Raises:
        DomainError: what it names is no domain.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "")
    return _number(text) if text else None


def _number(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) <= HIGHEST):
        raise DomainError(f"ROS_DOMAIN_ID={text!r} is not a DDS domain; it is a number from 0 to {HIGHEST}")
    return int(text)


def hold(number: int, namespace: str = "") -> int | None:
    """Hold a domain, or a namespace in it, while the descriptor that is returned stays open.

    None is returned when another run has it.

    The hold is a socket in Linux's abstract namespace, which the kernel grants once, to whichever user asks
    first, and takes back when its process ends; it is no file, in whose place another user could put a link.
    Like the ports that it stands for it belongs to a network namespace: containers that share the host's
    network share the domains, too.
    """
    held = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        held.bind(f"{ABSTRACT}{number}{namespace.rstrip('/')}")
        # A process that connects learns from the kernel who holds it.
        held.listen(_BACKLOG)
    except OSError as error:
        held.close()
        if error.errno == errno.EADDRINUSE:
            return None
        raise
    return held.detach()


def holder(number: int) -> tuple[int, int] | None:
    """Process and user that hold a domain; None when nobody does or it is not known.

    Args:
        number: of the domain.

    Returns:
        Their ids, as the kernel has them.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asked:
        asked.setblocking(False)
        try:
            asked.connect(f"{ABSTRACT}{number}")
            data = asked.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        except OSError:
            return None
    process, user, _group = _CREDENTIALS.unpack(data)
    return process, user


def domains_with_participants() -> set[int]:
    """Domains in which DDS participants are on this machine, runs or not, by the UDP ports that are bound.

    By the DDS standard's formula (RTPS 2.2, section 9.6.1.1) domain d has the ports from 7400 + 250 d on.
    """
    ports = bound_ports()
    return {(port - _FIRST_PORT) // _PORTS_OF_A_DOMAIN for port in ports if port >= _FIRST_PORT}


def bound_ports() -> set[int]:
    """UDP ports that are bound on this machine, on whatever address."""
    found: set[int] = set()
    for table in ("/proc/net/udp", "/proc/net/udp6"):
        try:
            rows = Path(table).read_text(encoding="ascii").splitlines()[1:]
        except OSError:
            continue
        found |= {int(row.split()[1].rpartition(":")[2], 16) for row in rows}
    return found


def discovery_ports(domain: int, count: int) -> range:
    """UDP ports at which participants of a domain are called, by the same formula.

    Args:
        domain: DDS domain.
        count: of participants; the last domains have ports for fewer.
    """
    first = _FIRST_PORT + _PORTS_OF_A_DOMAIN * domain + _FIRST_OF_PARTICIPANTS
    return range(first, min(first + 2 * count, _LAST_PORT), 2)


def _in_order() -> list[int]:
    """Domains to try: those without any participant first, from a place on that differs between processes."""
    begin = os.getpid() % (LAST - FIRST + 1)
    numbers = [FIRST + (begin + turn) % (LAST - FIRST + 1) for turn in range(LAST - FIRST + 1)]
    used = domains_with_participants()
    return sorted(numbers, key=lambda number: number in used)


def _in_words(number: int) -> str:
    """Who holds a domain, for a sentence."""
    found = holder(number)
    if found is None:
        return ""
    process, user = found
    return f" (process {process}{'' if user == os.geteuid() else f' of user {_name_of(user)}'})"


def _name_of(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return str(user)
