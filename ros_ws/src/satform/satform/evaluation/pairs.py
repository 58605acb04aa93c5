# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of satellites, and their closest approaches as they are found block by block."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated, TypeAlias

import numpy as np
from pydantic import Field

from satform.evaluation.reducers import quantity
from satform.numeric.elementwise import Array, dot
from satform.record.flight_block import FlightBlock
from satform.record.stretch import Stretch, StretchReader
from satform.scenario.parts import Timing
from satform.scenario.windowed_expectation import OverWindow

MOST_SATELLITES = 100
"""Satellites whose pairs are judged together."""


class OfPairs(OverWindow):
    """An expectation of two satellites, or of all pairs of several."""

    satellites: Annotated[tuple[str, ...], Field(min_length=2)] | None = None
    """Names of the two satellites, or of several whose pairs are all meant; all pairs when left out."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = super().complaints(satellites, timing)
        names = self.satellites or ()
        twice = sorted({name for name in names if names.count(name) > 1})
        own += [f"a pair is of two different satellites; found {name} twice" for name in twice]
        count = len(satellites) if self.satellites is None else len(names)
        if count < 2:
            own.append("a pair is of two satellites; there is one")
        if count > MOST_SATELLITES:
            own.append(f"pairs of at most {MOST_SATELLITES} satellites are judged; found {count}: name some")
        return own


def pairs_of(stretch: Stretch) -> tuple[tuple[int, int], ...]:
    """All pairs of the satellites of a stretch, by their positions among its columns."""
    return tuple(combinations(range(len(stretch.columns)), 2))


def between(values: Array, pairs: tuple[tuple[int, int], ...]) -> Array:
    """A quantity of the first of each pair less that of the second.

    Args:
        values: shape (..., columns, n).
        pairs: P of them, by positions among the columns.

    Returns:
        Shape (..., P, n).
    """
    first, second = (list(own) for own in zip(*pairs, strict=True))
    difference: Array = values[..., first, :] - values[..., second, :]
    return difference


@dataclass(frozen=True)
class Approaches:
    """The closest approach of each of P pairs in each of R runs.

    Attributes:
        time: s, shape (R, P).
        separation: of the first from the second, LVLH, m, shape (R, P, 3).
        velocity: of the first relative to the second, m/s, shape (R, P, 3).
        covariance: sum of the covariances of both estimated positions, m^2, shape (R, P, 3, 3); NaN where a
            filter does not give it, or it was not asked for.
    """

    time: Array
    separation: Array
    velocity: Array
    covariance: Array


ApproachFigure: TypeAlias = Callable[[Approaches], Array]
"""Makes the figure of each run, shape (R,)."""


class ClosestApproaches:
    """A figure of the closest approaches of pairs of satellites, which move evenly between two steps.

    Memory: time, separation, velocity and covariance of each pair's closest approach so far.
    """

    def __init__(
        self, stretch: Stretch, step: float, figure: ApproachFigure, *, covariances: bool = False
    ) -> None:
        """What is read.

        Args:
            stretch: rows of states, and the satellites whose pairs are meant.
            step: control period, s.
            figure: made of the closest approaches.
            covariances: whether it needs those of the estimated positions.
        """
        names = {"position", "velocity"} | ({"estimate_covariance"} if covariances else set())
        self.needs = frozenset(names)
        self._positions, self._velocities = StretchReader(stretch), StretchReader(stretch)
        self._columns, self._pairs = list(stretch.columns), pairs_of(stretch)
        self._step, self._figure, self._covariances = step, figure, covariances
        self._begins, self._ends = stretch.first * step, (stretch.end - 1) * step
        self._squared = self._gap = np.zeros(0)
        self._best: Mapping[str, Array] = {}

    def update(self, block: FlightBlock) -> None:
        """Take the next block of the flights."""
        if not block.first_step:
            shape = (block.runs, len(self._pairs))
            self._squared, self._gap = np.full(shape, np.inf), np.zeros(block.runs)
            sizes = {"time": (), "separation": (3,), "velocity": (3,), "covariance": (3, 3)}
            self._best = {name: np.full((*shape, *size), np.nan) for name, size in sizes.items()}
        positions = self._positions.read(block, quantity("position"))
        velocities = self._velocities.read(block, quantity("velocity"))
        if positions is None or velocities is None:
            return
        self._gap += positions.gaps()
        self._gap += velocities.gaps()
        rows = np.arange(positions.first, positions.first + len(positions.values))
        time = (rows * self._step)[:, None, None]
        apart, closing = (between(part.values, self._pairs) for part in (positions, velocities))
        speed_squared = dot(closing, closing)
        ahead = -dot(apart, closing) / np.where(speed_squared > 0.0, speed_squared, 1.0)
        ahead = np.clip(ahead, -0.5 * self._step, 0.5 * self._step)
        ahead = np.clip(time + ahead, self._begins, self._ends) - time
        nearest = apart + ahead[..., None] * closing
        squared = dot(nearest, nearest)
        best = np.argmin(squared, axis=0)[None]
        least = np.take_along_axis(squared, best, axis=0)[0]
        found = {
            "time": np.take_along_axis(time + ahead, best, axis=0)[0],
            "separation": np.take_along_axis(nearest, best[..., None], axis=0)[0],
            "velocity": np.take_along_axis(closing, best[..., None], axis=0)[0],
        }
        if self._covariances:
            found["covariance"] = self._covariance(block, rows[best[0]] - block.first_step)
        self._keep(least < self._squared, found)
        self._squared = np.where(least < self._squared, least, self._squared)

    def figures(self) -> Array:
        """The figure of each run, shape (R,); NaN for a run that does not give it."""
        if not self._positions.rows:
            return np.full(len(self._gap), np.nan)
        return np.where(self._gap > 0.0, np.nan, self._figure(self.approaches()))

    def approaches(self) -> Approaches:
        """The closest approaches after the last block."""
        return Approaches(**self._best)

    def _keep(self, nearer: Array, found: Mapping[str, Array]) -> None:
        self._best = {
            name: np.where(nearer.reshape(nearer.shape + (1,) * (own.ndim - 2)), found[name], own)
            if name in found
            else own
            for name, own in self._best.items()
        }

    def _covariance(self, block: FlightBlock, rows: Array) -> Array:
        """Sum of both covariances in some rows, the last one for the state after it, shape (R, P, 3, 3)."""
        estimates = block.estimate_covariance
        shape = (*rows.shape, 3, 3)
        if not len(estimates):
            return np.full(shape, np.nan)
        runs = np.arange(block.runs)[:, None]
        row = np.minimum(rows, len(estimates) - 1)
        both = np.zeros(shape)
        for own in zip(*self._pairs, strict=True):
            columns = np.array([self._columns[column] for column in own])[None]
            both = both + estimates[row, runs, columns, :3, :3]
        return both
