# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Events of a flight: losses, rejoins, changes of topology, parameters and links; and its graph over time."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.bag.events import Status
from satform.numeric.elementwise import Array
from satform_tools.run.stored_run import StoredRun

Kind = Literal["loss", "return", "graph", "gain", "phase", "link"]

_MOST_LINKS = 4
"""Of more links that change in one step, only the number is given."""

_EXPECTED = frozenset({"waiting", "flying", "finished"})
"""Phases of a flight without events."""


@dataclass(frozen=True)
class Event:
    """An event of a flight.

    Attributes:
        step: from which it holds.
        time: of that step, s.
        kind: of the event.
        text: a description.
    """

    step: int
    time: float
    kind: Kind
    text: str


@dataclass(frozen=True)
class GraphState:
    """Living satellites and communication graph, from a time on.

    Attributes:
        time: s.
        alive: one for each satellite, shape (N,).
        adjacency: 1 where the row's satellite receives the column's messages, both alive, shape (N, N).
        connectivity: algebraic connectivity of the graph of living satellites.
    """

    time: float
    alive: tuple[bool, ...]
    adjacency: Array
    connectivity: float


def flight_events(stored: StoredRun) -> list[Event]:
    """All events of a flight, by time; only those of its links where no bag recorded the others."""
    step = stored.scenario.timing.step
    found = _link_changes(stored)
    if stored.events is None:
        return [Event(at, at * step, kind, text) for at, kind, text in found]
    before: Status | None = None
    for status in stored.events.statuses:
        found += [(status.step, kind, text) for kind, text in _changes(before, status)]
        before = status
    for change in stored.events.gain_changes:
        value = ", ".join(f"{number:g}" for number in change.value)
        shown = value if len(change.value) == 1 else f"[{value}]"
        found.append((change.step, "gain", f"{change.satellite}: {change.name} is now {shown}"))
    found.sort(key=lambda entry: entry[0])
    return [Event(at, at * step, kind, text) for at, kind, text in found]


def graph_states(stored: StoredRun) -> list[GraphState]:
    """The graph from the start on and after each change of it, by time."""
    graph = stored.scenario.communication_graph()
    all_alive = (True,) * len(graph)
    if stored.events is None or not stored.events.statuses:
        return [GraphState(0.0, all_alive, graph.adjacency, graph.algebraic_connectivity)]
    step = stored.scenario.timing.step
    return [
        GraphState(
            status.step * step,
            status.alive,
            np.array(status.adjacency, dtype=np.float64) * np.outer(status.alive, status.alive),
            status.algebraic_connectivity,
        )
        for status in stored.events.statuses
    ]


def _link_changes(stored: StoredRun) -> list[tuple[int, Kind, str]]:
    """Radio and optical links that reach their required bit error rate or no longer do."""
    links = stored.scenario.links
    if links is None or not links.physical:
        return []
    history = stored.record.links
    found: list[tuple[int, Kind, str]] = []
    # The first change is what holds at the start.
    for change in [] if history is None else history.changes():
        if change.step == 0:
            continue
        parts = [
            f"{_links(links)} {what}"
            for links, what in (
                (change.opened, "above the required margin"),
                (change.closed, "below the required margin"),
                (change.blocked, "blocked by the Earth"),
            )
            if links
        ]
        # Eigenvalues of a graph that is not connected may differ from zero by a rounding.
        connectivity = change.connectivity if abs(change.connectivity) > 1e-9 else 0.0
        found.append((change.step, "link", f"{'; '.join(parts)}; connectivity {connectivity:.3g}"))
    return found


def _links(links: tuple[tuple[str, str], ...]) -> str:
    """Links in words; both directions of a pair as one."""
    pairs = {frozenset(link): link for link in links if link[::-1] in links}
    texts = [f"{first} and {second}" for first, second in pairs.values()]
    texts += [f"{sender} to {receiver}" for sender, receiver in links if (receiver, sender) not in links]
    return f"{len(links)} links" if len(texts) > _MOST_LINKS else ", ".join(sorted(texts))


def _changes(before: Status | None, now: Status) -> list[tuple[Kind, str]]:
    found: list[tuple[Kind, str]] = []
    reason = f": {now.reason}" if now.reason else ""
    were = before.alive if before is not None else (True,) * len(now.alive)
    lost = [name for name, was, alive in zip(now.satellites, were, now.alive, strict=True) if was > alive]
    rejoined = [name for name, was, alive in zip(now.satellites, were, now.alive, strict=True) if was < alive]
    if lost:
        found.append(("loss", f"{', '.join(lost)} lost{reason}"))
    if rejoined:
        found.append(("return", f"{', '.join(rejoined)} rejoined{reason}"))
    if before is not None and before.adjacency != now.adjacency:
        found.append(("graph", f"topology changed{reason}"))
    if (before is None or before.phase != now.phase) and now.phase not in _EXPECTED:
        found.append(("phase", f"{now.phase}{reason}"))
    elif before is not None and before.phase != now.phase and before.phase not in _EXPECTED:
        found.append(("phase", f"{now.phase} again{reason}"))
    elif not found and now.reason:
        found.append(("phase", now.reason))
    return found
