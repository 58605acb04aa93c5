# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns by name or path: shipped ones, files, and folders of campaigns under way."""

from pathlib import Path

from satform.campaign.folder import CampaignFolder
from satform.campaign.loader import load_campaign
from satform.campaign.manifest import MANIFEST, FolderError
from satform.campaign.model import Campaign
from satform.files.bounded_file import is_file
from satform_tools.errors import CommandError
from satform_tools.run import shipped_files
from satform_tools.run.scenario_library import SCENARIOS

CAMPAIGNS = SCENARIOS / "campaigns"
"""Folder of the shipped campaigns."""


def names() -> list[str]:
    """Names of the shipped campaigns."""
    return shipped_files.names(CAMPAIGNS)


def find(campaign: str) -> Path:
    """The file of a campaign.

    Args:
        campaign: name of a shipped one, path of a file, or of the folder of a campaign.

    Returns:
        The file, whether or not it exists.

    Raises:
        CommandError: nothing of that name is known.
    """
    if is_folder_of(campaign):
        return Path(campaign) / "campaign.json"
    otherwise = "the path of a YAML file, or the folder of a campaign"
    return shipped_files.find(campaign, CAMPAIGNS, "campaign", otherwise)


def load(campaign: str) -> tuple[Campaign, Path]:
    """Load a campaign.

    Args:
        campaign: as for `find`.

    Returns:
        The campaign and its file.

    Raises:
        CommandError: nothing of that name is known, or the copy in the folder of a campaign was changed.
        ScenarioError: it or its scenario cannot be flown.
    """
    file = find(campaign)
    if not is_folder_of(campaign):
        return load_campaign(file, SCENARIOS), file
    try:
        return opened(file.parent).campaign(), file
    except FolderError as error:
        raise CommandError(str(error)) from None


def is_folder_of(campaign: str) -> bool:
    """Whether the name of a campaign, as for `find`, is that of its folder."""
    return campaign not in names() and is_folder(Path(campaign))


def is_folder(path: Path) -> bool:
    """Whether a path is the folder of a campaign."""
    return is_file(path / MANIFEST)


def opened(path: Path) -> CampaignFolder:
    """The folder of a campaign.

    Raises:
        CommandError: it is none.
    """
    try:
        return CampaignFolder.open(path)
    except FolderError as error:
        raise CommandError(str(error)) from None


def newest_folder(file: Path, runs: Path) -> CampaignFolder:
    """The newest folder of a campaign that was started from a file.

    Args:
        file: of the campaign.
        runs: folder of the folders.

    Raises:
        CommandError: there is none.
    """
    found = []
    for manifest in runs.glob(f"*/{MANIFEST}"):
        try:
            folder = CampaignFolder.open(manifest.parent)
        except FolderError:
            continue
        if folder.manifest.file == str(file.absolute()):
            found.append((folder.manifest.started, str(folder.path), folder))
    if not found:
        raise CommandError(
            f"no campaign in {runs} was started from {file}; name its folder, or start it with: "
            f"satform campaign run {file}"
        )
    return max(found)[2]
