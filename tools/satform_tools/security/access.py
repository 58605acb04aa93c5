# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who may say and hear what: the adjacency matrix and the nodes' work, as lists of topics and services."""

from dataclasses import dataclass

from satform.communication.topic_graph import PLANT, RECORDER, channels
from satform.flight.compile import topic_plan
from satform.scenario import Scenario
from satform_bringup.deployment.security import ENCLAVES

OPERATOR = "operator"
"""Enclave of the person who looks in and changes gains: hears everything, says nothing to the flight."""

_PARAMETER_SERVICES = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "get_type_description",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)
"""Which every ROS 2 node offers."""

_EVERYONE_SAYS = ("/parameter_events", "/rosout")
"""What every ROS 2 node publishes."""


@dataclass(frozen=True)
class Access:
    """What one node may do; everything else is denied.

    Attributes:
        node: its name.
        publishes: names of topics.
        subscribes: names of topics.
        replies: names of services that it offers.
        requests: names of services that it may call.
    """

    node: str
    publishes: tuple[str, ...]
    subscribes: tuple[str, ...]
    replies: tuple[str, ...] = ()
    requests: tuple[str, ...] = ()

    @property
    def enclave(self) -> str:
        """Path of the node's enclave, which is also the common name of its certificate."""
        return f"{ENCLAVES}/{self.node}"


def accesses(scenario: Scenario) -> list[Access]:
    """What each node of a formation needs, and no more.

    Args:
        scenario: what is flown.

    Returns:
        Plant, satellites in their order, recorder, operator.
    """
    from satform_nodes.plant import services  # noqa: PLC0415 - needs ROS

    offers = (services.PAUSE, services.RESUME, services.STEP, services.STOP, services.SET_GRAPH)
    names = [PLANT, *(satellite.name for satellite in scenario.satellites), RECORDER]
    says: dict[str, list[str]] = {name: [] for name in names}
    hears: dict[str, list[str]] = {name: [] for name in names}
    for channel in channels(topic_plan(scenario)):
        for name in channel.speakers:
            says[name].append(channel.topic)
        for name in channel.listeners:
            hears[name].append(channel.topic)
    flying = [_node(name, says[name], hears[name], offers if name == PLANT else ()) for name in names]
    return [*flying, _operator(flying)]


def _operator(flying: list[Access]) -> Access:
    said = {topic for access in flying for topic in access.publishes}
    served = {service for access in flying for service in access.replies}
    return Access(OPERATOR, _EVERYONE_SAYS, tuple(sorted(said)), (), tuple(sorted(served)))


def _node(name: str, publishes: list[str], subscribes: list[str], offers: tuple[str, ...]) -> Access:
    replies = sorted({*offers, *(f"/{name}/{service}" for service in _PARAMETER_SERVICES)})
    said = sorted({*publishes, *_EVERYONE_SAYS})
    return Access(name, tuple(said), tuple(sorted({*subscribes})), tuple(replies))
