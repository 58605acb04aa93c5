# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Ideal sensor of relative motion: noise, bias, update rate and latency between true and measured motion."""

from dataclasses import dataclass, replace

import numpy as np

from satform.common.spec import NonNegative, NonNegativePerAxis, PerAxis, Spec
from satform.equipment.sensors.timing import whole_steps
from satform.numeric.elementwise import Array

NOISE_PER_STEP = 6
"""Standard normal numbers that `Sensor.measure` wants: three of position, three of velocity."""


@dataclass(frozen=True)
class Measurement:
    """Motion as measured, by one satellite or by many that measure together.

    Attributes:
        position: m, LVLH, shape (..., 3).
        velocity: m/s, in the rotating frame, shape (..., 3).
        step: number of the step at which the motion was so; older than now by the latency and by the
            time since the last update.
    """

    position: Array
    velocity: Array
    step: int


@dataclass(frozen=True)
class SensorMemory:
    """Measurements on their way.

    Attributes:
        delivered: the newest that has arrived.
        waiting: taken, but not yet arrived, oldest first.
    """

    delivered: Measurement
    waiting: tuple[Measurement, ...] = ()


@dataclass(frozen=True)
class Sensor:
    """White noise, bias, update rate and latency between the true and the measured motion.

    Attributes:
        noise: standard deviation of position (m) and velocity (m/s), shape (..., 6).
        bias: constant error of position (m) and velocity (m/s), shape (..., 6).
        update: steps between two measurements, at least 1.
        latency: steps from a measurement to its arrival.
    """

    noise: Array
    bias: Array
    update: int
    latency: int

    def start(self, position: Array, velocity: Array, normals: Array) -> SensorMemory:
        """The memory at step 0, whose measurement is there at once.

        Args:
            position: true, m, LVLH, shape (..., 3).
            velocity: true, m/s, shape (..., 3).
            normals: standard normal numbers of step 0, shape (..., 6).
        """
        return SensorMemory(self._taken(position, velocity, normals, 0))

    def measure(
        self, memory: SensorMemory, position: Array, velocity: Array, step: int, normals: Array
    ) -> SensorMemory:
        """What is known at one step; called at each step after 0, in order.

        Args:
            memory: of the step before.
            position: true, m, LVLH, shape (..., 3).
            velocity: true, m/s, shape (..., 3).
            step: number of the step.
            normals: standard normal numbers of this step, shape (..., 6).

        Returns:
            The memory whose `delivered` is the measured motion.
        """
        waiting = memory.waiting
        if step % self.update == 0:
            waiting = (*waiting, self._taken(position, velocity, normals, step))
        if waiting and waiting[0].step + self.latency <= step:
            return SensorMemory(waiting[0], waiting[1:])
        return replace(memory, waiting=waiting)

    def _taken(self, position: Array, velocity: Array, normals: Array, step: int) -> Measurement:
        error = self.bias + self.noise * normals
        return Measurement(position + error[..., :3], velocity + error[..., 3:], step)


class NavigationSpec(Spec):
    """Relative navigation of a satellite; what is left out is perfect."""

    position_noise: NonNegativePerAxis = (0.0, 0.0, 0.0)
    """Standard deviation of the white noise on position, LVLH [m]."""
    velocity_noise: NonNegativePerAxis = (0.0, 0.0, 0.0)
    """Standard deviation of the white noise on velocity, LVLH [m/s]."""
    position_bias: PerAxis = (0.0, 0.0, 0.0)
    """Constant error of position, LVLH [m]."""
    velocity_bias: PerAxis = (0.0, 0.0, 0.0)
    """Constant error of velocity, LVLH [m/s]."""
    update_period: NonNegative = 0.0
    """Time between measurements, whole control periods [s]; 0 for one at every step."""
    latency: NonNegative = 0.0
    """Time from a measurement to its arrival, whole control periods [s]."""

    def build(self, step: float) -> Sensor:
        """The sensor itself.

        Args:
            step: control period, s.

        Raises:
            ValueError: update period or latency is not a whole number of control periods.
        """
        return Sensor(
            noise=np.array([*self.position_noise, *self.velocity_noise]),
            bias=np.array([*self.position_bias, *self.velocity_bias]),
            update=max(1, whole_steps("update_period", self.update_period, step)),
            latency=whole_steps("latency", self.latency, step),
        )
