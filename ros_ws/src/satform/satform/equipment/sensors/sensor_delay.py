# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Readings on their way from sensors to the flight software."""

from collections.abc import Sequence

import numpy as np

from satform.equipment.sensors.protocol import SensorChannel
from satform.numeric.elementwise import Array


class SensorDelay:
    """Holds the readings of a satellite's channels back for their latencies."""

    def __init__(self, channels: Sequence[SensorChannel]) -> None:
        """Channels with nothing on its way.

        Args:
            channels: of one satellite, in order.
        """
        self._latency = np.array(
            [channel.timing.latency for channel in channels for _ in range(channel.width)], dtype=np.int64
        )
        self._depth = int(self._latency.max(initial=0)) + 1
        self._waiting = np.full((self._depth, len(self._latency)), np.nan)
        self._columns = np.arange(len(self._latency))

    def arriving(self, taken: Array, step: int) -> Array:
        """What arrives at a step; to be called at each step, in order.

        Args:
            taken: readings of all channels at this step, side by side, not a number where there is none,
                shape (W,).
            step: its number.

        Returns:
            The readings that arrive, each taken as long ago as its latency, not a number where none does,
            shape (W,).
        """
        self._waiting[step % self._depth] = taken
        arrived: Array = self._waiting[(step - self._latency) % self._depth, self._columns].copy()
        return arrived
