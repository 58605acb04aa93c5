# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Parquet files of a campaign's results: each written whole or not at all, and checked when it is read.

A file holds some cases in order of their numbers. Its name has the first and the last of these and the
beginning of the SHA-256 of its content: `cases-00000000-00000499-9f86d081884c7d65.parquet`. Retained series
are in a file of their own, which is written first and which the metadata of the file of results names. The
metadata have the digest of the campaign, too.
"""

import hashlib
import heapq
import io
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from satform.campaign.parquet_file import ParquetError, ParquetFile
from satform.campaign.results import CaseResult, Columns, Kind
from satform.files.bounded_file import read_bounded
from satform.files.durable_file import write_durably
from satform.numeric.elementwise import Array

RESULTS = "results"
"""Folder of the results in a campaign's folder."""

SERIES = "series"
"""Folder of the retained series in a campaign's folder."""

_NAME = re.compile(r"cases-(\d{8,})-(\d{8,})-([0-9a-f]{16})\.parquet")
_SERIES_FILE = "series_file"
"""Entry of the metadata of a file of results: name of the file of its series, empty where there is none."""

_CAMPAIGN = "campaign_digest"
"""Entry of the metadata of a file of results: digest of the campaign."""

_MOST_BYTES = 2**29
"""Size of the largest file that is read; series of the cases of a file have 64 megabytes at most."""


class ResultFileError(ValueError):
    """A file of results that is damaged; the message names it.

    Attributes:
        path: of the file.
        sentence: what is wrong with it.
    """

    def __init__(self, path: Path, sentence: str) -> None:
        super().__init__(path, sentence)
        self.path = path
        self.sentence = sentence

    def __str__(self) -> str:
        """The message, with the path in front."""
        return f"{self.path}: {self.sentence}"


@dataclass(frozen=True)
class ResultSchema:
    """What all files of results of a campaign have in common.

    Attributes:
        columns: of the campaign.
        digest: of the campaign and its scenario.
        cases: number of all cases of the campaign.
    """

    columns: Columns
    digest: str
    cases: int


@dataclass(frozen=True, order=True)
class ResultFile:
    """A file of results.

    Attributes:
        first: smallest number of a case in it.
        last: largest number of a case in it.
        path: of the file.
    """

    first: int
    last: int
    path: Path

    @classmethod
    def at(cls, path: Path) -> "ResultFile":
        """The file at a path, with what its name says.

        Raises:
            ResultFileError: it does not have the name of a file of results.
        """
        match = _NAME.fullmatch(path.name)
        if match is None:
            raise ResultFileError(path, "is not the name of a file of results")
        return cls(int(match[1]), int(match[2]), path)


def result_files(folder: Path) -> list[ResultFile]:
    """All files of results of a campaign, in order of their first case.

    Args:
        folder: of the campaign.

    Raises:
        ResultFileError: there is a file of another name among them.
    """
    files, misnamed = listed_files(folder)
    if misnamed:
        raise misnamed[0]
    return files


def listed_files(folder: Path) -> tuple[list[ResultFile], list[ResultFileError]]:
    """All files of results of a campaign in order of their first case, and an error for each other file.

    Args:
        folder: of the campaign.
    """
    files, misnamed = [], []
    for path in sorted((folder / RESULTS).glob("*.parquet")):
        try:
            files.append(ResultFile.at(path))
        except ResultFileError as error:
            misnamed.append(error)
    return sorted(files), misnamed


def write_results(folder: Path, results: Sequence[CaseResult], schema: ResultSchema) -> None:
    """Write some results of a campaign.

    Args:
        folder: of the campaign.
        results: at least one, in order of their numbers, with all columns of the campaign.
        schema: of the campaign.

    Raises:
        OSError: they cannot be written.
    """
    retained = any(result.series for result in results)
    series = _write(folder / SERIES, results, *_series_columns(results)) if retained else ""
    metadata = {_SERIES_FILE: series, _CAMPAIGN: schema.digest}
    _write(folder / RESULTS, results, result_columns(results, schema.columns), metadata)


def read_results(file: ResultFile, schema: ResultSchema) -> Iterator[CaseResult]:
    """The results in a file, without series.

    Args:
        file: to be read.
        schema: of the campaign.

    Raises:
        OSError: it cannot be read.
        ResultFileError: it is damaged, of another campaign, or has cases that the campaign does not have.
    """
    with _opened(file.path) as opened:
        yield from _checked_results(file, schema, opened)


def _checked_results(file: ResultFile, schema: ResultSchema, opened: ParquetFile) -> Iterator[CaseResult]:
    digest = opened.metadata.get(_CAMPAIGN, "")
    if digest != schema.digest:
        raise ResultFileError(
            file.path,
            f"is of another campaign: it has the digest {digest[:16] or 'of none'}, this campaign has "
            f"{schema.digest[:16]}",
        )
    if file.last >= schema.cases:
        raise ResultFileError(file.path, f"has case {file.last}, and the campaign has {schema.cases} cases")
    last = file.first - 1
    for rows in opened.batches():
        try:
            results = _results(rows, schema.columns)
        except KeyError as error:
            raise ResultFileError(file.path, f"does not have the column {error} of this campaign") from None
        except TypeError as error:
            raise ResultFileError(file.path, f"does not have the columns of this campaign: {error}") from None
        for result in results:
            if not last < result.number <= file.last:
                raise ResultFileError(file.path, f"case {result.number} is out of order")
            last = result.number
            yield result


def all_results(
    folder: Path, schema: ResultSchema, files: Sequence[ResultFile] | None = None
) -> Iterator[CaseResult]:
    """All results of a campaign in order of their numbers, without series.

    Files are opened when their first case comes up, so that memory does not grow with the number of runs.

    Args:
        folder: of the campaign.
        schema: of the campaign.
        files: that are read, in the order of `result_files`; None for all that are in the folder now.

    Raises:
        OSError: a file cannot be read.
        ResultFileError: a file is damaged, or two hold the same case.
    """
    waiting = list(result_files(folder) if files is None else files)[::-1]
    under_way: list[tuple[int, str, CaseResult, Iterator[CaseResult]]] = []
    last, last_path = -1, ""
    while waiting or under_way:
        while waiting and (not under_way or waiting[-1].first <= under_way[0][0]):
            file = waiting.pop()
            _advance(under_way, read_results(file, schema), str(file.path))
        if not under_way:
            continue
        number, path, result, rest = heapq.heappop(under_way)
        if number == last:
            raise ResultFileError(Path(path), f"has case {number}, which is in {last_path}, too")
        last, last_path = number, path
        yield result
        _advance(under_way, rest, path)


def _advance(
    under_way: list[tuple[int, str, CaseResult, Iterator[CaseResult]]],
    results: Iterator[CaseResult],
    path: str,
) -> None:
    following = next(results, None)
    if following is not None:
        heapq.heappush(under_way, (following.number, path, following, results))


def all_series(
    folder: Path, files: Sequence[ResultFile] | None = None
) -> Iterator[tuple[int, dict[str, Array]]]:
    """Number and retained series of every case that has any, file by file.

    Args:
        folder: of the campaign.
        files: files of results whose series are read; None for all that are in the folder now.

    Yields:
        The number of a case, and its series by name, shape (T, N, ...).

    Raises:
        OSError: a file cannot be read.
        ResultFileError: a file is damaged.
    """
    for file in result_files(folder) if files is None else files:
        yield from series_of(file)


def series_of(file: ResultFile) -> Iterator[tuple[int, dict[str, Array]]]:
    """As `all_series`, of the cases in one file of results."""
    series = series_file(file)
    if series is not None:
        yield from _read_series(series)


def _read_series(path: Path) -> Iterator[tuple[int, dict[str, Array]]]:
    with _opened(path) as opened:
        try:
            shapes: dict[str, list[int]] = json.loads(opened.metadata["shapes"])
            for rows in opened.batches():
                yield from _series_of_rows(rows, shapes)
        except (KeyError, TypeError, ValueError, AttributeError, IndexError, RecursionError) as error:
            raise ResultFileError(path, f"has no series of cases: {error}") from None


def _series_of_rows(
    rows: dict[str, Any], shapes: dict[str, list[int]]
) -> Iterator[tuple[int, dict[str, Array]]]:
    for row, number in enumerate(rows["number"]):
        found = {}
        for name, shape in shapes.items():
            ends, values = rows[name]
            part = values[ends[row] - ends[0] : ends[row + 1] - ends[0]]
            if len(part):
                found[name] = part.reshape(-1, *shape)
        if found:
            yield int(number), found


def verify(file: ResultFile, schema: ResultSchema) -> NDArray[np.int64]:
    """Check that a file, and that of the series of its cases, are as they were written.

    Args:
        file: to be read.
        schema: of the campaign.

    Returns:
        Numbers of its cases, ascending.

    Raises:
        OSError: it cannot be read.
        ResultFileError: `read_results` would fail with it, or the file of the series has another digest.
    """
    numbers = np.fromiter((result.number for result in read_results(file, schema)), dtype=np.int64)
    series = series_file(file)
    if series is not None:
        try:
            _content(series)
        except ResultFileError as error:
            raise ResultFileError(file.path, f"the series of its cases are damaged: {error}") from None
    return numbers


def series_file(file: ResultFile) -> Path | None:
    """The file of the series of the cases in a file of results; None where none are retained.

    Raises:
        OSError: the file of results cannot be read.
        ResultFileError: the file of results is damaged, or that of the series is missing.
    """
    with _opened(file.path) as opened:
        name = opened.metadata.get(_SERIES_FILE, "")
    if not name:
        return None
    series = file.path.parent.parent / SERIES / Path(name).name
    if not series.exists():
        raise ResultFileError(file.path, f"the series of its cases are missing: there is no {series}")
    return series


def _content(path: Path) -> bytes:
    content = read_bounded(path, _MOST_BYTES, "a file of results")
    match = _NAME.fullmatch(path.name)
    if match is None or _digest(content) != match[3]:
        raise ResultFileError(path, "is damaged: its content does not have the digest in its name")
    return content


@contextmanager
def _opened(path: Path) -> Iterator[ParquetFile]:
    """A file whose content has its digest; closed afterwards.

    Raises:
        OSError: it cannot be read.
        ResultFileError: it is damaged; also where its rows are read within the context.
    """
    content = _content(path)
    try:
        opened = ParquetFile(content)
        try:
            yield opened
        finally:
            opened.close()
    except ParquetError as error:
        raise ResultFileError(path, f"cannot be read: {error}") from None


def _write(
    folder: Path, results: Sequence[CaseResult], columns: Mapping[str, Any], metadata: Mapping[str, str]
) -> str:
    """Write columns to a file of these cases; returns its name."""
    from arro3.core import Field, Schema, Table  # noqa: PLC0415 - an extra
    from arro3.io import write_parquet  # noqa: PLC0415

    schema = Schema([Field(name, column.type) for name, column in columns.items()], metadata=dict(metadata))
    table = Table.from_arrays(list(columns.values()), schema=schema)
    content = io.BytesIO()
    write_parquet(table, content, compression="zstd(3)", key_value_metadata=dict(metadata))
    first, last = results[0].number, results[-1].number
    name = f"cases-{first:08d}-{last:08d}-{_digest(content.getvalue())}.parquet"
    folder.mkdir(exist_ok=True)
    write_durably(folder / name, content.getvalue())
    return name


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def result_columns(results: Sequence[CaseResult], columns: Columns) -> dict[str, Any]:
    """Columns of a table with a row for each result, as the files have them.

    Args:
        results: with all columns of the campaign.
        columns: of the campaign.

    Returns:
        Arrow arrays by name.
    """
    from arro3.core import Array as Column  # noqa: PLC0415 - an extra
    from arro3.core import DataType  # noqa: PLC0415

    text, boolean = DataType.string(), DataType.bool()
    kinds = {"number": DataType.float64(), "integer": DataType.int64(), "boolean": boolean, "text": text}
    data = {
        "number": Column([result.number for result in results], DataType.int64()),
        "success": Column([result.success for result in results], boolean),
        "reason": Column([result.reason for result in results], text),
        "lost": Column([result.lost for result in results], boolean),
        "stacked": Column([result.stacked for result in results], boolean),
        "state_hash": Column([result.state_hash for result in results], text),
        "record_path": Column([result.record_path for result in results], text),
    }
    for path, kind in columns.changes.items():
        data[f"change.{path}"] = Column([result.changes.get(path) for result in results], kinds[kind])
    for name in columns.figures:
        data[f"figure.{name}"] = Column([result.figures[name] for result in results], DataType.float64())
    for name in columns.judged:
        data[f"met.{name}"] = Column([result.met[name] for result in results], boolean)
    return data


_TYPES: dict[str, tuple[type, ...]] = {
    "number": (int,),
    "success": (bool,),
    "reason": (str,),
    "lost": (bool,),
    "stacked": (bool,),
    "state_hash": (str, type(None)),
    "record_path": (str, type(None)),
}
"""Types of the values of columns that all campaigns have."""

_CHANGES: dict[Kind, tuple[type, ...]] = {
    "number": (float, type(None)),
    "integer": (int, type(None)),
    "boolean": (bool, type(None)),
    "text": (str, type(None)),
}
"""Types of the values of a change."""


def _require_types(plain: dict[str, Any], columns: Columns) -> None:
    """Check that the columns of a file have values of their types.

    Raises:
        KeyError: a column is missing.
        TypeError: a column has another type.
    """
    types = {
        **_TYPES,
        **{f"change.{path}": _CHANGES[kind] for path, kind in columns.changes.items()},
        **{f"figure.{name}": (float,) for name in columns.figures},
        **{f"met.{name}": (bool,) for name in columns.judged},
    }
    for name, allowed in types.items():
        wrong = next((value for value in plain[name] if type(value) not in allowed), None)
        if wrong is not None or (type(None) not in allowed and None in plain[name]):
            raise TypeError(f"the column {name} has a value of type {type(wrong).__name__}")


def _results(plain: dict[str, Any], columns: Columns) -> list[CaseResult]:
    _require_types(plain, columns)
    count = len(plain["number"])
    changes = _rows({path: plain[f"change.{path}"] for path in columns.changes}, count)
    figures = _rows({name: plain[f"figure.{name}"] for name in columns.figures}, count)
    met = _rows({name: plain[f"met.{name}"] for name in columns.judged}, count)
    names = ("number", "success", "reason", "lost", "stacked", "state_hash", "record_path")
    return [
        CaseResult(
            changes={path: value for path, value in changes[row].items() if value is not None},
            figures=figures[row],
            met=met[row],
            **{name: plain[name][row] for name in names},
        )
        for row in range(count)
    ]


def _rows(columns: dict[str, list[Any]], count: int) -> list[dict[str, Any]]:
    return [{name: values[row] for name, values in columns.items()} for row in range(count)]


def _series_columns(results: Sequence[CaseResult]) -> tuple[dict[str, Any], dict[str, str]]:
    from arro3.core import Array as Column  # noqa: PLC0415 - an extra
    from arro3.core import list_array  # noqa: PLC0415

    nothing = np.empty(0)
    shapes = {name: array.shape[1:] for result in results for name, array in result.series.items()}
    data = {"number": Column.from_numpy(np.asarray([result.number for result in results], dtype=np.int64))}
    for name in sorted(shapes):
        rows = [np.ravel(result.series.get(name, nothing)) for result in results]
        offsets = np.cumsum([0, *map(len, rows)], dtype=np.int32)
        data[name] = list_array(Column.from_numpy(offsets), Column.from_numpy(np.concatenate(rows)))
    return data, {"shapes": json.dumps(shapes)}
