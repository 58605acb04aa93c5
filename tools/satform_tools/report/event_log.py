# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What happened in a flight, as sentences with their times, and the graph as it was at each time."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.bag.events import Status
from satform.numeric.elementwise import Array
from satform_tools.run.stored_run import Kept

Kind = Literal["loss", "return", "graph", "gain", "phase"]

_EXPECTED = frozenset({"waiting", "flying", "finished"})
"""Phases of a flight in which nothing happens."""


@dataclass(frozen=True)
class Happening:
    """Something that happened.

    Attributes:
        step: from which it holds.
        time: of that step, s.
        kind: of what kind it was.
        text: what happened.
    """

    step: int
    time: float
    kind: Kind
    text: str


@dataclass(frozen=True)
class Connection:
    """Who flies and who hears whom, from a time on.

    Attributes:
        time: s.
        alive: one for each satellite, shape (N,).
        hears: 1 where the row's satellite hears the column's, both being alive, shape (N, N).
        connectivity: algebraic connectivity of the graph of the living.
    """

    time: float
    alive: tuple[bool, ...]
    hears: Array
    connectivity: float


def happenings(kept: Kept) -> list[Happening]:
    """All that happened in a flight, by time; nothing where nobody noted it down."""
    if kept.events is None:
        return []
    step = kept.scenario.timing.step
    found: list[tuple[int, Kind, str]] = []
    before: Status | None = None
    for status in kept.events.statuses:
        found += [(status.step, kind, text) for kind, text in _changes(before, status)]
        before = status
    for change in kept.events.gain_changes:
        value = ", ".join(f"{number:g}" for number in change.value)
        shown = value if len(change.value) == 1 else f"[{value}]"
        found.append((change.step, "gain", f"{change.satellite}: {change.name} is now {shown}"))
    found.sort(key=lambda entry: entry[0])
    return [Happening(at, at * step, kind, text) for at, kind, text in found]


def connections(kept: Kept) -> list[Connection]:
    """The graph from the start on and after each change of it, by time."""
    graph = kept.scenario.communication_graph()
    everyone = (True,) * len(graph)
    if kept.events is None or not kept.events.statuses:
        return [Connection(0.0, everyone, graph.adjacency, graph.algebraic_connectivity)]
    step = kept.scenario.timing.step
    return [
        Connection(
            status.step * step,
            status.alive,
            np.array(status.hears, dtype=np.float64) * np.outer(status.alive, status.alive),
            status.algebraic_connectivity,
        )
        for status in kept.events.statuses
    ]


def _changes(before: Status | None, now: Status) -> list[tuple[Kind, str]]:
    found: list[tuple[Kind, str]] = []
    reason = f": {now.reason}" if now.reason else ""
    were = before.alive if before is not None else (True,) * len(now.alive)
    lost = [name for name, was, alive in zip(now.satellites, were, now.alive, strict=True) if was > alive]
    back = [name for name, was, alive in zip(now.satellites, were, now.alive, strict=True) if was < alive]
    if lost:
        found.append(("loss", f"{', '.join(lost)} lost{reason}"))
    if back:
        found.append(("return", f"{', '.join(back)} back{reason}"))
    if before is not None and before.hears != now.hears:
        found.append(("graph", f"who hears whom changed{reason}"))
    if (before is None or before.phase != now.phase) and now.phase not in _EXPECTED:
        found.append(("phase", f"{now.phase}{reason}"))
    elif before is not None and before.phase != now.phase and before.phase not in _EXPECTED:
        found.append(("phase", f"{now.phase} again{reason}"))
    elif not found and now.reason:
        found.append(("phase", now.reason))
    return found
