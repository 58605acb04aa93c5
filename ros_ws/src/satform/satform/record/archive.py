# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The record of an in-process flight as a numpy archive."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from satform.files.durable_file import durable_file
from satform.record.flight_record import FlightRecord

RECORD = "record.npz"
"""Name of the archive in the folder of a run."""


def save_record(record: FlightRecord, path: Path) -> None:
    """Write a flight as a numpy archive.

    Args:
        record: the flight.
        path: of the archive.

    Raises:
        OSError: it cannot be written.
    """
    arrays: dict[str, Any] = record.quantities()
    end = None if record.early_end is None else record.early_end.data()
    head = json.dumps({"satellites": record.satellites, "step": record.step, "early_end": end})
    with durable_file(path) as file:
        np.savez(file, head=np.array(head), **arrays)
