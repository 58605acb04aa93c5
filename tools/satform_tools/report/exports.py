# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Exports a stored flight: figures, its quantities as CSV or Parquet, its orbits as OEM or OMM."""

import csv
import json
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.record.tables import columns, unit_of
from satform_tools.errors import CommandError
from satform_tools.report.formats import FlightFormat
from satform_tools.run.stored_run import StoredRun


def export(stored: StoredRun, folder: Path, formats: Sequence[FlightFormat]) -> list[Path]:
    """Write the exports of a flight; its overview as PNG is always among them.

    Args:
        stored: the flight.
        folder: existing; files of the same name are replaced.
        formats: figures as PNG, SVG or PDF, quantities as CSV or Parquet, orbits as OEM or OMM.

    Returns:
        The files.

    Raises:
        OSError: a file cannot be written.
        CommandError: the flight has no inertial motion for OEM or OMM, SGP4 does not propagate an orbit, or
            sgp4 is not installed.
    """
    from satform_tools.report.plots import figures  # noqa: PLC0415 - matplotlib takes long to load

    files: list[Path] = []
    if FlightFormat.PNG not in formats:
        files += figures.draw(stored.scenario, stored.record, folder, "png", ("flight",))
    for wanted in dict.fromkeys(formats):
        if wanted is FlightFormat.CSV:
            files.append(_write_csv(stored.record, folder / "flight.csv"))
        elif wanted is FlightFormat.PARQUET:
            files.append(_write_parquet(stored, folder / "flight.parquet"))
        elif wanted in {FlightFormat.OEM, FlightFormat.OMM}:
            files += _write_orbits(stored, folder, wanted)
        else:
            files += figures.draw(stored.scenario, stored.record, folder, wanted.value)
    return files


def _write_orbits(stored: StoredRun, folder: Path, wanted: FlightFormat) -> list[Path]:
    """Write a message of the chief's orbit and of each satellite's."""
    from satform.flight import orbit_messages  # noqa: PLC0415 - brahe and scipy take long to load

    digest = stored.scenario.digest()[:16]
    comment = f"true motion in a flight of the scenario {stored.scenario.name}, digest {digest}"
    files = []
    try:
        for ephemeris in orbit_messages.ephemerides(stored.record):
            if wanted is FlightFormat.OEM:
                text = orbit_messages.oem_text(ephemeris, comment)
            else:
                elements = orbit_messages.fitted_elements(ephemeris)
                text = orbit_messages.omm_text(ephemeris, elements)
            file = folder / f"{ephemeris.name}.{wanted.value}"
            file.write_text(text, encoding="utf-8")
            files.append(file)
    except (ImportError, ValueError) as error:
        raise CommandError(f"no {wanted.value.upper()}: {error}") from None
    return files


def _write_csv(record: FlightRecord, file: Path) -> Path:
    """Every number with all its digits; an empty cell where there is none."""
    table = _table(record)
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["step", "satellite", *table])
        writer.writerows(_rows(record, table))
    return file


def _table(record: FlightRecord) -> dict[str, Array]:
    """All quantities, with inertial states and relative elements where the chief's motion is known."""
    quantities = {**record.quantities(), **record.orbital_quantities()}
    return columns(record.satellites, record.time, quantities)


def _rows(record: FlightRecord, table: dict[str, Array]) -> Iterator[list[object]]:
    count = len(record.satellites)
    numbers = zip(*(values.tolist() for values in table.values()), strict=True)
    labels = chain.from_iterable(
        ((step, name) for name in record.satellites) for step in range(len(table["time"]) // count)
    )
    for label, row in zip(labels, numbers, strict=True):
        # NaN is not equal to itself.
        yield [*label, *("" if value != value else value for value in row)]  # noqa: PLR0124


def _write_parquet(stored: StoredRun, file: Path) -> Path:
    """Write all quantities bitwise, with units in the metadata that readers use.

    pandas takes `DataFrame.attrs` from `PANDAS_ATTRS`, pyarrow `unit` from the metadata of a field, and
    `polars.read_parquet_metadata` gives `unit.<column>` of the file.
    """
    from arro3.core import Array as Column  # noqa: PLC0415 - only this needs it
    from arro3.core import DataType, Field, Schema, Table  # noqa: PLC0415
    from arro3.io import write_parquet  # noqa: PLC0415

    record = stored.record
    table = _table(record)
    steps = np.repeat(np.arange(record.steps + 1, dtype=np.int64), len(record.satellites))
    names = list(record.satellites) * (record.steps + 1)
    data: dict[str, Any] = {
        "step": Column.from_numpy(steps),
        "satellite": Column(names, DataType.string()),
        **{name: Column.from_numpy(np.ascontiguousarray(values)) for name, values in table.items()},
    }
    units = {name: unit_of(name) for name in table}
    about = {"scenario": stored.scenario.to_json(), "digest": stored.scenario.digest()}
    attributes = {"units": units, "scenario": stored.scenario.name, "digest": stored.scenario.digest()}
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
