# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Validates a campaign file: errors, and warnings about cases that cannot fly and what has no effect.

The errors are those of loading (`satform.campaign.campaign_checks`); cases are tried by
`satform.campaign.effects`. Warnings about expectations that cannot be missed or met are made here.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from satform.campaign.effects import case_problems, without_effect
from satform.campaign.expectations import MeanSpec, PercentileSpec, SuccessRateSpec, by_estimate
from satform.campaign.loader import load_campaign
from satform.campaign.model import Campaign
from satform.campaign.sampling import SobolSpec
from satform.scenario import Problem
from satform.scenario.yaml_reader import line_of, read_tree
from satform_tools.run.scenario_library import SCENARIOS

_MOST_CHECKED_CASES = 1_000_000
"""Campaigns with more cases have intervals narrow enough, and are not asked."""


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
    for index, sentence in decided_before(campaign):
        path = ("expect", index)
        found.append(Problem(file, line_of(path, tree), f"expect[{index}]", sentence))
    runs = campaign.cases
    if isinstance(campaign.sampling, SobolSpec) and runs & (runs - 1):
        sentence = (
            f"{runs} runs of a Sobol sequence are less evenly spread than a power of two, such as "
            f"{1 << (runs - 1).bit_length()}"
        )
        found.append(Problem(file, line_of(("runs",), tree), "runs", sentence))
    return found


def decided_before(campaign: Campaign) -> Iterator[tuple[int, str]]:
    """Expectations of the campaign whose verdict is the same whatever the cases give.

    Args:
        campaign: loaded.

    Yields:
        Index of the expectation and a sentence.
    """
    if campaign.cases > _MOST_CHECKED_CASES:
        return
    is_random = campaign.sampling.is_random
    expected = campaign.expect if is_random else map(by_estimate, campaign.expect)
    for index, wanted in enumerate(expected):
        if isinstance(wanted, SuccessRateSpec):
            sentence = _decided_rate(wanted, campaign.cases)
        elif isinstance(wanted, PercentileSpec | MeanSpec) and wanted.compare == "interval":
            # All cases have a figure that is allowed: only the width of the interval can miss.
            value = wanted.above if wanted.above is not None else wanted.below
            figures = {wanted.figure: np.full(campaign.cases, value, dtype=np.float64)}
            met = wanted.verdict(np.ones(campaign.cases, dtype=np.bool_), figures, {}).met
            sentence = "" if met else f"cannot be met: {campaign.cases} cases are too few for its interval"
        else:
            sentence = ""
        if sentence:
            yield index, sentence


def _decided_rate(wanted: SuccessRateSpec, cases: int) -> str:
    """Why a success rate is met or missed whatever the cases give; empty where it depends on them."""
    none, every = (
        wanted.verdict(np.full(cases, success, dtype=np.bool_), {}, {}) for success in (False, True)
    )
    if none.met and every.met:
        return "cannot be missed: it is met if no case succeeds, and if all do"
    if wanted.compare == "estimate":
        return ""
    if wanted.above is not None and every.low < wanted.above:
        what, limit = "all succeed, the lower", every.low
    elif wanted.below is not None and none.high > wanted.below:
        what, limit = "none succeeds, the upper", none.high
    else:
        return ""
    return (
        f"cannot be met with {cases} cases: if {what} limit of the {100 * wanted.confidence:g} % interval is "
        f"{limit:.4g}; use more runs, or compare: estimate"
    )


def _about(index: int | None, sentence: str, tree: object, file: str) -> Problem:
    if index is None:
        return Problem(file, line_of(("dispersions",), tree), "dispersions", sentence)
    return Problem(file, line_of(("dispersions", index), tree), f"dispersions[{index}]", sentence)
