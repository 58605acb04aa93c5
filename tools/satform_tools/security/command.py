# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `security`: makes a formation's keystore and prints what it permits."""

from collections.abc import Iterable
from pathlib import Path

from satform.consensus.graph import Graph
from satform.scenario import Scenario
from satform.scenario.errors import ScenarioError
from satform_nodes.plant.permitted_edges import POLICIES
from satform_tools import console
from satform_tools.console import Table
from satform_tools.errors import CommandError
from satform_tools.run import ros_packages, scenario_library
from satform_tools.security.access import OPERATOR
from satform_tools.security.keystore import make
from satform_tools.security.permission_documents import ANY_DOMAIN


def further_graph(scenario: str, changes: Iterable[str], text: str) -> Graph:
    """Graph whose edges a service may use in flight.

    Args:
        scenario: its name or the path of its file.
        changes: `key=value` settings laid over the file.
        text: the graph as a value of the scenario's field `graph`.

    Raises:
        CommandError: the scenario could not fly with this graph.
    """
    try:
        return scenario_library.load(scenario, (*changes, f"graph={text}")).possible_graph()
    except ScenarioError as error:
        sentences = (str(problem).replace("--set graph=", "--possible-graph ") for problem in error.problems)
        raise CommandError("\n".join(sentences)) from None


def secure(
    scenario: Scenario,
    out: Path | None,
    days: int,
    domain: int | None,
    further: Graph | None = None,
    *,
    as_json: bool,
) -> None:
    """Make a formation's keystore.

    Args:
        scenario: whose nodes get keys and permissions.
        out: folder of the keystore; None for one by the scenario's name in `keystores`, where the user is.
        days: validity of the certificates.
        domain: DDS domain to which the permissions are restricted; None for all.
        further: graph whose edges a service may use in flight, beside those of the scenario.
        as_json: whether to print JSON.

    Raises:
        CommandError: ROS is missing, or the keystore cannot be made.
    """
    ros_packages.require()
    folder = (out or Path("keystores") / scenario.name).absolute()
    granted = make(scenario, folder, days, ANY_DOMAIN if domain is None else (domain, domain), further)
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
