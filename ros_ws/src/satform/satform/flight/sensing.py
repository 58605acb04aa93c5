# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Sensors of all satellites in the plant: readings of each step, and what of them arrives."""

from collections.abc import Sequence

import numpy as np

from satform.equipment.random_streams import SENSOR_STREAM, channel_number
from satform.equipment.sensors.protocol import Scene, SensorChannel
from satform.equipment.sensors.sensor_delay import SensorDelay
from satform.numeric.elementwise import Array
from satform.numeric.seeded_numbers import SeededNormals


class _Suite:
    """The channels of one satellite, with their random numbers and the readings on their way."""

    def __init__(self, satellite: int, channels: Sequence[SensorChannel], seed: int) -> None:
        self._channels = [channel.started() for channel in channels]
        self._normals = [
            SeededNormals(seed, SENSOR_STREAM, [channel_number(satellite, number)], max(1, channel.draws))
            for number, channel in enumerate(channels)
        ]
        self._delay = SensorDelay(channels)

    def arriving(self, scene: Scene, step: int) -> Array:
        """What arrives at a step, shape (W,); called at each step, in order."""
        taken = [
            channel.reading(scene, step, normals.at(step)[0, : channel.draws])
            for channel, normals in zip(self._channels, self._normals, strict=True)
        ]
        arrived = self._delay.arriving(np.concatenate(taken), step)
        # All that is not a number has the same bits.
        return np.where(np.isnan(arrived), np.nan, arrived)


class Sensing:
    """Sensors of the satellites that have some.

    Attributes:
        arrived: readings that arrive at the present step, by the satellite's index, shape (W,) each.
    """

    def __init__(self, channels: Sequence[Sequence[SensorChannel]], seed: int) -> None:
        """Sensors before step 0.

        Args:
            channels: of each satellite, in order.
            seed: of the run.
        """
        self._suites = {index: _Suite(index, own, seed) for index, own in enumerate(channels) if own}
        self.arrived: dict[int, Array] = {}

    def __bool__(self) -> bool:
        return bool(self._suites)

    def sample(self, scene: Scene, step: int) -> None:
        """Take the readings of a step; called at each step, in order.

        Args:
            scene: truth at the step.
            step: its number.
        """
        self.arrived = {index: suite.arriving(scene, step) for index, suite in self._suites.items()}
