# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about the communication graph and the consensus: connectivity, periods, Byzantine agents."""

from satform.consensus.arc_length import ArcLengthGainsSpec
from satform.consensus.byzantine_robustness import agreement_guarantee
from satform.consensus.resilient import ResilientArcLengthConsensusSpec
from satform.consensus.stability import Gains, delay_margin
from satform.flight.compile_satellite import flight_plan
from satform.membership.formation import topology_changes
from satform.scenario import Scenario

_SAME_PERIOD = 1e-9
"""Relative difference of periods up to which satellites can agree for ever."""


def consensus_warnings(scenario: Scenario) -> list[str]:
    """Sentences about a graph or periods that prevent consensus."""
    return [
        *_graph_warnings(scenario),
        *_byzantine_warnings(scenario),
        *_period_warnings(scenario),
    ]


def margin(scenario: Scenario) -> float | None:
    """Delay margin of the consensus: largest delay of all messages that is stable, s; infinite where any is.

    None without a consensus, for projected arc lengths and for large formations, for which it is not
    computed. With a graph schedule it is that of the first graph.
    """
    law = scenario.consensus
    if not isinstance(law, ArcLengthGainsSpec) or law.arc_length_source == "projected":
        return None
    gains = Gains(law.tracking_gain, law.coupling_gain, law.rate_gain)
    return delay_margin(scenario.communication_graph(), gains, law.neighbour_values)


def _graph_warnings(scenario: Scenario) -> list[str]:
    graph = scenario.communication_graph()
    # A graph without edges means no consensus; a graph schedule is checked elsewhere.
    if not graph.edges or graph.connected() or scenario.graph_schedule:
        return []
    return ["graph: it is not connected; satellites without a path between them do not reach a common phase"]


def _byzantine_warnings(scenario: Scenario) -> list[str]:
    law = scenario.consensus
    if not isinstance(law, ResilientArcLengthConsensusSpec):
        return []
    graphs = [(0, scenario.communication_graph())]
    graphs += [(step, event.graph) for step, event in topology_changes(scenario.membership_plan().events)]
    largest_in_degree = max(int(graph.adjacency.sum(axis=1).max()) for _, graph in graphs)
    found = [
        f"consensus: {doubt}; correct satellites may leave the interval of their initial phases"
        for doubt in law.doubts(largest_in_degree, scenario.timing.step)
    ]
    warned: dict[str, str] = {}
    for step, graph in graphs:
        promised = agreement_guarantee(graph, law.tolerated_byzantine)
        if not (promised.local or promised.total):
            when = f"from {step * scenario.timing.step:g} s on: " if step else ""
            # A periodic schedule has each graph many times.
            warned.setdefault(promised.sentence, f"consensus.tolerated_byzantine: {when}{promised.sentence}")
    return [*found, *warned.values()]


def _period_warnings(scenario: Scenario) -> list[str]:
    if not scenario.communication_graph().edges:
        return []
    periods = [float(flight_plan(scenario, index).path.period) for index in range(len(scenario.satellites))]
    # A fixed point has no period: it agrees with any phase.
    periods = [period for period in periods if period > 0.0]
    if not periods or max(periods) - min(periods) <= _SAME_PERIOD * max(periods):
        return []
    return [
        f"satellites: perimeter divided by scale runs from {min(periods):.10g} to {max(periods):.10g} m; "
        "satellites that agree on the arc length have equal periods only if it is equal for all"
    ]
