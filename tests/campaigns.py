# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns made in tests."""

from typing import Any

from flights import SCENARIOS
from satform.campaign.model import Campaign
from satform.campaign.scenario_file import CampaignSource

CAMPAIGNS = SCENARIOS / "campaigns"
SHIPPED = sorted(path.stem for path in CAMPAIGNS.glob("*.yaml"))


def campaign(scenario: str = "triangle", **fields: Any) -> Campaign:
    """A campaign of a shipped scenario."""
    source = CampaignSource(CAMPAIGNS)
    return Campaign.model_validate({"scenario": scenario, "seed": 1, **fields}, context=source)


def of(path: str, distribution: Any = None, **fields: Any) -> dict[str, Any]:
    """A dispersion as the file has it."""
    drawn = {} if distribution is None else {"distribution": distribution}
    return {"path": path, **drawn, **fields}
