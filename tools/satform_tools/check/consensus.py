# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about the communication graph and the agreement on it: connection, periods, faulty neighbours."""

from satform.consensus.arc_length import ArcLengthGainsSpec
from satform.consensus.byzantine_robustness import agreement_guarantee
from satform.consensus.resilient import ResilientArcLengthConsensusSpec
from satform.consensus.stability import Gains, delay_margin
from satform.flight.compile import flight_plan
from satform.membership.state import topology_changes
from satform.scenario import Scenario

_SAME_PERIOD = 1e-9
"""Relative difference of periods up to which satellites can agree for ever."""


def consensus_warnings(scenario: Scenario) -> list[str]:
    """Sentences about a graph on which, or periods at which, satellites do not come to agree."""
    return [
        *_graph_warnings(scenario),
        *_liar_warnings(scenario),
        *_period_warnings(scenario),
    ]


def margin(scenario: Scenario) -> float | None:
    """Delay in s of all messages up to which the consensus that flies is stable, infinite where any is.

    None for satellites that agree on nothing, for projected arc lengths, which are not worked out, and for
    more satellites than are. With a graph that changes it is that of the first one.
    """
    law = scenario.consensus
    if not isinstance(law, ArcLengthGainsSpec) or law.arc_length_source == "projected":
        return None
    gains = Gains(law.tracking_gain, law.coupling_gain, law.rate_gain)
    return delay_margin(scenario.communication_graph(), gains, law.neighbour_values)


def _graph_warnings(scenario: Scenario) -> list[str]:
    graph = scenario.communication_graph()
    # Who chooses no links at all does not mean to agree on anything; a graph that changes is looked at later.
    if not graph.edges or graph.connected() or scenario.graph_schedule:
        return []
    return ["graph: it is not connected; satellites that nobody connects never agree on their phase"]


def _liar_warnings(scenario: Scenario) -> list[str]:
    law = scenario.consensus
    if not isinstance(law, ResilientArcLengthConsensusSpec):
        return []
    graphs = [(0, scenario.communication_graph())]
    graphs += [(step, event.graph) for step, event in topology_changes(scenario.membership_plan().events)]
    most_heard = max(int(graph.adjacency.sum(axis=1).max()) for _, graph in graphs)
    found = [
        f"consensus: {doubt}; honest satellites may leave the interval of phases in which they began"
        for doubt in law.doubts(most_heard, scenario.timing.step)
    ]
    said: dict[str, str] = {}
    for step, graph in graphs:
        promised = agreement_guarantee(graph, law.tolerated_byzantine)
        if not (promised.local or promised.total):
            when = f"from {step * scenario.timing.step:g} s on: " if step else ""
            # A schedule that goes to and fro has each graph many times.
            said.setdefault(promised.sentence, f"consensus.tolerated_byzantine: {when}{promised.sentence}")
    return [*found, *said.values()]


def _period_warnings(scenario: Scenario) -> list[str]:
    if not scenario.communication_graph().edges:
        return []
    periods = [float(flight_plan(scenario, index).path.period) for index in range(len(scenario.satellites))]
    # A fixed point has no lap: it goes along with any agreement.
    periods = [period for period in periods if period > 0.0]
    if not periods or max(periods) - min(periods) <= _SAME_PERIOD * max(periods):
        return []
    return [
        f"satellites: perimeter divided by scale runs from {min(periods):.10g} to {max(periods):.10g} m; "
        "satellites that agree on the arc length make a lap in the same time only if it is the same for all"
    ]
