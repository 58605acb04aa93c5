# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prediction of the arc-length spread by linear theory, drawn beside a flight."""

from collections.abc import Iterator

import numpy as np
from scipy.linalg import expm

from satform.consensus.arc_length import ArcLengthConsensusSpec
from satform.consensus.graph import Graph
from satform.flight.compile_satellite import flight_plan
from satform.membership.faults import ByzantineSpec, ClockOffsetSpec, SatelliteLostSpec
from satform.membership.formation import topology_changes
from satform.numeric.elementwise import Array
from satform.scenario import Scenario

_MOST_SATELLITES = 200
_DISTURBING = (SatelliteLostSpec, ByzantineSpec, ClockOffsetSpec)


def arc_length_spread(scenario: Scenario, time: Array) -> Array | None:
    """Spread of the arc lengths under continuous-time consensus on the scenario's graph.

    Args:
        scenario: whose gains, graph and start are taken.
        time: evenly spaced from zero, s, shape (K,) with K of at least 2.

    Returns:
        Largest minus smallest arc length less the desired offsets, m, shape (K,); None where the law
        is not the linear one on reference points that all share one nominal rate, or where links or
        faults come between. A graph that changes does so at the next of the moments.

    Source: Ren & Beard, ch. 4, second-order consensus, by the exponential of its matrix.
    """
    law, count = scenario.consensus, len(scenario.satellites)
    if (
        not isinstance(law, ArcLengthConsensusSpec)
        or law.arc_length_source != "reference"
        or count > _MOST_SATELLITES
        or scenario.links is not None
        or any(isinstance(fault, _DISTURBING) for fault in scenario.faults)
    ):
        return None
    plans = [flight_plan(scenario, index) for index in range(count)]
    nominal = np.array([float(plan.nominal_rate) for plan in plans])
    if np.ptp(nominal) > 1e-9 * np.max(np.abs(nominal), initial=1.0):
        return None
    phase = np.array([float(plan.arc_length - plan.phase_offset) for plan in plans])
    state = np.concatenate((phase, np.array([float(plan.rate) for plan in plans]) - nominal))
    spread = np.empty(len(time))
    advance, before = np.empty((0, 0)), None
    for row, graph in enumerate(_graphs(scenario, time)):
        if graph is not before:
            advance = expm(_rates(law, graph.laplacian()) * (time[1] - time[0]))
        before = graph
        spread[row] = np.ptp(state[:count])
        state = advance @ state
    return spread


def _graphs(scenario: Scenario, time: Array) -> Iterator[Graph]:
    """The communication graph at each of the times."""
    plan = scenario.membership_plan().events
    changes = [(step * scenario.timing.step, event.graph) for step, event in topology_changes(plan)]
    graph = scenario.communication_graph()
    for moment in time:
        while changes and changes[0][0] <= moment:
            graph = changes.pop(0)[1]
        yield graph


def _rates(law: ArcLengthConsensusSpec, laplacian: Array) -> Array:
    """Matrix of the rates of change of all arc lengths and their rates."""
    unit = np.eye(len(laplacian))
    return np.block(
        [
            [np.zeros_like(unit), unit],
            [-law.coupling_gain * laplacian, -law.tracking_gain * unit - law.rate_gain * laplacian],
        ]
    )
