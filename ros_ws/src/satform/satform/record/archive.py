# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The record of an in-process flight as a numpy archive."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from satform.common.printable_text import reason
from satform.files.durable_file import durable_file
from satform.files.numpy_archive import read_archive
from satform.numeric.elementwise import Array
from satform.record.early_end import EarlyEnd
from satform.record.flight_record import FlightRecord
from satform.record.navigation_history import NavigationHistory
from satform.record.quantities import OPTIONAL, OPTIONAL_EQUIPMENT, QUANTITIES, without

RECORD = "record.npz"
"""Name of the archive in the folder of a run."""


class RecordError(ValueError):
    """A file that is not the record of a flight; its text says which file, and why not."""


def save_record(record: FlightRecord, path: Path) -> None:
    """Write a flight as a numpy archive.

    Args:
        record: the flight.
        path: of the archive.

    Raises:
        OSError: it cannot be written.
    """
    arrays: dict[str, Any] = {**record.quantities(), **record.navigation_arrays()}
    end = None if record.early_end is None else record.early_end.data()
    head = json.dumps(
        {
            "satellites": record.satellites,
            "step": record.step,
            "early_end": end,
            "clocked": record.clocked,
        }
    )
    with durable_file(path) as file:
        np.savez(file, head=np.array(head), **arrays)


def load_record(path: Path) -> FlightRecord:
    """Read a flight from a numpy archive.

    Args:
        path: of the archive.

    Returns:
        The flight, bitwise equal.

    Raises:
        OSError: the archive cannot be read.
        RecordError: it holds no flight.
    """
    try:
        archive = read_archive(path)
        head = json.loads(str(archive["head"]))
        # Records of earlier versions have no estimates of filters and no plans.
        names = [_text(name) for name in head["satellites"]]
        count = len(names)
        arrays: dict[str, Any] = {}
        for equipment in OPTIONAL_EQUIPMENT:
            arrays |= without(equipment, count, None)
        steps = len(np.atleast_1d(archive["position"])) - 1
        arrays |= {
            name: _quantity(name, archive[name], steps, count)
            for name in QUANTITIES
            if name in archive or name not in OPTIONAL
        }
        end = head.get("early_end")
        early_end = None if end is None else EarlyEnd.of(end)
        return FlightRecord(
            tuple(names),
            _period(head["step"]),
            **arrays,
            early_end=early_end,
            clocked=bool(head.get("clocked", False)),
            navigation=_navigation(archive, steps, count),
            chief_source=None,
            link_source=None,
            central_source=None,
        )
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise RecordError(f"{path}: is not the record of a run: {reason(error)}") from None


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"found {value!r:.60}; the name of a satellite is text")
    return value


def _period(value: Any) -> float:
    if not isinstance(value, int | float) or not 0.0 < value < math.inf:
        raise ValueError(f"found {value!r:.60}; a control period is a positive number of seconds")
    return float(value)


def _quantity(name: str, values: NDArray[Any], steps: int, count: int) -> Array:
    """The array of a quantity.

    Args:
        name: of the quantity.
        values: in the archive.
        steps: of the flight.
        count: number of satellites.

    Raises:
        ValueError: it has another shape, or holds no real numbers.
    """
    quantity = QUANTITIES[name]
    shape = (steps + quantity.of_states, count, *quantity.shape)
    # Only thrusters count in every flight; of other equipment that no satellite has there are no rows.
    rowless = (0, *shape[1:]) if quantity.equipment not in {"", "thruster"} else shape
    return _numbers(name, values, shape, rowless)


def _numbers(name: str, values: NDArray[Any], *shapes: tuple[int, ...]) -> Array:
    """An array of real numbers of one of some shapes."""
    if values.dtype.kind not in "biuf":
        raise ValueError(f"{name} holds {values.dtype.name}, not numbers")
    if values.shape not in shapes:
        raise ValueError(f"{name} has shape {values.shape}, not {shapes[0]}")
    return np.asarray(values, dtype=np.float64)


def _navigation(archive: Mapping[str, NDArray[Any]], steps: int, count: int) -> NavigationHistory | None:
    """Readings of sensors and estimates of the formation; None for a flight without sensors."""
    if "readings" not in archive:
        return None
    readings, mean = archive["readings"], archive["navigation_mean"]
    return NavigationHistory(
        _numbers("readings", readings, (steps + 1, count, readings.shape[-1] if readings.ndim else 0)),
        _numbers("navigation_mean", mean, (steps, count, 6 * count)),
    )
