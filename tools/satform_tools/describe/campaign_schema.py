# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Generates the JSON Schema of campaign files from the declarations that also validate them."""

import json
from typing import Any

from satform.campaign.figure import CRITERION
from satform.campaign.model import Campaign
from satform.common.spec import specs
from satform_tools.describe.json_schema import DIALECT, InputSchema


def schema() -> dict[str, Any]:
    """The schema as data."""
    made = Campaign.model_json_schema(schema_generator=InputSchema)
    for metric in specs("satform.metrics").values():
        definition = made["$defs"][metric.__name__]
        definition.pop("anyOf", None)
        for name in CRITERION:
            definition["properties"].pop(name, None)
        # In a scenario it has a default; a measure is chosen by it.
        definition["required"] = sorted({*definition.get("required", []), "kind"})
    return {"$schema": DIALECT, **made}


def text() -> str:
    """The schema as the text of `scenarios/campaign.schema.json`."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"
