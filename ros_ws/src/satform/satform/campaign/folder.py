# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The folder of a campaign: what is flown, by which software, and which cases have results.

manifest.json     name, digest, number of cases, columns, versions
campaign.json     the campaign as it was started, with scenario.json and copies of the files that it names
results/          Parquet files, see `result_files`
series/           retained series, likewise
records/          retained records, a folder for each case
bags/             runs with retained bags, a folder for each case
report/           page of the campaign
summary.json      outcome, figures and checks, as `--json` prints them
workers.log       what the workers printed
damaged/          damaged files of results that a repair has put aside
replaced/         files of results that are being written anew without their lost cases
"""

import fcntl
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from satform.campaign.chunk import columns_of
from satform.campaign.loader import load_campaign, save_campaign
from satform.campaign.manifest import MANIFEST, FolderError, Manifest
from satform.campaign.model import Campaign
from satform.campaign.result_files import ResultFile, all_results, read_results, result_files
from satform.campaign.results import CaseResult, ResultsHash
from satform.campaign.software import software
from satform.common.name_list import listed
from satform.files.durable_file import write_durably
from satform.scenario import ScenarioError

RECORDS = "records"
LOCK = ".lock"


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Keep other processes from flying a campaign in a folder.

    Args:
        path: existing folder of a campaign, or one in which a campaign is to be started.

    Raises:
        FolderError: another process has the lock.
        OSError: the folder cannot be written.
    """
    descriptor = os.open(path / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            owner = os.read(descriptor, 32).decode(errors="replace").strip()
            process = f"process {owner}" if owner else "another process"
            raise FolderError(f"{path}: {process} is flying a campaign in this folder") from None
        os.ftruncate(descriptor, 0)
        os.write(descriptor, f"{os.getpid()}\n".encode())
        yield
    finally:
        # Closing it releases the lock, and so does the end of the process.
        os.close(descriptor)


@dataclass(frozen=True)
class CampaignFolder:
    """The folder of a campaign.

    Attributes:
        path: of the folder.
        manifest: of its results.
    """

    path: Path
    manifest: Manifest

    @classmethod
    def create(cls, path: Path, campaign: Campaign, file: Path | None, started: str) -> "CampaignFolder":
        """Write what is to be flown into an empty folder, which the caller has `locked`.

        Args:
            path: existing folder, with nothing in it but the lock.
            campaign: to be flown.
            file: from which it was loaded.
            started: time of the start, UTC, ISO 8601.

        Raises:
            FolderError: there is something in it.
            OSError: it cannot be written.
        """
        if any(entry.name != LOCK for entry in path.iterdir()):
            raise FolderError(f"{path}: is not an empty folder; name another")
        save_campaign(campaign, path)
        source = "" if file is None else str(file.absolute())
        manifest = Manifest(
            campaign.name, source, campaign.digest, campaign.cases, columns_of(campaign), software(), started
        )
        # The last one: a folder with a manifest is complete.
        write_durably(path / MANIFEST, f"{json.dumps(manifest.data(), indent=1)}\n".encode())
        return cls(path, manifest)

    @classmethod
    def open(cls, path: Path) -> "CampaignFolder":
        """Open the folder of a campaign.

        Raises:
            FolderError: it is not the folder of a campaign.
        """
        if not path.is_dir():
            raise FolderError(f"{path}: there is no such folder")
        return cls(path, Manifest.read(path / MANIFEST))

    def campaign(self) -> Campaign:
        """The campaign as it was started.

        Raises:
            FolderError: its file was changed since, or the manifest is of another campaign.
            ScenarioError: its file is not a campaign any more.
        """
        campaign = load_campaign(self.path / "campaign.json")
        self.require(campaign, self.path / "campaign.json")
        manifest, names = self.manifest, campaign.figure_names
        if (manifest.cases, manifest.columns.figures) != (campaign.cases, names) or not set(
            manifest.columns.judged
        ) <= set(names):
            raise FolderError(
                f"{self.path / MANIFEST}: has {manifest.cases} cases with the figures "
                f"{listed(manifest.columns.figures)}; the campaign has {campaign.cases} with {listed(names)}"
            )
        return campaign

    def require(self, campaign: Campaign, file: Path) -> None:
        """Check that a campaign is the one that is flown here.

        Args:
            campaign: loaded.
            file: that it was loaded from.

        Raises:
            FolderError: it is another one, or it or its scenario was changed.
        """
        if campaign.digest != self.manifest.digest:
            raise FolderError(
                f"{file}: the campaign or its scenario is not the one that was started in {self.path}: its "
                f"digest is {campaign.digest[:16]}, there it was {self.manifest.digest[:16]}"
            )

    def require_source(self, library: Path | None = None) -> None:
        """Check that the file from which the campaign was started still has the same campaign, if it exists.

        Args:
            library: folder of the shipped scenarios.

        Raises:
            FolderError: it has changed.
        """
        file = Path(self.manifest.file)
        if not self.manifest.file or not file.is_file():
            return
        try:
            self.require(load_campaign(file, library), file)
        except ScenarioError as error:
            raise FolderError(f"{file}: the campaign has changed since it was started: {error}") from None

    def other_software(self) -> str:
        """How the software that runs now differs from that of the results, in words; empty if it does not."""
        now, then = software(), self.manifest.versions
        changed = [name for name in {**then, **now} if now.get(name) != then.get(name)]
        return ", ".join(f"{name} {then.get(name)} then, {now.get(name)} now" for name in changed)

    def require_software(self) -> None:
        """Check that results of the software that runs now fit those in the folder.

        Raises:
            FolderError: they may have other bits.
        """
        differences = self.other_software()
        if differences:
            raise FolderError(
                f"{self.path}: its results are of other software, whose bits may differ ({differences}); "
                "start the campaign in a new folder"
            )

    def done(self) -> NDArray[np.bool_]:
        """Which cases have a result, shape (cases,).

        Raises:
            OSError: a file cannot be read.
            ResultFileError: a file is damaged.
        """
        done = np.zeros(self.manifest.cases, dtype=np.bool_)
        for file in result_files(self.path):
            for result in read_results(file, self.manifest.schema):
                done[result.number] = True
        return done

    def results(self, files: Sequence[ResultFile] | None = None) -> Iterator[CaseResult]:
        """All results in order of their numbers, without series.

        Args:
            files: that are read, in the order of `result_files`; None for all that are in the folder now.

        Raises:
            OSError: a file cannot be read.
            ResultFileError: a file is damaged.
        """
        return all_results(self.path, self.manifest.schema, files)

    def result(self, number: int) -> CaseResult | None:
        """The result of a case, without series; None where it has none.

        Raises:
            OSError: a file cannot be read.
            ResultFileError: a file is damaged.
        """
        files = [file for file in result_files(self.path) if file.first <= number <= file.last]
        return next((result for result in self.results(files) if result.number == number), None)

    def results_hash(self) -> str:
        """Hash over all results, equal however and wherever they were flown.

        Raises:
            OSError: a file cannot be read.
            ResultFileError: a file is damaged.
        """
        found = ResultsHash(self.manifest.columns)
        for result in self.results():
            found.add(result)
        return found.hexdigest()
