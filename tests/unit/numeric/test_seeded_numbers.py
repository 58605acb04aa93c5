# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Random numbers of a satellite depend on its run's seed, its index there and the step, and nothing else."""

import numpy as np
import pytest

from satform.numeric.seeded_numbers import SeededNormals, SeededSigned, SeededUniforms

STREAM = 7
KINDS = [SeededNormals, SeededUniforms, SeededSigned]


def expected(kind: type[SeededNormals], seed: int, satellite: int, step: int) -> bytes:
    """By numpy alone: 256 steps from each generator."""
    generator = np.random.default_rng([seed, STREAM, satellite, step // 256])
    drawn = {
        SeededNormals: lambda: generator.standard_normal((256, 3)),
        SeededUniforms: lambda: generator.random((256, 3)),
        SeededSigned: lambda: generator.uniform(-1.0, 1.0, (256, 3)),
    }[kind]()
    return bytes(drawn[step % 256].tobytes())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [1, 3, 100])
def test_rows_have_seeds_of_their_own(kind: type[SeededNormals], count: int) -> None:
    seeds, satellites = [2**40 * (row % 2) + row for row in range(count)], [row % 5 for row in range(count)]
    numbers = kind(seeds, STREAM, satellites, 3)
    for step in (0, 1, 127, 128, 255, 256, 700, 3, 130):
        drawn = numbers.at(step)
        assert drawn.shape == (count, 3)
        for row in {0, count // 2, count - 1}:
            assert drawn[row].tobytes() == expected(kind, seeds[row], satellites[row], step)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("kept", [[0, 3, 50], list(range(100)), list(range(1, 99))])
def test_some_of_the_rows_go_on_where_all_were(kind: type[SeededNormals], kept: list[int]) -> None:
    numbers = kind(list(range(100)), STREAM, [1] * 100, 3)
    numbers.at(40)
    fewer = numbers.keep(np.array(kept))
    for step in (41, 127, 128, 200, 256):
        drawn = fewer.at(step)
        for place in (0, len(kept) - 1):
            assert drawn[place].tobytes() == expected(kind, kept[place], 1, step)


def test_one_seed_stands_for_all_rows() -> None:
    alike = SeededNormals(5, STREAM, range(4), 2)
    assert alike.seeds == (5, 5, 5, 5)
    assert alike.at(9).tobytes() == SeededNormals([5] * 4, STREAM, range(4), 2).at(9).tobytes()
