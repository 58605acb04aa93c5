# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Exports the results of a campaign: figures as PNG, SVG or PDF, a row for each case as CSV or Parquet."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from satform.campaign.result_files import result_columns
from satform_tools.campaign.report_statistics import ReportStatistics
from satform_tools.campaign.summary import Summary
from satform_tools.report.formats import Format


def export(statistics: ReportStatistics, folder: Path, formats: Sequence[Format]) -> list[Path]:
    """Write the exports of a campaign.

    Args:
        statistics: of the campaign.
        folder: existing; files of the same name are replaced.
        formats: figures as PNG, SVG or PDF, the results as CSV or Parquet.

    Returns:
        The files.

    Raises:
        OSError: a file cannot be written.
        ResultFileError: a file of results is damaged.
    """
    from satform_tools.campaign import plots  # noqa: PLC0415 - matplotlib takes long to load

    files: list[Path] = []
    for wanted in dict.fromkeys(formats):
        if wanted is Format.CSV:
            files.append(_write_csv(statistics.summary, folder / "cases.csv"))
        elif wanted is Format.PARQUET:
            files.append(_write_parquet(statistics.summary, folder / "cases.parquet"))
        else:
            files += plots.draw(statistics, folder, wanted.value)
    return files


def _write_csv(summary: Summary, file: Path) -> Path:
    """Every number with all its digits; an empty cell where there is none."""
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        is_first = True
        for results in summary.batches():
            columns = result_columns(results, summary.folder.manifest.columns)
            if is_first:
                writer.writerow(columns)
                is_first = False
            for row in zip(*(column.to_pylist() for column in columns.values()), strict=True):
                # NaN is not equal to itself.
                writer.writerow(["" if value is None or value != value else value for value in row])  # noqa: PLR0124
    return file


def _write_parquet(summary: Summary, file: Path) -> Path:
    """All cases in order of their numbers in one file, bitwise."""
    from arro3.core import Field, RecordBatch, RecordBatchReader, Schema  # noqa: PLC0415 - only this needs it
    from arro3.io import write_parquet  # noqa: PLC0415

    empty = result_columns([], summary.folder.manifest.columns)
    schema = Schema([Field(name, column.type) for name, column in empty.items()])

    def batches() -> Iterator[Any]:
        for results in summary.batches():
            columns = result_columns(results, summary.folder.manifest.columns)
            yield RecordBatch.from_arrays(list(columns.values()), schema=schema)

    metadata = {"campaign": summary.folder.manifest.name, "digest": summary.folder.manifest.digest}
    reader = RecordBatchReader.from_batches(schema, batches())
    write_parquet(reader, file, compression="zstd(3)", key_value_metadata=metadata)
    return file
