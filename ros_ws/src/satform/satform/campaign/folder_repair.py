# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What is done in a campaign's folder before it is resumed.

Damaged files are put aside, what a killed process left half done is removed, and lost cases are forgotten.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from satform.campaign.folder import CampaignFolder
from satform.campaign.result_files import (
    RESULTS,
    SERIES,
    ResultFile,
    ResultFileError,
    listed_files,
    read_results,
    result_files,
    series_file,
    series_of,
    verify,
    write_results,
)
from satform.campaign.results import CaseResult

DAMAGED = "damaged"
REPLACED = "replaced"


def damaged_files(folder: CampaignFolder) -> list[ResultFileError]:
    """Files among those of results that cannot be used, with the reason; all are read.

    These are files of another name, damaged ones, those of another campaign, and each that has a case
    which an earlier file has, too.

    Raises:
        OSError: a file cannot be read.
    """
    files, found = listed_files(folder.path)
    file_of_case = np.full(folder.manifest.cases, -1, dtype=np.int64)
    for index, file in enumerate(files):
        try:
            numbers = verify(file, folder.manifest.schema)
        except ResultFileError as error:
            found.append(error)
            continue
        twice = numbers[file_of_case[numbers] >= 0]
        if len(twice):
            other = files[file_of_case[twice[0]]].path
            found.append(ResultFileError(file.path, f"has case {twice[0]}, which is in {other}, too"))
        else:
            file_of_case[numbers] = index
    return found


def repair(folder: CampaignFolder) -> int:
    """Move each file that cannot be used out of the results, so that its cases are flown again.

    Returns:
        How many files there were.

    Raises:
        OSError: a file cannot be read or moved.
    """
    damaged = damaged_files(folder)
    for error in damaged:
        (folder.path / DAMAGED).mkdir(exist_ok=True)
        error.path.replace(folder.path / DAMAGED / error.path.name)
    return len(damaged)


def clean(folder: CampaignFolder) -> None:
    """Remove what a killed process left half done; to be called with the folder locked.

    A file that was to be replaced is put back if its cases are in no other file. Files of series that no
    file of results names are removed.

    Raises:
        OSError: a file cannot be read, moved or removed.
        ResultFileError: a file is damaged.
    """
    for path in sorted((folder.path / REPLACED).glob("*.parquet")):
        _settle(folder, path)
    _remove_unused_series(folder)


def _settle(folder: CampaignFolder, aside: Path) -> None:
    """Put a file that was to be replaced back, or remove it where the new one is there."""
    numbers = verify(ResultFile.at(aside), folder.manifest.schema)
    if folder.done()[numbers].any():
        aside.unlink()
    else:
        aside.replace(folder.path / RESULTS / aside.name)


def forget_lost(folder: CampaignFolder) -> int:
    """Remove the results of cases that a timeout or the end of a worker process ended; how many.

    To be called with the folder locked.

    Raises:
        OSError: a file cannot be read or written.
        ResultFileError: a file is damaged.
    """
    count = 0
    for file in result_files(folder.path):
        results = list(read_results(file, folder.manifest.schema))
        rest = [result for result in results if not result.lost]
        if len(rest) < len(results):
            _replace(folder, file, rest)
            count += len(results) - len(rest)
    clean(folder)
    return count


def _remove_unused_series(folder: CampaignFolder) -> None:
    used = {series_file(file) for file in result_files(folder.path)}
    for path in (folder.path / SERIES).glob("*.parquet"):
        if path not in used:
            path.unlink()


def _replace(folder: CampaignFolder, file: ResultFile, results: Sequence[CaseResult]) -> None:
    """Write a file anew with these of its results; without any it is removed.

    The old file leaves the results before the new one is there, so that no case is ever in two files.
    """
    series = dict(series_of(file))
    retained = [replace(result, series=series.get(result.number, {})) for result in results]
    aside = folder.path / REPLACED / file.path.name
    aside.parent.mkdir(exist_ok=True)
    file.path.replace(aside)
    if retained:
        try:
            write_results(folder.path, retained, folder.manifest.schema)
        except OSError:
            # The new one may have its name already, and only its folder could not be synchronised.
            _settle(folder, aside)
            raise
    aside.unlink()
