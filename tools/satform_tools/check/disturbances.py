# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about links, topology changes and losses of satellites, and about their timeouts."""

from dataclasses import dataclass

import numpy as np

from satform.communication.channel_model import LinkSpec
from satform.consensus.arc_length import ArcLengthGainsSpec
from satform.consensus.graph import Graph
from satform.consensus.stability import Gains, delay_margin
from satform.membership.faults import SatelliteLostSpec
from satform.membership.formation import Formation, SatelliteRejoined, topology_changes
from satform.scenario import Scenario

_LONG = 0.25
"""Part of a flight that is long enough to matter."""


def disturbance_warnings(scenario: Scenario) -> list[str]:
    """Sentences about what is allowed but unwise in links, graph_schedule and faults."""
    return [
        *_link_warnings(scenario),
        *_schedule_warnings(scenario),
        *_loss_warnings(scenario),
        *_end_warnings(scenario),
    ]


@dataclass(frozen=True)
class PlannedState:
    """A state of the formation that a scenario plans.

    Attributes:
        at: from when, s.
        reason: reason of the change.
        flying: how many satellites fly.
        edges: of the graph of those that fly.
        connectivity: lambda_2 of that graph.
        connected: whether agreement is possible on it.
    """

    at: float
    reason: str
    flying: int
    edges: int
    connectivity: float
    connected: bool


def describe_schedule(scenario: Scenario) -> list[PlannedState]:
    """Every state of the formation after the first that a scenario plans, in order."""
    names = [satellite.name for satellite in scenario.satellites]
    formation, found = Formation.of(scenario.membership_plan()), []
    for step, events in scenario.membership_plan().events.items():
        if not formation.apply(events, step, names):
            continue
        flying = int(formation.alive.sum())
        graph = formation.graph.subgraph(formation.alive)
        found.append(
            PlannedState(
                at=step * scenario.timing.step,
                reason=formation.reason,
                flying=flying,
                edges=len(graph.edges),
                connectivity=formation.connectivity,
                connected=flying > 0 and graph.connected(),
            )
        )
    return found


def _link_warnings(scenario: Scenario) -> list[str]:
    if scenario.links is None:
        return []
    names = [satellite.name for satellite in scenario.satellites]
    possible = {(names[sender], names[receiver]) for sender, receiver in scenario.possible_graph().edges}
    found = [
        f"links.edges: the graph has no edge from {edge.sender} to {edge.receiver}; this link is not used"
        for edge in scenario.links.edges
        if (edge.sender, edge.receiver) not in possible
    ]
    own = [scenario.links.of(*edge) for edge in sorted(possible)]
    if not own:
        return found
    longest, rarest = max(map(_age, own)), max(link.period for link in own)
    bound = scenario.consensus.neighbour_timeout
    if longest > bound:
        found.append(
            f"consensus.neighbour_timeout: {bound:g} s is shorter than the largest message age of "
            f"{longest:g} s by delay, jitter and period of a link; messages of working neighbours are "
            "discarded"
        )
    return found + _age_warnings(scenario, max(link.delay + link.jitter for link in own), rarest)


def _age(link: LinkSpec) -> float:
    """Largest age of a message in s on a link without loss."""
    return link.delay + link.jitter + link.period


def _age_warnings(scenario: Scenario, delay: float, period: float) -> list[str]:
    law = scenario.consensus
    if not isinstance(law, ArcLengthGainsSpec):
        return []
    found = []
    graph = scenario.possible_graph()
    gains = Gains(law.tracking_gain, law.coupling_gain, law.rate_gain)
    bound = delay_margin(graph, gains, law.neighbour_values)
    if bound is not None and delay >= bound:
        found.append(
            f"links: messages take up to {delay:g} s, beyond the delay margin of {bound:g} s of these gains "
            f"on this graph with neighbour_values: {law.neighbour_values}; the phases diverge"
        )
    if law.neighbour_values == "hold" and max(delay, period) > scenario.timing.step:
        slower = _slowed(graph, law, delay + 0.5 * period)
        found.append(
            f"consensus.neighbour_values: hold uses values that are up to {delay + period:g} s old, which "
            f"slows the formation down to about {100.0 * slower:.3g} % of its rate; use extrapolate"
        )
    return found


def _slowed(graph: Graph, law: ArcLengthGainsSpec, age: float) -> float:
    """Fraction of the nominal rate that remains where all hold messages of one age, by the mean in-degree."""
    in_degree = float(graph.adjacency.sum(axis=1).mean())
    return law.tracking_gain / (law.tracking_gain + law.coupling_gain * in_degree * age)


def _schedule_warnings(scenario: Scenario) -> list[str]:
    changes = topology_changes(scenario.membership_plan().events)
    if not changes:
        return []
    graphs = [scenario.communication_graph(), *(event.graph for _, event in changes)]
    if not scenario.possible_graph().connected():
        return [
            "graph_schedule: the union of all its graphs is not connected; some satellites do not reach a "
            "common phase"
        ]
    if any(graph.connected() for graph in graphs) or _union_is_connected(graphs[len(graphs) // 2 :]):
        return []
    return [
        "graph_schedule: the union of its graphs in the second half is not connected; a common phase is not "
        "guaranteed"
    ]


def _union_is_connected(graphs: list[Graph]) -> bool:
    return Graph(np.maximum.reduce([graph.adjacency for graph in graphs])).connected()


def _loss_warnings(scenario: Scenario) -> list[str]:
    found = []
    for fault in scenario.faults:
        if not isinstance(fault, SatelliteLostSpec) or fault.rejoin_at is None:
            continue
        if fault.rejoin_at >= scenario.timing.duration:
            found.append(
                f"faults: {fault.satellite} rejoins at {fault.rejoin_at:g} s, after the flight's end"
            )
        period = scenario.checkpoint_period
        if fault.memory == "checkpoint" and period is not None and fault.at < period:
            found.append(
                f"faults: {fault.satellite} is lost at {fault.at:g} s, before its first checkpoint at "
                f"{period:g} s; it rejoins from its flight plan"
            )
    returns = any(
        isinstance(event, SatelliteRejoined)
        for events in scenario.membership_plan().events.values()
        for event in events
    )
    if scenario.checkpoint_period is not None and not returns and not scenario.tolerated_losses:
        found.append("checkpoint_period: checkpoints are written, but no satellite rejoins from one")
    return found


def _end_warnings(scenario: Scenario) -> list[str]:
    """A sentence about a formation that stays disconnected for long at its end, unless it began so."""
    states = describe_schedule(scenario)
    if not states or states[-1].connected or not scenario.communication_graph().connected():
        return []
    last = states[-1]
    if last.at > (1.0 - _LONG) * scenario.timing.duration:
        return []
    return [
        f"graph: from {last.at:g} s on ({last.reason}) the flying satellites are not connected; parts of the "
        "formation do not reach a common phase again"
    ]
