# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How the cases of a campaign are sampled: what each case has on each axis.

An axis is one random or enumerated number: that of a dispersion, or of one field of a dispersion with a
wildcard. Case N has a quantile on it, an index into the values of a grid, or the scenario's own value.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from satform.campaign.distributions import LARGEST_QUANTILE, LEAST_QUANTILE
from satform.common.spec import Spec
from satform.numeric.elementwise import Array

MONTE_CARLO_STREAM = 2_000_001
"""Stream of the quantiles of Monte Carlo cases."""
LATIN_HYPERCUBE_STREAM = 2_000_002
"""Stream of a Latin hypercube."""
SOBOL_STREAM = 2_000_003
"""Stream of the scrambling of a Sobol sequence."""
CASE_SEED_STREAM = 2_000_004
"""Stream of the seeds of the cases' scenarios."""

MOST_CASES = 10_000_000
"""Cases of a campaign at most."""
MOST_SOBOL_AXES = 21_201
"""Axes of a Sobol sequence at most: those of scipy's table."""
MOST_HYPERCUBE_NUMBERS = 50_000_000
"""Cases times axes of a Latin hypercube at most: the whole design is held in memory, 8 bytes each."""

_BLOCK = 256
"""Points of a Sobol sequence that are made at once; a power of two, which keeps its balance."""

Coordinate = float | int | None
"""Of a case on an axis: a quantile, the index of a value of a grid, or None for the scenario's own value."""


@dataclass(frozen=True)
class Axis:
    """One coordinate of a case.

    Attributes:
        count: values of its grid; 0 for an axis with a distribution.
        dispersion: index of its dispersion in the campaign.
    """

    count: int
    dispersion: int


class Sampling(Spec):
    """How the cases of a campaign are chosen."""

    enumerates: ClassVar[bool] = False
    """Whether the number of cases follows from the values that are listed, not from `runs`."""
    takes_grids: ClassVar[bool] = False
    """Whether a dispersion may list its values."""
    is_random: ClassVar[bool] = True
    """Whether the cases are drawn at random from the distributions. Only then statistics of all cases have
    confidence intervals and p-values."""

    def cases(self, axes: Sequence[Axis], runs: int | None) -> int:
        """Number of cases.

        Args:
            axes: of the campaign.
            runs: of the campaign; None for a sampling that enumerates.
        """
        assert runs is not None  # noqa: S101 - the campaign's validator has seen to it
        return runs

    def complaint(self, axes: int, runs: int) -> str:
        """What this sampling cannot do with a number of axes and cases; empty when it can."""
        return ""

    def coordinates(self, axes: Sequence[Axis], runs: int, seed: int, number: int) -> list[Coordinate]:
        """The coordinates of a case: a pure function of the arguments.

        Args:
            axes: of the campaign.
            runs: number of cases.
            seed: of the campaign.
            number: of the case, from 0.

        Returns:
            One for each axis.
        """
        raise NotImplementedError


class MonteCarloSpec(Sampling):
    """Independent random cases. Case N depends on the campaign's seed and N, not on the number of runs."""

    kind: Literal["monte_carlo"] = "monte_carlo"

    def coordinates(self, axes: Sequence[Axis], runs: int, seed: int, number: int) -> list[Coordinate]:
        return list(_random_quantiles(seed, number, len(axes)).tolist())


class LatinHypercubeSpec(Sampling):
    """A Latin hypercube: of n runs one has each n-th of every distribution, in random combinations.

    Of dispersions that are correlated this holds for the first of each group alone: the quantiles of the
    others are mixed with those before them.

    Case N depends on the campaign's seed, N and the number of runs.
    """

    kind: Literal["latin_hypercube"] = "latin_hypercube"

    def complaint(self, axes: int, runs: int) -> str:
        if axes * runs <= MOST_HYPERCUBE_NUMBERS:
            return ""
        return (
            f"a Latin hypercube of {runs} runs and {axes} axes has {axes * runs} numbers, and at most "
            f"{MOST_HYPERCUBE_NUMBERS} are held in memory; use fewer runs, or sobol or monte_carlo"
        )

    def coordinates(self, axes: Sequence[Axis], runs: int, seed: int, number: int) -> list[Coordinate]:
        return list(_inside(_latin_hypercube(seed, runs, len(axes))[number]).tolist())


class SobolSpec(Sampling):
    """A scrambled Sobol sequence, evenly spread in all axes together; best with a power of two of runs.

    Case N depends on the campaign's seed and N, not on the number of runs.
    """

    kind: Literal["sobol"] = "sobol"

    def complaint(self, axes: int, runs: int) -> str:
        if axes <= MOST_SOBOL_AXES:
            return ""
        return f"a Sobol sequence has at most {MOST_SOBOL_AXES} axes, and this campaign {axes}"

    def coordinates(self, axes: Sequence[Axis], runs: int, seed: int, number: int) -> list[Coordinate]:
        block, row = divmod(number, _BLOCK)
        return list(_inside(_sobol_block(seed, len(axes), block)[row]).tolist())


class GridSpec(Sampling):
    """Every combination of the listed values, the last axis fastest; what has a distribution is random."""

    enumerates: ClassVar[bool] = True
    takes_grids: ClassVar[bool] = True
    is_random: ClassVar[bool] = False

    kind: Literal["grid"] = "grid"
    repeats: Annotated[int, Field(ge=1, le=1_000_000)] = 1
    """How often every combination is flown, each time with a seed of its own. The whole grid comes first
    once, then once more."""

    def cases(self, axes: Sequence[Axis], runs: int | None) -> int:
        return self.repeats * _combinations(axes)

    def coordinates(self, axes: Sequence[Axis], runs: int, seed: int, number: int) -> list[Coordinate]:
        found: list[Coordinate] = list(_random_quantiles(seed, number, len(axes)).tolist())
        position = number % _combinations(axes)
        for index in range(len(axes) - 1, -1, -1):
            if axes[index].count:
                position, found[index] = divmod(position, axes[index].count)
        return found


class OneAtATimeSpec(Sampling):
    """The scenario's own values as case 0; then those of one axis after the other, the rest as in case 0."""

    enumerates: ClassVar[bool] = True
    takes_grids: ClassVar[bool] = True
    is_random: ClassVar[bool] = False

    kind: Literal["one_at_a_time"] = "one_at_a_time"
    quantiles: Annotated[
        tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...], Field(min_length=1, max_length=1000)
    ] = (0.05, 0.95)
    """Quantiles that are flown of an axis with a distribution; of one with a grid every value is."""

    def cases(self, axes: Sequence[Axis], runs: int | None) -> int:
        return 1 + sum(axis.count or len(self.quantiles) for axis in axes)

    def coordinates(self, axes: Sequence[Axis], runs: int, seed: int, number: int) -> list[Coordinate]:
        found: list[Coordinate] = [None] * len(axes)
        position = number - 1
        for index, axis in enumerate(axes):
            points = axis.count or len(self.quantiles)
            if 0 <= position < points:
                found[index] = position if axis.count else self.quantiles[position]
            position -= points
        return found


def case_seed(seed: int, number: int) -> int:
    """Seed of a case's scenario.

    Args:
        seed: of the campaign.
        number: of the case.
    """
    sequence = np.random.SeedSequence([seed, CASE_SEED_STREAM, number])
    return int(sequence.generate_state(1, np.uint64)[0]) >> 1


def _combinations(axes: Sequence[Axis]) -> int:
    return math.prod(axis.count for axis in axes if axis.count)


def _random_quantiles(seed: int, number: int, axes: int) -> Array:
    return _inside(np.random.default_rng([seed, MONTE_CARLO_STREAM, number]).random(axes))


def _inside(quantiles: Array) -> Array:
    """Quantiles at which every distribution has a finite value."""
    return np.clip(quantiles, LEAST_QUANTILE, LARGEST_QUANTILE)


@functools.lru_cache(maxsize=2)
def _latin_hypercube(seed: int, runs: int, axes: int) -> Array:
    from scipy.stats import qmc  # noqa: PLC0415  slow to import, and not needed for other samplings

    sampler = qmc.LatinHypercube(axes, rng=np.random.default_rng([seed, LATIN_HYPERCUBE_STREAM]))
    design: Array = sampler.random(runs)
    return design


@functools.lru_cache(maxsize=16)
def _sobol_block(seed: int, axes: int, block: int) -> Array:
    from scipy.stats import qmc  # noqa: PLC0415  slow to import, and not needed for other samplings

    sampler = qmc.Sobol(axes, scramble=True, rng=np.random.default_rng([seed, SOBOL_STREAM]))
    if block:
        sampler.fast_forward(block * _BLOCK)
    points: Array = sampler.random(_BLOCK)
    return points
