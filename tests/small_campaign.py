# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A campaign of some short flights, and its command."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from flights import SCENARIOS
from satform.campaign.chunk import columns_of, fly_chunk
from satform.campaign.loader import load_campaign
from satform.campaign.results import ResultsHash
from satform_tools.cli import main as cli

_SMALL = """
name: small
title: Some short flights
scenario: triangle.yaml
runs: {runs}
seed: 7
set:
  timing.duration: {duration}
  expect: [{{kind: arc_length_spread, at: 4.0, below: 50.0e3, source: a test}}]
dispersions:
  - path: satellites[*].arc_length
    distribution: {{kind: uniform, low: -15.0e3, high: 15.0e3}}
    applied: add
figures: [{{name: effort, measure: {{kind: delta_v}}}}]
expect: [{{kind: success_rate, above: {above}, compare: estimate, source: a test}}]
{more}
"""


def write_campaign(
    folder: Path, *, runs: int = 12, duration: float = 4.0, above: float = 0.0, more: str = ""
) -> Path:
    """The file of a campaign, with its scenario beside it."""
    shutil.copy(SCENARIOS / "triangle.yaml", folder)
    file = folder / "small.yaml"
    file.write_text(_SMALL.format(runs=runs, duration=duration, above=above, more=more))
    return file


def campaign_command(capsys: pytest.CaptureFixture[str], *words: str | Path) -> tuple[int, str, str]:
    """Exit code, output and errors of `satform campaign`."""
    code = cli.main(["campaign", *map(str, words)])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def campaign_summary(capsys: pytest.CaptureFixture[str], *words: str | Path) -> dict[str, Any]:
    """What `satform campaign --json` prints."""
    _, out, err = campaign_command(capsys, *words, "--json")
    assert out, err
    found: dict[str, Any] = json.loads(out)
    return found


def results_hash(file: Path) -> str:
    """The hash over all results of a campaign, flown in this process alone."""
    campaign = load_campaign(file)
    found = ResultsHash(columns_of(campaign))
    for result in fly_chunk(campaign, range(campaign.cases)):
        found.add(columns_of(campaign).complete(result))
    return found.hexdigest()
