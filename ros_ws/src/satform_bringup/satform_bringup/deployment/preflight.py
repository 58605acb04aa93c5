# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the environment of a flight has to allow, looked at before any process starts.

Variables that a flight does not need, and that would keep its nodes from finding each other, are taken away
from its processes (`UNUSED_VARIABLES`); what cannot work is named in a sentence.
"""

import ipaddress
import os
import resource
import socket
import tempfile
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree

from ament_index_python.packages import PackageNotFoundError, get_package_prefix

from satform_bringup import LOG_FOLDER
from satform_bringup.deployment.domain_lock import DomainError, shell_domain
from satform_bringup.deployment.local_discovery import RANGE
from satform_bringup.deployment.middleware import VARIABLES as PROFILES

UNUSED_VARIABLES = (
    # Another way of discovery, by a server that the nodes of a flight do not ask.
    "ROS_DISCOVERY_SERVER",
    "ROS_SUPER_CLIENT",
    "FASTDDS_ENVIRONMENT_FILE",
    # Another transport or other qualities of service than the run's own profile has.
    "FASTDDS_BUILTIN_TRANSPORTS",
    "RMW_FASTRTPS_PUBLICATION_MODE",
    "RMW_FASTRTPS_USE_QOS_FROM_XML",
    # How a node logs: error messages are read from a node's log file.
    "RCUTILS_COLORIZED_OUTPUT",
    "RCUTILS_CONSOLE_OUTPUT_FORMAT",
    "RCUTILS_LOGGING_BUFFERED_STREAM",
    "RCUTILS_LOGGING_USE_STDOUT",
    "RCL_LOGGING_IMPLEMENTATION",
    "ROS_HOME",
)
"""Environment variables that are taken away from the processes of a flight."""

RANGES = ("LOCALHOST", "SUBNET", "SYSTEM_DEFAULT")
"""Values of `ROS_AUTOMATIC_DISCOVERY_RANGE` with which nodes find each other."""

_FILES_OF_A_PROCESS, _FILES_OF_A_RUN = 6, 64
"""Open files that the process that starts a run needs for each node process, and for itself."""

_FEWEST_FILES = 256
"""Open files that a node may have at least: its sockets, libraries and threads."""

_TIMEOUT = 2.0
"""Wall-clock time that a datagram on the loopback interface may take, s."""

_LARGEST_PROFILE = 1_000_000
"""Size of a file of profiles that is read, bytes."""


class PreflightError(RuntimeError):
    """A flight that cannot work in this environment; the message says why, and what would be right."""


def require(processes: int = 1, *, secured: bool = False) -> None:
    """Go on only in an environment in which the nodes of a flight can find each other.

    Args:
        processes: of the flight.
        secured: whether it is flown with the keys of a keystore.

    Raises:
        PreflightError: it cannot work; all that is wrong is named.
    """
    found = [*_wrong_variables(secured=secured), *_wrong_machine(processes)]
    if found:
        raise PreflightError("; ".join(found))


def remove_unused_variables() -> None:
    """Take away from this process what a flight does not need."""
    for name in UNUSED_VARIABLES:
        os.environ.pop(name, None)


def log_variables(run: Path) -> dict[str, str]:
    """Environment variables by which nodes keep their log files in a run's folder, and need no home folder.

    Args:
        run: its folder.
    """
    return {"ROS_LOG_DIR": str((run / LOG_FOLDER / "ros").absolute())}


def unused_variables() -> list[str]:
    """Names of the variables that are set and not used by a flight."""
    return [name for name in UNUSED_VARIABLES if os.environ.get(name)]


def shared_memory() -> str:
    """Sentence for a run whose nodes may use shared memory, since the environment has a Fast DDS profile.

    Without one nodes communicate through sockets, which the kernel closes with their process.

    Returns:
        The sentence; empty without a profile.
    """
    found = [name for name in PROFILES if os.environ.get(name)]
    if not found:
        return ""
    return (
        f"{found[0]} is set, so the nodes use that profile and may communicate through shared memory; files "
        "of killed processes then stay in /dev/shm, where `fastdds shm clean` removes them"
    )


def _wrong_variables(*, secured: bool) -> Iterable[str]:
    try:
        shell_domain()
    except DomainError as error:
        yield str(error)
    found = os.environ.get(RANGE, "")
    if found == "OFF":
        yield f"{RANGE}=OFF prevents nodes from discovering each other; unset it, or set LOCALHOST"
    elif found and found not in RANGES:
        yield f"{RANGE}={found!r} is not a discovery range; the allowed values are {', '.join(RANGES)}"
    yield from _wrong_peers(os.environ.get("ROS_STATIC_PEERS", ""))
    yield from _wrong_profiles()
    middleware = os.environ.get("RMW_IMPLEMENTATION", "")
    if middleware and not _is_installed(middleware):
        yield f"RMW_IMPLEMENTATION={middleware} is not installed here; unset it, or set rmw_fastrtps_cpp"
    if not secured and os.environ.get("ROS_SECURITY_ENABLE", "").lower() == "true":
        yield (
            "ROS_SECURITY_ENABLE=true asks for a secured flight, which needs --secure KEYSTORE; "
            "give that, or unset the variable to fly unsecured"
        )


def _wrong_peers(peers: str) -> Iterable[str]:
    for peer in filter(None, peers.split(";")):
        numeric = peer.replace(".", "").isdigit()
        try:
            if numeric:
                ipaddress.ip_address(peer)
            else:
                socket.getaddrinfo(peer, None)
        except (ValueError, OSError):
            what = "no IP address" if numeric else "not known as a host here"
            yield f"ROS_STATIC_PEERS names {peer!r}, which is {what}; it lists addresses, with ';' between"


def _wrong_profiles() -> Iterable[str]:
    for name in PROFILES:
        found = os.environ.get(name, "")
        if not found:
            continue
        try:
            with Path(found).open("rb") as file:
                ElementTree.fromstring(file.read(_LARGEST_PROFILE))  # noqa: S314 - the user's own file
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            yield f"{name}={found}: cannot be read: {reason}; correct or unset it"
        except ElementTree.ParseError as error:
            yield f"{name}={found}: is not XML ({error}); correct or unset it"


def _is_installed(package: str) -> bool:
    try:
        return bool(get_package_prefix(package))
    except (PackageNotFoundError, ValueError):
        return False


def _wrong_machine(processes: int) -> Iterable[str]:
    if not _loopback_works():
        yield (
            "no datagram passes on the loopback interface (127.0.0.1), by which the nodes of a flight "
            "communicate; bring it up (ip link set lo up), or let a firewall pass it"
        )
    try:
        tempfile.gettempdir()
    except OSError:
        yield "no folder for temporary files can be written to; set TMPDIR to one"
    needed = max(_FEWEST_FILES, _FILES_OF_A_RUN + _FILES_OF_A_PROCESS * processes)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < needed:
        yield (
            f"{hard} open files are allowed and {needed} are needed for {processes} processes; "
            f"raise the limit (ulimit -n {needed})"
        )
    elif soft != resource.RLIM_INFINITY and soft < needed:
        resource.setrlimit(resource.RLIMIT_NOFILE, (needed, hard))


def _loopback_works() -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as reader:
        reader.settimeout(_TIMEOUT)
        try:
            reader.bind(("127.0.0.1", 0))
            reader.sendto(b"satform", reader.getsockname())
            return reader.recv(16) == b"satform"
        except OSError:
            return False
