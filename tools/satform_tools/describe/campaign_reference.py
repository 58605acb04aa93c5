# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of everything that a campaign may say, from the one declaration that also checks it."""

from satform.campaign.model import Campaign
from satform_tools.describe.field_text import CAMPAIGN_GROUPS
from satform_tools.describe.scenario_reference import page

_INTRODUCTION = """# Campaign reference

Every field of a campaign file, as it is declared in the code, by which files are checked and editors complete
them. Made by `./tools/satform schema --campaign --markdown > docs/campaign_reference.md`. How a campaign is
written: [campaigns](campaigns.md). Fields of the scenario that it disperses: [scenario
reference](scenario_reference.md).

- Quantities have the unit of the field that is dispersed, SI and radians. Where that field takes an angle as
  text, such as `"45 deg"` or `"0.06 deg/s"`, so do its values here.
- No number is infinite. Where no bounds are given, it lies between -1e15 and 1e15.
- A field without a default is required; one with the default *none* is optional.
- A `kind` is a name under which a package has registered a part ([entry
  points](../ros_ws/src/satform/README.md#entry-points)). This page has the kinds of the project itself.
"""


def text() -> str:
    """The text of `docs/campaign_reference.md`."""
    made = page(_INTRODUCTION, Campaign, "Campaign", CAMPAIGN_GROUPS)
    return made.replace("](#metrics)", "](scenario_reference.md#metrics)")
