# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a file is a campaign; importable without the models of scenarios and campaigns."""

import re
from collections.abc import Mapping
from pathlib import Path

from satform.scenario.errors import ScenarioError
from satform.scenario.text_file import read_text_file
from satform.scenario.yaml_reader import read_tree

CAMPAIGN = "a campaign"
"""What such a file is called in messages."""

_SATELLITES = re.compile("^satellites[ \\t]*:", re.MULTILINE)
"""The field `satellites` at the top of a file: text that is continued from the line before is indented."""


def is_campaign(path: Path) -> bool:
    """Whether a file is a campaign and no scenario: it names a scenario and has no satellites.

    Args:
        path: of any file; one that cannot be read, or is not YAML, is no campaign.
    """
    try:
        text = read_text_file(path, CAMPAIGN)
        if _SATELLITES.search(text):
            # A scenario, whose text is not parsed twice.
            return False
        tree = read_tree(text, str(path))
    except ScenarioError:
        return False
    return isinstance(tree, Mapping) and "satellites" not in tree and ("scenario" in tree or "runs" in tree)
