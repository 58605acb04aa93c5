# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns made in tests."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

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


SHORT_DURATIONS = {
    "triangle_dispersed": 60.0,
    "noisy_navigation_dispersed": 60.0,
    "lossy_links_sweep": 1000.0,
    "gain_sweep": 40.0,
}
"""Durations of shipped campaigns for tests that fly some of their cases, s."""


def shortened_campaign(name: str, folder: Path, series: Sequence[str] = ()) -> Path:
    """File of a shipped campaign with a short duration.

    Figures at a time or after one are those of the middle of the flight or after it.

    Args:
        name: of the campaign.
        folder: existing one, for the file.
        series: further quantities that are retained, of every step.
    """
    data = YAML(typ="safe").load((CAMPAIGNS / f"{name}.yaml").read_text())
    data["scenario"] = str(SCENARIOS / f"{data['scenario']}.yaml")
    duration = SHORT_DURATIONS[name]
    data["set"]["timing.duration"] = duration
    for measure in (*data["set"]["expect"], *(figure["measure"] for figure in data["figures"])):
        measure.update({key: 0.5 * duration for key in ("at", "after") if key in measure})
    keep = data.setdefault("keep", {})
    known = [own for own in keep.get("series", []) if own["quantity"] not in series]
    keep["series"] = [*known, *({"quantity": quantity} for quantity in series)]
    file = folder / f"{name}.yaml"
    file.write_text(json.dumps(data))
    return file
