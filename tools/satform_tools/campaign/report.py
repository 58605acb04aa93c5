# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the report of a campaign: the page, and what is exported besides."""

import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from satform_tools.campaign.summary import Speed, Summary
from satform_tools.report.formats import Format

REPORT = "report"
"""Folder of the report in that of a campaign."""

PAGE = "report.html"

SUMMARY = "summary.json"
"""What came of a campaign when it was flown, in its folder."""


def write(summary: Summary, folder: Path, formats: Sequence[Format] = ()) -> list[Path]:
    """Write the page of a campaign, and its exports.

    Args:
        summary: of the campaign, complete or under way.
        folder: of the report; made where it is missing.
        formats: figures as PNG, SVG or PDF, the results of all cases as CSV or Parquet.

    Returns:
        The files; the page is the first.

    Raises:
        OSError: a file cannot be written or read.
        ResultFileError: a file of results is damaged.
    """
    # The template engine and scipy are slow to import.
    from satform_tools.campaign.page.render import page_of  # noqa: PLC0415
    from satform_tools.campaign.report_statistics import report_statistics  # noqa: PLC0415

    found = report_statistics(summary)
    folder.mkdir(parents=True, exist_ok=True)
    page = folder / PAGE
    page.write_text(page_of(found, summary.speed or stored_speed(summary.folder.path)), encoding="utf-8")
    if not formats:
        return [page]
    from satform_tools.campaign.exports import export  # noqa: PLC0415 - matplotlib takes long to load

    return [page, *export(found, folder, formats)]


def stored_speed(folder: Path) -> Speed | None:
    """How fast the cases were flown by the last command that flew some; None where that is not known."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        data = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))["speed"]
        return Speed(int(data["cases"]), float(data["seconds"]), int(data["workers"]), str(data["engine"]))
    return None
