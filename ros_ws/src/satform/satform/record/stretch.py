# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A stretch of a flight: which rows and satellites a figure is made of, and what of them may be missing."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from satform.numeric.elementwise import Array
from satform.record.derived import absent_of_rows, excusable_rows
from satform.record.flight_block import FlightBlock
from satform.record.flight_record import FlightRecord

TIME_SLACK = 1e-9
"""Relative slack when a time is looked up on the grid of steps."""

Series: TypeAlias = Callable[[FlightBlock], Array]
"""Gives the rows of a block's series, shape (K or K + 1, R, N, ...); no rows where no satellite has it."""

Mask: TypeAlias = NDArray[np.bool_]

_Number = TypeVar("_Number", np.float64, np.bool_)


@dataclass(frozen=True)
class Stretch:
    """Consecutive rows of a flight, and the satellites that are meant.

    Attributes:
        first: first row, of steps or of states.
        end: row after the last one; not after `first` where there are none.
        columns: of the satellites that are meant, in order.
        named: whether each of them has to fly in one of these rows at least.
        of_others: whether a satellite cannot give the series either while another one does not fly.
        of_bodies: whether a satellite has it that does not fly, as it has a position.
    """

    first: int
    end: int
    columns: tuple[int, ...]
    named: bool = False
    of_others: bool = False
    of_bodies: bool = False


@dataclass(frozen=True)
class Part:
    """The rows of a stretch that a block holds, of the satellites that are meant.

    Attributes:
        first: row of the flight that comes first.
        values: shape (rows, R, columns, ...).
        excused: where what is missing may be left out, shape (rows, R, columns); None for nowhere.
    """

    first: int
    values: Array
    excused: Mask | None

    def gaps(self) -> Mask:
        """In which runs something is missing without an excuse, shape (R,)."""
        return gaps(self.values, self.excused)


class StretchReader:
    """Takes the rows of a stretch from the blocks of a flight, and keeps who flew in them.

    Memory: a few numbers for each run and satellite, whatever the length of the flight.
    """

    def __init__(self, stretch: Stretch) -> None:
        self.stretch = stretch
        self.rows = 0
        """Rows taken so far."""
        self._missing_at_first: Mask = np.zeros((), dtype=np.bool_)
        self._flown: Mask | None = None

    def read(self, block: FlightBlock, series: Series) -> Part | None:
        """The rows of the stretch in a block; None where it holds none.

        Args:
            block: the next one of the flight.
            series: what is read of it.
        """
        stretch, begin = self.stretch, block.first_step
        if begin == 0 and not stretch.of_bodies:
            self._missing_at_first = _missing_at_first(series(block), block)
        first, end = max(stretch.first - begin, 0), min(stretch.end - begin, block.steps + block.last)
        if first >= end:
            return None
        values = series(block)[first:end]
        if not len(values):
            return None
        self.rows += len(values)
        chosen = self.of_columns(values)
        if stretch.of_bodies:
            return Part(begin + first, chosen, None)
        if not block.any_not_flown:
            self._note_flown(block.runs, None)
            return Part(begin + first, chosen, None)
        rows = max(block.steps, end)
        self._note_flown(block.runs, self.of_columns(absent_of_rows(block.not_flown, rows)[first:end]))
        excusable = excusable_rows(block.not_flown, rows, clocked=block.clocked)[first:end]
        if stretch.of_others:
            excusable = np.broadcast_to(excusable.any(axis=2, keepdims=True), excusable.shape)
        # What is missing when a satellite flies first belongs to one that never gives it.
        excused = excusable & missing(values) & ~self._missing_at_first
        return Part(begin + first, chosen, self.of_columns(excused))

    def lacking(self) -> Mask:
        """In which runs a satellite that has to fly did not fly in any of the rows, shape (R,)."""
        flown = True if self._flown is None else self._flown.all(axis=1)
        return np.logical_not(flown)

    def of_columns(self, values: NDArray[_Number]) -> NDArray[_Number]:
        """The satellites that are meant: shape (rows, R, N, ...) to (rows, R, columns, ...)."""
        columns = self.stretch.columns
        if columns == tuple(range(columns[0], columns[-1] + 1)):
            return values[:, :, columns[0] : columns[-1] + 1]
        return values[:, :, list(columns)]

    def _note_flown(self, runs: int, absent: Mask | None) -> None:
        if not self.stretch.named:
            return
        if self._flown is None:
            self._flown = np.zeros((runs, len(self.stretch.columns)), dtype=np.bool_)
        self._flown |= True if absent is None else ~absent.all(axis=0)


def rows_of(series: Array, record: FlightRecord, stretch: Stretch) -> Array:
    """The rows of a stretch of a whole flight.

    Args:
        series: a row for each step or each state, a column for each satellite, shape (K or K + 1, N, ...).
        record: of the flight.
        stretch: rows and satellites.

    Returns:
        Shape (rows, columns, ...). Nothing is a number when something is missing without an excuse, or when
        a satellite that has to fly does not fly in any of these rows.
    """
    reader = StretchReader(stretch)
    part = reader.read(FlightBlock.of(record), lambda _: series[:, None])
    if part is None:
        return series[:0][:, list(stretch.columns)]
    whole = not (part.gaps() | reader.lacking())[0]
    return part.values[:, 0] if whole else np.full_like(part.values[:, 0], np.nan)


def _missing_at_first(values: Array, block: FlightBlock) -> Mask:
    """What is missing in the first step that a satellite flies, shape (1, R, N).

    On the wall clock a satellite may skip the first steps of the flight.

    Args:
        values: of a series, from the first step of the flight on.
        block: of the same rows.
    """
    if not len(values) or not block.clocked:
        return missing(values[:1])
    first = np.argmin(block.not_flown, axis=0)[None]
    index = first.reshape(*first.shape, *[1] * (values.ndim - 3))
    return missing(np.take_along_axis(values, index, axis=0))


def missing(values: Array) -> Mask:
    """Where a component of a series is not a number; shape (rows, R, N, ...), gives (rows, R, N)."""
    found = np.isnan(values)
    while found.ndim > 3:
        found = any_of(found)
    return found


def gaps(values: Array, excused: Mask | None) -> Mask:
    """In which runs something is missing without an excuse, so that nothing is judged by the rest.

    Args:
        values: shape (rows, R, columns, ...).
        excused: where what is missing may be left out, shape (rows, R, columns); None for nowhere.

    Returns:
        Shape (R,).
    """
    if not np.isnan(values).any():
        return np.zeros(values.shape[1], dtype=np.bool_)
    found = missing(values)
    return np.asarray((found if excused is None else found & ~excused).any(axis=(0, 2)))


_FEW = 8
"""Columns that are faster taken one by one than as numpy's last axis."""


def any_of(mask: Mask) -> Mask:
    """Whether any of the last axis is true; as `mask.any(axis=-1)`, faster where the axis is short."""
    if not 0 < mask.shape[-1] <= _FEW:
        return np.asarray(mask.any(axis=-1))
    found = mask[..., 0].copy()
    for column in range(1, mask.shape[-1]):
        found |= mask[..., column]
    return found


def rows_within(after: float, before: float | None, step: float, rows: int, *, held: bool) -> tuple[int, int]:
    """The rows whose times lie in a stretch of time.

    Args:
        after: its start, s.
        before: its end, s; None for the end of the flight.
        step: control period, s.
        rows: how many there are, the first at time zero.
        held: whether a row holds for the whole step that begins at its time, such as a command; the step
            that begins where the stretch ends is not part of it.

    Returns:
        The first row, and the row after the last one.
    """
    first = _first_where(after * (1 - TIME_SLACK), step, rows, beyond=False)
    if before is None:
        return first, rows
    end = before * (1 + (-TIME_SLACK if held else TIME_SLACK))
    return first, _first_where(end, step, rows, beyond=True)


def _first_where(bound: float, step: float, rows: int, *, beyond: bool) -> int:
    """The first row whose time is at a bound or later, or beyond it; the number of rows for none."""
    if bound / step > rows:
        return rows
    row = max(int(bound / step) - 1, 0)
    while row < rows and (row * step <= bound if beyond else row * step < bound):
        row += 1
    return row
