# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Texts and tables of a campaign's page."""

import json
import math
from typing import Any

from satform_tools.campaign.envelopes import MOST_SAMPLED
from satform_tools.campaign.progress import duration_text, rate_text
from satform_tools.campaign.report_statistics import ReportStatistics
from satform_tools.campaign.summary import NOTHING_FLOWN, Speed, Summary, interval_text
from satform_tools.console import number
from satform_tools.report.page.content import Fact, PageTable, Status, listed_versions, yaml_text
from satform_tools.run.versions import versions

MOST_PAIRS = 60
"""Rank correlations that are listed."""

_MOST_REASONS = 30


def page_content(statistics: ReportStatistics, speed: Speed | None) -> dict[str, Any]:
    """Everything that the page prints.

    Args:
        statistics: of the campaign.
        speed: how fast it was flown; None where that is not known.
    """
    summary = statistics.summary
    campaign = summary.campaign
    text = campaign.text or campaign.title
    return {
        "heading": campaign.title,
        "overline": f"{campaign.name} · {summary.folder.path.name}",
        "status": status(summary),
        "facts": facts(statistics, speed),
        "expectations": expectations(summary),
        "expectations_note": _expectations_note(summary),
        "figures": figures(summary),
        "figures_note": "Percentiles are of the cases that have the figure.",
        "has_series": bool(statistics.envelopes),
        "series_note": "5, 50 and 95 % percentiles; every satellite of every case is one member.",
        "inputs_note": _inputs_note(statistics),
        "correlations": correlations(statistics),
        "correlations_note": _correlations_note(statistics),
        "reasons": reasons(summary),
        "failures": [
            {
                "number": failure.number,
                "reason": failure.reason,
                "command": summary.command(failure.number),
            }
            for failure in summary.failures
        ],
        "failures_note": _failures_note(summary),
        "paragraphs": [" ".join(part.split()) for part in text.strip().split("\n\n")],
        "yaml": _yaml(summary),
        "provenance": provenance(summary, speed),
    }


def status(summary: Summary) -> Status:
    """The conclusion about a campaign."""
    if not summary.complete:
        missing = summary.cases - summary.flown
        return Status("partial", f"Not complete: {missing} of {summary.cases} cases are not flown")
    if not summary.verdicts:
        return Status("plain", "Flown to the end and not judged: the campaign expects nothing")
    count, missed = len(summary.verdicts), sum(not verdict.met for verdict in summary.verdicts)
    if missed:
        return Status("missed", f"Missed: {missed} of {count} expectations")
    return Status("met", f"As expected: {count} of {count} expectations met")


def facts(statistics: ReportStatistics, speed: Speed | None) -> list[Fact]:
    """The facts at the head of the page."""
    summary = statistics.summary
    rate, low, high = summary.rate
    campaign, count = summary.campaign, len(statistics.inputs)
    interval = interval_text(100 * low, 100 * high, ".4g")
    success = [
        Fact("Success", f"{summary.succeeded} of {summary.flown} cases"),
        Fact("Success rate", f"{100 * rate:.4g} %{f' ({interval} %)' if interval else ''}"),
    ]
    found = [
        *(success if summary.flown else ()),
        Fact("Cases", f"{summary.flown} of {summary.cases} flown"),
        Fact("Scenario", campaign.base.name),
        Fact("Sampling", str(getattr(campaign.sampling, "kind", "own")).replace("_", " ")),
        Fact("Dispersed", f"{count} independent {'input' if count == 1 else 'inputs'}"),
        Fact("Flown", f"{summary.stacked} in stacks, {summary.flown - summary.stacked} alone"),
    ]
    if speed is not None and speed.cases:
        found.append(Fact("Speed", speed_text(speed)))
    return found


def speed_text(speed: Speed) -> str:
    """How fast cases were flown."""
    workers = f"{speed.workers} {'worker' if speed.workers == 1 else 'workers'}"
    rate = rate_text(speed.cases / speed.seconds) if speed.seconds else "-"
    return f"{speed.cases} cases in {duration_text(speed.seconds)} by {workers} ({rate})"


def expectations(summary: Summary) -> PageTable:
    """Each expectation of the campaign with statistic, interval and verdict."""
    rows = [
        (
            verdict.label,
            verdict.allowed,
            f"{number(verdict.statistic)} {verdict.unit}".rstrip(),
            f"{interval} ({100 * verdict.confidence:g} %)" if interval else "-",
            verdict.compared,
            "passed" if verdict.met else "missed",
            verdict.origin,
        )
        for verdict in summary.verdicts
        for interval in [interval_text(verdict.low, verdict.high, ".7g")]
    ]
    styles = {row: "met" if verdict.met else "missed" for row, verdict in enumerate(summary.verdicts)}
    headings = ("expectation of all cases", "allowed", "found", "interval", "compared", "result", "source")
    return PageTable("Expectations", headings, rows, frozenset({2, 3}), styles)


def figures(summary: Summary) -> PageTable:
    """Percentiles of each figure; no rows where no case is flown."""
    rows = []
    for figure in summary.figures if summary.flown else ():
        low, middle, high = figure.percentiles
        shown = (figure.minimum, low, middle, high, figure.maximum, figure.mean)
        met = "-" if figure.met is None else f"{figure.met} of {summary.flown}"
        rows.append((figure.name, figure.unit, *(number(value) for value in shown), str(figure.cases), met))
    headings = ("figure", "unit", "minimum", "5 %", "50 %", "95 %", "maximum", "mean", "cases", "as expected")
    return PageTable("Figures", headings, rows, frozenset(range(2, 10)))


def correlations(statistics: ReportStatistics) -> PageTable:
    """The strongest rank correlations."""
    rows = [
        (
            pair.input,
            pair.figure,
            f"{pair.coefficient:+.3f}",
            "-" if math.isnan(pair.p_value) else f"{pair.p_value:.1e}",
            str(pair.cases),
            "-" if math.isnan(pair.p_value) else "yes" if pair.significant else "no",
        )
        for pair in statistics.correlations[:MOST_PAIRS]
    ]
    headings = ("input", "figure", "rank correlation ρ", "p-value", "cases", "significant")
    return PageTable("Rank correlations", headings, rows, frozenset({2, 3, 4}))


def reasons(summary: Summary) -> PageTable:
    """Reasons without their numbers, the most frequent first."""
    rows = [(str(count), kind) for kind, count in list(summary.kinds.items())[:_MOST_REASONS]]
    more = len(summary.kinds) - _MOST_REASONS
    if more > 0:
        rest = sum(list(summary.kinds.values())[_MOST_REASONS:])
        rows.append((str(rest), f"{more} more reasons"))
    return PageTable("Reasons", ("cases", "reason"), rows, frozenset({0}))


def provenance(summary: Summary, speed: Speed | None) -> PageTable:
    """Campaign, digests, versions and hash."""
    campaign, manifest = summary.campaign, summary.folder.manifest
    found = {
        "stored in": str(summary.folder.path),
        "campaign": campaign.name,
        "file": summary.file,
        "digest of campaign and scenario": manifest.digest,
        "scenario": campaign.base.name,
        "scenario digest": campaign.base.digest(),
        "seed": str(campaign.seed),
        "sampling": f"{campaign.sampling.model_dump_json()}, {summary.cases} cases",
        "started": manifest.started,
        "engine": "not recorded" if speed is None else f"{speed.engine}, {speed_text(speed)}",
        "flown in stacks": str(summary.stacked),
        "flown one by one": str(summary.flown - summary.stacked),
        "ended by a timeout or with their worker": str(summary.lost),
        "hash over all results": summary.results_hash or "none while cases are missing or lost",
        "flown with": listed_versions(manifest.versions),
        "reported with": listed_versions(versions()),
    }
    return PageTable("Provenance", ("what", "value"), list(found.items()))


def _expectations_note(summary: Summary) -> str:
    """Why no expectation is judged."""
    if not summary.flown:
        return f"No case is flown: {NOTHING_FLOWN}."
    return "" if summary.verdicts else "The campaign expects nothing of all cases together."


def _inputs_note(statistics: ReportStatistics) -> str:
    if not statistics.inputs or not statistics.summary.flown:
        return ""
    of_text = len(statistics.inputs) - len(statistics.sample.inputs)
    cases = len(statistics.sample.numbers)
    note = (
        "Spearman's rank correlation: 1 where the figure rises with the input, -1 where it falls, 0 where it "
        f"does neither. Computed from {cases} cases"
    )
    if statistics.summary.flown > cases:
        note += f", a random sample of at most {MOST_SAMPLED} of {statistics.summary.flown}"
    note += "."
    return note + (f" {of_text} inputs that are text have no rank." if of_text else "")


def _correlations_note(statistics: ReportStatistics) -> str:
    count = len(statistics.correlations)
    note = f"Significant: p-value below 0.05 / {count}, the number of all pairs (Bonferroni)."
    if not statistics.summary.campaign.sampling.is_random:
        note = "There are no p-values: the cases are not drawn at random."
    if count > MOST_PAIRS:
        note += f" {count - MOST_PAIRS} weaker pairs are not listed."
    return note


def _failures_note(summary: Summary) -> str:
    if not summary.flown:
        return "No case is flown."
    if not summary.failed:
        return f"None: all {summary.flown} flown cases succeeded."
    shown = len(summary.failures)
    more = summary.failed - shown
    rest = f" {more} more failed cases are in the results." if more else ""
    return f"The first {shown} of {summary.failed} failed cases; a click on a command selects it.{rest}"


def _yaml(summary: Summary) -> str:
    return yaml_text(json.loads((summary.folder.path / "campaign.json").read_text(encoding="utf-8")))
