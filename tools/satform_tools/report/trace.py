# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Traces of a flight's processes: joined in Chrome's trace format, and the times of the parts of a step."""

import json
import statistics
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from satform_tools import console

FILE = "trace.json"
"""In a run's folder: the traces of all processes in Chrome's format, which ui.perfetto.dev opens."""

_PLANT = "plant"
_COMMAND = "/command"


@dataclass(frozen=True)
class Span:
    """An interval in which a process did one thing.

    Attributes:
        process: name of its node, or of its first node.
        name: topic of the message that it processed, or a name of its own.
        begin: ns of the machine's monotonic clock.
        end: likewise.
    """

    process: str
    name: str
    begin: int
    end: int


@dataclass(frozen=True)
class Part:
    """A part of a step.

    Attributes:
        name: what happens in it.
        seconds: its median length, s.
    """

    name: str
    seconds: float


def spans(folder: Path) -> list[Span]:
    """The spans of all processes, in the order of their begin; an incomplete file is skipped with a note.

    Args:
        folder: with a file of each process.

    Raises:
        OSError: a file cannot be read.
    """
    found = []
    for path in sorted(folder.glob("*.json")):
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            nodes = data["nodes"] or [path.stem]
            found += _spans_of(_PLANT if _PLANT in nodes else min(nodes), data)
        except (ValueError, KeyError, TypeError, IndexError):
            console.note(f"{path}: is not a complete trace of a process and is left out")
    return sorted(found, key=lambda span: span.begin)


def write(found: list[Span], path: Path) -> None:
    """Write spans in Chrome's trace format, times from the first one on.

    Raises:
        OSError: the file cannot be written.
    """
    names = sorted({span.process for span in found}, key=lambda name: (name != _PLANT, name))
    numbers = {name: number for number, name in enumerate(names)}
    zero = found[0].begin if found else 0
    events: list[dict[str, Any]] = [
        {"ph": "M", "name": "process_name", "pid": number, "tid": 0, "args": {"name": name}}
        for name, number in numbers.items()
    ]
    events += [
        {
            "ph": "X",
            "name": span.name,
            "pid": numbers[span.process],
            "tid": 0,
            "ts": (span.begin - zero) / 1e3,
            "dur": (span.end - span.begin) / 1e3,
        }
        for span in found
    ]
    path.write_text(json.dumps({"traceEvents": events, "displayTimeUnit": "ns"}), encoding="utf-8")


def parts(found: list[Span]) -> list[Part]:
    """Parts of a step along its critical path, with their times.

    A step is from the moment when the plant takes the last command of one step to that of the next. Its last
    command is that of the satellite which was slowest; the path goes through that one.

    Args:
        found: spans of a flight in lockstep.

    Returns:
        Medians over all steps but the first; empty for too few steps, where a step does not have one command
        of each satellite (on a busy machine some are sent again), and where satellites share a process.
    """
    acting, lasts = _by_process(found), step_ends(found)
    rows = []
    for before, last in pairwise(lasts[1:]):
        row = _critical_path(before, last, acting)
        if row is not None:
            rows.append(row)
    if len(rows) < 3:
        return []
    labels = (
        "plant: takes the last command, propagates all satellites, publishes their states",
        "transport: last state until the slowest satellite begins",
        "satellite: computes, publishes its command, its phase and its tracking",
        "transport: until the plant takes the last command",
    )
    columns = zip(labels, zip(*rows, strict=True), strict=True)
    return [Part(name, statistics.median(values) * 1e-9) for name, values in columns]


def step_ends(found: list[Span]) -> list[Span]:
    """The plant's span of the last command of each step, in which it moves on to the next step.

    Args:
        found: spans of a flight in lockstep.

    Returns:
        One for each step; empty where steps cannot be separated, as in `parts`.
    """
    plant = [span for span in found if span.process == _PLANT and span.name.endswith(_COMMAND)]
    names = {span.name for span in plant}
    steps = [plant[first : first + len(names)] for first in range(0, len(plant), max(1, len(names)))]
    # The trace may end within a step.
    steps = [step for step in steps if len(step) == len(names)]
    if any({span.name for span in step} != names for step in steps):
        return []
    return [step[-1] for step in steps] if _by_process(found).keys() >= _publishers(names) else []


def _publishers(topics: set[str]) -> set[str]:
    return {topic.split("/")[-2] for topic in topics}


def _critical_path(
    before: Span, last: Span, acting: dict[str, list[Span]]
) -> tuple[int, int, int, int] | None:
    """Lengths in ns of a step's four parts; None where marks are missing."""
    satellite = last.name.split("/")[-2]
    candidates = [
        span for span in acting.get(satellite, ()) if before.begin < span.begin and span.begin < last.begin
    ]
    if not candidates:
        return None
    # Acting takes much longer than storing a neighbour's message.
    act = max(candidates, key=lambda span: span.end - span.begin)
    return (
        before.end - before.begin,
        act.begin - before.end,
        act.end - act.begin,
        last.begin - act.end,
    )


def _by_process(found: list[Span]) -> dict[str, list[Span]]:
    processes: dict[str, list[Span]] = {}
    for span in found:
        processes.setdefault(span.process, []).append(span)
    return processes


def _spans_of(process: str, data: dict[str, Any]) -> list[Span]:
    names, opened, found = data["names"], [], []
    for what, when in zip(data["what"], data["when"], strict=True):
        if what >= 0:
            opened.append((what, when))
        elif opened and opened[-1][0] == ~what:
            found.append(Span(process, names[~what], opened.pop()[1], when))
    return found
