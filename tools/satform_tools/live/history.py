# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the live page shows over time: columns of numbers, events; all of a bounded number."""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from satform.numeric.elementwise import Array
from satform_tools.report.page.document import packed

MOST_ROWS = 3000
"""Rows that a history has at most: every second one of the older is then left out."""

_MOST_POSITIONS = 120_000
_FEWEST_ROWS = 60


def rows_for(satellites: int) -> int:
    """Rows that the history of a formation has at most, so that large formations fit into a browser, too."""
    return max(_FEWEST_ROWS, min(MOST_ROWS, _MOST_POSITIONS // max(1, satellites)))


class Recent:
    """The newest entries of a list of any length.

    Attributes:
        count: of all entries so far, those included that are not kept.
    """

    def __init__(self, most: int, entries: Iterable[dict[str, Any]] = ()) -> None:
        """Keep entries.

        Args:
            most: that are kept.
            entries: the first ones.
        """
        self._entries: deque[dict[str, Any]] = deque(maxlen=most)
        self.count = 0
        for entry in entries:
            self.append(entry)

    def append(self, entry: dict[str, Any]) -> None:
        """Add an entry, in place of the oldest one where there are too many."""
        self._entries.append(entry)
        self.count += 1

    def after(self, count: int) -> list[dict[str, Any]]:
        """The entries that came after the first so many, those that are not kept left out."""
        new = min(len(self._entries), self.count - count)
        return list(self._entries)[len(self._entries) - new :]


@dataclass(frozen=True)
class Column:
    """A quantity of each row.

    Attributes:
        width: numbers in a row.
        double: whether the page needs 64 bits of each, as of a time, instead of 32.
    """

    width: int
    double: bool = False


class History:
    """Rows of a flight, by time.

    When it is full, every second row is left out, and from then on rows are taken at twice the interval at
    least: a flight of any length has at most `most` rows, evenly spread.

    Attributes:
        columns: by name.
        most: rows that it may have.
    """

    def __init__(self, columns: Mapping[str, Column], most: int = MOST_ROWS) -> None:
        """A history without rows.

        Args:
            columns: by name; `time` in s is added.
            most: rows that it may have.
        """
        self.most = most
        self.columns = {"time": Column(1, double=True), **columns}
        self._rows: list[dict[str, Array]] = []
        self._interval = 0.0

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def last_time(self) -> float:
        """Time of the newest row, s; minus infinity before the first."""
        return float(self._rows[-1]["time"][0]) if self._rows else -np.inf

    def append(self, time: float, values: Mapping[str, ArrayLike]) -> bool:
        """Add a row, unless it is not later than the last one by the present interval.

        Args:
            time: simulated, s.
            values: by column; those that are left out are not a number.

        Returns:
            Whether it was added.
        """
        if time <= self.last_time or time < self.last_time + self._interval:
            return False
        row = {"time": np.array([time])}
        for name, column in self.columns.items():
            if name != "time":
                given = values.get(name)
                flat = np.full(column.width, np.nan) if given is None else np.ravel(np.asarray(given, float))
                if flat.shape != (column.width,):
                    raise ValueError(f"{name}: found {flat.size} numbers; a row has {column.width}")
                row[name] = flat
        self._rows.append(row)
        if len(self._rows) >= self.most:
            self._interval = max(2.0 * self._interval, 1.5 * self._mean_interval())
            self._rows = self._rows[::2]
        return True

    def packed(self, after: float) -> dict[str, Any] | None:
        """Rows after a time, as the page takes them; None where there are none.

        Args:
            after: time, s.

        Returns:
            Number of rows, and each column as base64 of little-endian numbers.
        """
        first = next((k for k in range(len(self._rows), 0, -1) if self._rows[k - 1]["time"][0] <= after), 0)
        rows = self._rows[first:]
        if not rows:
            return None
        return {
            "count": len(rows),
            "columns": {
                name: packed(np.stack([row[name] for row in rows]), double=column.double)
                for name, column in self.columns.items()
            },
        }

    def _mean_interval(self) -> float:
        first, last = self._rows[0]["time"][0], self._rows[-1]["time"][0]
        return float(last - first) / max(1, len(self._rows) - 1)
