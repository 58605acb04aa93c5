# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `security`: makes a formation's keystore and prints what it permits."""

from pathlib import Path

from satform.scenario import Scenario
from satform_tools import console
from satform_tools.console import Table
from satform_tools.run import ros_packages
from satform_tools.security.access import OPERATOR
from satform_tools.security.keystore import POLICIES, make
from satform_tools.security.permission_documents import ANY_DOMAIN


def secure(scenario: Scenario, out: Path | None, days: int, domain: int | None, *, as_json: bool) -> None:
    """Make a formation's keystore.

    Args:
        scenario: whose nodes get keys and permissions.
        out: folder of the keystore; None for one by the scenario's name in `keystores`, where the user is.
        days: validity of the certificates.
        domain: DDS domain to which the permissions are restricted; None for all.
        as_json: whether to print JSON.

    Raises:
        CommandError: ROS is missing, or the keystore cannot be made.
    """
    ros_packages.require()
    folder = (out or Path("keystores") / scenario.name).absolute()
    granted = make(scenario, folder, days, ANY_DOMAIN if domain is None else (domain, domain))
    if as_json:
        console.as_json(
            {
                "keystore": str(folder),
                "enclaves": {
                    access.enclave: {"publishes": access.publishes, "subscribes": access.subscribes}
                    for access in granted
                },
            }
        )
        return
    rows = [
        (access.enclave, str(len(access.publishes)), ", ".join(access.subscribes))
        for access in granted
        if access.node not in {OPERATOR, "recorder"}
    ]
    console.table(Table(("enclave", "published topics", "subscribed topics"), rows, frozenset({1})))
    console.line(f"{granted[-1].enclave} subscribes to all topics and may call the services of all nodes")
    console.line(
        f"written to {folder}: {POLICIES}, and for each enclave its key, certificate and signed permissions"
    )
    console.line(
        "private/ca.key.pem can sign new certificates and is not needed to fly: move it to a safe location"
    )
