# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The folder of a campaign: what is flown, by which software, and which cases have results.

manifest.json     name, digest, number of cases, columns, versions
campaign.json     the campaign as it was started, with scenario.json and copies of the files that it names
results/          Parquet files, see `result_files`
series/           retained series, likewise
records/          retained records, a folder for each case
damaged/          damaged files of results that a repair has put aside
replaced/         files of results that are being written anew without their lost cases
"""

import fcntl
import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from satform.campaign.chunk import columns_of
from satform.campaign.engine import MOST_SERIES_BYTES
from satform.campaign.loader import load_campaign, save_campaign
from satform.campaign.model import Campaign
from satform.campaign.result_files import (
    RESULTS,
    SERIES,
    ResultFile,
    ResultFileError,
    ResultSchema,
    all_results,
    listed_files,
    read_results,
    result_files,
    series_file,
    series_of,
    verify,
    write_results,
)
from satform.campaign.results import CaseResult, Columns, ResultsHash
from satform.campaign.software import software
from satform.files.bounded_file import read_json
from satform.files.durable_file import write_durably
from satform.scenario import ScenarioError

MANIFEST = "manifest.json"
RECORDS = "records"
DAMAGED = "damaged"
REPLACED = "replaced"
LOCK = ".lock"

_FORMAT = 1
_MOST_BYTES = 100_000_000
_MOST_ROWS = 5000
_PERIOD = 5.0
"""Wall-clock time after which finished cases are written, s."""


class FolderError(ValueError):
    """A folder that is not that of this campaign, or cannot be used; its text says why."""


@dataclass(frozen=True)
class Manifest:
    """What the results in a folder are of.

    Attributes:
        name: of the campaign.
        file: absolute path of the file from which it was started; empty where there was none.
        digest: of the campaign and its scenario.
        cases: number of all cases.
        columns: of the results.
        versions: of the software that flies it.
        started: time of the start, UTC, ISO 8601.
    """

    name: str
    file: str
    digest: str
    cases: int
    columns: Columns
    versions: Mapping[str, str]
    started: str

    @property
    def schema(self) -> ResultSchema:
        """What all files of results have in common."""
        return ResultSchema(self.columns, self.digest, self.cases)

    def data(self) -> dict[str, Any]:
        """As plain data."""
        return {"format": _FORMAT, **asdict(self), "columns": self.columns.data()}

    @classmethod
    def read(cls, path: Path) -> "Manifest":
        """Read a manifest.

        Raises:
            FolderError: there is none, or it cannot be read.
        """
        try:
            data = read_json(path, _MOST_BYTES)
            if data["format"] != _FORMAT:
                raise FolderError(f"{path}: is of format {data['format']}; this version reads {_FORMAT}")
            return cls(
                name=str(data["name"]),
                file=str(data["file"]),
                digest=str(data["digest"]),
                cases=int(data["cases"]),
                columns=Columns.of_data(data["columns"]),
                versions=dict(data["versions"]),
                started=str(data["started"]),
            )
        except FileNotFoundError:
            raise FolderError(
                f"{path.parent}: is not the folder of a campaign: it has no {path.name}"
            ) from None
        except OSError as error:
            raise FolderError(f"{path}: cannot be read: {error.strerror}") from None
        except (KeyError, TypeError, AttributeError):
            raise FolderError(f"{path}: is not the manifest of a campaign") from None
        except FolderError:
            raise
        except ValueError as error:
            raise FolderError(f"{path}: {error}") from None


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
            FolderError: its file was changed since.
            ScenarioError: its file is not a campaign any more.
        """
        campaign = load_campaign(self.path / "campaign.json")
        self.require(campaign, self.path / "campaign.json")
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

    def require_software(self) -> None:
        """Check that results of the software that runs now fit those in the folder.

        Raises:
            FolderError: they may have other bits.
        """
        now, then = software(), self.manifest.versions
        changed = [name for name in {**then, **now} if now.get(name) != then.get(name)]
        if changed:
            differences = ", ".join(f"{name} {then.get(name)} then, {now.get(name)} now" for name in changed)
            raise FolderError(
                f"{self.path}: its results are of other software, whose bits may differ ({differences}); "
                "start the campaign in a new folder"
            )

    def damaged(self) -> list[ResultFileError]:
        """Files among those of results that cannot be used, with the reason; all are read.

        These are files of another name, damaged ones, those of another campaign, and each that has a case
        which an earlier file has, too.

        Raises:
            OSError: a file cannot be read.
        """
        files, found = listed_files(self.path)
        file_of_case = np.full(self.manifest.cases, -1, dtype=np.int64)
        for index, file in enumerate(files):
            try:
                numbers = verify(file, self.manifest.schema)
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

    def repair(self) -> int:
        """Move each file that cannot be used out of the results, so that its cases are flown again.

        Returns:
            How many files there were.

        Raises:
            OSError: a file cannot be read or moved.
        """
        damaged = self.damaged()
        for error in damaged:
            (self.path / DAMAGED).mkdir(exist_ok=True)
            error.path.replace(self.path / DAMAGED / error.path.name)
        return len(damaged)

    def clean(self) -> None:
        """Remove what a killed process left half done; to be called with the folder locked.

        A file that was to be replaced is put back if its cases are in no other file. Files of series that no
        file of results names are removed.

        Raises:
            OSError: a file cannot be read, moved or removed.
            ResultFileError: a file is damaged.
        """
        for path in sorted((self.path / REPLACED).glob("*.parquet")):
            numbers = verify(ResultFile.at(path), self.manifest.schema)
            if self.done()[numbers].any():
                path.unlink()
            else:
                path.replace(self.path / RESULTS / path.name)
        self._remove_unused_series()

    def _remove_unused_series(self) -> None:
        folder = self.path / SERIES
        if folder.is_dir():
            used = {series_file(file) for file in result_files(self.path)}
            for path in folder.glob("*.parquet"):
                if path not in used:
                    path.unlink()

    def forget_lost(self) -> int:
        """Remove the results of cases that a time-out or the end of a worker process ended; how many.

        To be called with the folder locked.

        Raises:
            OSError: a file cannot be read or written.
            ResultFileError: a file is damaged.
        """
        count = 0
        for file in result_files(self.path):
            results = list(read_results(file, self.manifest.schema))
            rest = [result for result in results if not result.lost]
            if len(rest) < len(results):
                self._replace(file, rest)
                count += len(results) - len(rest)
        self.clean()
        return count

    def _replace(self, file: ResultFile, results: Sequence[CaseResult]) -> None:
        """Write a file anew with these of its results; without any it is removed.

        The old file leaves the results before the new one is there, so that no case is ever in two files.
        """
        series = dict(series_of(file))
        retained = [replace(result, series=series.get(result.number, {})) for result in results]
        aside = self.path / REPLACED / file.path.name
        aside.parent.mkdir(exist_ok=True)
        file.path.replace(aside)
        if retained:
            try:
                write_results(self.path, retained, self.manifest.schema)
            except OSError:
                aside.replace(file.path)
                raise
        aside.unlink()

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


class ResultStore:
    """Takes results of a campaign under way, and writes them now and then."""

    def __init__(self, folder: CampaignFolder) -> None:
        self._folder = folder
        self._waiting: list[CaseResult] = []
        self._bytes = 0
        self._next = time.monotonic() + _PERIOD

    def store(self, results: Sequence[CaseResult]) -> None:
        """Take results.

        Raises:
            OSError: they cannot be written.
        """
        columns = self._folder.manifest.columns
        self._waiting += [columns.complete(result) for result in results]
        self._bytes += sum(map(_series_bytes, results))
        is_full = len(self._waiting) >= _MOST_ROWS or self._bytes >= MOST_SERIES_BYTES
        if is_full or time.monotonic() >= self._next:
            self.flush()

    def flush(self) -> None:
        """Write all that was taken.

        Raises:
            OSError: it cannot be written.
        """
        waiting, self._waiting, self._bytes = self._waiting, [], 0
        self._next = time.monotonic() + _PERIOD
        waiting.sort(key=lambda result: result.number)
        for part in _parts(waiting):
            write_results(self._folder.path, part, self._folder.manifest.schema)


def _parts(results: Sequence[CaseResult]) -> Iterator[list[CaseResult]]:
    """Consecutive results for one file each, whose series are not larger than those of a chunk."""
    part: list[CaseResult] = []
    size = 0
    for result in results:
        own = _series_bytes(result)
        if part and size + own > MOST_SERIES_BYTES:
            yield part
            part, size = [], 0
        part.append(result)
        size += own
    if part:
        yield part


def _series_bytes(result: CaseResult) -> int:
    return sum(array.nbytes for array in result.series.values())
