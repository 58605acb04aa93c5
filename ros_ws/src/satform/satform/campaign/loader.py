# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""From a YAML file to a `Campaign`, or to all that is wrong with it."""

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from satform.campaign.campaign_checks import change_complaints
from satform.campaign.campaign_file import CAMPAIGN, is_campaign
from satform.campaign.model import Campaign
from satform.campaign.paths import PathError, targets
from satform.campaign.scenario_file import CampaignSource
from satform.common.spec import Complaint
from satform.files.durable_file import write_durably
from satform.scenario import Problem, ScenarioError, load_scenario, save_scenario
from satform.scenario.field_errors import coerced, dotted, problems
from satform.scenario.loader import SCENARIO_FILE
from satform.scenario.text_file import first_problems, read_text_file
from satform.scenario.yaml_reader import line_of, plain, read_mapping


def load_campaign(path: str | Path, library: Path | None = None) -> Campaign:
    """Read and check a campaign file.

    Args:
        path: the YAML file; the scenario that it names counts from its folder.
        library: folder of the shipped scenarios, in which a name is looked for that is in neither the folder
            of the file nor the folder above.

    Returns:
        The campaign, complete and consistent.

    Raises:
        ScenarioError: the file or its scenario cannot be read or cannot fly; all problems at once.
    """
    text = read_text_file(path, CAMPAIGN)
    return parse_campaign(text, str(path), CampaignSource(Path(path).parent, library=library))


def parse_campaign(text: str, file: str = "<text>", source: CampaignSource | None = None) -> Campaign:
    """Check the text of a campaign.

    Args:
        text: YAML 1.2.
        file: the name to use in messages.
        source: where its scenario is looked for; the working directory when left out.

    Returns:
        The campaign, complete and consistent.

    Raises:
        ScenarioError: the text is no campaign that can be flown; all problems at once.
    """
    tree = read_mapping(text, file, "a campaign is a mapping of fields such as scenario, runs, dispersions")
    data = plain(tree)
    try:
        campaign = Campaign.model_validate(data, context=source or CampaignSource())
    except ValidationError as error:
        found = _all_problems(error, data, tree, file, source or CampaignSource())
    else:
        found = coerced(data, campaign.model_dump(exclude_unset=True), tree, file, {})
        if not found:
            return campaign
    found.sort(key=lambda problem: (problem.file != file, problem.line or 0))
    raise ScenarioError(first_problems(found))


def _all_problems(
    error: ValidationError, data: Any, tree: Any, file: str, source: CampaignSource
) -> list[Problem]:
    """What the check of a campaign found, and what it could not look for because of that."""
    found: list[Problem] = []
    every = error.errors(include_url=False)
    for details in every:
        if details["type"] == "scenario":
            found += _problems_of_the_scenario(details["ctx"]["problems"], data, tree, file, source)
        else:
            found += problems(details, Campaign, data, tree, file, {})
    if not any(details["type"] == "inconsistent" for details in every):
        # A wrong field keeps the model from comparing the fields with each other, and with the scenario.
        found += [
            Problem(file, line_of(path, tree), dotted(path), sentence)
            for path, sentence in _scenario_complaints(data, source)
        ]
    return found


def _problems_of_the_scenario(
    found: list[Problem], data: Any, tree: Any, file: str, source: CampaignSource
) -> list[Problem]:
    """What is wrong with the scenario's file; one sentence where it is no scenario's file at all."""
    path, line = source.find(str(data["scenario"])), line_of(("scenario",), tree)
    if all(problem.line is None and not problem.field for problem in found):
        # It could not be read: what is wrong is its name, here.
        return [Problem(file, line, "scenario", str(problem)) for problem in found]
    if is_campaign(path):
        sentence = f"{path} is a campaign itself; name the scenario that it disperses"
        return [Problem(file, line, "scenario", sentence)]
    return found


def _scenario_complaints(data: Any, source: CampaignSource) -> list[Complaint]:
    """Changes that the scenario does not take and paths that lead nowhere, of data that is no campaign."""
    changes, dispersions = data.get("set"), data.get("dispersions")
    changes = changes if isinstance(changes, dict) else {}
    try:
        scenario = load_scenario(source.find(str(data.get("scenario", ""))))
    except ValueError:
        # The check of the field `scenario` has said so.
        return []
    try:
        scenario = scenario.with_(changes) if changes else scenario
    except ScenarioError as error:
        return change_complaints(error, changes)
    complaints: list[Complaint] = []
    for index, dispersion in enumerate(dispersions if isinstance(dispersions, list) else ()):
        path = dispersion.get("path") if isinstance(dispersion, dict) else None
        try:
            targets(scenario, path if isinstance(path, str) else "seed")
        except PathError as error:
            complaints.append((("dispersions", index, "path"), str(error)))
    return complaints


def save_campaign(campaign: Campaign, folder: Path) -> Path:
    """Write a campaign and its scenario, with copies of the files that it names, into a folder.

    Args:
        campaign: to be written.
        folder: that exists.

    Returns:
        The campaign's file, from which a campaign with the same cases and digest is loaded.

    Raises:
        OSError: it cannot be written.
    """
    save_scenario(campaign.scenario.scenario, folder / SCENARIO_FILE)
    path = folder / "campaign.json"
    renamed = campaign.model_copy(update={"scenario": campaign.scenario.renamed(SCENARIO_FILE)})
    write_durably(path, renamed.model_dump_json(indent=1, exclude_unset=True).encode())
    return path
