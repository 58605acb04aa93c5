# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Validates a campaign file: errors, and warnings about cases that cannot fly and what has no effect."""

from pathlib import Path

from satform.campaign.effects import case_problems, without_effect
from satform.campaign.loader import load_campaign
from satform.campaign.model import Campaign
from satform.campaign.sampling import SobolSpec
from satform.scenario import Problem
from satform.scenario.yaml_reader import line_of, read_tree
from satform_tools.run.scenario_library import SCENARIOS


def check(path: Path, file: str) -> list[Problem]:
    """Check a campaign.

    Args:
        path: of its file.
        file: name to use in messages.

    Returns:
        Warnings, with the line that each is about.

    Raises:
        ScenarioError: it or its scenario cannot be flown; all problems at once.
    """
    campaign = load_campaign(path, SCENARIOS)
    tree = read_tree(path.read_text(encoding="utf-8"), file)
    return warnings(campaign, tree, file)


def warnings(campaign: Campaign, tree: object, file: str) -> list[Problem]:
    """What is valid but unwise about a campaign.

    Args:
        campaign: loaded.
        tree: of its file, which knows the lines.
        file: name to use in messages.
    """
    found: list[Problem] = []
    for index, sentence in case_problems(campaign):
        found.append(_about(index, f"some cases cannot fly: {sentence}", tree, file))
    for index, sentence in without_effect(campaign):
        found.append(_about(index, sentence, tree, file))
    runs = campaign.cases
    if isinstance(campaign.sampling, SobolSpec) and runs & (runs - 1):
        sentence = (
            f"{runs} runs of a Sobol sequence are less evenly spread than a power of two, such as "
            f"{1 << (runs - 1).bit_length()}"
        )
        found.append(Problem(file, line_of(("runs",), tree), "runs", sentence))
    return found


def _about(index: int | None, sentence: str, tree: object, file: str) -> Problem:
    if index is None:
        return Problem(file, line_of(("dispersions",), tree), "dispersions", sentence)
    return Problem(file, line_of(("dispersions", index), tree), f"dispersions[{index}]", sentence)
