# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reports stored flights: prints figures, writes a page for a browser and exports; compares two flights."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from satform.evaluation.conclusion import conclusion_of
from satform.scenario.expectation import Verdict
from satform_tools import console
from satform_tools.console import Table, number
from satform_tools.errors import CommandError, sentence_of
from satform_tools.report import exports, tables
from satform_tools.report.comparison import Comparison, compare
from satform_tools.report.formats import FlightFormat
from satform_tools.run.flight_summary import summarise
from satform_tools.run.stored_run import StoredRun, find

if TYPE_CHECKING:
    from satform.evaluation.visibility import Timeline

PAGE = "report.html"


def report(runs: Sequence[Path], out: Path | None, formats: Sequence[FlightFormat], *, as_json: bool) -> None:
    """Print the figures of a stored flight and write its page; of two flights, their differences.

    Args:
        runs: one or two; folder of a run, folder of a bag, or `.mcap` file.
        out: folder of what is written; None for `report` beside the bag or record of the first.
        formats: to be written besides the page.
        as_json: whether to print for a machine.

    Raises:
        CommandError: there is no flight, or something cannot be written.
    """
    if len(runs) > 2:
        raise CommandError(f"report takes one run, or two to compare; found {len(runs)}")
    flights = [find(run) for run in runs]
    if len(flights) == 2 and formats:
        raise CommandError("--export is for one run; of two only the page is written")
    folder = out or _report_folder(flights)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if len(flights) == 2:
            _report_both(flights[0], flights[1], folder, as_json=as_json)
        else:
            _report_one(flights[0], folder, formats, as_json=as_json)
    except OSError as error:
        raise CommandError(f"the report cannot be written: {sentence_of(error)}") from None


def _report_folder(flights: list[StoredRun]) -> Path:
    beside = flights[0].path.parent
    return beside / "report" if len(flights) == 1 else beside / f"report-with-{flights[1].name}"


def _report_one(stored: StoredRun, folder: Path, formats: Sequence[FlightFormat], *, as_json: bool) -> None:
    from satform_tools.report import visibility  # noqa: PLC0415 - brahe and scipy take long to load
    from satform_tools.report.page import render  # noqa: PLC0415 - the template engine is needed here only

    verdicts = stored.verdicts()
    timeline = visibility.timeline_of(stored)
    written = [
        _write(folder / PAGE, render.page_of(stored, timeline)),
        *exports.export(stored, folder, formats),
    ]
    if as_json:
        console.as_json(_data(stored, verdicts, timeline, written))
        return
    console.heading(f"{stored.scenario.name}: {stored.scenario.title}")
    if not stored.complete:
        console.line(f"NOT COMPLETE, {stored.cut_short}: no expectation is evaluated", "bold red")
    if stored.ended_early:
        console.line(f"ENDED EARLY after {stored.ended_early}", "bold red")
    tables.print_summary(summarise(stored.record, stored.scenario.setting))
    if verdicts:
        console.line()
        tables.print_verdicts(verdicts)
    if stored.complete:
        console.line(f"{conclusion_of(stored.scenario, verdicts)}.")
    console.line(f"state hash {stored.state_hash[:16] or stored.why_no_hash}")
    console.line()
    console.line(f"report: {written[0]}")
    for file in written[1:]:
        console.line(f"        {file}")


def _report_both(first: StoredRun, second: StoredRun, folder: Path, *, as_json: bool) -> None:
    from satform_tools.report.page import render  # noqa: PLC0415 - the template engine is needed here only

    comparison = compare(first, second)
    file = _write(folder / PAGE, render.page_of_both(first, second, comparison))
    if as_json:
        console.as_json(_data_of_both(first, second, comparison, file))
        return
    console.heading(f"A {first.name} and B {second.name}: {comparison.sentence}")
    for side, stored in (("A", first), ("B", second)):
        if not stored.complete:
            console.line(
                f"{side} is NOT COMPLETE, {stored.cut_short}: no expectation is evaluated", "bold red"
            )
        if stored.ended_early:
            console.line(f"{side} ENDED EARLY after {stored.ended_early}", "bold red")
    _print_comparison(comparison)
    console.line(f"report: {file}")


def _print_comparison(comparison: Comparison) -> None:
    rows = [
        (
            entry.label,
            number(entry.first.figure) if entry.first else "-",
            number(entry.second.figure) if entry.second else "-",
            number(entry.difference),
            entry.unit,
        )
        for entry in comparison.expected
    ]
    if rows:
        console.table(Table(("expectation", "A", "B", "B less A", "unit"), rows, frozenset({1, 2, 3})))
        console.line()
    unlike = [entry for entry in comparison.differences if entry.first is not None]
    if unlike:
        headings = ("quantity", "largest difference", "unit", "satellite", "at step", "from step")
        cells = [
            (
                entry.quantity,
                number(entry.largest),
                entry.unit,
                entry.satellite,
                str(entry.step),
                str(entry.first),
            )
            for entry in unlike
        ]
        console.table(Table(headings, cells, frozenset({1, 4, 5})))
        console.line()


def _write(file: Path, text: str) -> Path:
    file.write_text(text, encoding="utf-8")
    return file


def _data(
    stored: StoredRun, verdicts: list[Verdict], timeline: "Timeline | None", written: list[Path]
) -> dict[str, Any]:
    from satform_tools.report import visibility  # noqa: PLC0415 - brahe and scipy take long to load

    return {
        "scenario": stored.scenario.name,
        "digest": stored.scenario.digest(),
        "state_hash": stored.state_hash or None,
        "source": str(stored.path),
        "steps": stored.record.steps,
        "steps_planned": stored.scenario.timing.steps,
        "complete": stored.complete,
        "cut_short": stored.cut_short,
        "early_end": None if stored.record.early_end is None else stored.record.early_end.data(),
        "summary": summarise(stored.record, stored.scenario.setting).data(),
        "timeline": visibility.data(timeline),
        "lines_of_sight_left_out": timeline is not None and timeline.pairs_left_out,
        "judged": bool(verdicts),
        "expectations": [asdict(verdict) for verdict in verdicts],
        "omitted_expectations": list(stored.scenario.omitted_expectations),
        "report": str(written[0]),
        "files": [str(file) for file in written],
    }


def _data_of_both(first: StoredRun, second: StoredRun, comparison: Comparison, file: Path) -> dict[str, Any]:
    return {
        "sources": [str(first.path), str(second.path)],
        "digests": [first.scenario.digest(), second.scenario.digest()],
        "state_hashes": [first.state_hash or None, second.state_hash or None],
        "same": comparison.same,
        "incomparable": comparison.incomparable,
        "differences": [asdict(entry) for entry in comparison.differences],
        "expectations": [{**asdict(entry), "difference": entry.difference} for entry in comparison.expected],
        "report": str(file),
    }
