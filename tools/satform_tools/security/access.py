# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Permissions of each node: topics and services by the communication graph, as lists of names."""

from dataclasses import dataclass, replace

import numpy as np

from satform.communication.topic_table import PLANT, RECORDER, channels
from satform.consensus.graph import Graph
from satform.flight.compile import compile_scenario, topic_plan
from satform.scenario import Scenario
from satform_bringup.deployment.security import ENCLAVES

OPERATOR = "operator"
"""Enclave of an operator: subscribes to all topics, calls all services, publishes no topic of the flight."""

_PARAMETER_SERVICES = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "get_type_description",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)
"""Services that every ROS 2 node offers."""

_ACTION_SERVICES = ("send_goal", "cancel_goal", "get_result")
"""Services of a ROS 2 action."""

_ACTION_TOPICS = ("feedback", "status")
"""Topics of a ROS 2 action, which its server publishes."""

_COMMON_TOPICS = ("/parameter_events", "/rosout")
"""Topics that every ROS 2 node publishes."""


@dataclass(frozen=True)
class Access:
    """Topics and services that one node may use; all others are denied.

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


def accesses(scenario: Scenario, further: Graph | None = None) -> list[Access]:
    """The access of each node of a formation, no more than it needs.

    Args:
        scenario: of the formation.
        further: edges that `/formation/set_graph` is to be able to use beside those that the scenario has at
            some time.

    Returns:
        Plant, satellites in their order, recorder, operator.

    Raises:
        ValueError: this formation cannot use such edges in flight.
    """
    from satform_nodes.plant import reconfiguration, services  # noqa: PLC0415 - needs ROS

    plan = topic_plan(scenario)
    if further is not None:
        services.wanted_graph(further.adjacency.ravel(), compile_scenario(scenario))
        plan = replace(plan, graph=Graph(np.maximum(plan.graph.adjacency, further.adjacency)))
    action = f"{reconfiguration.RECONFIGURE}/_action"
    offers = (
        *(services.PAUSE, services.RESUME, services.STEP, services.STOP, services.SET_GRAPH),
        *(f"{action}/{service}" for service in _ACTION_SERVICES),
    )
    names = [PLANT, *(satellite.name for satellite in scenario.satellites), RECORDER]
    publishes: dict[str, list[str]] = {name: [] for name in names}
    subscribes: dict[str, list[str]] = {name: [] for name in names}
    for channel in channels(plan):
        for name in channel.publishers:
            publishes[name].append(channel.topic)
        for name in (*channel.subscribers, *channel.watchers):
            subscribes[name].append(channel.topic)
    publishes[PLANT] += [f"{action}/{topic}" for topic in _ACTION_TOPICS]
    flying = [
        _node(name, publishes[name], subscribes[name], offers if name == PLANT else ()) for name in names
    ]
    return [*flying, _operator(flying)]


def _operator(flying: list[Access]) -> Access:
    published = {topic for access in flying for topic in access.publishes}
    served = {service for access in flying for service in access.replies}
    return Access(OPERATOR, _COMMON_TOPICS, tuple(sorted(published)), (), tuple(sorted(served)))


def _node(name: str, publishes: list[str], subscribes: list[str], offers: tuple[str, ...]) -> Access:
    replies = sorted({*offers, *(f"/{name}/{service}" for service in _PARAMETER_SERVICES)})
    published = sorted({*publishes, *_COMMON_TOPICS})
    return Access(name, tuple(published), tuple(sorted({*subscribes})), tuple(replies))
