# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A sensor of the distance from a radio beacon that stands at a fixed place in LVLH."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.common.spec import Deviation, Positive, Vector
from satform.equipment.sensors.protocol import Scene, SensorChannel
from satform.equipment.sensors.sensor_spec import NoisyChannel, SensorSpec
from satform.numeric.elementwise import Array, column, norm


@dataclass(frozen=True)
class BeaconModel:
    """What a filter knows of the sensor; arrays of shape (..., 6) with position and velocity."""

    name: str
    observer: int
    target: None
    position: Array  # m, shape (3,)
    variance: Array  # m^2, shape (1,)
    width: int = 1

    def predicted(self, own: Array, other: Array) -> Array:
        return norm(own[..., :3] - self.position)[..., None]

    def jacobian(self, own: Array, other: Array) -> tuple[Array, Array]:
        by_own = np.zeros((*own.shape[:-1], 1, 6))
        between = own[..., :3] - self.position
        by_own[..., 0, :3] = between / column(norm(between))
        return by_own, np.zeros_like(by_own)

    def residual(self, measured: Array, predicted: Array) -> Array:
        return np.asarray(measured - predicted)


class BeaconRangingSpec(SensorSpec):
    kind: Literal["beacon_ranging"] = "beacon_ranging"
    position: Vector
    """Position of the beacon, LVLH, m."""
    noise: Deviation = 0.1
    """Standard deviation of the white noise on the distance, m."""
    maximum_range: Positive = 1e5
    """Distance beyond which the beacon is not received, m."""

    def build(self, names: Sequence[str], observer: int, step: float) -> list[SensorChannel]:
        noise = np.array([self.noise])
        model = BeaconModel(self.kind, observer, None, np.array(self.position), noise * noise)

        def observed(scene: Scene) -> Array | None:
            own = np.concatenate((scene.position[observer], scene.velocity[observer]))
            distance = model.predicted(own, own)
            return distance if distance[0] <= self.maximum_range else None

        return [NoisyChannel(model, self.timing(step), observed, noise, np.zeros(1))]
