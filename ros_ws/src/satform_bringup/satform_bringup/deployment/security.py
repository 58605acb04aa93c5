# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""DDS security of a flight: every node has keys from a keystore, or the flight does not start."""

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from satform_bringup import PACKAGE
from satform_bringup.deployment.domain_lock import HIGHEST_SECURED
from satform_bringup.deployment.node_processes import NodeProcess

ENCLAVES = "/formation"
"""Namespace of the enclaves: a node `sat1` lives in `/formation/sat1`."""

_FILES = (
    "cert.pem",
    "key.pem",
    "identity_ca.cert.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
)
"""What the middleware looks for in an enclave."""

_TIMEOUT = 30.0
"""Wall-clock time within which a node with keys has to be made, s."""

_OF_OTHERS = 0o077
"""Permissions of a file for others than its owner."""


class SecurityError(RuntimeError):
    """A flight that was to be secured and would not be; the message says why."""


def variables(keystore: Path) -> dict[str, str]:
    """Environment variables by which nodes take part with their keys, or not at all."""
    return {
        "ROS_SECURITY_ENABLE": "true",
        # Without it a node whose keys are missing would take part without.
        "ROS_SECURITY_STRATEGY": "Enforce",
        "ROS_SECURITY_KEYSTORE": str(keystore.absolute()),
        # One for all processes would overrule each node's own.
        "ROS_SECURITY_ENCLAVE_OVERRIDE": "",
    }


def secured(nodes: Sequence[NodeProcess]) -> list[NodeProcess]:
    """The same processes, each in the enclave of its node.

    Raises:
        SecurityError: a process has several nodes, which could not have keys of their own.
    """
    groups = [node.name for node in nodes if node.executable == "group_node"]
    if groups:
        raise SecurityError(
            f"the satellites of {groups[0]} share a process, and keys belong to processes; "
            "fly with --satellites-per-process 1"
        )
    return [replace(node, enclave=f"{ENCLAVES}/{node.name}") for node in nodes]


def require_secured(keystore: Path, nodes: Sequence[NodeProcess], domain: int) -> None:
    """Go on only if the nodes will really be secured.

    Args:
        keystore: its folder.
        nodes: as `secured` gives them.
        domain: DDS domain of the flight.

    Raises:
        SecurityError: keys are missing or open to others, they do not hold for the domain, or the middleware
            does not take them.
    """
    if domain > HIGHEST_SECURED:
        raise SecurityError(
            f"ROS_DOMAIN_ID={domain} cannot be secured: the documents of DDS security hold for the domains "
            f"0 to {HIGHEST_SECURED}; set one of these"
        )
    for node in nodes:
        require_enclave(keystore, node.enclave)
    _require_middleware(keystore, nodes[0].enclave, domain)


def require_enclave(keystore: Path, enclave: str) -> None:
    """Go on only if the keys of an enclave are there, and closed to others.

    Args:
        keystore: its folder.
        enclave: path in the keystore.

    Raises:
        SecurityError: they are not.
    """
    folder = keystore / "enclaves" / enclave.lstrip("/")
    missing = [name for name in _FILES if not (folder / name).is_file()]
    if missing:
        raise SecurityError(
            f"{keystore} has no {missing[0]} for the enclave {enclave}; make a keystore of this scenario "
            "with satform security SCENARIO"
        )
    key = folder / "key.pem"
    if key.stat().st_mode & _OF_OTHERS:
        raise SecurityError(
            f"{key} may be read by others than its owner; make a new keystore, or chmod 600 it"
        )


def _require_middleware(keystore: Path, enclave: str, domain: int) -> None:
    """Have a node made with keys, in a process of its own: only that shows what the middleware can do."""
    environment = {**os.environ, **variables(keystore), "ROS_DOMAIN_ID": str(domain)}
    command = [sys.executable, "-m", f"{PACKAGE}.transport.security_probe", enclave]
    try:
        tried = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=_TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        raise SecurityError(f"a node with keys was not made within {_TIMEOUT:g} s") from None
    if tried.returncode != 0:
        reason = " ".join((tried.stdout.strip() or tried.stderr.strip() or "it gave no reason").split())
        raise SecurityError(f"the middleware does not support DDS Security, so nothing was flown: {reason}")
