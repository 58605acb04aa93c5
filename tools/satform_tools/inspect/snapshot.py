# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""State of a running formation at one time, as text and as a table on a terminal."""

import math
from dataclasses import dataclass
from typing import Any

from satform_tools import console
from satform_tools.console import Table

_LINKS = 12
"""Largest number of links that are printed one by one, the oldest message first."""

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
class SatelliteStatus:
    """State of one satellite; NaN before the first message and for quantities that it does not have.

    Attributes:
        name: of the satellite.
        alive: whether the plant waits for it.
        stale: whether no message of it has been received for a while, though it counts as alive.
        position: estimated by the satellite, LVLH, m.
        error: estimated distance from its reference, m.
        command: magnitude of the commanded acceleration, m/s^2.
        arc_length: without its phase offset, m.
    """

    name: str
    alive: bool
    stale: bool
    position: tuple[float, float, float]
    error: float
    command: float
    arc_length: float


@dataclass(frozen=True)
class LinkStatus:
    """One edge of the communication graph.

    Attributes:
        receiver: satellite that receives.
        sender: satellite whose messages it receives.
        age: simulated time since the newest message of the sender, s; NaN before the first.
    """

    receiver: str
    sender: str
    age: float


@dataclass(frozen=True)
class Frame:
    """State of a formation at one time.

    Attributes:
        title: scenario and domain.
        phase: waiting, flying, finished or aborted.
        step: newest one of which a message was received.
        last_step: step with which the flight ends.
        time: simulated time of `step`, s.
        steps_per_second: of wall-clock time; NaN before the second update.
        satellites: in the scenario's order.
        spread: largest minus smallest arc length at one time, m; NaN where satellites publish none.
        connectivity: algebraic connectivity of the living satellites' graph.
        links: edges of the communication graph.
        events: sentences, the oldest first.
    """

    title: str
    phase: str
    step: int
    last_step: int
    time: float
    steps_per_second: float
    satellites: tuple[SatelliteStatus, ...]
    spread: float
    connectivity: float
    links: tuple[LinkStatus, ...]
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
    percentage = f" ({100 * frame.step // frame.last_step} %)" if frame.last_step else ""
    speed = ""
    if not math.isnan(frame.steps_per_second):
        speed = f", {frame.steps_per_second:,.0f} steps/s"
        if frame.step:
            factor = frame.steps_per_second * frame.time / frame.step
            speed += f", {factor:,.{0 if factor >= 10 else 2}f} x real time"
    step = f"step {frame.step} of {frame.last_step}{percentage}"
    return f"{frame.title}: {frame.phase}, {step}, {frame.time:g} s{speed}"


def _table(frame: Frame) -> Table:
    rows = [
        (
            entry.name,
            "stale" if entry.stale else "alive" if entry.alive else "lost",
            *(_number(value, "10.1f") for value in entry.position),
            _number(entry.error, ".4g"),
            _number(entry.command, ".3g"),
            _number(entry.arc_length, "10.1f"),
        )
        for entry in frame.satellites
    ]
    styles = {
        index: "yellow" if entry.stale else "red"
        for index, entry in enumerate(frame.satellites)
        if entry.stale or not entry.alive
    }
    return Table(HEADINGS, rows, frozenset(range(2, len(HEADINGS))), styles)


def _lines(frame: Frame) -> list[str]:
    spread = "" if math.isnan(frame.spread) else f"arc-length spread {frame.spread:.4g} m, "
    lines = [f"{spread}algebraic connectivity {frame.connectivity:g}"]
    if frame.links:
        lines.append(_links(frame.links))
    lines += frame.events[-_EVENTS:]
    return lines


def _links(links: tuple[LinkStatus, ...]) -> str:
    """The ages of links as text, the oldest first."""
    # No message at all is older than any age.
    ordered = sorted(links, key=lambda link: -math.inf if math.isnan(link.age) else -link.age)
    named = [f"{link.receiver}<-{link.sender} {_number(link.age, 'g')}" for link in ordered[:_LINKS]]
    more = f", and {len(links) - _LINKS} with newer messages" if len(links) > _LINKS else ""
    return f"age of the newest message on {len(links)} links [s]: {', '.join(named)}{more}"


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form).strip()
