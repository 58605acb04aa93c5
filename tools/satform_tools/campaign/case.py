# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""One case of a campaign as a run of its own."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from satform.campaign.cases import case_values, changed_scenario
from satform.campaign.folder import CampaignFolder
from satform.campaign.model import Campaign
from satform.campaign.result_files import ResultFileError
from satform.files.durable_file import write_durably
from satform.scenario import Scenario
from satform_tools import console
from satform_tools.campaign import library
from satform_tools.errors import CommandError, sentence_of
from satform_tools.run import output_folders

CASE = "case.json"
"""In the folder of a run: of which campaign it is a case, and what that sets."""


@dataclass(frozen=True)
class Case:
    """A case of a campaign.

    Attributes:
        campaign: that it belongs to.
        file: of the campaign.
        number: of the case.
        changes: values by path of the scenario's field.
    """

    campaign: Campaign
    file: Path
    number: int
    changes: dict[str, Any]

    def scenario(self) -> Scenario:
        """The scenario with the changes of the case.

        Raises:
            ScenarioError: it cannot be flown.
        """
        return changed_scenario(self.campaign, self.changes, f"case {self.number}")

    def make_folder(self, out: Path | None) -> Path:
        """The folder of its run, which exists and is empty.

        Args:
            out: folder, new or empty; None for a new one in `runs`.

        Raises:
            CommandError: it cannot be written.
        """
        return output_folders.make(out, f"{self.campaign.name}-case-{self.number}")

    def describe(self, folder: Path) -> None:
        """Write into the folder of its run of which campaign it is a case, where there is room for that."""
        about = {
            "campaign": self.campaign.name,
            "file": str(self.file.absolute()),
            "digest": self.campaign.digest,
            "case": self.number,
            "changes": self.changes,
        }
        with suppress(OSError):
            write_durably(folder / CASE, f"{console.to_json(about)}\n".encode())


def load(name: str, number: int) -> Case:
    """A case of a campaign, with the values that its folder has where a folder is named.

    Args:
        name: of the campaign, its file or its folder.
        number: of the case.

    Raises:
        CommandError: there is no such case, or the folder cannot be used.
        ScenarioError: the campaign or its scenario cannot be flown.
    """
    campaign, file = library.load(name)
    if not 0 <= number < campaign.cases:
        raise CommandError(f"there is no case {number}: {campaign.name} has cases 0 to {campaign.cases - 1}")
    changes = case_values(campaign, number)
    if library.is_folder_of(name):
        changes = _as_stored(library.opened(file.parent), number, changes)
    return Case(campaign, file, number, changes)


def _as_stored(folder: CampaignFolder, number: int, computed: dict[str, Any]) -> dict[str, Any]:
    """The changes of a case that is flown again: those of its result, where it has one."""
    differences = folder.other_software()
    if differences:
        console.note(
            f"{folder.path}: its results are of other software ({differences}); case {number}, flown again, "
            "may have other bits"
        )
    try:
        result = folder.result(number)
    except (OSError, ResultFileError) as error:
        raise CommandError(sentence_of(error) if isinstance(error, OSError) else str(error)) from None
    if result is None or result.changes == computed:
        return computed
    count = sum(result.changes.get(path) != value for path, value in computed.items())
    console.note(
        f"case {number}: {count} of {len(computed)} values are computed otherwise on this machine; those "
        f"stored in {folder.path} are used"
    )
    return dict(result.changes)
