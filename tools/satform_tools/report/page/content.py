# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Texts and tables of a report's page."""

import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from ruamel.yaml import YAML

from satform.evaluation.conclusion import conclusion_of
from satform.plot.style import time_unit
from satform.scenario import Scenario
from satform.scenario.expectation import Verdict
from satform_tools.console import number
from satform_tools.report.comparison import Comparison, Expected
from satform_tools.report.event_log import Event
from satform_tools.run.flight_summary import Summary
from satform_tools.run.pair_figures import PAIR_HEADINGS, tetrahedron_text
from satform_tools.run.stored_run import StoredRun
from satform_tools.run.versions import versions


@dataclass(frozen=True)
class PageTable:
    """Rows of text under headings.

    Attributes:
        title: of the section that it makes.
        headings: of the columns.
        rows: texts, as many in each row as there are headings.
        right: columns of numbers.
        styles: `met` or `missed` of rows that are one of them.
    """

    title: str
    headings: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    right: frozenset[int] = frozenset()
    styles: dict[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Status:
    """The conclusion in one line.

    Attributes:
        kind: how it is to be coloured.
        text: the line.
    """

    kind: Literal["met", "missed", "partial", "plain"]
    text: str


@dataclass(frozen=True)
class Fact:
    """A name and a value at the head of the page."""

    name: str
    value: str


@dataclass(frozen=True)
class ScenarioText:
    """A scenario as a page prints it."""

    heading: str
    paragraphs: tuple[str, ...]
    sources: tuple[Any, ...]
    yaml: str
    json: str


def status(stored: StoredRun, verdicts: list[Verdict]) -> Status:
    """The conclusion about a flight."""
    if not stored.complete:
        return Status("partial", f"Not complete: {stored.cut_short}; no expectation is evaluated")
    if stored.ended_early:
        return Status("missed", f"Ended early after {stored.ended_early}")
    text = conclusion_of(stored.scenario, verdicts)
    if not verdicts:
        return Status("plain", text)
    return Status("met" if all(verdict.met for verdict in verdicts) else "missed", text)


def facts(stored: StoredRun) -> list[Fact]:
    """The facts at the head of the page: satellites, duration, chief, models, graph."""
    scenario, record = stored.scenario, stored.record
    duration = record.steps * record.step
    unit = time_unit(duration)
    orbit, graph = scenario.orbit, scenario.communication_graph()
    names = record.satellites
    graph_text = f"{getattr(scenario.graph, 'kind', 'own')}, λ₂ = {graph.algebraic_connectivity:.4g}"
    laws = {getattr(scenario.satellite(index).controller, "kind", "") for index in range(len(names))}
    found = [
        Fact("Satellites", ", ".join(names) if len(names) <= 6 else str(len(names))),
        Fact("Flown", f"{duration / unit.size:.6g} {unit.name} in {record.steps} steps of {record.step:g} s"),
        Fact("Chief", f"{orbit.altitude / 1e3:,.0f} km high, period {scenario_period(scenario)}"),
        Fact("Dynamics", getattr(scenario.dynamics, "kind", "")),
        Fact("Control", ", ".join(sorted(laws))),
        Fact("Graph", graph_text if len(names) > 1 else "none"),
    ]
    if not stored.complete or stored.ended_early:
        found.insert(2, Fact("Planned", f"{scenario.timing.steps} steps"))
    return found


def scenario_period(scenario: Scenario) -> str:
    """The chief's orbital period as text."""
    period = 2.0 * math.pi / scenario.orbit.rate
    return f"{period / 60.0:.1f} min" if period < 10 * 3600.0 else f"{period / 3600.0:.2f} h"


def expectations(verdicts: list[Verdict]) -> PageTable:
    """Each expectation with its allowed range, measured figure and verdict."""
    rows = [
        (
            verdict.label,
            verdict.allowed,
            f"{number(verdict.figure)} {verdict.unit}".rstrip(),
            "passed" if verdict.met else "missed",
            verdict.origin or "no source",
        )
        for verdict in verdicts
    ]
    styles = {row: "met" if verdict.met else "missed" for row, verdict in enumerate(verdicts)}
    headings = ("expectation", "allowed", "measured", "result", "source of the figure")
    return PageTable("Expectations", headings, rows, frozenset({2}), styles)


def expected_of_both(comparison: Comparison) -> PageTable:
    """Expectation by expectation of two flights."""

    def cell(verdict: Verdict | None) -> str:
        return "-" if verdict is None else f"{number(verdict.figure)} {'✓' if verdict.met else '✗'}"

    def asked(entry: Expected) -> str:
        allowed = [verdict.allowed for verdict in (entry.first, entry.second) if verdict is not None]
        return " / ".join(dict.fromkeys(allowed))

    rows = [
        (
            entry.label,
            asked(entry),
            cell(entry.first),
            cell(entry.second),
            number(entry.difference),
            entry.unit,
        )
        for entry in comparison.expected
    ]
    missed = {
        row: "missed"
        for row, entry in enumerate(comparison.expected)
        if any(verdict is not None and not verdict.met for verdict in (entry.first, entry.second))
    }
    headings = ("expectation", "allowed", "A", "B", "B minus A", "unit")
    return PageTable("Expectations", headings, rows, frozenset({2, 3, 4}), missed)


def differences(comparison: Comparison) -> PageTable:
    """The largest difference of each quantity."""
    rows = [
        (
            entry.quantity.replace("_", " "),
            "same bits" if entry.first is None else number(entry.largest),
            entry.unit,
            "" if entry.first is None else f"{entry.satellite}, step {entry.step}",
            "" if entry.first is None else f"step {entry.first}",
        )
        for entry in comparison.differences
    ]
    headings = ("quantity", "largest difference", "unit", "where", "first different bits")
    return PageTable("Differences by quantity", headings, rows, frozenset({1}))


def figures(summary: Summary, title: str) -> PageTable:
    """Each satellite's flight in figures."""
    start = f"from {summary.final_from:g} s on"
    headings: tuple[str, ...] = (
        "satellite",
        f"error [m], largest {start}",
        f"sliding variable [m/s], largest {start}",
        f"control [m/s²], mean {start}",
        "control [m/s²], largest",
        "delta-v [m/s]",
        "delta-v per orbit [m/s]",
        "propellant [kg]",
        "steps saturated / below minimum impulse / propellant depleted",
    )
    rows: list[tuple[str, ...]] = [
        (
            *entry.row(),
            number(entry.propellant_used),
            " / ".join(
                str(count)
                for count in (
                    entry.saturated_steps,
                    entry.below_minimum_impulse_steps,
                    entry.propellant_depleted_steps,
                )
            ),
        )
        for entry in summary.satellites
    ]
    if all(row[7] == "-" for row in rows):
        headings, rows = headings[:7], [row[:7] for row in rows]
    return PageTable(title, headings, rows, frozenset(range(1, len(headings))))


def pairs(summary: Summary) -> list[PageTable]:
    """Pairs of satellites in figures, as a list of one table; none of a lone satellite or of many."""
    rows = [entry.row() for entry in summary.pairs]
    if not rows:
        return []
    quality = tetrahedron_text(summary.tetrahedron_quality)
    title = f"Pairs of satellites; {quality}" if quality else "Pairs of satellites"
    return [PageTable(title, PAIR_HEADINGS, rows, frozenset(range(1, len(PAIR_HEADINGS))))]


def events(found: list[Event]) -> PageTable:
    """The events, numbered as in the charts."""
    rows = [
        (str(number), f"{entry.time:g} s", str(entry.step), entry.text)
        for number, entry in enumerate(found, start=1)
    ]
    return PageTable("Events", ("mark", "time", "step", "event"), rows, frozenset({0, 1, 2}))


def no_events(stored: StoredRun) -> str:
    """The text in number of an empty table of events."""
    if stored.events is None:
        return "The flight has no bag, in which other events than those of links are recorded."
    return "No events: no satellite was lost, nothing was changed in flight."


def provenance(flights: list[StoredRun]) -> PageTable:
    """Scenario, versions and hashes of each flight."""
    columns = [
        {
            "stored in": str(stored.path),
            "scenario": stored.scenario.name,
            "scenario digest": stored.scenario.digest(),
            "state hash": stored.state_hash or stored.why_no_hash,
            "seed": str(stored.scenario.seed),
            "flown with": listed_versions(stored.versions) or "not recorded",
            "reported with": listed_versions(versions()),
        }
        for stored in flights
    ]
    names = list(dict.fromkeys(name for column in columns for name in column))
    rows = [(name, *(column.get(name, "-") for column in columns)) for name in names]
    values = ("value",) if len(flights) == 1 else ("A", "B")
    return PageTable("Provenance", ("what", *values), rows)


def listed_versions(parts: Mapping[str, str]) -> str:
    """Names and versions of programs and packages, as text."""
    return ", ".join(f"{name} {version}" for name, version in parts.items())


def scenario_text(scenario: Scenario, heading: str) -> ScenarioText:
    """Text and fields of a scenario."""
    text = scenario.to_json()
    paragraphs = tuple(" ".join(part.split()) for part in scenario.text.strip().split("\n\n"))
    return ScenarioText(heading, paragraphs, scenario.sources, yaml_text(json.loads(text)), text)


def yaml_text(fields: Any) -> str:
    """Fields as YAML, short lists on one line."""
    writer = YAML()
    writer.default_flow_style = None
    writer.width = 110
    stream = io.StringIO()
    writer.dump(fields, stream)
    return stream.getvalue()
