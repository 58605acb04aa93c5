# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""One case of a campaign as a run of its own."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from satform.campaign.model import Campaign
from satform.files.durable_file import write_durably
from satform.scenario import Scenario
from satform_tools import console
from satform_tools.campaign import library
from satform_tools.run import output_folders

CASE = "case.json"
"""In the folder of a run: of which campaign it is a case, and what that sets."""


@dataclass(frozen=True)
class PreparedCase:
    """A case that is about to be flown as a run.

    Attributes:
        campaign: that it belongs to.
        file: of the campaign.
        number: of the case.
        scenario: with the changes of the case.
        folder: of its run; it exists and is empty.
    """

    campaign: Campaign
    file: Path
    number: int
    scenario: Scenario
    folder: Path

    def describe(self) -> None:
        """Write into the folder of the run of which campaign it is a case, where there is room for that."""
        about = {
            "campaign": self.campaign.name,
            "file": str(self.file.absolute()),
            "digest": self.campaign.digest,
            "case": self.number,
            "changes": library.values(self.campaign, self.number),
        }
        with suppress(OSError):
            write_durably(self.folder / CASE, f"{console.to_json(about)}\n".encode())


def prepare(name: str, number: int, out: Path | None) -> PreparedCase:
    """The scenario of a case, and the folder of its run.

    Args:
        name: of the campaign, its file or its folder.
        number: of the case.
        out: folder, new or empty; None for a new one in `runs`.

    Raises:
        CommandError: there is no such case, or the folder cannot be written.
        ScenarioError: the case cannot be flown.
    """
    campaign, file = library.load(name)
    scenario = library.case(campaign, number)
    folder = output_folders.make(out, f"{campaign.name}-case-{number}")
    return PreparedCase(campaign, file, number, scenario, folder)
