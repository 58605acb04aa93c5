# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures over a stretch of a flight, made while it is flown: extremes, sums, changes, and moments.

Each needs memory for a few numbers of each run and satellite, whatever the length of the flight.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock, base_quantities
from satform.record.stretch import Mask, Part, Series, Stretch, StretchReader

Transform: TypeAlias = Callable[[Array], Array]
"""Makes the numbers of a figure from the values of a part, shape (rows, R, columns, ...)."""

Extreme: TypeAlias = Literal["minimum", "maximum"]


def quantity(name: str) -> Series:
    """The series of a quantity of a `FlightRecord`, or of a derived one."""

    def series(block: FlightBlock) -> Array:
        values: Array = getattr(block, name)
        return values

    return series


class OverStretch(ABC):
    """A figure over a stretch. None where something is missing without an excuse, or nobody flies.

    Attributes:
        needs: quantities that the blocks have to hold.
    """

    def __init__(self, stretch: Stretch, series: str | Series, needs: Iterable[str] = ()) -> None:
        """What is read.

        Args:
            stretch: rows and satellites.
            series: what is read of them: a quantity by its name, or a function of a block.
            needs: quantities, derived ones too, that such a function reads.
        """
        names = (series,) if isinstance(series, str) else tuple(needs)
        flies = () if stretch.of_bodies else ("absent",)
        self.needs = base_quantities((*names, *flies))
        self._series = quantity(series) if isinstance(series, str) else series
        self._reader = StretchReader(stretch)
        self._gap: Mask = np.zeros(0, dtype=np.bool_)

    def update(self, block: FlightBlock) -> None:
        """Take the next block of the flights."""
        if not block.first_step:
            self._gap = np.zeros(block.runs, dtype=np.bool_)
        part = self._reader.read(block, self._series)
        if part is not None:
            self._gap |= part.gaps()
            self.take(part)

    def figures(self) -> Array:
        """The figure of each run, shape (R,); NaN for a run that does not give it."""
        if not self._reader.rows:
            return np.full(len(self._gap), np.nan)
        # What is missing is met with NaN below, and needs no warning.
        with np.errstate(all="ignore"):
            return np.where(self._gap | self._reader.lacking(), np.nan, self.found())

    @abstractmethod
    def take(self, part: Part) -> None:
        """Take the next rows of the stretch."""

    @abstractmethod
    def found(self) -> Array:
        """The figure from at least one row, shape (R,)."""


class ExtremeOf(OverStretch):
    """The largest or smallest number of all rows and satellites, leaving out what is excused."""

    def __init__(
        self,
        stretch: Stretch,
        series: str | Series,
        needs: Iterable[str] = (),
        *,
        which: Extreme = "maximum",
        transform: Transform | None = None,
    ) -> None:
        """What is read, as `OverStretch`.

        Args:
            stretch: rows and satellites.
            series: what is read of them.
            needs: quantities that it reads.
            which: largest or smallest.
            transform: makes the numbers, shape (rows, R, ...), from values of shape (rows, R, columns, ...).
        """
        super().__init__(stretch, series, needs)
        self._of_numbers = np.fmax if which == "maximum" else np.fmin
        self._transform = transform
        self._extreme: Array | None = None

    def take(self, part: Part) -> None:
        values = part.values if self._transform is None else self._transform(part.values)
        extreme = self._of_numbers.reduce(values, axis=0)
        self._extreme = extreme if self._extreme is None else self._of_numbers(self._extreme, extreme)

    def found(self) -> Array:
        assert self._extreme is not None  # noqa: S101 - a row was taken
        found: Array = self._of_numbers.reduce(self._extreme.reshape(len(self._extreme), -1), axis=1)
        return found


class MeanOf(OverStretch):
    """The mean of all numbers, each satellite's summed in the order of steps, then over the satellites."""

    def __init__(
        self,
        stretch: Stretch,
        series: str | Series,
        needs: Iterable[str] = (),
        *,
        root_of_squares: bool = False,
        transform: Transform | None = None,
    ) -> None:
        """What is read, as `OverStretch`.

        Args:
            stretch: rows and satellites.
            series: what is read of them, shape (rows, R, N) where nothing is made of it.
            needs: quantities that it reads.
            root_of_squares: whether the root of the mean square is meant.
            transform: makes the numbers, shape (rows, R, n), from values of shape (rows, R, columns, ...).
        """
        super().__init__(stretch, series, needs)
        self._squares, self._transform = root_of_squares, transform
        self._sums = MeanBySatellite()

    def take(self, part: Part) -> None:
        values = part.values if self._transform is None else self._transform(part.values)
        self._sums.add(values * values if self._squares else values)

    def found(self) -> Array:
        total = np.add.accumulate(self._sums.total, axis=1)[:, -1]
        mean = total / self._sums.count.sum(axis=1)
        found: Array = np.sqrt(mean) if self._squares else mean
        return found


class MeanBySatellite:
    """Sums and counts of the numbers of each satellite of each run.

    Attributes:
        total: sums in the order of steps, shape (R, columns).
        count: of numbers, shape (R, columns).
    """

    def __init__(self) -> None:
        self.total: Array = np.zeros(())
        self.count: NDArray[np.int64] = np.zeros((), dtype=np.int64)

    def add(self, values: Array) -> None:
        """Add the next rows, shape (rows, R, columns); what is not a number is left out."""
        unknown = np.isnan(values)
        if unknown.any():
            self.count = self.count + np.count_nonzero(~unknown, axis=0)
            values = np.where(unknown, 0.0, values)
        else:
            self.count = self.count + np.int64(len(values))
        self.total = added_in_order(self.total, values)
        self.count = np.broadcast_to(self.count, self.total.shape)

    def mean(self) -> Array:
        """Of each satellite, shape (R, columns); NaN for one without numbers."""
        mean: Array = self.total / self.count
        return mean


class LargestSum(OverStretch):
    """The largest of the satellites' sums, in the order of steps; of those that always give a number."""

    _total: Array = np.zeros(())

    def take(self, part: Part) -> None:
        self._total = added_in_order(self._total, part.values)

    def found(self) -> Array:
        found: Array = np.fmax.reduce(self._total, axis=1)
        return found


class LargestChange(OverStretch):
    """The largest of the satellites' changes from the first row to the last; NaN for fewer than two rows."""

    def __init__(self, stretch: Stretch, series: str, *, magnitude: bool = True) -> None:
        """What is read, as `OverStretch`.

        Args:
            stretch: rows and satellites.
            series: quantity by its name, shape (rows, R, N).
            magnitude: whether a decrease counts as a change, too.
        """
        super().__init__(stretch, series)
        self._magnitude = magnitude
        self._known = False
        self._first = self._last = np.zeros(())

    def take(self, part: Part) -> None:
        if not self._known:
            self._known, self._first = True, part.values[0].copy()
        self._last = part.values[-1].copy()

    def found(self) -> Array:
        change = self._last - self._first
        found: Array = np.fmax.reduce(np.abs(change) if self._magnitude else change, axis=1)
        return found if self._reader.rows > 1 else np.full_like(found, np.nan)


class OffsetOf(OverStretch):
    """The mean of each satellite's component that is furthest from zero, the first of equal ones."""

    def __init__(self, stretch: Stretch, series: str, axis: int) -> None:
        """What is read, as `OverStretch`.

        Args:
            stretch: rows and satellites.
            series: quantity by its name, shape (rows, R, N, 3).
            axis: index of the component.
        """
        super().__init__(stretch, series)
        self._axis = axis
        self._sums = MeanBySatellite()

    def take(self, part: Part) -> None:
        self._sums.add(part.values[..., self._axis])

    def found(self) -> Array:
        means = self._sums.mean()
        furthest = np.argmax(np.where(np.isnan(means), -np.inf, np.abs(means)), axis=1)
        chosen: Array = means[np.arange(len(means)), furthest]
        return chosen


class HalfRangeOf(OverStretch):
    """Half of the largest satellite's range of a component; of satellites with two numbers or more."""

    def __init__(self, stretch: Stretch, series: str, axis: int) -> None:
        """What is read, as `OffsetOf`."""
        super().__init__(stretch, series)
        self._axis = axis
        self._least: Array = np.full((), np.nan)
        self._most: Array = np.full((), np.nan)
        self._count: NDArray[np.int64] = np.zeros((), dtype=np.int64)

    def take(self, part: Part) -> None:
        values = part.values[..., self._axis]
        self._least = np.fmin(self._least, np.fmin.reduce(values, axis=0))
        self._most = np.fmax(self._most, np.fmax.reduce(values, axis=0))
        self._count = self._count + np.count_nonzero(~np.isnan(values), axis=0)

    def found(self) -> Array:
        spread = np.where(self._count > 1, self._most - self._least, np.nan)
        half: Array = 0.5 * np.fmax.reduce(spread, axis=1)
        return half


_WIDE = 64
"""Numbers in a row from which on rows are added one by one."""


def added_in_order(total: Array, values: Array) -> Array:
    """A sum over rows, one after the other, so that its bits do not depend on where the rows are cut.

    Args:
        total: of the rows so far, shape (...) or () before the first.
        values: next rows, shape (rows, ...).

    Returns:
        Shape (...).
    """
    if values[0].size < _WIDE:
        start = np.broadcast_to(total, (1, *values.shape[1:]))
        return np.asarray(np.add.accumulate(np.concatenate((start, values)), axis=0)[-1].copy())
    whole = np.array(np.broadcast_to(total, values.shape[1:]))
    for row in values:
        whole += row
    return whole


def highest_of(values: Array) -> Array:
    """The largest of the last axis; NaN where one of it is. As `np.max`, faster where the axis is short."""
    if values.shape[-1] > math.isqrt(_WIDE):
        return np.asarray(np.max(values, axis=-1))
    found = values[..., 0].copy()
    for column in range(1, values.shape[-1]):
        np.maximum(found, values[..., column], out=found)
    return found
