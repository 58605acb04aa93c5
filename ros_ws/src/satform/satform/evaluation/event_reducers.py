# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Times of events, computed block by block: settling time, first time within a bound.

`LastOutside` finds the last row outside of a bound, `FirstInside` the first row within it. `SettlingOf`, an
`EventTime`, is the settling time of a series of all satellites. Each stores one row number for each run and
series, whatever the length of the flight.
"""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from satform.evaluation.reducers import quantity
from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock, base_quantities
from satform.record.stretch import Mask, Part, Stretch, StretchReader, any_of


class LastOutside:
    """The last row in which each series of several was outside of what counts as settled.

    Attributes:
        rows: taken so far.
        last: the last row outside of each series, -1 for none, shape (...).
    """

    def __init__(self) -> None:
        self.rows = 0
        self.last: NDArray[np.int64] = np.zeros((), dtype=np.int64)

    def add(self, outside: Mask) -> None:
        """Take the next rows, shape (rows, ...)."""
        if not len(outside):
            return
        if not self.rows:
            self.last = np.full(outside.shape[1:], -1, dtype=np.int64)
        if outside[-1].all():
            self.last[...] = self.rows + len(outside) - 1
        elif outside.any():
            row = self.rows + len(outside) - 1 - np.argmax(outside[::-1], axis=0)
            self.last = np.where(outside.any(axis=0), row, self.last)
        self.rows += len(outside)

    def settled(self, since: NDArray[np.int64] | int = 0) -> Array:
        """Row from which a series was never outside again, shape (...).

        Args:
            since: row before which it does not matter, shape (...).

        Returns:
            Rows after `since`; NaN where the series ends outside or has no row since then.
        """
        first = np.maximum(self.last + 1, since)
        return np.where(first < self.rows, (first - since).astype(np.float64), np.nan)


class FirstInside:
    """The first row in which each series of several was where it is awaited."""

    def __init__(self) -> None:
        self._rows = 0
        self._first: Array | None = None

    @property
    def all_known(self) -> bool:
        """Whether no further row can change anything."""
        return self._first is not None and not np.isnan(self._first).any()

    def add(self, inside: Mask) -> None:
        """Take the next rows, shape (rows, ...)."""
        if self._first is None:
            self._first = np.full(inside.shape[1:], np.nan)
        if inside.any():
            found = np.where(inside.any(axis=0), self._rows + np.argmax(inside, axis=0), np.nan)
            self._first = np.where(np.isnan(self._first), found, self._first)
        self._rows += len(inside)

    def first(self) -> Array:
        """The row of each, shape (...); NaN for none."""
        return np.full((), np.nan) if self._first is None else self._first


class EventTime(ABC):
    """The time of each run at which something happens, of all satellites that are meant.

    Attributes:
        needs: quantities that the blocks have to hold.
    """

    def __init__(self, stretch: Stretch, series: str, level: float, step: float) -> None:
        """What is read.

        Args:
            stretch: all rows, and the satellites that are meant.
            series: quantity by its name, shape (K, R, N).
            level: at or below which it is awaited.
            step: control period, s.
        """
        self.needs = base_quantities((series, "absent"))
        self._reader = StretchReader(stretch)
        self._series = quantity(series)
        self._level, self._step, self._runs = level, step, 0

    def update(self, block: FlightBlock) -> None:
        """Take the next block of the flights."""
        self._runs = block.runs
        part = self._reader.read(block, self._series)
        if part is not None:
            self.take(part)

    def figures(self) -> Array:
        """The figure of each run, shape (R,); NaN for a run that does not give it."""
        return np.broadcast_to(self._rows() * self._step, (self._runs,)).copy()

    @abstractmethod
    def take(self, part: Part) -> None:
        """Take the next rows."""

    @abstractmethod
    def _rows(self) -> Array:
        """The row of the flight at which it happens, shape (R,)."""


class SettlingOf(EventTime):
    """Time after which a series of no satellite that flies exceeds a level again."""

    def __init__(self, stretch: Stretch, series: str, level: float, step: float) -> None:
        super().__init__(stretch, series, level, step)
        self._outside = LastOutside()

    def take(self, part: Part) -> None:
        self._outside.add(not_all_within(part.values, part.excused, self._level))

    def _rows(self) -> Array:
        return self._outside.settled()


def not_all_within(values: Array, excused: Mask | None, level: float) -> Mask:
    """Where not every satellite is at or below a level, or none flies.

    Args:
        values: shape (rows, R, columns).
        excused: who does not fly, shape (rows, R, columns); None for nobody.
        level: in the unit of the values.

    Returns:
        Shape (rows, R); what is missing is not below anything.
    """
    above = ~(values <= level)
    return any_of(above) if excused is None else any_of(above & ~excused) | excused.all(axis=-1)
