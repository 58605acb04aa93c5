# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""One case of a campaign as a run of its own."""

from contextlib import suppress
from pathlib import Path

from satform.files.durable_file import write_durably
from satform.scenario import Scenario
from satform_tools import console
from satform_tools.campaign import library
from satform_tools.run import output_folders

CASE = "case.json"
"""In the folder of a run: of which campaign it is a case, and what that sets."""


def prepare(name: str, number: int, out: Path | None) -> tuple[Scenario, Path]:
    """The scenario of a case, and the folder of its run.

    Args:
        name: of the campaign, its file or its folder.
        number: of the case.
        out: folder, new or empty; None for a new one in `runs`.

    Returns:
        The scenario, and the folder, which exists and is empty.

    Raises:
        CommandError: there is no such case, or the folder cannot be written.
        ScenarioError: the case cannot be flown.
    """
    campaign, _ = library.load(name)
    scenario = library.case(campaign, number)
    return scenario, output_folders.make(out, f"{campaign.name}-case-{number}")


def describe(name: str, number: int, folder: Path) -> None:
    """Write into the folder of a run of which campaign it is a case, where there is room for that.

    Args:
        name: of the campaign, its file or its folder.
        number: of the case.
        folder: of the run.
    """
    campaign, file = library.load(name)
    about = {
        "campaign": campaign.name,
        "file": str(file.absolute()),
        "digest": campaign.digest,
        "case": number,
        "changes": library.values(campaign, number),
    }
    with suppress(OSError):
        write_durably(folder / CASE, f"{console.to_json(about)}\n".encode())
