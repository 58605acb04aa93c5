# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints the budget of each radio and optical link over the time of a flight, and writes it as CSV."""

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from satform.communication.physical_links import LinkStates, PhysicalSpec, RadioSpec
from satform.flight.simulate import simulate
from satform.record.link_history import LinkHistory
from satform.scenario import Scenario
from satform_tools import console
from satform_tools.console import Table
from satform_tools.errors import CommandError, sentence_of

_COLUMNS = 7
"""Times at which the table on the terminal has the margin."""

_HEADINGS = (
    "time_s",
    "sender",
    "receiver",
    "distance_m",
    "blocked",
    "ratio_db",
    "margin_db",
    "loss",
    "light_time_s",
    "sent",
    "delivered",
)


@dataclass(frozen=True)
class _Flown:
    """The physical links of a flight.

    Attributes:
        scenario: that was flown.
        history: of its links.
        states: of the physical ones, arrays of shape (K, P).
        step: control period, s.
    """

    scenario: Scenario
    history: LinkHistory
    states: LinkStates
    step: float

    def names(self, link: int) -> tuple[str, str]:
        """Sender and receiver of a physical link."""
        return self.history.names_of(int(self.history.physical[link]))

    def spec(self, link: int) -> PhysicalSpec:
        """What a physical link consists of."""
        assert self.scenario.links is not None  # noqa: S101 - it has physical links
        channel = self.scenario.links.of(*self.names(link)).channel
        assert channel is not None  # noqa: S101 - it is physical
        return channel


def link(scenario: Scenario, every: float | None, file: Path | None, *, as_json: bool) -> None:
    """Fly a scenario in this process and print the budgets of its links.

    Args:
        scenario: with radio or optical links.
        every: time between two rows of the file, s; one step when None.
        file: CSV with the budget of each link over time; None for none.
        as_json: whether to print JSON.

    Raises:
        CommandError: there are no such links, or the file cannot be written.
    """
    if scenario.links is None or not scenario.links.physical:
        raise CommandError(f"{scenario.name}: no link has a radio or optical channel; give one a `channel`")
    stride = 1
    if every is not None:
        if not (math.isfinite(every) and every > 0.0):
            raise CommandError(f"--every {every:g}: takes a positive time in s")
        stride = max(1, round(every / scenario.timing.step))
    record = simulate(scenario)
    history = record.links
    if history is None or history.states is None or not record.steps:
        raise CommandError(f"{scenario.name}: the graph has no edge over a radio or optical link")
    flown = _Flown(scenario, history, history.states, record.step)
    if file is not None:
        _write(file, flown, stride)
    summary = [_summary(flown, index) for index in range(len(history.physical))]
    if as_json:
        console.as_json({"links": summary})
        return
    _print(flown, summary)
    if file is not None:
        console.line(f"Written: {file}")


def _summary(flown: _Flown, link: int) -> dict[str, Any]:
    """Budget, best and worst margin of a link."""
    states, edge = flown.states, int(flown.history.physical[link])
    margin = states.margin[:, link]
    seen = np.flatnonzero(margin > -np.inf)
    sent = int(flown.history.sent[:, edge].sum())
    sender, receiver = flown.names(link)
    found: dict[str, Any] = {"sender": sender, "receiver": receiver, **_fixed(flown.spec(link))}
    for name, of in (("worst", np.argmin), ("best", np.argmax)):
        if seen.size:
            step = int(seen[of(margin[seen])])
            found[name] = {
                "time": step * flown.step,
                "distance": float(states.distance[step, link]),
                "ratio": float(states.ratio[step, link]),
                "margin": float(margin[step]),
                "loss": float(states.loss[step, link]),
            }
        else:
            found[name] = None
    found["blocked"] = float(states.blocked[:, link].mean())
    found["no_gain"] = float((np.isneginf(margin) & ~states.blocked[:, link]).mean())
    found["closed"] = float((margin < 0.0).mean())
    found["delivered"] = int(flown.history.delivered[:, edge].sum()) / sent if sent else None
    return found


def _fixed(spec: PhysicalSpec) -> dict[str, float]:
    """The parts of a budget that do not change, dB; powers relative to 1 W."""
    found = {
        "power": 10.0 * math.log10(spec.power),
        "losses": spec.losses,
        "required_ratio": 10.0 * math.log10(spec.required),
    }
    if isinstance(spec, RadioSpec):
        found |= {"mismatch_loss": spec.mismatch, "coding_gain": spec.coding_gain}
    return found


def _print(flown: _Flown, summary: list[dict[str, Any]]) -> None:
    steps = len(flown.states.margin)
    chosen = np.unique(np.linspace(0, steps - 1, _COLUMNS).round().astype(np.int64))
    console.heading("Margin of each link [dB]")
    headings = (
        "link",
        *(f"{step * flown.step:g} s" for step in chosen.tolist()),
        "worst",
        "best",
        "blocked",
        "below 0 dB",
        "delivered",
    )
    rows = []
    for index, entry in enumerate(summary):
        blocked = flown.states.blocked[chosen, index].tolist()
        margins = [
            _decibels(value, blocked=behind)
            for value, behind in zip(flown.states.margin[chosen, index].tolist(), blocked, strict=True)
        ]
        extremes = [_extreme(entry[name]) for name in ("worst", "best")]
        fractions = [_percentage(entry[name]) for name in ("blocked", "closed", "delivered")]
        rows.append((f"{entry['sender']} to {entry['receiver']}", *margins, *extremes, *fractions))
    console.table(Table(headings, rows, frozenset(range(1, len(headings)))))
    console.line()
    console.heading("Fixed parts of the budgets")
    parts: dict[str, list[str]] = {}
    for entry in summary:
        text = f"power {entry['power']:.2f} dBW, losses {entry['losses']:.2f} dB"
        if "mismatch_loss" in entry:
            text += f", mismatch {entry['mismatch_loss']:.2f} dB"
        if entry.get("coding_gain"):
            text += f", coding gain {entry['coding_gain']:.2f} dB"
        unit = "Eb/N0" if "mismatch_loss" in entry else "photons a bit"
        text += f", required {unit} {entry['required_ratio']:.2f} dB"
        parts.setdefault(text, []).append(f"{entry['sender']} to {entry['receiver']}")
    for text, links in parts.items():
        console.line(f"{text}: {'all links' if len(parts) == 1 else ', '.join(links)}")


def _extreme(entry: dict[str, float] | None) -> str:
    return "" if entry is None else f"{entry['margin']:.2f} at {entry['distance'] / 1e3:.4g} km"


def _decibels(value: float, *, blocked: bool) -> str:
    if blocked:
        return "blocked"
    return "no gain" if value == -math.inf else f"{value:.2f}"


def _percentage(value: float | None) -> str:
    return "" if value is None else f"{100.0 * value:.1f} %"


def _rows(flown: _Flown, stride: int) -> Iterator[tuple[Any, ...]]:
    states, history = flown.states, flown.history
    for step in range(0, len(states.margin), stride):
        for link, edge in enumerate(history.physical.tolist()):
            margin, ratio = float(states.margin[step, link]), float(states.ratio[step, link])
            yield (
                step * flown.step,
                *flown.names(link),
                float(states.distance[step, link]),
                int(states.blocked[step, link]),
                "" if math.isinf(ratio) else ratio,
                "" if math.isinf(margin) else margin,
                float(states.loss[step, link]),
                float(states.light_time[step, link]),
                int(history.sent[step, edge]),
                int(history.delivered[step, edge]),
            )


def _write(file: Path, flown: _Flown, stride: int) -> None:
    try:
        with file.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(_HEADINGS)
            writer.writerows(_rows(flown, stride))
    except OSError as error:
        raise CommandError(f"{file}: cannot be written: {sentence_of(error)}") from None
