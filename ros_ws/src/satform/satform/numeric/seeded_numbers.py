# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Seeded random numbers that can be asked for at any step, one stream a satellite or link."""

from collections.abc import Sequence
from typing import Self

import numpy as np

from satform.numeric.elementwise import Array, Indices
from satform.numeric.recorded_arrays import Recorded

_BLOCK = 256
"""Steps whose numbers come from one generator."""
_PART = 128
"""Steps of a block that are drawn at once for many satellites, which bounds the memory."""
_MANY = 64
"""Satellites from which on a block is drawn part by part."""


class SeededNormals:
    """Standard normal numbers as a pure function of seed, stream, satellite and step.

    A satellite's numbers do not depend on who else flies, nor on which steps were asked for before.

    Attributes:
        seeds: of the run that each satellite belongs to.
        stream: keeps apart what is random for different reasons.
        satellites: index of each satellite in the formation of its run, M of them; or numbers of links.
        width: numbers a satellite and step.
    """

    def __init__(self, seed: int | Sequence[int], stream: int, satellites: Sequence[int], width: int) -> None:
        """Numbers of some satellites.

        Args:
            seed: of the run; or that of each satellite's run, M of them, for satellites of many runs.
            stream: keeps apart what is random for different reasons.
            satellites: index of each satellite in the formation of its run.
            width: numbers a satellite and step.
        """
        self.satellites = tuple(satellites)
        self.seeds = (seed,) * len(self.satellites) if isinstance(seed, int) else tuple(seed)
        self.stream = stream
        self.width = width
        self._part_steps = _PART if len(self.satellites) >= _MANY else _BLOCK
        self._part = -1
        self._generators: list[np.random.Generator] = []
        self._numbers = np.empty((0, 0, 0))

    def at(self, step: int) -> Array:
        """The numbers of one step, shape (M, width)."""
        if isinstance(step, Recorded):
            return step.called(self.at)
        part, row = divmod(step, self._part_steps)
        if part != self._part:
            self._draw(part)
        numbers: Array = self._numbers[row].T
        return numbers

    def keep(self, rows: Indices) -> Self:
        """The numbers of some of the satellites alone; this object is not to be used any more.

        Args:
            rows: indices of these satellites among those here, each once.
        """
        kept = type(self)(
            [self.seeds[row] for row in rows.tolist()],
            self.stream,
            [self.satellites[row] for row in rows.tolist()],
            self.width,
        )
        if kept._part_steps == self._part_steps:
            kept._part = self._part
            kept._generators = [self._generators[row] for row in rows.tolist()] if self._generators else []
            kept._numbers = self._numbers[..., rows]
        return kept

    def _draw(self, part: int) -> None:
        """Draw a part of a block; components in front, so that a number of all satellites is in one piece."""
        block, begin = divmod(part * self._part_steps, _BLOCK)
        # A block's generators go on where they are if this part follows the one drawn last.
        if begin == 0 or part != self._part + 1:
            self._generators = [
                _generator(seed, self.stream, satellite, block)
                for seed, satellite in zip(self.seeds, self.satellites, strict=True)
            ]
            if begin:
                for generator in self._generators:
                    self._fill(generator, np.empty((begin, self.width)))
        drawn = np.empty((len(self._generators), self._part_steps, self.width))
        for generator, numbers in zip(self._generators, drawn, strict=True):
            self._fill(generator, numbers)
        self._numbers = np.ascontiguousarray(self._spread(drawn).transpose(1, 2, 0))
        self._part = part

    def _fill(self, generator: np.random.Generator, numbers: Array) -> None:
        generator.standard_normal(out=numbers)

    def _spread(self, numbers: Array) -> Array:
        return numbers


class SeededUniforms(SeededNormals):
    """The same with numbers that are evenly spread over [0, 1)."""

    def _fill(self, generator: np.random.Generator, numbers: Array) -> None:
        generator.random(out=numbers)


class SeededSigned(SeededUniforms):
    """The same with numbers that are evenly spread over [-1, 1)."""

    def _spread(self, numbers: Array) -> Array:
        # As `Generator.uniform` does it.
        return -1.0 + 2.0 * numbers


def _generator(*numbers: int) -> np.random.Generator:
    """`default_rng` of a list of non-negative numbers, in two thirds of its time where they are short."""
    if max(numbers) >> 32:
        return np.random.default_rng(list(numbers))
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(np.array(numbers, dtype=np.uint32))))
