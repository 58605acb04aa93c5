# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What makes a figure of a flight while it is flown, block by block, of several runs at once."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from satform.control.protocol import FlightSetting
from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock
from satform.record.flight_record import FlightRecord


@dataclass(frozen=True)
class FlightShape:
    """What is known of a flight before it is flown.

    Attributes:
        satellites: N names, in the order of the columns.
        step: control period, s.
        steps: K, of the whole flight.
        settings: chief and control period of each of the runs that are flown side by side; none where they
            are not known.
    """

    satellites: tuple[str, ...]
    step: float
    steps: int
    settings: tuple[FlightSetting, ...] = ()

    @classmethod
    def of(cls, record: FlightRecord, setting: FlightSetting | None = None) -> "FlightShape":
        """Of a flight that has been flown.

        Args:
            record: of the flight.
            setting: its chief; None where it is not known.
        """
        settings = () if setting is None else (setting,)
        return cls(record.satellites, record.step, record.steps, settings)

    @property
    def mean_motions(self) -> Array:
        """Of the chief of each run, rad/s, shape (R,); one NaN for all where the chief is not known."""
        return np.array([own.mean_motion for own in self.settings] or [np.nan])

    @property
    def states(self) -> int:
        """Rows of what is known at the start of a step: one more than steps."""
        return self.steps + 1

    def columns(self, names: tuple[str, ...] | None) -> tuple[int, ...]:
        """Columns of satellites; of all for None."""
        return tuple(self.satellites.index(name) for name in (self.satellites if names is None else names))


class Reducer(Protocol):
    """A figure of each of R runs, made of the blocks of their flights in order.

    It gives the same bits however the flights are cut into blocks and whatever runs lie side by side: sums
    are accumulated step by step, in order.
    """

    @property
    def needs(self) -> frozenset[str]:
        """Names of the quantities of a `FlightRecord` that the blocks have to hold."""

    def update(self, block: FlightBlock) -> None:
        """Take the next block of the flights.

        Args:
            block: that follows the one before, with the same runs; the first begins at step 0.
        """

    def figures(self) -> Array:
        """The figure of each run, after the last block, shape (R,); NaN for a run that does not give it."""
