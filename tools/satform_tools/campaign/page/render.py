# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Renders the report of a campaign as one HTML file that needs a browser, no network and no other file."""

from pathlib import Path

from satform_tools.campaign.page.charts import charts
from satform_tools.campaign.page.content import page_content
from satform_tools.campaign.report_statistics import ReportStatistics
from satform_tools.campaign.summary import Speed
from satform_tools.report.page.document import rendered


def page_of(statistics: ReportStatistics, speed: Speed | None) -> str:
    """The page of a campaign.

    Args:
        statistics: of the campaign.
        speed: how fast it was flown; None where that is not known.

    Returns:
        The HTML file's text.
    """
    folder = Path(__file__).parent
    return rendered("campaign", page_content(statistics, speed), {"charts": charts(statistics)}, folder)
