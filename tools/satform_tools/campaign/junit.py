# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A campaign's result as JUnit XML: test cases for the flights, the expectations and the failed cases."""

from collections.abc import Iterator
from pathlib import Path

from satform.campaign.expectations import CampaignVerdict
from satform_tools import console
from satform_tools.campaign.summary import Summary, interval_text
from satform_tools.report import junit
from satform_tools.report.junit import CAMPAIGN_SUITE, FLIGHTS, Case, Suite


def write(summary: Summary, file: Path | None) -> None:
    """Write a test case for all flights, for each expectation, and for each failed case of those listed.

    An expectation that was missed is a failure; a failed case is skipped, since whether it may fail is for
    the expectations to say; cases without a result are an error.

    Args:
        summary: of the campaign.
        file: to write; None for none.

    Raises:
        CommandError: it cannot be written.
    """
    name, seconds = summary.campaign.name, summary.speed.seconds if summary.speed else 0.0
    suite = Suite(
        name=f"{CAMPAIGN_SUITE} {name}",
        classname=name,
        cases=[_flights(summary, seconds), *map(_judged, summary.verdicts), *_failed(summary)],
        properties={
            "digest": summary.folder.manifest.digest,
            "results_hash": summary.results_hash or "",
            **summary.folder.manifest.versions,
        },
        seconds=seconds,
        output=f"{summary.flown} of {summary.cases} cases flown, stored in {summary.folder.path}",
    )
    junit.write(suite, file)


def _flights(summary: Summary, seconds: float) -> Case:
    if summary.complete and not summary.reason:
        return Case(FLIGHTS, seconds=seconds)
    missing = f"{summary.cases - summary.flown} of {summary.cases} cases have no result"
    message = "; ".join(filter(None, ("" if summary.complete else missing, summary.reason)))
    return Case(FLIGHTS, "error", message, "stopped" if summary.stopped else "lost", seconds=seconds)


def _judged(verdict: CampaignVerdict) -> Case:
    if verdict.met:
        return Case(verdict.label)
    found = f"{console.number(verdict.statistic)} {verdict.unit}".strip()
    interval = interval_text(verdict.low, verdict.high, ".7g")
    message = f"expected {verdict.allowed}, found {found}{f' ({interval})' if interval else ''}"
    return Case(verdict.label, "failure", message, "missed")


def _failed(summary: Summary) -> Iterator[Case]:
    for failed in summary.failures:
        command = summary.command(failed.number)
        yield Case(f"case {failed.number}", "skipped", failed.reason, text=command)
    more = summary.failed - len(summary.failures)
    if more:
        yield Case(f"{more} more failed cases", "skipped", "not listed one by one")
