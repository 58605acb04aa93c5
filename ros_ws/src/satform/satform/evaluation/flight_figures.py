# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The figures of several expectations, made while flights go on side by side."""

from collections.abc import Sequence

import numpy as np

from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock
from satform.record.reducer import FlightShape
from satform.scenario.expectation import ComputedFrom, Expectation


class FlightFigures:
    """Figures of R flights of the same expectations, from the blocks of their steps.

    Attributes:
        whole_records: indices of the expectations that measure whole records only.
        of_loops: indices of those whose figure is computed from the sampled loops, without a flight.
        needs: quantities of a `FlightRecord` that the blocks have to hold.
    """

    def __init__(self, expectations: Sequence[Expectation], flight: FlightShape) -> None:
        """What is made.

        Args:
            expectations: whose figures are meant.
            flight: names, control period and steps of each flight.
        """
        self._count, self._runs = len(expectations), 0
        kinds = [expectation.computed_from for expectation in expectations]
        self._reducers = {
            index: reducer
            for index, (kind, expectation) in enumerate(zip(kinds, expectations, strict=True))
            if kind is ComputedFrom.BLOCKS and (reducer := expectation.reducer(flight)) is not None
        }
        self.of_loops = tuple(index for index, kind in enumerate(kinds) if kind is ComputedFrom.LOOPS)
        others = {*self._reducers, *self.of_loops}
        self.whole_records = tuple(index for index in range(self._count) if index not in others)
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
