# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A campaign's result as JUnit XML, which continuous integration servers read."""

from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, tostring

from satform.files.durable_file import write_durably
from satform_tools import console
from satform_tools.campaign.summary import Summary, interval_text


def write(summary: Summary, file: Path) -> None:
    """Write a test case for each expectation, and one for each failed case of those that are listed.

    An expectation that was missed is a failure; a failed case is skipped, since whether it may fail is for
    the expectations to say; cases without a result are an error.

    Args:
        summary: of the campaign.
        file: to write.

    Raises:
        OSError: it cannot be written.
    """
    suite = Element("testsuite", name=f"satform campaign {summary.campaign.name}")
    properties = SubElement(suite, "properties")
    for name, value in (
        ("digest", summary.folder.manifest.digest),
        ("results_hash", summary.results_hash or ""),
        *summary.folder.manifest.versions.items(),
    ):
        SubElement(properties, "property", name=name, value=value)
    for verdict in summary.verdicts:
        test = _case(suite, summary, verdict.label)
        if not verdict.met:
            found = f"{console.number(verdict.statistic)} {verdict.unit}".strip()
            interval = interval_text(verdict.low, verdict.high, ".7g")
            message = f"expected {verdict.allowed}, found {found}{f' ({interval})' if interval else ''}"
            SubElement(test, "failure", message=_text(message))
    for failed in summary.failures:
        test = _case(suite, summary, f"case {failed.number}")
        SubElement(test, "skipped", message=_text(failed.reason))
        SubElement(test, "system-out").text = summary.command(failed.number)
    more = summary.failed - len(summary.failures)
    if more:
        test = _case(suite, summary, f"{more} more failed cases")
        SubElement(test, "skipped", message="not listed one by one")
    if not summary.complete:
        missing = f"{summary.cases - summary.flown} of {summary.cases} cases have no result"
        test = _case(suite, summary, "all cases are flown")
        SubElement(test, "error", message=_text("; ".join(filter(None, (missing, summary.reason)))))
    for kind in ("failure", "skipped", "error"):
        count = len(suite.findall(f"testcase/{kind}"))
        suite.set({"failure": "failures", "error": "errors"}.get(kind, kind), str(count))
    suite.set("tests", str(len(suite.findall("testcase"))))
    suite.set("time", f"{summary.speed.seconds if summary.speed else 0.0:.3f}")
    write_durably(file, tostring(suite, encoding="utf-8", xml_declaration=True))


def _case(suite: Element, summary: Summary, name: str) -> Element:
    return SubElement(suite, "testcase", classname=summary.campaign.name, name=_text(name), time="0")


def _text(text: str) -> str:
    """Text without the control characters that XML does not have."""
    return "".join(character if character.isprintable() else " " for character in text)
