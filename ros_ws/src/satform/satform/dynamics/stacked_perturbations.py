# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Perturbations of the satellites of many runs: each distinct one is computed once a step."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from satform.dynamics.prescribed_disturbances import BoundedNoise, Constant, Harmonic, Perturbation
from satform.numeric.elementwise import Array, Indices
from satform.numeric.stacking import component_major

STACKED_PERTURBATIONS = (Constant, Harmonic, BoundedNoise)
"""Perturbations that can be stacked; one from another package cannot."""


@dataclass(frozen=True)
class _Wave:
    """Sinusoids of satellites, of which many are in phase.

    Attributes:
        amplitude: of each satellite, m/s^2, shape (M, 3).
        angular_frequency: of each distinct phase, rad/s, shape (U, 1).
        phase: the distinct ones, rad, shape (U, 3).
        own: which of them each satellite has, shape (M,).
        step: control period, s.
    """

    amplitude: Array
    angular_frequency: Array
    phase: Array
    own: Indices
    step: float

    def acceleration(self, step: int, offset: float) -> Array:
        time = step * self.step + offset
        wave = np.sin(self.angular_frequency * time + self.phase)
        product: Array = self.amplitude * _of_rows(wave, self.own)
        return product


class StackedPerturbations:
    """The sum of all perturbations on the satellites of many runs.

    Attributes:
        own: which of the distinct sums each satellite has, shape (M,); None where each has its own.
    """

    def __init__(self, runs: Sequence[Sequence[Perturbation]]) -> None:
        """Perturbations of many runs.

        Args:
            runs: perturbations of each run, for the same number of satellites, of the same kinds in the same
                order; at least one.
        """
        self._whole = [_concatenated(alike) for alike in zip(*runs, strict=True)]
        self._settle()

    def _settle(self) -> None:
        columns = [_numbers(perturbation) for perturbation in self._whole]
        self.own: Indices | None = None
        self._flown: list[Constant | _Wave | BoundedNoise] = [_quick(part) for part in self._whole]
        if all(column is not None for column in columns):
            first, own = _distinct([column for column in columns if column is not None])
            if 2 * len(first) <= len(own):
                self.own = own
                self._flown = [_quick(_rows(part, first)) for part in self._whole]

    def distinct(self, step: int, offset: float) -> Array:
        """The distinct sums, `offset` seconds into a step, m/s^2, shape (U, 3); M of them without `own`."""
        total: Array = self._flown[0].acceleration(step, offset)
        for perturbation in self._flown[1:]:
            total = total + perturbation.acceleration(step, offset)
        return total

    def acceleration(self, step: int, offset: float) -> Array:
        """As in `Perturbation`, shape (M, 3)."""
        total = self.distinct(step, offset)
        return total if self.own is None else _of_rows(total, self.own)

    def bound(self) -> Array:
        """As in `Perturbation`: of each perturbation the bound, added, shape (M, 3)."""
        bound: Array = np.add.reduce([part.bound() for part in self._whole])
        return bound

    def centre(self) -> Array:
        """As in `Perturbation`: of each perturbation the middle, added, shape (M, 3)."""
        centre: Array = np.add.reduce([part.centre() for part in self._whole])
        return centre

    def keep(self, rows: Indices) -> "StackedPerturbations":
        """The perturbations of some of the satellites; this object is not to be used on."""
        kept = object.__new__(StackedPerturbations)
        kept._whole = [_rows(part, rows) for part in self._whole]
        kept._settle()
        return kept


def _concatenated(runs: Sequence[Perturbation]) -> Constant | Harmonic | BoundedNoise:
    constants = [run for run in runs if isinstance(run, Constant)]
    waves = [run for run in runs if isinstance(run, Harmonic)]
    noises = [run for run in runs if isinstance(run, BoundedNoise)]
    if constants:
        return Constant(component_major(np.concatenate([run.value for run in constants])))
    if noises:
        return BoundedNoise.stacked(noises)
    frequency = [np.full((len(run.phase), 1), run.angular_frequency) for run in waves]
    return Harmonic(
        amplitude=np.concatenate([run.amplitude for run in waves]),
        angular_frequency=np.concatenate(frequency),
        phase=np.concatenate([run.phase for run in waves]),
        step=waves[0].step,
    )


def _numbers(perturbation: Constant | Harmonic | BoundedNoise) -> Array | None:
    """All that a satellite's perturbation depends on, a row for each; None where no two have the same."""
    match perturbation:
        case Constant():
            return perturbation.value
        case Harmonic():
            parts = (perturbation.amplitude, perturbation.phase, np.asarray(perturbation.angular_frequency))
            return np.concatenate(parts, axis=1)
        case BoundedNoise():
            return None


def _rows(
    perturbation: Constant | Harmonic | BoundedNoise, rows: Indices
) -> Constant | Harmonic | BoundedNoise:
    match perturbation:
        case Constant():
            return Constant(_of_rows(perturbation.value, rows))
        case BoundedNoise():
            return perturbation.keep(rows)
        case Harmonic():
            return Harmonic(
                amplitude=_of_rows(perturbation.amplitude, rows),
                angular_frequency=np.asarray(perturbation.angular_frequency)[rows],
                phase=_of_rows(perturbation.phase, rows),
                step=perturbation.step,
            )


def _quick(perturbation: Constant | Harmonic | BoundedNoise) -> Constant | _Wave | BoundedNoise:
    """The same numbers, with the sine of phases that many satellites share taken once."""
    if not isinstance(perturbation, Harmonic):
        return perturbation
    frequency = np.asarray(perturbation.angular_frequency)
    first, own = _distinct([perturbation.phase, frequency])
    everyone = np.arange(len(own))
    if 2 * len(first) > len(own):
        first, own = everyone, everyone
    return _Wave(
        amplitude=_of_rows(perturbation.amplitude, everyone),
        angular_frequency=frequency[first],
        phase=_of_rows(perturbation.phase, first),
        own=own,
        step=perturbation.step,
    )


def _distinct(columns: Sequence[Array]) -> tuple[Indices, Indices]:
    """Index of the first of each distinct row, and which of these each row is; bits are compared."""
    bits = np.ascontiguousarray(np.concatenate(columns, axis=1)).view(np.int64)
    _, first, own = np.unique(bits, axis=0, return_index=True, return_inverse=True)
    return first, own.reshape(-1)


def _of_rows(values: Array, rows: Indices) -> Array:
    """Rows of vectors (U, 3), shape (M, 3), a component of all of them in one piece of memory."""
    picked: Array = values.T.take(rows, axis=1).T
    return picked
