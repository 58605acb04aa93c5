# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Rate-integrating gyro: mean angular velocity with white noise, a bias that walks, and scale factors.

Equations: docs/attitude_estimation.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.common.angle_text import OR_DEGREES_PER_SECOND
from satform.common.spec import NonNegative
from satform.equipment.sensors.protocol import Scene, SensorChannel
from satform.equipment.sensors.sensor_spec import SensorSpec
from satform.equipment.sensors.timing import SensorTiming
from satform.numeric.elementwise import Array
from satform.numeric.modified_rodrigues import relative_mrp, rotation_of_mrp

Rate = Annotated[float, Field(ge=-1.0, le=1.0), OR_DEGREES_PER_SECOND]
ScaleError = Annotated[float, Field(ge=-0.5, le=0.5)]


@dataclass
class GyroChannel:
    """Readings of a gyro: mean angular velocity over its last period, rad/s, body axes.

    It remembers the attitude a period ago and its bias, and has to be asked once a step, in order.

    Attributes:
        timing: when readings are taken and arrive.
        observer: index of the satellite.
        step: control period, s.
        angle_random_walk: rad/s^(1/2).
        rate_random_walk: rad/s^(3/2).
        turn_on_bias: standard deviation of the part of the bias that is drawn at the start, rad/s.
        bias: the other part, rad/s, shape (3,).
        scale: measured per true angular velocity on each axis, shape (3,).
        walking_bias: at the end of the last period, rad/s, shape (3,); None before the first one.

    Source: Markley & Crassidis 2014, ch. 4.7 (discrete model of a gyro, exact for sampled angle and bias);
    Farrenkopf 1978.
    """

    timing: SensorTiming
    observer: int
    step: float
    angle_random_walk: float
    rate_random_walk: float
    turn_on_bias: float
    bias: Array
    scale: Array
    walking_bias: Array | None = field(default=None, init=False)
    _mrp: Array | None = field(default=None, init=False, repr=False)

    name = "gyro"
    width = 3
    model = None
    draws = 9

    @property
    def largest_bias(self) -> float:
        """Root mean square of the bias at the start on the axis with the largest constant part, rad/s."""
        return math.hypot(self.turn_on_bias, float(np.abs(self.bias).max()))

    def started(self) -> "GyroChannel":
        """As of every channel: a gyro that remembers nothing."""
        return replace(self)

    def reading(self, scene: Scene, step: int, normals: Array) -> Array:
        """As of every channel.

        The first one is as though the satellite had turned at its present rate before. In an outage the bias
        walks on and no rotation is summed up: the first reading after it is the mean over one period, too.
        """
        if scene.mrp is None or scene.angular_velocity is None or step % self.timing.period:
            return np.full(3, np.nan)
        time = self.timing.period * self.step
        mrp = scene.mrp[self.observer]
        if self.walking_bias is None or self._mrp is None:
            rate = scene.angular_velocity[self.observer]
            before = self.bias + self.turn_on_bias * normals[6:]
            now = before
        else:
            rate = rotation_of_mrp(relative_mrp(mrp, self._mrp)) / time
            before = self.walking_bias
            now = before + self.rate_random_walk * math.sqrt(time) * normals[3:6]
        self._mrp, self.walking_bias = mrp.copy(), now
        angle, walk = self.angle_random_walk, self.rate_random_walk
        white = math.sqrt(angle * angle / time + walk * walk * time / 12.0)
        measured = np.asarray(self.scale * rate + 0.5 * (before + now) + white * normals[:3])
        return measured if self.timing.is_due(step) else np.full(3, np.nan)


class GyroSpec(SensorSpec):
    """A rate-integrating gyro with three axes along those of the body.

    A reading is the rotation over the last period, divided by it; the rotation has to be less than half a
    turn. With `latency` or `outages` the attitude filter needs an `angular_acceleration_density`.
    """

    kind: Literal["gyro"] = "gyro"
    angle_random_walk: NonNegative = 1e-6
    """White noise of the measured angular velocity, as the standard deviation of its integral after a second,
    rad/s^(1/2); 1 deg/h^(1/2) is 2.91e-4."""
    rate_random_walk: NonNegative = 1e-9
    """Walk of the bias, as its standard deviation after a second, rad/s^(3/2)."""
    turn_on_bias: Annotated[float, Field(ge=0.0, le=1.0), OR_DEGREES_PER_SECOND] = 0.0
    """Standard deviation of the bias at the start, drawn by the seed for each axis, rad/s or text such as
    `0.001 deg/s`."""
    bias: tuple[Rate, Rate, Rate] = (0.0, 0.0, 0.0)
    """Constant part of the bias, body axes, rad/s or text."""
    scale_factor_error: tuple[ScaleError, ScaleError, ScaleError] = (0.0, 0.0, 0.0)
    """Measured less true angular velocity, over the true one, on each body axis."""

    def build(self, names: Sequence[str], observer: int, step: float) -> list[SensorChannel]:
        """As of every sensor."""
        return [
            GyroChannel(
                timing=self.timing(step),
                observer=observer,
                step=step,
                angle_random_walk=self.angle_random_walk,
                rate_random_walk=self.rate_random_walk,
                turn_on_bias=self.turn_on_bias,
                bias=np.array(self.bias),
                scale=1.0 + np.array(self.scale_factor_error),
            )
        ]
