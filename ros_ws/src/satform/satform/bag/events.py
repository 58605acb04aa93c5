# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Events of a recorded flight: lost and rejoined satellites, communication graphs and changed gains.

Read by a bag's own message definitions, so that bags with other versions of these messages can be read.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.bag.message_types import TopicMessages, decoded
from satform.common.printable_text import reason
from satform.consensus.graph import Graph

STATUS_TYPE = "satform_msgs/msg/FormationStatus"
CHANGE_TYPE = "satform_msgs/msg/ParameterChange"

TYPES = (STATUS_TYPE, CHANGE_TYPE)
"""Types of the messages that carry events."""


class EventError(ValueError):
    """Messages that cannot be read as events; the text names their topic."""


@dataclass(frozen=True)
class Status:
    """Membership and communication graph from a step on.

    Attributes:
        step: from which this holds.
        phase: lower case, as the message names it: waiting, flying, finished, aborted.
        last_step: with which the run was to end.
        satellites: names.
        alive: one for each satellite.
        adjacency: row for each satellite, with a 1 for each in-neighbour.
        algebraic_connectivity: of the graph of the satellites that take part.
        reason: why the formation changed or the run was aborted; empty when nothing happened.
    """

    step: int
    phase: str
    last_step: int
    satellites: tuple[str, ...]
    alive: tuple[bool, ...]
    adjacency: tuple[tuple[int, ...], ...]
    algebraic_connectivity: float
    reason: str


@dataclass(frozen=True)
class GainChange:
    """A gain that was changed in flight.

    Attributes:
        step: at which the new value is used for the first time.
        satellite: whose gain.
        name: of the parameter.
        value: new, in the parameter's own unit; one number or one for each axis.
    """

    step: int
    satellite: str
    name: str
    value: tuple[float, ...]


@dataclass(frozen=True)
class Events:
    """All that happened in a flight, each kind by ascending step.

    Attributes:
        statuses: one from the first step on, and one at every change.
        gain_changes: in the order of their steps.
    """

    statuses: tuple[Status, ...]
    gain_changes: tuple[GainChange, ...]


def read_events(topics: Iterable[TopicMessages]) -> Events:
    """The events that messages carry.

    Args:
        topics: one entry for each topic of these types.

    Returns:
        The events; of several statuses for one step all are kept, the last being the one that holds.

    Raises:
        EventError: a message is not what its definition says.
    """
    statuses: list[Status] = []
    changes: list[GainChange] = []
    for entry in topics:
        if not entry.messages:
            continue
        try:
            messages, phases = decoded(entry)
            if entry.type_name == STATUS_TYPE:
                statuses += [_status(message, phases) for message in messages]
            else:
                satellite = entry.topic.strip("/").partition("/")[0]
                changes += [_change(message, satellite) for message in messages]
        except Exception as error:  # the decoder is made from the bag's text, which may be any
            raise EventError(
                f"{entry.topic} has messages that are not {entry.type_name}: {reason(error)}"
            ) from None
    return Events(
        tuple(sorted(statuses, key=lambda status: status.step)),
        tuple(sorted(changes, key=lambda change: change.step)),
    )


def _status(message: Any, phases: dict[int, str]) -> Status:
    count = len(message.satellites)
    graph = Graph.of_edges(count, message.edge_receivers, message.edge_senders)
    adjacency = graph.adjacency.astype(np.int64).tolist()
    if len(message.alive) != count:
        raise ValueError(f"{len(message.alive)} entries of alive for {count} satellites")
    return Status(
        step=int(message.step),
        phase=phases.get(int(message.phase), f"phase {message.phase}"),
        last_step=int(message.last_step),
        satellites=tuple(message.satellites),
        alive=tuple(bool(alive) for alive in message.alive),
        adjacency=tuple(tuple(row) for row in adjacency),
        algebraic_connectivity=float(message.algebraic_connectivity),
        reason=str(message.reason),
    )


def _change(message: Any, satellite: str) -> GainChange:
    return GainChange(int(message.step), satellite, str(message.name), tuple(message.value.tolist()))
