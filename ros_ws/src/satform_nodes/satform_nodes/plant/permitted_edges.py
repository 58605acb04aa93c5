# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Edges of the communication graph for which the satellites of a secured flight have permissions."""

import os
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from satform.communication.topic_table import topic_name
from satform.consensus.graph import Graph
from satform.files.bounded_file import read_bounded
from satform.flight.compile import FormationPlan

POLICIES = "policies.xml"
"""In a keystore: the permissions of all nodes, as an SROS 2 policy."""

MOST_BYTES = 100_000_000
"""Size of the largest list that is read; that of a satellite has a line for each of its in-neighbours."""


def permitted_graph(plan: FormationPlan, environment: Mapping[str, str] = os.environ) -> Graph | None:
    """The edges that a keystore permits.

    The document is read as what it is for, a list that anyone may read: what it says too much is refused by
    DDS Security, which goes by the signed permissions.

    Args:
        plan: of the flight's parts.
        environment: variables that say whether and with which keystore the nodes are secured.

    Returns:
        The edges that the list of the keystore has; those of the scenario when the list is not there or
        cannot be read; None in a flight without security, in which every edge can be used.
    """
    if environment.get("ROS_SECURITY_ENABLE", "").lower() != "true":
        return None
    planned = plan.membership.possible_graph
    try:
        path = Path(environment.get("ROS_SECURITY_KEYSTORE", "")) / POLICIES
        # What expat expands of entities is bounded.
        root = ET.fromstring(read_bounded(path, MOST_BYTES, "a list of permissions"))  # noqa: S314
    except (OSError, ET.ParseError, LookupError, ValueError):
        # The last two are about the encoding that the document says it has.
        return planned
    adjacency = np.zeros_like(planned.adjacency)
    for enclave in root.iterfind("enclaves/enclave"):
        name = enclave.get("path", "").rpartition("/")[2]
        if name in plan.names:
            subscribed = {topic.text for topic in enclave.iterfind(".//topics[@subscribe='ALLOW']/topic")}
            senders = [topic_name(plan.announces, sender) in subscribed for sender in plan.names]
            adjacency[plan.names.index(name)] = senders
    return Graph(adjacency)
