# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The arrays of one flight, and which of their numbers a figure is made of by its definition."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from satform.control.protocol import FlightSetting
from satform.record.flight_record import FlightRecord

SLACK = 1e-9
"""Relative slack of times, as the pages of the expectations say."""


@dataclass(frozen=True)
class Flight:
    """The arrays of one flight, and what the formulas below need of them."""

    names: tuple[str, ...]
    step: float
    arrays: dict[str, np.ndarray]
    mean_motion: float = 0.3
    """Of its chief, rad/s."""

    @property
    def setting(self) -> FlightSetting:
        return FlightSetting(self.mean_motion, self.step)

    @property
    def steps(self) -> int:
        return len(self.arrays["acceleration"])

    @property
    def record(self) -> FlightRecord:
        return FlightRecord(self.names, self.step, **self.arrays)

    @cached_property
    def absent(self) -> list[list[bool]]:
        """Who does not fly in each step and, as in the last step, at the end."""
        reference, command = self.arrays["reference_position"], self.arrays["acceleration"]
        steps = [
            [
                bool(np.isnan(reference[k, n]).all() and not command[k, n].any())
                for n in range(len(self.names))
            ]
            for k in range(self.steps)
        ]
        return [*steps, steps[-1]]

    def columns(self, names: tuple[str, ...] | None) -> list[int]:
        return [self.names.index(name) for name in names or self.names]

    def kept(
        self,
        series: np.ndarray,
        rows: list[int],
        columns: list[int],
        *,
        named: bool = False,
        of_others: bool = False,
        of_bodies: bool = False,
    ) -> np.ndarray | None:
        """The numbers of some rows; None where there is no figure."""
        if not rows or not len(series):
            return None
        if named and any(all(self.absent[k][n] for k in rows) for n in columns):
            return None
        for k in rows:
            for n in columns:
                away = any(self.absent[k]) if of_others else self.absent[k][n]
                excused = away and not np.isnan(series[0, n]).any() and not of_bodies
                if np.isnan(series[k, n]).any() and not excused:
                    return None
        return series[rows][:, columns]

    def window(
        self, expectation: Any, series: np.ndarray, *, held: bool = False, **how: bool
    ) -> np.ndarray | None:
        columns = self.columns(expectation.satellites)
        before, after = expectation.before, expectation.after * (1 - SLACK)
        if before is not None and before * (1 - SLACK) > self.steps * self.step:
            return None
        end = math.inf if before is None else before * (1 - SLACK if held else 1 + SLACK)
        rows = [k for k in range(len(series)) if after <= k * self.step <= end]
        named = expectation.satellites is not None and not how.get("of_bodies")
        return self.kept(series, rows, columns, named=named, **how)

    def row(self, expectation: Any, rows: int) -> list[int]:
        row = self.steps if expectation.at is None else round(expectation.at / self.step)
        return [] if row > self.steps else [min(row, rows - 1)]

    def excused(self, series: np.ndarray, k: int, n: int, *, of_others: bool = False) -> bool:
        away = any(self.absent[k]) if of_others else self.absent[k][n]
        return bool(away and np.isnan(series[k, n]).any() and not np.isnan(series[0, n]).any())

    def spread(self, k: int, columns: list[int]) -> float:
        series = self.arrays["arc_length"]
        flying = [series[k, n] for n in columns if not self.excused(series, k, n)]
        known = len(flying) > 1 and not any(math.isnan(own) for own in flying)
        return max(flying) - min(flying) if known else math.nan
