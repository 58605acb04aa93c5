# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The manifest of a campaign's folder: of what campaign its results are, and by which software."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from satform.campaign.result_files import ResultSchema
from satform.campaign.results import Columns
from satform.files.bounded_file import read_json

MANIFEST = "manifest.json"

_FORMAT = 1
_MOST_BYTES = 100_000_000


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
