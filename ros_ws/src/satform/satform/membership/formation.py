# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Formation: membership and communication graph, and the steps at which they change.

All nodes hold the same `Formation`, whose changes are numbered. Planned and unplanned changes are applied as
the same few events, so that a flight with unplanned ones can be repeated in one process with the same bits.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from satform.common.name_list import listed
from satform.common.spec import NonNegative, Plugin, Spec
from satform.consensus.graph import MAXIMUM_SPECTRUM, Graph, TopologySpec
from satform.membership.faults import FaultSpec, SatelliteLostSpec, step_at
from satform.membership.reconfiguration import ReconfigurationSpec, Target, TargetsChanged
from satform.numeric.elementwise import Array


class GraphChangeSpec(Spec):
    """A change of the communication graph: another topology, or edges that come and go."""

    at: NonNegative
    """When, at the first step that does not begin before this simulated time, s."""
    graph: Annotated[TopologySpec, Plugin("satform.topologies")] | None = None
    """The whole graph from then on; as it was when left out."""
    add: tuple[tuple[str, str], ...] = ()
    """Edges that come, each as receiver and sender."""
    remove: tuple[tuple[str, str], ...] = ()
    """Edges that go, each as receiver and sender."""

    @model_validator(mode="after")
    def _changes_something(self) -> "GraphChangeSpec":
        if self.graph is None and not self.add and not self.remove:
            raise ValueError("nothing changes: give a graph, or edges to add or remove")
        both = sorted(set(self.add) & set(self.remove))
        if both:
            receiver, sender = both[0]
            raise ValueError(f"the edge [{receiver}, {sender}] cannot both come and go at one moment")
        return self

    def applied(self, graph: Graph, names: Sequence[str]) -> Graph:
        """The graph after this change.

        Raises:
            ValueError: an edge names an unknown satellite, or the topology does not exist for so many.
        """
        if self.graph is not None:
            graph = self.graph.build(len(names))
        adjacency = graph.adjacency.copy()
        for edges, value in ((self.add, 1.0), (self.remove, 0.0)):
            for receiver, sender in edges:
                for name in (receiver, sender):
                    if name not in names:
                        raise ValueError(
                            f"there is no satellite {name}; there are {', '.join(sorted(names))}"
                        )
                if receiver == sender:
                    raise ValueError(f"{receiver} cannot receive from itself")
                adjacency[names.index(receiver), names.index(sender)] = value
        return Graph(adjacency)


@dataclass(frozen=True)
class SatelliteLost:
    """A satellite no longer answers: this step is the first without a command of it."""

    satellite: int
    reason: str


@dataclass(frozen=True)
class SatelliteRejoined:
    """A satellite that was lost takes part again from this step on.

    Attributes:
        satellite: its index.
        checkpoint: step of the checkpoint from which it goes on; None when it knows its flight plan only.
    """

    satellite: int
    checkpoint: int | None


@dataclass(frozen=True, eq=False)
class TopologyChanged:
    """The communication graph is another one from this step on."""

    graph: Graph
    reason: str


@dataclass(frozen=True)
class ParameterChanged:
    """A parameter of a satellite has another value from this step on."""

    satellite: int
    name: str
    value: tuple[float, ...]


Event: TypeAlias = SatelliteLost | SatelliteRejoined | TopologyChanged | ParameterChanged | TargetsChanged
Plan: TypeAlias = dict[int, list[Event]]
"""Events by the step at which they take effect."""


@dataclass(frozen=True, eq=False)
class MembershipPlan:
    """Who takes part in a flight and over which graph, as the scenario plans it.

    Attributes:
        names: of the satellites.
        graph: of communication at the start, with a row for each satellite.
        events: what changes it, by step.
        steps: of the flight.
    """

    names: tuple[str, ...]
    graph: Graph
    events: Plan
    steps: int

    @cached_property
    def possible_graph(self) -> Graph:
        """Every edge that the graph has at some time of the flight."""
        return possible_graph(self.graph, self.events)


def planned_events(
    names: Sequence[str],
    graph: Graph,
    step: float,
    faults: Iterable[FaultSpec],
    changes: Iterable[GraphChangeSpec],
    checkpoint_steps: int | None,
    reconfigurations: Iterable[ReconfigurationSpec] = (),
) -> Plan:
    """Planned events of a formation, from the scenario.

    Args:
        names: of the satellites.
        graph: at the start.
        step: control period, s.
        faults: of the scenario; only losses of satellites are events.
        changes: of the graph.
        checkpoint_steps: steps between two checkpoints of a satellite; None when none are stored.
        reconfigurations: new targets of satellites.
    """
    plan: Plan = {}
    losses = [fault for fault in faults if isinstance(fault, SatelliteLostSpec)]
    flying_since: dict[int, int] = {}
    stored: dict[int, int] = {}
    for fault in sorted(losses, key=lambda fault: fault.at):
        index = names.index(fault.satellite)
        gone = step_at(fault.at, step)
        plan.setdefault(gone, []).append(SatelliteLost(index, f"{fault.satellite} is killed by the scenario"))
        latest = _last_checkpoint(gone, checkpoint_steps)
        # Checkpoints are stored after each step flown, and those of an earlier life outlast it.
        if latest > flying_since.get(index, 0):
            stored[index] = latest
        if fault.rejoin_at is not None:
            back = flying_since[index] = step_at(fault.rejoin_at, step)
            own = None if fault.memory == "plan" else stored.get(index)
            plan.setdefault(back, []).append(SatelliteRejoined(index, own))
    for change in sorted(changes, key=lambda change: change.at):
        graph = change.applied(graph, names)
        event = TopologyChanged(graph, "the scenario changes the graph")
        plan.setdefault(step_at(change.at, step), []).append(event)
    for reconfiguration in sorted(reconfigurations, key=lambda own: own.at):
        targets = {names.index(own.satellite): own.target for own in reconfiguration.targets}
        reason = f"the scenario changes the targets of {listed([names[index] for index in targets])}"
        plan.setdefault(step_at(reconfiguration.at, step), []).append(TargetsChanged(targets, reason))
    # A loss comes before a return at the same step.
    return {
        at: sorted(plan[at], key=lambda event: isinstance(event, SatelliteRejoined)) for at in sorted(plan)
    }


def _last_checkpoint(step: int, every: int | None) -> int:
    """Step of the last checkpoint that is due up to a step; 0 when none is."""
    return 0 if every is None else step // every * every


def merge_plans(*plans: Plan) -> Plan:
    """Several plans as one; what is planned first comes first.

    Of two returns of a satellite at one step the later plan's counts: it may come back from another
    checkpoint than it was to.
    """
    whole: Plan = {}
    for plan in plans:
        for step, events in plan.items():
            back = {event.satellite for event in events if isinstance(event, SatelliteRejoined)}
            before = [
                event
                for event in whole.get(step, [])
                if not (isinstance(event, SatelliteRejoined) and event.satellite in back)
            ]
            whole[step] = [*before, *events]
    return whole


def possible_graph(graph: Graph, plan: Plan) -> Graph:
    """Every edge that there is at some time."""
    adjacency = graph.adjacency
    for events in plan.values():
        for event in events:
            if isinstance(event, TopologyChanged):
                adjacency = np.maximum(adjacency, event.graph.adjacency)
    return Graph(adjacency)


def topology_changes(plan: Plan) -> list[tuple[int, TopologyChanged]]:
    """The changes of the graph in it, each with its step, in order."""
    return [
        (step, event) for step in sorted(plan) for event in plan[step] if isinstance(event, TopologyChanged)
    ]


def is_lost_at(plan: Plan, satellite: int, step: int) -> bool:
    """Whether a satellite is planned to be lost at a step."""
    events = plan.get(step, [])
    return any(isinstance(event, SatelliteLost) and event.satellite == satellite for event in events)


def rejoins_after(plan: Plan, satellite: int, since: int) -> bool:
    """Whether a satellite is planned to take part again at a step or a later one."""
    return any(
        isinstance(event, SatelliteRejoined) and event.satellite == satellite
        for step, events in plan.items()
        for event in events
        if step >= since
    )


def has_individual_events(plan: Plan) -> bool:
    """Whether a satellite is lost in it, or changed by itself, so that satellites cannot fly as one."""
    return any(
        isinstance(event, SatelliteLost | SatelliteRejoined | ParameterChanged | TargetsChanged)
        for events in plan.values()
        for event in events
    )


@dataclass
class Formation:
    """Present membership and communication graph.

    Attributes:
        graph: the communication graph.
        alive: of each satellite, whether it is waited for, shape (N,).
        number: of this state, counted from 0 at the start.
        step: from which it holds.
        reason: why it is so, in words.
        lost_at: by the index of a satellite that has been lost, the step of its latest loss if it had
            announced something for that step; the step before if it had not.
        rejoined_at: by the index of a satellite that has rejoined, the step at which it did last.
        targets: by the index of a satellite whose target is not that of the scenario, the one in force.
    """

    graph: Graph
    alive: NDArray[np.bool_]
    number: int = 0
    step: int = 0
    reason: str = ""
    lost_at: dict[int, int] = field(default_factory=dict)
    rejoined_at: dict[int, int] = field(default_factory=dict)
    targets: dict[int, Target] = field(default_factory=dict)

    @classmethod
    def of(cls, plan: MembershipPlan) -> "Formation":
        """The formation at the start of a flight."""
        return cls(plan.graph, np.ones(len(plan.names), dtype=np.bool_))

    def apply(self, events: Iterable[Event], step: int, names: Sequence[str]) -> list[Event]:
        """Change at a step.

        Args:
            events: that are due at this step, in order.
            step: its number.
            names: of the satellites, for the reason.

        Returns:
            Those that changed something: who is lost is not lost again, and who flies does not return.
        """
        changes: list[Event] = []
        reasons: list[str] = []
        for event in events:
            match event:
                case SatelliteLost() if self.alive[event.satellite]:
                    self.lost_at[event.satellite] = (
                        step if self.is_used_by_neighbours(event.satellite, step) else step - 1
                    )
                    self.alive[event.satellite] = False
                    reasons.append(event.reason)
                case SatelliteRejoined() if not self.alive[event.satellite]:
                    self.alive[event.satellite] = True
                    self.rejoined_at[event.satellite] = step
                    reasons.append(f"{names[event.satellite]} is back")
                case TopologyChanged():
                    self.graph = event.graph
                    reasons.append(event.reason)
                case TargetsChanged():
                    self.targets = event.applied(self.targets, step)
                    reasons.append(event.reason)
                case _:
                    continue
            changes.append(event)
        if changes:
            self.number += 1
            self.step = step
            self.reason = "; ".join(reasons)
        return changes

    def is_used_by_neighbours(self, satellite: int, step: int) -> bool:
        """Whether the neighbours of a satellite use what it has announced for a step.

        What is announced for a step is computed in the step before, and comes with the command of that
        step. So a satellite that is lost is still used in the step of its loss, and one that rejoins from
        the step after its return on: were its first announcement used at once, one that is lost again in
        that step would have reached some of its neighbours and not others.
        """
        if self.lost_at.get(satellite) == step:
            return True
        return bool(self.alive[satellite]) and self.rejoined_at.get(satellite, -1) < step

    @property
    def connectivity(self) -> float:
        """Algebraic connectivity of the graph of those that are alive, no unit.

        Not a number for more than `MAXIMUM_SPECTRUM` satellites, whose eigenvalues would take minutes.
        """
        if np.count_nonzero(self.alive) > MAXIMUM_SPECTRUM:
            return math.nan
        # The whole graph keeps its eigenvalues, which take a while for a thousand satellites.
        graph = self.graph if self.alive.all() else self.graph.subgraph(self.alive)
        return graph.algebraic_connectivity if self.alive.any() else 0.0

    def linked(self, receiver: int, senders: Sequence[int]) -> Array:
        """1 for each of these senders that is at present an in-neighbour, else 0, shape (K,)."""
        linked: Array = self.graph.adjacency[receiver, list(senders)]
        return linked
