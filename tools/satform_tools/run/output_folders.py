# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The output folder of a run: makes it, and writes and reads the result and the in-process record in it."""

import json
import os
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from satform.files.numpy_archive import read_archive
from satform.record.early_end import EarlyEnd
from satform.record.flight_record import FlightRecord
from satform.record.quantities import ESTIMATES, QUANTITIES, without
from satform_tools.errors import CommandError, sentence_of

RESULT = "result.json"
TRACE = "trace"

MOST_BYTES = 100_000_000
"""Size of the largest file of JSON that is read; that of 10 000 satellites has some megabytes."""


def make(out: Path | None, scenario: str) -> Path:
    """Make the folder of a run; an existing run is never touched.

    Args:
        out: requested folder; None for a new one in `runs` of the current folder.
        scenario: name of what is flown.

    Returns:
        The folder, empty.

    Raises:
        CommandError: the folder holds something already or cannot be made.
    """
    try:
        require_text(Path.cwd() if out is None else out.absolute())
        if out is None:
            return _new_folder(scenario)
        if out.exists() and (not out.is_dir() or any(out.iterdir())):
            raise CommandError(f"{out} already exists and is not an empty folder; name another with --out")
        out.mkdir(parents=True, exist_ok=True)
        # A folder that was there already may be one that cannot be written to.
        probe = out / RESULT
        probe.touch()
        probe.unlink()
    except (OSError, ValueError) as error:
        reason = sentence_of(error) if isinstance(error, OSError) else str(error)
        raise CommandError(f"the run's folder cannot be written: {reason}") from None
    return out


def require_text(folder: Path) -> None:
    """Check that the path of a folder is UTF-8 text, as ROS parameters and messages need.

    Raises:
        CommandError: it is not.
    """
    try:
        str(folder).encode()
    except UnicodeEncodeError as error:
        wrong = os.fsencode(str(folder)[error.start])[0]
        raise CommandError(
            f"{folder}: the path is not UTF-8 text (byte {wrong:#04x}), which ROS asks of all text; "
            "name another folder with --out"
        ) from None


def _new_folder(scenario: str) -> Path:
    moment = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    runs = Path.cwd() / "runs"
    runs.mkdir(exist_ok=True)
    number = 1
    while True:
        folder = runs / (f"{scenario}-{moment}" + (f"-{number}" if number > 1 else ""))
        try:
            folder.mkdir()
        except FileExistsError:
            number += 1
        else:
            return folder


def load_record(path: Path) -> FlightRecord:
    """Read a flight from a numpy archive.

    Args:
        path: of the archive.

    Returns:
        The flight, bitwise equal.

    Raises:
        CommandError: there is no such archive, or it holds no flight.
    """
    try:
        archive = read_archive(path)
        head = json.loads(str(archive["head"]))
        # Records of earlier versions have no covariance of filters.
        arrays = without("filter", len(head["satellites"]), None) | {
            name: np.asarray(archive[name], dtype=np.float64)
            for name in QUANTITIES
            if name in archive or name not in ESTIMATES
        }
        end = head.get("early_end")
        early_end = None if end is None else EarlyEnd.of(end)
        return FlightRecord(tuple(head["satellites"]), float(head["step"]), **arrays, early_end=early_end)
    except OSError as error:
        raise CommandError(f"{path}: cannot be read: {sentence_of(error)}") from None
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise CommandError(f"{path}: is not the record of a run: {error}") from None
