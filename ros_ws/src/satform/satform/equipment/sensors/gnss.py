# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""GNSS receivers: own motion, and motion relative to a reference satellite by carrier phases.

Equations: docs/sensors.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.common.spec import DeviationPerAxis, PerAxis
from satform.equipment.sensors.protocol import Scene, SensorChannel
from satform.equipment.sensors.sensor_spec import NoisyChannel, SensorSpec, SightedSensorSpec, other_satellite
from satform.equipment.sensors.visibility import Sight
from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class MotionModel:
    """Position, and velocity if it is measured, of a satellite in LVLH, less those of a reference if any.

    Attributes:
        name: for people.
        observer: index of the satellite that carries the receiver.
        target: index of the reference; None where the motion is that relative to the chief.
        variance: of position (m^2) and velocity (m^2/s^2) by axis, shape (3,) or (6,).
    """

    name: str
    observer: int
    target: int | None
    variance: Array

    @property
    def width(self) -> int:
        """Three, or six with the velocity."""
        return len(self.variance)

    def predicted(self, own: Array, other: Array) -> Array:
        """As of every model: position in m, velocity in m/s."""
        motion = own if self.target is None else own - other
        return np.array(motion[..., : self.width])

    def jacobian(self, own: Array, other: Array) -> tuple[Array, Array]:
        """As of every model."""
        by_own = np.broadcast_to(np.eye(6)[: self.width], (*own.shape[:-1], self.width, 6)).copy()
        return by_own, np.zeros_like(by_own) if self.target is None else -by_own

    def residual(self, measured: Array, predicted: Array) -> Array:
        """As of every model."""
        return np.asarray(measured - predicted)


@dataclass(frozen=True)
class _Motion:
    """Truth of a GNSS channel."""

    model: MotionModel
    sight: Sight | None

    def __call__(self, scene: Scene) -> Array | None:
        """Position and velocity; None where the reference is not seen."""
        if self.sight is not None and not self.sight.is_free(scene):
            return None
        own = np.concatenate((scene.position[self.model.observer], scene.velocity[self.model.observer]))
        if self.model.target is None:
            return self.model.predicted(own, own)
        other = np.concatenate((scene.position[self.model.target], scene.velocity[self.model.target]))
        return self.model.predicted(own, other)


class _ReceiverSpec(SensorSpec):
    """Errors of measured motion."""

    position_noise: DeviationPerAxis
    """Standard deviation of the white noise on the position, LVLH, m."""
    velocity_noise: DeviationPerAxis | None = None
    """Standard deviation of the white noise on the velocity, LVLH, m/s; no velocity is measured when left
    out."""
    position_bias: PerAxis = (0.0, 0.0, 0.0)
    """Constant error of the position, LVLH, m."""
    velocity_bias: PerAxis = (0.0, 0.0, 0.0)
    """Constant error of the velocity, LVLH, m/s."""

    def channel(self, name: str, observer: int, sight: Sight | None, step: float) -> SensorChannel:
        """The one channel of the receiver.

        Args:
            name: of it.
            observer: index of the satellite that carries it.
            sight: of the reference; None without one.
            step: control period, s.
        """
        noise, bias = list(self.position_noise), list(self.position_bias)
        if self.velocity_noise is not None:
            noise += self.velocity_noise
            bias += self.velocity_bias
        target = None if sight is None else sight.target
        model = MotionModel(name, observer, target, np.square(noise))
        return NoisyChannel(model, self.timing(step), _Motion(model, sight), np.array(noise), np.array(bias))


class GnssSpec(_ReceiverSpec):
    """A GNSS receiver: own position and velocity relative to the chief, whose orbit is taken as known."""

    kind: Literal["gnss"] = "gnss"
    position_noise: DeviationPerAxis = (7.0, 7.0, 7.0)
    """Standard deviation of the white noise on the position, LVLH, m."""

    def build(self, names: Sequence[str], observer: int, step: float) -> list[SensorChannel]:
        """As of every sensor."""
        return [self.channel(self.kind, observer, None, step)]


class DifferentialGnssSpec(_ReceiverSpec, SightedSensorSpec):
    """Carrier-phase differential GNSS: own motion less that of a reference satellite with a receiver, too."""

    kind: Literal["differential_gnss"] = "differential_gnss"
    reference: str
    """Name of the reference satellite."""
    position_noise: DeviationPerAxis = (0.05, 0.05, 0.05)
    """Standard deviation of the white noise on the relative position, LVLH, m."""

    def build(self, names: Sequence[str], observer: int, step: float) -> list[SensorChannel]:
        """As of every sensor."""
        reference = other_satellite("reference", self.reference, names, observer)
        return [
            self.channel(f"{self.kind} {self.reference}", observer, self.sight(observer, reference), step)
        ]
