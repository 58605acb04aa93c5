# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""When satellites did not take part, from the plant's words: what need not be in a bag, and what happened."""

from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import numpy as np

from satform.consensus.graph import Graph
from satform.membership.formation import (
    Event,
    MembershipPlan,
    ParameterChanged,
    Plan,
    SatelliteLost,
    SatelliteRejoined,
    TopologyChanged,
)
from satform.membership.reconfiguration import Target, TargetsChanged, targets_in_force

FormationStatus: TypeAlias = Any
"""A message satform_msgs/msg/FormationStatus, of rclpy or decoded from a bag."""

ParameterChange: TypeAlias = Any
"""A message satform_msgs/msg/ParameterChange, of rclpy or decoded from a bag."""

FOREVER = 2**62
"""A step after every flight."""


class Absences:
    """From which step to which each satellite was lost.

    Attributes:
        spells: of each satellite the first step without its command, and the step of its return.
    """

    def __init__(self, names: Sequence[str]) -> None:
        """Nobody has been lost.

        Args:
            names: of the satellites.
        """
        self._names = list(names)
        self.spells: list[list[tuple[int, int]]] = [[] for _ in self._names]

    def take(self, status: FormationStatus) -> None:
        """Take in a status of the plant."""
        for name in set(status.lost) & set(self._names):
            self.spells[self._names.index(name)].append((int(status.step), FOREVER))
        for name in set(status.rejoined) & set(self._names):
            own = self.spells[self._names.index(name)]
            if own and own[-1][1] == FOREVER:
                own[-1] = (own[-1][0], int(status.step))

    def explain(self, satellite: int, kind: str, first: int, last: int) -> bool:
        """Whether a satellite had nothing to publish on a topic from one step to another.

        Args:
            satellite: its index; -1 for the plant, which is never absent.
            kind: of topic. What a satellite shows of its last step may be lost with it.
            first: first step without a message.
            last: last step without one.
        """
        early = 1 if kind in {"tracking", "estimate", "attitude_estimate"} else 0
        return satellite >= 0 and any(
            begin - early <= first and last < end for begin, end in self.spells[satellite]
        )


def happened(
    statuses: Iterable[FormationStatus],
    changes: Iterable[tuple[str, ParameterChange]],
    membership: MembershipPlan,
) -> Plan:
    """What happened in a flight beside what is planned, to fly it once more.

    Args:
        statuses: of the plant, in order.
        changes: name of the satellite and what was changed of it, in order.
        membership: what was planned.

    Returns:
        Events by step, for `satform.flight.simulate`.
    """
    names, expected = membership.names, membership.events
    plan: Plan = {}
    graph = membership.graph
    number = 0
    targets: dict[int, Target] = {}
    for status in statuses:
        if status.version <= number:
            continue
        number, step = int(status.version), int(status.step)
        events: list[Event] = [SatelliteLost(names.index(name), status.reason) for name in status.lost]
        now = Graph.of_edges(len(names), status.edge_receivers, status.edge_senders)
        if not np.array_equal(now.adjacency, graph.adjacency):
            graph = now
            events.append(TopologyChanged(now, status.reason))
        for name, checkpoint in zip(status.rejoined, status.rejoin_checkpoints, strict=True):
            events.append(SatelliteRejoined(names.index(name), int(checkpoint) if checkpoint >= 0 else None))
        before, targets = targets, targets_in_force(status, names)
        events += _unplanned_targets(before, targets, step, expected.get(step, []), status.reason)
        for event in events:
            if not _is_planned(event, expected.get(step, [])):
                plan.setdefault(step, []).append(event)
    for name, change in changes:
        adjusted = ParameterChanged(names.index(name), change.name, tuple(change.value.tolist()))
        plan.setdefault(int(change.step), []).append(adjusted)
    return plan


def _unplanned_targets(
    before: dict[int, Target], after: dict[int, Target], step: int, planned: list[Event], reason: str
) -> list[Event]:
    """The change of targets at a step, where it is not the one that the scenario has."""
    expected = before
    for event in planned:
        if isinstance(event, TargetsChanged):
            expected = event.applied(expected, step)
    other = {index: target for index, target in after.items() if target != expected.get(index)}
    specs = {index: target.spec for index, target in other.items()}
    fields = {index: target.fields for index, target in other.items()}
    return [TargetsChanged(specs, reason, whole=True, fields=fields)] if other else []


def _is_planned(event: Event, expected: list[Event]) -> bool:
    """Whether the scenario has an event at this step."""
    match event:
        case SatelliteRejoined():
            # From another checkpoint than planned it is another return.
            return event in expected
        case SatelliteLost():
            return any(
                isinstance(other, SatelliteLost) and other.satellite == event.satellite for other in expected
            )
        case TargetsChanged():
            return False
        case _:
            return any(
                isinstance(event, TopologyChanged)
                and isinstance(other, TopologyChanged)
                and np.array_equal(event.graph.adjacency, other.graph.adjacency)
                for other in expected
            )
