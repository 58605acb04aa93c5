# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What sensors and filters share: measurement models of single channels, and what the plant samples.

A channel is one sensor with one target, or without a target. The readings of all channels of a satellite are
one vector, in the order of the scenario: sensors in order, targets of a sensor in order.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from satform.equipment.sensors.timing import SensorTiming
from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class Scene:
    """Truth at one step, as far as sensors sample it.

    Attributes:
        time: simulated, s.
        position: of all satellites, m, LVLH, shape (N, 3).
        velocity: m/s, in the rotating frame, shape (N, 3).
        chief_radius: distance of the chief from the Earth's centre, m, shape ().
        body: rows are the body axes of each satellite in LVLH, shape (N, 3, 3); the axes of LVLH for one
            without attitude; None where nobody has an attitude.
        mrp: modified Rodrigues parameters of each satellite, inertial to body, shape (N, 3), not a number
            for one without attitude; None where nobody has an attitude.
        angular_velocity: of each body in its own axes, rad/s, shape (N, 3); likewise.
        sun: unit vector from the Earth towards the Sun, LVLH, shape (3,); None for a scenario without a date.
    """

    time: float
    position: Array
    velocity: Array
    chief_radius: Array
    body: Array | None = None
    mrp: Array | None = None
    angular_velocity: Array | None = None
    sun: Array | None = None


class MeasurementModel(Protocol):
    """What a filter knows of a channel: a function of the motion of one or two satellites."""

    @property
    def name(self) -> str:
        """For people, such as `laser_ranging sat2`."""

    @property
    def observer(self) -> int:
        """Index of the satellite that carries the sensor."""

    @property
    def target(self) -> int | None:
        """Index of the other satellite; None where only the own motion is measured."""

    @property
    def width(self) -> int:
        """Numbers of a reading, m."""

    @property
    def variance(self) -> Array:
        """Variance of each number, assumed by a filter, shape (m,)."""

    def predicted(self, own: Array, other: Array) -> Array:
        """The reading without errors, shape (..., m).

        Args:
            own: position (m) and velocity (m/s) of the observer, LVLH, shape (..., 6).
            other: likewise of the target; any finite numbers without one.
        """

    def jacobian(self, own: Array, other: Array) -> tuple[Array, Array]:
        """Derivatives of `predicted` by both states, shapes (..., m, 6); by the other zero without target."""

    def residual(self, measured: Array, predicted: Array) -> Array:
        """Measured less predicted, angles wrapped into [-pi, pi], shape (..., m)."""


@dataclass(frozen=True)
class PairModel:
    """What models of measurements between two satellites have in common.

    Attributes:
        name: for people.
        observer: index of the satellite that carries the sensor.
        target: index of the other satellite.
        variance: of each number of a reading, shape (m,).
    """

    name: str
    observer: int
    target: int
    variance: Array


@runtime_checkable
class VaryingVariance(Protocol):
    """A measurement model whose noise depends on the reading."""

    def variance_at(self, reading: Array) -> Array:
        """Variance of each number of a reading, shape (..., m); `variance` is that of the least noise."""


def assumed_variance(model: MeasurementModel, reading: Array) -> Array:
    """Variance of each number of a reading, as a filter assumes it, shape (m,) or (..., m).

    Args:
        model: of the channel.
        reading: of it, shape (..., m).
    """
    return model.variance_at(reading) if isinstance(model, VaryingVariance) else model.variance


class SensorChannel(Protocol):
    """A channel in the plant: truth, visibility and errors of its readings."""

    @property
    def name(self) -> str:
        """For people, such as `laser_ranging sat2`."""

    @property
    def width(self) -> int:
        """Numbers of a reading, m."""

    @property
    def model(self) -> MeasurementModel | None:
        """What a filter of relative motion knows of it; None where no motion is measured."""

    @property
    def timing(self) -> SensorTiming:
        """When readings are taken and arrive."""

    @property
    def draws(self) -> int:
        """Standard normal numbers that a reading takes."""

    def started(self) -> "SensorChannel":
        """The channel before step 0, with a memory of its own; itself where it has none."""

    def reading(self, scene: Scene, step: int, normals: Array) -> Array:
        """The reading taken at a step, shape (m,); not a number where there is none.

        There is none at a step that is not due, in an outage, and while the target is not visible. A reading
        is delayed by its latency outside of the channel. Called once a step, in order, from step 0 on.

        Args:
            scene: truth at the step.
            step: its number.
            normals: standard normal numbers of this channel and step, shape (draws,).
        """
