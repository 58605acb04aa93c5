# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Eclipses, ground contacts and blocked lines of sight of a flight, as rows, bars and data."""

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from satform.evaluation.visibility import MOST_PAIRS, Interval, Timeline, timeline
from satform.plot.style import Unit
from satform.scenario.environment import earth_rotation
from satform_tools.console import number
from satform_tools.report.page.charts import MOST_LINES, Chart, Line
from satform_tools.report.page.content import PageTable
from satform_tools.run.stored_run import StoredRun

MOST_ROWS = 200
"""Intervals in the table of a page; all are in the output of `--json`."""

_WORDS = {"penumbra": "penumbra", "umbra": "umbra", "contact": "contact", "blocked": "line of sight blocked"}


def timeline_of(stored: StoredRun) -> Timeline | None:
    """What was seen from where in a flight; None where its chief's motion is not known."""
    if stored.record.chief is None:
        return None
    scenario = stored.scenario
    rotation = earth_rotation(scenario.dynamics) if scenario.stations else None
    return timeline(stored.record, scenario.stations, rotation, scenario.line_of_sight_margin)


def data(found: Timeline | None) -> list[dict[str, Any]] | None:
    """The intervals for a machine; None where there is no timeline."""
    if found is None:
        return None
    return [
        {
            name: None if isinstance(value, float) and math.isnan(value) else value
            for name, value in {**asdict(interval), "duration": interval.duration}.items()
        }
        for interval in found.intervals
    ]


def table(found: Timeline | None) -> list[PageTable]:
    """The intervals as a list of one table; none where there are none."""
    if found is None or not found.intervals:
        return []
    headings = ("from [s]", "to [s]", "duration [s]", "what", "satellite", "with", "highest elevation [deg]")
    rows = [
        (
            f"{'≤ ' if own.open_begin else ''}{own.begin:.1f}",
            f"{'≥ ' if own.open_end else ''}{own.end:.1f}",
            f"{own.duration:.1f}",
            _WORDS[own.kind],
            own.satellite,
            own.other or "-",
            number(math.degrees(own.highest_elevation)),
        )
        for own in found.intervals[:MOST_ROWS]
    ]
    title = "Eclipses, contacts and lines of sight"
    if len(found.intervals) > MOST_ROWS:
        title += f": the first {MOST_ROWS} of {len(found.intervals)}"
    return [PageTable(title, headings, rows, frozenset({0, 1, 2, 6}))]


def chart(found: Timeline | None, names: tuple[str, ...], unit: Unit) -> list[Chart]:
    """The intervals as bars over time, in a list of one chart; none where there are none.

    Args:
        found: of a flight.
        names: of its satellites.
        unit: of the time axis.
    """
    if found is None:
        return []
    rows: dict[tuple[str, str, str], list[Interval]] = {}
    for own in found.intervals:
        if own.kind != "umbra":
            rows.setdefault((own.satellite, own.kind, own.other), []).append(own)
    if not 0 < len(rows) <= MOST_LINES:
        return []
    ordered = sorted(rows, key=lambda row: (names.index(row[0]), row[1], row[2]))
    lines = []
    for row, key in enumerate(ordered):
        satellite, kind, other = key
        time = np.array([moment for own in rows[key] for moment in (own.begin, own.end, own.end)])
        bars = np.array([value for _ in rows[key] for value in (float(row), float(row), math.nan)])
        what = {"penumbra": "eclipse", "blocked": f"no sight of {other}"}.get(kind, other)
        lines.append(Line(f"{satellite}: {what}", time / unit.size, bars, names.index(satellite)))
    note = "Eclipses: with the penumbra. Contacts: above the station's elevation mask."
    if found.pairs_left_out:
        note += f" Lines of sight are left out for more than {MOST_PAIRS} pairs."
    return [Chart("timeline", "Eclipses, contacts, lines of sight", "", tuple(lines), note=note)]
