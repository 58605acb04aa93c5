# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the links of a flight did, computed once more from the record: state, sent and delivered messages."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from satform.communication.channel_model import LinkSpec, LinksSpec, combined_loss, loss_draws
from satform.communication.physical_links import Geometry, LinkMedium, LinkStates
from satform.flight.compile import FormationPlan
from satform.flight.link_geometry import body_axes
from satform.membership.formation import Formation, Plan, merge_plans, possible_graph
from satform.numeric.elementwise import Array, Indices, norm
from satform.record.flight_record import FlightRecord
from satform.record.link_history import LinkHistory

Flags: TypeAlias = NDArray[np.bool_]


def link_history(plan: FormationPlan, record: FlightRecord, events: Plan) -> LinkHistory:
    """State of every link at every step, and which messages it delivered.

    The losses of satellites are those of the record.

    Args:
        plan: of the flight.
        record: of the flight, with its chief.
        events: that the scenario does not plan, by step.
    """
    names = plan.names
    happened = merge_plans(plan.membership.events, events)
    receivers, senders = np.nonzero(possible_graph(plan.membership.graph, happened).adjacency)
    edges = np.stack((senders, receivers), axis=1)
    specs = plan.links.links or LinksSpec()
    links = [specs.of(names[sender], names[receiver]) for sender, receiver in edges.tolist()]
    medium = plan.plant.links
    # An edge that only an unplanned change brings has no channel in the flight, either.
    reached: set[tuple[int, int]] = set() if medium is None else set(map(tuple, medium.edges.tolist()))
    physical = np.array(
        [place for place, edge in enumerate(edges.tolist()) if tuple(edge) in reached], dtype=np.int64
    )
    states = None if medium is None else _states(plan, record, medium)
    linked = _linked(plan, happened, record, edges)
    every = np.array([max(1, round(link.period / record.step)) for link in links], dtype=np.int64)
    sent = linked & (np.arange(record.steps)[:, None] % every == 0)
    loss = np.tile(np.array([link.loss for link in links]), (record.steps, 1))
    if states is not None:
        loss[:, physical] = combined_loss(loss[:, physical], states.loss)
    if plan.links.links is None:
        return LinkHistory(names, edges, physical, states, linked, sent, sent)
    draws = loss_draws(plan.links.seed, edges, len(names), record.steps)
    delivered = sent & (draws >= loss) & ~_cut(links, record)
    return LinkHistory(names, edges, physical, states, linked, sent, delivered)


def _linked(plan: FormationPlan, happened: Plan, record: FlightRecord, edges: Indices) -> Flags:
    """Whether the graph has an edge, its sender flew one step before and its receiver flies, shape (K, E)."""
    senders, receivers = edges.T
    formation = Formation.of(plan.membership)
    found = np.zeros((record.steps, len(edges)), dtype=np.bool_)
    absent = record.not_flown
    for step in range(record.steps):
        events = happened.get(step)
        if events:
            formation.apply(events, step, plan.names)
        published = ~absent[max(step - 1, 0), senders]
        linked = formation.graph.adjacency[receivers, senders] > 0.0
        found[step] = linked & published & ~absent[step, receivers]
    return found


def _cut(links: list[LinkSpec], record: FlightRecord) -> Flags:
    """Whether an outage of the link loses what is sent for a step, shape (K, E)."""
    cut = np.zeros((record.steps, len(links)), dtype=np.bool_)
    time: Array = record.step * np.arange(record.steps, dtype=np.float64)
    for place, link in enumerate(links):
        for window in link.outages:
            cut[:, place] |= window.covers(time)
    return cut


def _states(plan: FormationPlan, record: FlightRecord, medium: LinkMedium) -> LinkStates:
    steps = record.steps
    turned = record.mrp[:steps] if len(record.mrp) else None
    times: Array = np.arange(steps, dtype=np.float64) * record.step
    body = body_axes(turned, plan.plant.attitude_orbits, times)
    return medium.states(Geometry(record.position[:steps], _chief_radius(plan, record), body))


def _chief_radius(plan: FormationPlan, record: FlightRecord) -> Array:
    """Distance of the chief from the Earth's centre at each step, m, shape (K,)."""
    chief = record.chief
    if chief is None or chief.nominal:
        return np.full(record.steps, float(np.asarray(plan.plant.chief_radius)))
    return norm(chief.position[: record.steps])
