# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Seeded random numbers that can be asked for at any step, one stream a satellite or link."""

from collections.abc import Sequence

import numpy as np

from satform.numeric.elementwise import Array

THRUSTER_STREAM = 1_000_001
"""Stream of the thrusters' errors."""
NAVIGATION_STREAM = 1_000_002
"""Stream of the navigation's white noise."""
LINK_STREAM = 1_000_003
"""Stream of what happens to messages on their way."""

_BLOCK = 256


class SeededNormals:
    """Standard normal numbers as a pure function of seed, stream, satellite and step.

    A satellite's numbers do not depend on who else flies, nor on which steps were asked for before.

    Attributes:
        seed: of the run.
        stream: keeps apart what is random for different reasons.
        satellites: indices of the satellites in the formation, N of them; or numbers of links.
        width: numbers a satellite and step.
    """

    def __init__(self, seed: int, stream: int, satellites: Sequence[int], width: int) -> None:
        self.seed = seed
        self.stream = stream
        self.satellites = tuple(satellites)
        self.width = width
        self._block = -1
        self._numbers = np.empty((0, 0, 0))

    def at(self, step: int) -> Array:
        """The numbers of one step, shape (N, width)."""
        block, row = divmod(step, _BLOCK)
        if block != self._block:
            generators = [
                np.random.default_rng([self.seed, self.stream, satellite, block])
                for satellite in self.satellites
            ]
            self._numbers = np.stack([self._drawn(generator) for generator in generators], axis=1)
            self._block = block
        numbers: Array = self._numbers[row]
        return numbers

    def _drawn(self, generator: np.random.Generator) -> Array:
        return generator.standard_normal((_BLOCK, self.width))


class SeededUniforms(SeededNormals):
    """The same with numbers that are evenly spread over [0, 1)."""

    def _drawn(self, generator: np.random.Generator) -> Array:
        return generator.random((_BLOCK, self.width))
