# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Renders a report as one HTML file that needs a browser, no network and no other file."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from satform.evaluation.visibility import Timeline
from satform.numeric.elementwise import Array
from satform.plot.style import Unit, length_unit, time_unit
from satform_tools.report import visibility
from satform_tools.report.comparison import Comparison
from satform_tools.report.event_log import flight_events
from satform_tools.report.page import content
from satform_tools.report.page.charts import Chart, Dash, Drawer, Line, charts, graph_charts
from satform_tools.report.page.document import SCENE_SCRIPTS, THREE, packed, rendered
from satform_tools.report.page.view3d import Space, space
from satform_tools.run.flight_summary import summarise
from satform_tools.run.stored_run import StoredRun

_SIDES = ("A", "B")


def page_of(stored: StoredRun, timeline: Timeline | None = None) -> str:
    """The page of one flight.

    Args:
        stored: the flight.
        timeline: of it; computed when left out.

    Returns:
        The HTML file's text.
    """
    clock = time_unit(_duration([stored]))
    verdicts, found = stored.verdicts(), flight_events(stored)
    summary = summarise(stored.record, stored.scenario.setting)
    seen = _spaces([stored], clock)
    timeline = visibility.timeline_of(stored) if timeline is None else timeline
    page = {
        "heading": stored.scenario.title,
        "overline": f"{stored.scenario.name} · {stored.name}",
        "status": content.status(stored, verdicts),
        "facts": content.facts(stored),
        "has_space": bool(seen),
        "space_note": seen[0].note if seen else "",
        "expectations": content.expectations(verdicts),
        "tables_first": [],
        "events": content.events(found),
        "no_events": content.no_events(stored),
        "tables_last": [
            content.figures(summary, "Flight in figures"),
            *content.pairs(summary),
            *visibility.table(timeline),
        ],
        "scenarios": [content.scenario_text(stored.scenario, "Scenario")],
        "provenance": content.provenance([stored]),
    }
    data = {
        **_frame([stored], clock, seen),
        "charts": [_chart(chart) for chart in charts(stored, clock)],
        "graphs": [
            _chart(chart)
            for chart in (
                *graph_charts(stored, clock),
                *visibility.chart(timeline, stored.record.satellites, clock),
            )
        ],
        "events": [{"time": entry.time / clock.size, "kind": entry.kind} for entry in found],
        "keys": [],
    }
    return rendered("report", page, data, scripts=SCENE_SCRIPTS, libraries=[THREE])


def page_of_both(first: StoredRun, second: StoredRun, comparison: Comparison) -> str:
    """The page that compares two flights.

    Args:
        first: called A on the page.
        second: called B.
        comparison: of the two.

    Returns:
        The HTML file's text.
    """
    both = [first, second]
    clock = time_unit(_duration(both))
    seen = _spaces(both, clock)
    same_scenario = first.scenario.digest() == second.scenario.digest()
    shown = (
        [(first, "Scenario of both")]
        if same_scenario
        else [(first, "Scenario of A"), (second, "Scenario of B")]
    )
    figures = [
        content.figures(summarise(stored.record, stored.scenario.setting), f"Flight {side} in figures")
        for side, stored in zip(_SIDES, both, strict=True)
    ]
    page = {
        "heading": f"{first.name} and {second.name}",
        "overline": f"A: {first.scenario.name}, {first.name} · B: {second.scenario.name}, {second.name}",
        "status": content.Status("met" if comparison.same else "partial", comparison.sentence),
        "facts": [
            content.Fact(f"{fact.name} ({side})", fact.value)
            for side, stored in zip(_SIDES, both, strict=True)
            for fact in (
                content.Fact("Result", content.status(stored, stored.verdicts()).text),
                *content.facts(stored)[:2],
            )
        ],
        "has_space": bool(seen),
        "space_note": "A is drawn with lines and dots, B with dashes and diamonds." if seen else "",
        "expectations": content.expected_of_both(comparison),
        "tables_first": [content.differences(comparison)] if comparison.differences else [],
        "events": content.events([]),
        "no_events": "Events are in the report of each flight.",
        "tables_last": figures,
        "scenarios": [content.scenario_text(stored.scenario, heading) for stored, heading in shown],
        "provenance": content.provenance(both),
    }
    pairs = [[*charts(stored, clock), *graph_charts(stored, clock)] for stored in both]
    data = {
        **_frame(both, clock, seen),
        "charts": [
            _chart(chart) for chart in (*_apart(first, second, comparison, clock), *_overlaid(*pairs))
        ],
        "graphs": [],
        "events": [],
        "keys": ["A solid", "B dashed"],
        "sameOrbits": same_scenario,
    }
    return rendered("report", page, data, scripts=SCENE_SCRIPTS, libraries=[THREE])


def _duration(flights: Sequence[StoredRun]) -> float:
    return max(stored.record.steps * stored.record.step for stored in flights)


def _spaces(flights: Sequence[StoredRun], clock: Unit) -> list[Space]:
    length = length_unit(np.concatenate([stored.record.position.ravel() for stored in flights]))
    return [seen for stored in flights if (seen := space(stored, length, clock)) is not None]


def _frame(flights: Sequence[StoredRun], clock: Unit, seen: list[Space]) -> dict[str, Any]:
    """What all figures of a page share."""
    names = max((stored.record.satellites for stored in flights), key=len)
    positions = np.concatenate([stored.record.position.ravel() for stored in flights])
    return {
        "satellites": len(names),
        "names": list(names),
        "clock": clock.name,
        "end": _duration(flights) / clock.size,
        "length": length_unit(positions).name,
        "space": [
            _space(flight, f" · {side}" if len(flights) > 1 else "")
            for flight, side in zip(seen, _SIDES, strict=False)
        ],
        "sameOrbits": True,
    }


def _overlaid(first: list[Chart], second: list[Chart]) -> list[Chart]:
    """The charts of two flights, those of the same quantity on the same axes."""
    theirs = {chart.key: chart for chart in second}
    found = []
    for chart in first:
        other = theirs.pop(chart.key, None)
        if chart.key == "alive":
            continue
        lines = [replace(line, name=f"{line.name} · A") for line in chart.lines]
        if other is not None:
            lines += [replace(line, name=f"{line.name} · B", dash=_other(line)) for line in other.lines]
        found.append(replace(chart, lines=tuple(lines)))
    found += [chart for chart in theirs.values() if chart.key != "alive"]
    return found


def _other(line: Line) -> Dash:
    return "dash" if line.dash == "solid" else "dot"


def _apart(first: StoredRun, second: StoredRun, comparison: Comparison, clock: Unit) -> list[Chart]:
    """Distance between the positions of each satellite in both flights, over time."""
    if comparison.incomparable:
        return []
    rows = min(len(first.record.position), len(second.record.position))
    apart: Array = np.linalg.norm(second.record.position[:rows] - first.record.position[:rows], axis=-1)
    shorter = min((first, second), key=lambda stored: stored.record.steps).record
    chart = Drawer(shorter, clock).each("apart", "Distance between A and B", "distance [m]", apart)
    return [] if chart is None else [chart]


def _chart(chart: Chart) -> dict[str, Any]:
    colours: dict[str, int] = {}
    for line in chart.lines:
        # The same colour for the same quantity of both flights.
        colours.setdefault(line.name.removesuffix(" · A").removesuffix(" · B"), len(colours))
    return {
        "key": chart.key,
        "title": chart.title,
        "axis": chart.axis,
        "logarithmic": chart.logarithmic,
        "steps": chart.steps,
        "note": chart.note,
        "lines": [
            {
                "name": line.name,
                "time": packed(line.time),
                "values": packed(line.values),
                "satellite": line.satellite,
                "colour": colours[line.name.removesuffix(" · A").removesuffix(" · B")],
                "dash": line.dash,
            }
            for line in chart.lines
        ],
    }


def _space(flight: Space, suffix: str) -> dict[str, Any]:
    return {
        "names": list(flight.names),
        "suffix": suffix,
        "time": packed(flight.time),
        "position": packed(flight.position),
        "orbits": [packed(orbit) if len(orbit) else None for orbit in flight.orbits],
        "links": [
            {"moment": links.moment, "pairs": links.pairs, "alive": links.alive} for links in flight.links
        ],
        "trail": flight.trail,
        "triangle": flight.triangle,
    }
