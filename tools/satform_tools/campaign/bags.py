# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags of the cases of which a campaign retains one: each is flown once more, as ROS 2 nodes in lockstep."""

import shutil
from collections.abc import Iterator
from pathlib import Path

from satform.campaign.cases import case_scenario
from satform.campaign.chunk import fly_case
from satform.campaign.folder import CampaignFolder
from satform.campaign.model import Campaign
from satform.campaign.results import CaseResult
from satform.scenario import Scenario, ScenarioError
from satform_tools import console
from satform_tools.run import command as run_command
from satform_tools.run import dds_preparation

BAGS = "bags"
"""Folder of the runs with bags in the folder of a campaign."""


def prepare(campaign: Campaign) -> None:
    """Check that bags can be recorded here, if the campaign retains any.

    Raises:
        CommandError: they cannot.
    """
    if campaign.keep.bag != "never":
        dds_preparation.prepare(secured=False)


def record(folder: CampaignFolder, campaign: Campaign) -> tuple[str, bool]:
    """Fly the cases whose bag is retained and not there yet.

    Args:
        folder: of the campaign.
        campaign: that is flown there.

    Returns:
        Why bags are missing, in a sentence, empty for none; and whether the user stopped it.

    Raises:
        CommandError: a flight cannot be started.
        OSError: results cannot be read, or a folder cannot be written.
        ResultFileError: a file of results is damaged.
    """
    for result in _wanted(folder, campaign):
        path = folder.path / BAGS / f"case-{result.number:08d}"
        if path.exists():
            continue
        try:
            scenario = case_scenario(campaign, result.number)
        except ScenarioError:
            # Its result says that it cannot be flown.
            continue
        reason, stopped = _fly(path, campaign, result, scenario)
        if reason or stopped:
            return reason, stopped
    return "", False


def _wanted(folder: CampaignFolder, campaign: Campaign) -> Iterator[CaseResult]:
    wanted = campaign.keep.bag
    if wanted != "never":
        yield from (found for found in folder.results() if wanted == "always" or not found.success)


def _fly(path: Path, campaign: Campaign, result: CaseResult, scenario: Scenario) -> tuple[str, bool]:
    draft = path.with_name(f".{path.name}")
    # Of a campaign that was stopped meanwhile.
    shutil.rmtree(draft, ignore_errors=True)
    console.note(f"{campaign.name}: recording the bag of case {result.number}")
    run = run_command.run(scenario, "lockstep", record=True, out=draft)
    if run.stopped:
        shutil.rmtree(draft, ignore_errors=True)
        return "", True
    if run.lost or not (run.complete or run.early_end):
        return f"the bag of case {result.number} is not complete: {run.reason}", False
    alone = result
    if result.stacked:
        # Only a case flown alone has a state hash. Its figures say that it is the same flight.
        alone = fly_case(campaign, result.number)
        if {name: repr(value) for name, value in alone.figures.items()} != {
            name: repr(value) for name, value in result.figures.items()
        }:
            return f"case {result.number} has other figures alone than flown together with others", False
    if alone.state_hash and run.state_hash != alone.state_hash:
        return (
            f"case {result.number} has the state hash {run.state_hash} over DDS, and {alone.state_hash} in "
            "one process"
        ), False
    draft.replace(path)
    return "", False
