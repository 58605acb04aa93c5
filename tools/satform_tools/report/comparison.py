# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Compares two flights: the bits of every quantity, and the verdicts on their expectations."""

import math
from dataclasses import dataclass

import numpy as np

from satform.numeric.elementwise import Array
from satform.record.quantities import QUANTITIES
from satform.scenario.expectation import Verdict
from satform_tools.run.stored_run import StoredRun


@dataclass(frozen=True)
class Difference:
    """Difference of one quantity between two flights.

    Attributes:
        quantity: its name in the flight record.
        unit: of it.
        largest: difference of any number, over the steps that both flights have; NaN when there is none.
        step: at which it is.
        satellite: to which it belongs.
        first: step of the first number that has other bits; None when all have the same.
    """

    quantity: str
    unit: str
    largest: float
    step: int
    satellite: str
    first: int | None


@dataclass(frozen=True)
class Expected:
    """One expectation in two flights.

    Attributes:
        label: what was measured.
        unit: of the figures.
        first: verdict on the first flight; None when it was not asked or not judged.
        second: verdict on the second flight, likewise.
    """

    label: str
    unit: str
    first: Verdict | None
    second: Verdict | None

    @property
    def difference(self) -> float:
        """Second figure less the first; NaN when there is not one of each."""
        if self.first is None or self.second is None:
            return math.nan
        return self.second.figure - self.first.figure


@dataclass(frozen=True)
class Comparison:
    """Two flights side by side.

    Attributes:
        same: whether every number of both has the same bits.
        incomparable: why numbers cannot be compared step by step; empty when they can.
        differences: one for each quantity that both have.
        expected: expectation by expectation.
    """

    same: bool
    incomparable: str
    differences: tuple[Difference, ...]
    expected: tuple[Expected, ...]

    @property
    def sentence(self) -> str:
        """The conclusion in one line."""
        if self.same:
            return "Bitwise equal."
        if self.incomparable:
            return f"Different flights: {self.incomparable}."
        firsts = [entry.first for entry in self.differences if entry.first is not None]
        if not firsts:
            return "Bitwise equal over the steps of both; one is longer."
        return f"Not equal: {len(firsts)} quantities differ, the first at step {min(firsts)}."


def compare(first: StoredRun, second: StoredRun) -> Comparison:
    """Two flights side by side.

    Args:
        first: a flight.
        second: another one, of the same or of another scenario.

    Returns:
        The comparison.
    """
    reason = _incomparable(first, second)
    found = () if reason else tuple(_difference(first, second, name) for name in QUANTITIES)
    return Comparison(
        same=not first.record.differences(second.record),
        incomparable=reason,
        differences=tuple(entry for entry in found if entry is not None),
        expected=tuple(_expected(first.verdicts(), second.verdicts())),
    )


def _incomparable(first: StoredRun, second: StoredRun) -> str:
    one, other = first.record, second.record
    if one.satellites != other.satellites:
        return f"one has {_named(one.satellites)}, the other {_named(other.satellites)}"
    if one.step != other.step:
        return f"one has steps of {one.step:g} s, the other of {other.step:g} s"
    return ""


def _named(satellites: tuple[str, ...]) -> str:
    return ", ".join(satellites) if len(satellites) <= 6 else f"{len(satellites)} satellites"


def _difference(first: StoredRun, second: StoredRun, name: str) -> Difference | None:
    mine, theirs = getattr(first.record, name), getattr(second.record, name)
    rows = min(len(mine), len(theirs))
    if rows == 0:
        return None
    one, other = mine[:rows], theirs[:rows]
    if np.all(np.isnan(one)) and np.all(np.isnan(other)):
        return None
    unequal = np.flatnonzero((one.view(np.uint64) != other.view(np.uint64)).reshape(rows, -1).any(axis=1))
    apart: Array = np.abs(other - one)
    step, satellite, largest = 0, 0, math.nan
    if np.any(np.isfinite(apart)):
        index = np.unravel_index(int(np.nanargmax(apart)), apart.shape)
        step, satellite, largest = int(index[0]), int(index[1]), float(apart[index])
    return Difference(
        quantity=name,
        unit=QUANTITIES[name].unit,
        largest=largest,
        step=step,
        satellite=first.record.satellites[satellite],
        first=int(unequal[0]) if unequal.size else None,
    )


def _expected(first: list[Verdict], second: list[Verdict]) -> list[Expected]:
    """Expectations of both by their labels: those of the first in their order, then those of the second."""
    theirs = {(verdict.label, verdict.unit): verdict for verdict in second}
    found = []
    for verdict in first:
        key = (verdict.label, verdict.unit)
        found.append(Expected(*key, verdict, theirs.pop(key, None)))
    return [*found, *(Expected(*key, None, verdict) for key, verdict in theirs.items())]
