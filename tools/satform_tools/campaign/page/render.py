# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Renders the report of a campaign as one HTML file that needs a browser, no network and no other file."""

from satform_tools.campaign.page.charts import charts
from satform_tools.campaign.page.content import page_content
from satform_tools.campaign.study import Study
from satform_tools.campaign.summary import Speed
from satform_tools.report.page.document import rendered


def page_of(study: Study, speed: Speed | None) -> str:
    """The page of a campaign.

    Args:
        study: its statistics.
        speed: how fast it was flown; None where that is not known.

    Returns:
        The HTML file's text.
    """
    return rendered("campaign", page_content(study, speed), {"charts": charts(study)})
