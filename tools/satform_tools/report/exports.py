# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A kept flight in other forms: pictures, and its numbers as a table that other programs read."""

import csv
import json
import re
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from satform.numeric.elementwise import Array
from satform.record.flight_record import QUANTITIES, FlightRecord
from satform_tools.report.formats import Format
from satform_tools.report.units import UNITS
from satform_tools.run.stored_run import Kept

_STATE = ("x", "y", "z", "vx", "vy", "vz")
"""Components of an estimated motion, by which those of its covariance are named."""

_COVARIANCE = re.compile(r"estimate_covariance_(v?[xyz])_(v?[xyz])")
"""A column with an element of a covariance."""


def export(kept: Kept, folder: Path, formats: Sequence[Format]) -> list[Path]:
    """Write a flight in other forms; its overview as a picture is always among them.

    Args:
        kept: the flight.
        folder: existing; files of the same name are replaced.
        formats: pictures as PNG, SVG or PDF, numbers as CSV or Parquet.

    Returns:
        The files.

    Raises:
        OSError: a file cannot be written.
    """
    from satform_tools.report.plots import figures  # noqa: PLC0415 - matplotlib takes long to load

    files: list[Path] = []
    if Format.PNG not in formats:
        files += figures.draw(kept.scenario, kept.record, folder, "png", ("flight",))
    for wanted in dict.fromkeys(formats):
        if wanted is Format.CSV:
            files.append(_write_csv(kept.record, folder / "flight.csv"))
        elif wanted is Format.PARQUET:
            files.append(_write_parquet(kept, folder / "flight.parquet"))
        else:
            files += figures.draw(kept.scenario, kept.record, folder, wanted.value)
    return files


def columns(record: FlightRecord) -> dict[str, Array]:
    """All quantities as columns of one table, with a row for each step and satellite, satellites in turn.

    Quantities that are decided in a step are not numbers in the rows of the last state, after which nothing
    is decided; quantities that the flight does not have are left out.

    Args:
        record: of K steps of N satellites.

    Returns:
        Columns of (K + 1) N numbers by their names; vectors have one for each axis.
    """
    found: dict[str, Array] = {"time": np.repeat(record.time, len(record.satellites))}
    for name in QUANTITIES:
        values = getattr(record, name)
        if not len(values) or np.all(np.isnan(values)):
            continue
        missing = np.full((record.steps + 1 - len(values), *values.shape[1:]), np.nan)
        whole = np.concatenate((values, missing))
        if whole.ndim == 2:
            found[name] = whole.ravel()
        elif whole.ndim == 4:
            found.update(
                {
                    f"{name}_{row}_{column}": whole[..., i, j].ravel()
                    for i, row in enumerate(_STATE)
                    for j, column in enumerate(_STATE)
                    if j >= i
                }
            )
        else:
            parts = {f"{name}_{axis}": whole[..., place].ravel() for place, axis in enumerate("xyz")}
            found.update(parts)
    return found


def unit_of(column: str) -> str:
    """The unit of a column."""
    if column == "time":
        return "s"
    covariance = _COVARIANCE.fullmatch(column)
    if covariance:
        rates = sum(part.startswith("v") for part in covariance.groups())
        return ("m²", "m²/s", "m²/s²")[rates]
    return UNITS[column if column in UNITS else column[:-2]]


def _write_csv(record: FlightRecord, file: Path) -> Path:
    """Every number with all its digits; an empty cell where there is none."""
    table = columns(record)
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["step", "satellite", *table])
        writer.writerows(_rows(record, table))
    return file


def _rows(record: FlightRecord, table: dict[str, Array]) -> Iterator[list[object]]:
    count = len(record.satellites)
    numbers = zip(*(values.tolist() for values in table.values()), strict=True)
    places = chain.from_iterable(
        ((step, name) for name in record.satellites) for step in range(len(table["time"]) // count)
    )
    for place, row in zip(places, numbers, strict=True):
        # What is not a number is not equal to itself.
        yield [*place, *("" if value != value else value for value in row)]  # noqa: PLR0124


def _write_parquet(kept: Kept, file: Path) -> Path:
    """Every number with its bits; units stand where readers look for them.

    pandas takes `DataFrame.attrs` from `PANDAS_ATTRS`, pyarrow `unit` from the metadata of a field, and
    `polars.read_parquet_metadata` gives `unit.<column>` of the file.
    """
    from arro3.core import Array as Column  # noqa: PLC0415 - only this needs it
    from arro3.core import DataType, Field, Schema, Table  # noqa: PLC0415
    from arro3.io import write_parquet  # noqa: PLC0415

    record = kept.record
    table = columns(record)
    steps = np.repeat(np.arange(record.steps + 1, dtype=np.int64), len(record.satellites))
    names = list(record.satellites) * (record.steps + 1)
    data: dict[str, Any] = {
        "step": Column.from_numpy(steps),
        "satellite": Column(names, DataType.string()),
        **{name: Column.from_numpy(np.ascontiguousarray(values)) for name, values in table.items()},
    }
    units = {name: unit_of(name) for name in table}
    about = {"scenario": kept.scenario.to_json(), "digest": kept.scenario.digest()}
    attributes = {"units": units, "scenario": kept.scenario.name, "digest": kept.scenario.digest()}
    metadata = {
        **about,
        **{f"unit.{name}": unit for name, unit in units.items()},
        "PANDAS_ATTRS": json.dumps(attributes, ensure_ascii=False),
    }
    fields = [
        Field(name, column.type, metadata={"unit": units[name]} if name in units else {})
        for name, column in data.items()
    ]
    written = Table.from_arrays(list(data.values()), schema=Schema(fields, metadata=metadata))
    write_parquet(written, file, compression="zstd(3)", key_value_metadata=metadata)
    return file
