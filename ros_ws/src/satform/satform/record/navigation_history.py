# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Readings of sensors and estimates of a whole formation over a flight."""

from dataclasses import dataclass

import numpy as np

from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class NavigationHistory:
    """What sensors measured and filters estimated of all satellites, in a flight of N satellites.

    Attributes:
        readings: that arrived at each state, in the order of `satform show`, not a number where none did and
            beyond the readings of a satellite that has fewer, shape (K + 1, N, W).
        mean: estimated position (m) and velocity (m/s) of all satellites by each satellite, LVLH, shape
            (K, N, 6 N); not a number for a satellite that estimates its own motion alone or is lost.
    """

    readings: Array
    mean: Array

    @classmethod
    def empty(cls, steps: int, satellites: int, readings: int) -> "NavigationHistory":
        """A history in which nothing is known.

        Args:
            steps: of the flight.
            satellites: how many.
            readings: numbers that arrive at a satellite at most.
        """
        return cls(
            np.full((steps + 1, satellites, readings), np.nan),
            np.full((steps, satellites, 6 * satellites), np.nan),
        )

    def first(self, steps: int) -> "NavigationHistory":
        """That of the first steps, and of the state after them."""
        return NavigationHistory(self.readings[: steps + 1], self.mean[:steps])

    def arrays(self) -> dict[str, Array]:
        """The arrays by their names in a record."""
        return {"readings": self.readings, "navigation_mean": self.mean}
