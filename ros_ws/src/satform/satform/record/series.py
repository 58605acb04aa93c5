# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every k-th row of a quantity, kept while flights go on side by side."""

import numpy as np

from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock, StepEnds, base_quantities


class DecimatedSeries:
    """Every k-th row of a quantity of R flights, from the first: the bits of `record.quantity[::k]`.

    Memory: the rows that are kept.

    Attributes:
        needs: quantities of a `FlightRecord` that the blocks have to hold.
    """

    def __init__(self, quantity: str, every: int) -> None:
        """What is kept.

        Args:
            quantity: name of a quantity of a `FlightRecord`, or of a derived one such as `tracking_error`.
            every: k, steps from a row that is kept to the next.

        Raises:
            KeyError: a flight has no such quantity.
            ValueError: `every` is less than 1.
        """
        if every < 1:
            raise ValueError(f"every has to be 1 or more; found {every}")
        self.needs = base_quantities((quantity,))
        self._quantity, self._every = quantity, every
        self._ends = StepEnds(self.needs) if quantity == "effort" else None
        self._retained: list[Array] = []

    def update(self, block: FlightBlock) -> None:
        """Take the next block of the flights; the first begins at step 0."""
        if self._ends is None:
            self._keep(getattr(self._thinned(block), self._quantity))
            return
        for ended in self._ends.take(block):
            self._keep(ended.effort[self._first(ended) :: self._every])

    def series(self) -> Array:
        """The rows of each run after the last block, shape (R, rows, satellites, ...).

        No rows where no satellite has the quantity.
        """
        return np.ascontiguousarray(np.moveaxis(np.concatenate(self._retained), 1, 0))

    def _keep(self, rows: Array) -> None:
        # Nothing that was derived from it is needed of the block any more once these rows are copied.
        if len(rows) or not self._retained:
            self._retained.append(np.array(rows, dtype=np.float64))

    def _first(self, block: FlightBlock) -> int:
        return -block.first_step % self._every

    def _thinned(self, block: FlightBlock) -> FlightBlock:
        """A block that holds only the rows that are kept, so that nothing is derived in vain."""
        rows = slice(self._first(block), None, self._every)
        held = {name: getattr(block, name)[rows] for name in self.needs}
        steps = len(range(block.steps)[rows])
        first = block.first_step + self._first(block)
        return FlightBlock(
            block.satellites, block.step, first, steps, block.runs, block.last, held, block.clocked
        )
