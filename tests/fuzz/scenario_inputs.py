# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Damaged files of scenarios and of campaigns, from the shipped ones."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from random import Random

from byte_damage import damaged
from input_kind import Input
from yaml_damage import SNIPPETS, Damage, text, yaml_text

from flights import SCENARIOS
from satform.campaign.cases import case_values
from satform.campaign.loader import load_campaign
from satform.scenario import Scenario, ScenarioError, load_scenario, parse_scenario
from satform.scenario.yaml_reader import plain, read_tree
from satform_tools import console
from satform_tools.check import warnings
from satform_tools.describe import scenario as describe_scenario

_DESCRIBED = 0.05
"""Part of the accepted scenarios that are shown and advised on, which takes ten times as long as reading."""


def _whole(folder: Path) -> tuple[list[Path], Damage]:
    files = sorted(folder.glob("*.yaml"))
    return files, Damage.of(plain(read_tree(file.read_text(encoding="utf-8"), str(file))) for file in files)


def _content(draw: Random, files: list[Path], damage: Damage) -> bytes:
    """A file with changed data, with changed bytes, or of nothing but any bytes."""
    match draw.randrange(10):
        case 0:
            own = text(draw, 300).encode("utf-8", "surrogatepass")
            return draw.choice((own, draw.randbytes(draw.randrange(300))))
        case 1 | 2 | 3:
            return damaged(draw, draw.choice(files).read_bytes(), SNIPPETS, draw.choice((1, 1, 2, 6)))
        case _:
            return yaml_text(damage.changed(draw, draw.choice(damage.data)))


def scenario_inputs(_folder: Path) -> Callable[[Random, Path], Input]:
    """What makes damaged scenarios, and settings laid over whole ones."""
    files, damage = _whole(SCENARIOS)

    def make(draw: Random, place: Path) -> Input:
        described = draw.random() < _DESCRIBED
        if draw.random() < 0.1:
            whole, change = draw.choice(files), damage.setting(draw)
            return Input(lambda: _used(load_scenario(whole, [change]), described), "", (ScenarioError,))
        file = place / "damaged.yaml"
        file.write_bytes(_content(draw, files, damage))
        command = ["check", str(file)]
        return Input(lambda: _used(load_scenario(file), described), file.name, (ScenarioError,), command)

    return make


def _used(scenario: Scenario, described: bool) -> None:
    """Write, show and advise on what was accepted."""
    whole = parse_scenario(scenario.to_json())
    if whole.digest() != scenario.digest():
        raise AssertionError("what was written of it is another scenario")
    if described:
        warnings(scenario)
        json.loads(console.to_json(describe_scenario.describe(scenario)))


def campaign_inputs(folder: Path) -> Callable[[Random, Path], Input]:
    """What makes damaged campaigns, beside whole or damaged scenarios.

    Args:
        folder: for the scenarios that the campaigns name.
    """
    files, damage = _whole(SCENARIOS / "campaigns")
    scenarios, of_scenarios = _whole(SCENARIOS)
    library = folder / "library"
    shutil.copytree(SCENARIOS, library)

    def make(draw: Random, place: Path) -> Input:
        file = place / "damaged.yaml"
        content = _content(draw, files, damage)
        if draw.random() < 0.2:
            scenario = place / "own.yaml"
            scenario.write_bytes(_content(draw, scenarios, of_scenarios))
            tree = damage.changed(draw, draw.choice(damage.data)) if draw.random() < 0.3 else damage.data[0]
            content = yaml_text({**tree, "scenario": scenario.name})
        file.write_bytes(content)
        # What is wrong may be in the scenario.
        return Input(lambda: _sampled(file, library), str(place), (ScenarioError,), ["check", str(file)])

    return make


def _sampled(file: Path, library: Path) -> None:
    """Read a campaign, and what its first and its last case set."""
    campaign = load_campaign(file, library)
    for number in (0, campaign.cases - 1):
        case_values(campaign, number)
