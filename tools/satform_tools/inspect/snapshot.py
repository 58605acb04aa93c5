# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""One look at a flying formation, and how it reads on a terminal or in a pipe."""

import math
from dataclasses import dataclass
from typing import Any

from satform_tools import console
from satform_tools.console import Table

_LINKS = 12
"""Links that are named one by one, the oldest first; a complete graph of many has more than anyone reads."""

_EVENTS = 6
"""Newest events that are shown."""

HEADINGS = (
    "satellite",
    "",
    "x [m]",
    "y [m]",
    "z [m]",
    "error [m]",
    "command [m/s²]",
    "arc length [m]",
)


@dataclass(frozen=True)
class SatelliteLook:
    """What is known of one satellite; nan where nothing has been heard yet or there is no such thing.

    Attributes:
        name: of the satellite.
        alive: whether the plant waits for it.
        silent: whether nothing has been heard of it of late, though it counts as alive.
        position: m, lvlh, as the satellite believes itself.
        error: m, distance from its reference, as it believes itself.
        command: m/s^2, length of the acceleration it asks for.
        arc_length: m, less its phase offset.
    """

    name: str
    alive: bool
    silent: bool
    position: tuple[float, float, float]
    error: float
    command: float
    arc_length: float


@dataclass(frozen=True)
class LinkLook:
    """One direction of talk.

    Attributes:
        receiver: satellite that listens.
        sender: satellite that it listens to.
        age: s of simulated time since the newest word of the speaker; nan when none has been heard.
    """

    listener: str
    speaker: str
    age: float


@dataclass(frozen=True)
class Frame:
    """One look at a formation.

    Attributes:
        title: what flies, and where.
        phase: waiting, flying, finished or aborted.
        step: steps taken.
        last_step: step with which the flight ends.
        time: s, simulated.
        steps_per_second: of wall-clock time; nan before two looks.
        satellites: in the scenario's order.
        spread: m, largest less smallest arc length at one moment; nan where satellites share none.
        connectivity: algebraic connectivity of the living satellites' graph.
        links: who listens to whom.
        events: sentences, the oldest first.
    """

    title: str
    phase: str
    step: int
    last_step: int
    time: float
    steps_per_second: float
    satellites: tuple[SatelliteLook, ...]
    spread: float
    connectivity: float
    links: tuple[LinkLook, ...]
    events: tuple[str, ...]


def as_text(frame: Frame) -> str:
    """A frame as plain text."""
    return "\n".join([_head(frame), console.plain_table(_table(frame)), *_lines(frame)])


def as_renderable(frame: Frame) -> Any:
    """A frame as rich shows it on a terminal."""
    from rich.console import Group  # noqa: PLC0415 - only a terminal needs them
    from rich.text import Text  # noqa: PLC0415

    lines = (Text(line) for line in _lines(frame))
    return Group(Text(_head(frame), style="bold"), console.drawn_table(_table(frame)), *lines)


def _head(frame: Frame) -> str:
    share = f" ({100 * frame.step // frame.last_step} %)" if frame.last_step else ""
    pace = ""
    if not math.isnan(frame.steps_per_second):
        pace = f", {frame.steps_per_second:,.0f} steps/s"
        if frame.step:
            factor = frame.steps_per_second * frame.time / frame.step
            pace += f", {factor:,.{0 if factor >= 10 else 2}f} x real time"
    return (
        f"{frame.title}: {frame.phase}, step {frame.step} of {frame.last_step}{share}, {frame.time:g} s{pace}"
    )


def _table(frame: Frame) -> Table:
    rows = [
        (
            entry.name,
            "silent" if entry.silent else "alive" if entry.alive else "lost",
            *(_number(value, "10.1f") for value in entry.position),
            _number(entry.error, ".4g"),
            _number(entry.command, ".3g"),
            _number(entry.arc_length, "10.1f"),
        )
        for entry in frame.satellites
    ]
    styles = {
        index: "yellow" if entry.silent else "red"
        for index, entry in enumerate(frame.satellites)
        if entry.silent or not entry.alive
    }
    return Table(HEADINGS, rows, frozenset(range(2, len(HEADINGS))), styles)


def _lines(frame: Frame) -> list[str]:
    spread = "" if math.isnan(frame.spread) else f"arc-length spread {frame.spread:.4g} m, "
    lines = [f"{spread}algebraic connectivity {frame.connectivity:g}"]
    if frame.links:
        lines.append(_links(frame.links))
    lines += frame.events[-_EVENTS:]
    return lines


def _links(links: tuple[LinkLook, ...]) -> str:
    """The ages of links in words, the oldest first."""
    # Not heard at all is older than any age.
    ordered = sorted(links, key=lambda link: -math.inf if math.isnan(link.age) else -link.age)
    named = [f"{link.listener}<-{link.speaker} {_number(link.age, 'g')}" for link in ordered[:_LINKS]]
    more = f", and {len(links) - _LINKS} that are younger" if len(links) > _LINKS else ""
    return f"age of the newest word on {len(links)} links [s]: {', '.join(named)}{more}"


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form).strip()
