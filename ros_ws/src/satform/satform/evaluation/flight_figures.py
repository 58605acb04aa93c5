# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The figures of several expectations, made while flights go on side by side."""

from collections.abc import Sequence

import numpy as np

from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock
from satform.record.reducer import FlightShape
from satform.scenario.expectation import Expectation


class FlightFigures:
    """Figures of R flights of the same expectations, from the blocks of their steps.

    Attributes:
        whole_records: indices of the expectations that measure whole records only: kinds that define
            `measure` and no `reducer` of their own, and kinds of loops that define `figure` alone.
        of_loops: indices of those whose figure is one of the sampled loops, for which nothing is flown.
        needs: quantities of a `FlightRecord` that the blocks have to hold.
    """

    def __init__(self, expectations: Sequence[Expectation], flight: FlightShape) -> None:
        """What is made.

        Args:
            expectations: whose figures are meant.
            flight: names, control period and steps of each flight.
        """
        self._count, self._runs = len(expectations), 0
        made = {
            index: None if expectation.of_loops else expectation.reducer_in_flight(flight)
            for index, expectation in enumerate(expectations)
            if not expectation.is_of_loops()
        }
        self._reducers = {index: reducer for index, reducer in made.items() if reducer is not None}
        self.whole_records = tuple(index for index, reducer in made.items() if reducer is None)
        self.of_loops = tuple(index for index in range(self._count) if index not in made)
        self.needs: frozenset[str] = frozenset().union(*(own.needs for own in self._reducers.values()))

    def update(self, block: FlightBlock) -> None:
        """Take the next block of the flights; the first begins at step 0."""
        self._runs = block.runs
        for reducer in self._reducers.values():
            reducer.update(block)

    def figures(self) -> Array:
        """The figures after the last block, shape (expectations, R).

        NaN for what a run does not give, and for the `whole_records` and `of_loops`.
        """
        found = np.full((self._count, self._runs), np.nan)
        for index, reducer in self._reducers.items():
            found[index] = reducer.figures()
        return found
