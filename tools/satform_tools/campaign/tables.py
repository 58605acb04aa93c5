# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What came of a campaign, printed as text."""

from satform_tools import console
from satform_tools.campaign.progress import duration_text, rate_text
from satform_tools.campaign.summary import NOTHING_FLOWN, Summary, interval_text

_MOST_LISTED = 10
"""Failed cases and kinds of reasons that are printed."""


def print_summary(summary: Summary, *, quiet: bool = False) -> None:
    """Print what came of a campaign.

    Args:
        summary: of the campaign.
        quiet: whether nothing is printed that depends on the wall clock, which differs from run to run.
    """
    console.heading(f"{summary.campaign.name}: {summary.campaign.title}")
    _print_cases(summary, quiet=quiet)
    if summary.flown and summary.figures:
        console.line()
        _print_figures(summary)
    if summary.verdicts:
        console.line()
        _print_verdicts(summary)
    if summary.failures:
        console.line()
        _print_failures(summary)
    console.line()
    console.line(f"Results: {summary.folder.path}")
    if summary.results_hash:
        console.line(f"Hash over all results: {summary.results_hash}")
    elif summary.complete and summary.lost:
        console.line(
            "No hash over all results: lost cases depend on the machine; `satform campaign resume --retry` "
            "flies them again"
        )
    for index, file in enumerate(summary.files):
        console.line(f"        {file}" if index else f"Report: {file}")
    _print_conclusion(summary)


def _print_cases(summary: Summary, *, quiet: bool) -> None:
    rate, low, high = summary.rate
    interval = interval_text(100 * low, 100 * high, ".4g")
    flown = f"{summary.flown} of {summary.cases} cases flown"
    if summary.speed is not None and summary.speed.cases and not quiet:
        speed = summary.speed
        flown += (
            f", {speed.cases} of them now in {duration_text(speed.seconds)} by {speed.workers} "
            f"{'worker' if speed.workers == 1 else 'workers'} ({rate_text(speed.cases / speed.seconds)})"
        )
    console.line(flown if summary.flown else f"{flown}: {NOTHING_FLOWN}")
    if summary.flown:
        console.line(
            f"Success: {summary.succeeded} of {summary.flown}, {100 * rate:.4g} %"
            f"{f' (95 % interval {interval} %)' if interval else ''}"
        )
        if summary.lost:
            console.line(f"Ended by a timeout or with their worker process: {summary.lost}")
        if summary.records_missing:
            console.line(f"Records that could not be stored, as on a full disk: {summary.records_missing}")
        alone = summary.flown - summary.stacked
        console.line(f"Flown in stacks: {summary.stacked}, one by one: {alone}")


def _print_figures(summary: Summary) -> None:
    rows = []
    for figure in summary.figures:
        low, median, high = figure.percentiles
        numbers = (figure.minimum, low, median, high, figure.maximum)
        met = "" if figure.met is None else f"{figure.met} of {summary.flown}"
        rows.append((figure.name, figure.unit, *(f"{number:.5g}" for number in numbers), met))
    headings = ("figure", "unit", "minimum", "5 %", "50 %", "95 %", "maximum", "as expected")
    console.table(console.Table(headings, rows, right=frozenset({2, 3, 4, 5, 6, 7})))


def _print_verdicts(summary: Summary) -> None:
    rows = [
        (
            verdict.label,
            f"{verdict.statistic:.5g} {verdict.unit}".strip(),
            interval_text(verdict.low, verdict.high, ".5g") or "-",
            verdict.allowed,
            "pass" if verdict.met else "MISSED",
        )
        for verdict in summary.verdicts
    ]
    missed = {row: "red" for row, verdict in enumerate(summary.verdicts) if not verdict.met}
    headings = ("expectation of the campaign", "found", "interval", "allowed", "")
    console.table(console.Table(headings, rows, styles=missed))


def _print_failures(summary: Summary) -> None:
    kinds = list(summary.kinds.items())
    console.table(
        console.Table(
            ("cases", "reason"),
            [(str(count), kind) for kind, count in kinds[:_MOST_LISTED]],
            right=frozenset({0}),
        )
    )
    if len(kinds) > _MOST_LISTED:
        console.line(f"and {len(kinds) - _MOST_LISTED} more reasons")
    console.line()
    rows = [(str(failure.number), failure.reason) for failure in summary.failures[:_MOST_LISTED]]
    console.table(console.Table(("case", "reason"), rows, right=frozenset({0})))
    if summary.failed > _MOST_LISTED:
        console.line(f"and {summary.failed - _MOST_LISTED} more failed cases: see --json, and the results")
    console.line(f"Fly one again: {summary.command(summary.failures[0].number)}")


def _print_conclusion(summary: Summary) -> None:
    again = f"go on with: satform campaign resume {summary.folder.path}"
    missing = summary.cases - summary.flown
    if summary.complete and (summary.stopped or summary.reason):
        why = summary.reason or "stopped"
        console.line(f"NOT COMPLETE: all cases are flown, but bags are missing: {why}; {again}", "red")
    elif summary.stopped:
        console.line(f"STOPPED: {missing} of {summary.cases} cases are not flown; {again}", "red")
    elif not summary.complete:
        why = f": {summary.reason}" if summary.reason else ""
        console.line(f"NOT COMPLETE: {missing} of {summary.cases} cases are not flown{why}; {again}", "red")
    elif not summary.verdicts:
        console.line("Flown to the end and not judged: the campaign expects nothing.")
    else:
        count, missed = len(summary.verdicts), sum(not verdict.met for verdict in summary.verdicts)
        if missed:
            console.line(f"MISSED: {missed} of {count}.", "red")
        else:
            console.line(f"As expected: {count} of {count} met.", "green")
