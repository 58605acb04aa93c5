# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Two-way ranging between satellites, by laser or radio: range and range rate, with the light time.

Equations: docs/sensors.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import model_validator

from satform.common.physical_constants import SPEED_OF_LIGHT
from satform.common.spec import Deviation, Number, Positive, Vector
from satform.equipment.sensors.protocol import PairModel, Scene, SensorChannel
from satform.equipment.sensors.sensor_spec import DirectedSensorSpec, FullAngle, NoisyChannel
from satform.equipment.sensors.visibility import Cone, Sight
from satform.numeric.directions import require_direction, unit
from satform.numeric.elementwise import Array, column, dot, joined, norm

_ITERATIONS = 3
"""Of the light time of one way: each adds the digits of (speed / speed of light), which is below 1e-4."""

_SHORTEST = 1e-3
"""Distance below which directions are not computed any more, m."""


@dataclass(frozen=True)
class RangingModel(PairModel):
    """Distance between two satellites, and its rate if that is measured, at the time of the reading.

    The variance is that of the range, m^2, and of the range rate, m^2/s^2.
    """

    @property
    def width(self) -> int:
        """One, or two with the range rate."""
        return len(self.variance)

    def predicted(self, own: Array, other: Array) -> Array:
        """As of every model: range in m, range rate in m/s."""
        distance, direction, velocity = _relative(own, other)
        return joined(*(distance, dot(direction, velocity))[: self.width])

    def jacobian(self, own: Array, other: Array) -> tuple[Array, Array]:
        """As of every model."""
        distance, direction, velocity = _relative(own, other)
        by_other = np.zeros((*distance.shape, self.width, 6))
        by_other[..., 0, :3] = direction
        if self.width > 1:
            across = velocity - column(dot(direction, velocity)) * direction
            by_other[..., 1, :3] = across / column(np.maximum(distance, _SHORTEST))
            by_other[..., 1, 3:] = direction
        return -by_other, by_other

    def residual(self, measured: Array, predicted: Array) -> Array:
        """As of every model."""
        return np.asarray(measured - predicted)


def _relative(own: Array, other: Array) -> tuple[Array, Array, Array]:
    """Distance, direction and relative velocity of the other satellite as seen from the own one."""
    between = other[..., :3] - own[..., :3]
    distance = norm(between)
    return distance, between / column(np.maximum(distance, _SHORTEST)), other[..., 3:] - own[..., 3:]


def two_way_reading(own: Array, other: Array) -> Array:
    """Two-way range and range rate of a signal that returns to the observer at the time of the states.

    The range is half the light's travel time times the speed of light, the rate its derivative by the time of
    reception. During the travel both satellites move on with their velocities.

    Args:
        own: position (m) and velocity (m/s) of the observer, LVLH, shape (..., 6).
        other: likewise of the target.

    Returns:
        Range in m and range rate in m/s, shape (..., 2).
    """
    own_velocity, other_velocity = own[..., 3:], other[..., 3:]
    # Positions relative to that of the observer at the reception; times count from it.
    target = other[..., :3] - own[..., :3]
    down = np.zeros(target.shape[:-1])
    for _ in range(_ITERATIONS):
        reflected = target - other_velocity * column(down)
        down = norm(reflected) / SPEED_OF_LIGHT
    reflected = target - other_velocity * column(down)
    up = down
    for _ in range(_ITERATIONS):
        emitted = -own_velocity * column(down + up)
        up = norm(reflected - emitted) / SPEED_OF_LIGHT
    emitted = -own_velocity * column(down + up)
    rate = _two_way_rate(own_velocity, other_velocity, reflected, emitted)
    return joined(0.5 * SPEED_OF_LIGHT * (down + up), rate)


def _two_way_rate(own_velocity: Array, other_velocity: Array, reflected: Array, emitted: Array) -> Array:
    """Derivative of the two-way range by the time of reception, from the Doppler factors of both ways."""
    returning, leaving = _direction(-reflected), _direction(reflected - emitted)
    relative = own_velocity - other_velocity
    back = dot(returning, relative) / (SPEED_OF_LIGHT - dot(returning, other_velocity))
    forth = dot(leaving, relative) / (SPEED_OF_LIGHT - dot(leaving, own_velocity))
    # One less (1 - back) (1 + forth), the derivative of the time of emission, without its loss of digits.
    return np.asarray(0.5 * SPEED_OF_LIGHT * (back - forth + back * forth))


def _direction(vector: Array) -> Array:
    return np.asarray(vector / column(np.maximum(norm(vector), _SHORTEST)))


@dataclass(frozen=True)
class _TwoWay:
    """Truth of a ranging channel."""

    sight: Sight
    width: int

    def __call__(self, scene: Scene) -> Array | None:
        """Range and range rate; None where the target is not seen."""
        if not self.sight.is_free(scene):
            return None
        pair = [self.sight.observer, self.sight.target]
        own, other = np.concatenate((scene.position[pair], scene.velocity[pair]), axis=-1)
        return two_way_reading(own, other)[: self.width]


class RangingSpec(DirectedSensorSpec):
    """Two-way ranging to other satellites, each with a reflector or transponder."""

    kind: str
    range_noise: Deviation
    """Standard deviation of the white noise on the range, m."""
    range_bias: Number = 0.0
    """Constant error of the range, m."""
    range_rate_noise: Deviation | None = None
    """Standard deviation of the white noise on the range rate, m/s; when left out no rate is measured."""
    range_rate_bias: Number = 0.0
    """Constant error of the range rate, m/s."""
    target_boresight: Vector = (1.0, 0.0, 0.0)
    """Middle of the field of view of the target's reflector or transponder, in the target's body axes."""
    target_field_of_view: FullAngle = 2.0 * math.pi
    """Full angle of the cone of directions from which the reflector or transponder answers, rad or text such
    as `40 deg`; all directions when left out."""

    @model_validator(mode="after")
    def _answers(self) -> "RangingSpec":
        require_direction(self.target_boresight, "target_boresight")
        return self

    def build(self, names: Sequence[str], observer: int, step: float) -> list[SensorChannel]:
        """As of every sensor."""
        timing = self.timing(step)
        noise, bias = [self.range_noise], [self.range_bias]
        if self.range_rate_noise is not None:
            noise.append(self.range_rate_noise)
            bias.append(self.range_rate_bias)
        found: list[SensorChannel] = []
        for target in self.target_indices(names, observer):
            name = f"{self.kind} {names[target]}"
            model = RangingModel(name, observer, target, np.square(noise))
            truth = _TwoWay(self.sight(observer, target), model.width)
            found.append(NoisyChannel(model, timing, truth, np.array(noise), np.array(bias)))
        return found

    def sight(self, observer: int, target: int) -> Sight:
        """When a target is seen and answers."""
        back = Cone(unit(self.target_boresight), 0.5 * self.target_field_of_view)
        return replace(super().sight(observer, target), target_field_of_view=back)


class LaserRangingSpec(RangingSpec):
    """Two-way laser ranging to reflectors or transponders on other satellites."""

    kind: Literal["laser_ranging"] = "laser_ranging"
    range_noise: Deviation = 1e-3
    """Standard deviation of the white noise on the range, m."""
    maximum_range: Positive = 1e6
    """Distance beyond which there is no reading, m."""


class RadioRangingSpec(RangingSpec):
    """Two-way radio ranging to transponders on other satellites."""

    kind: Literal["radio_ranging"] = "radio_ranging"
    range_noise: Deviation = 1.0
    """Standard deviation of the white noise on the range, m."""
