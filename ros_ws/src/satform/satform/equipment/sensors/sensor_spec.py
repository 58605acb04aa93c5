# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What specifications of sensors have in common, and the channel that they build.

How to write a sensor of one's own: docs/own_sensor.md.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Self, TypeAlias

import numpy as np
from pydantic import Field, model_validator

from satform.common.angle_text import OR_DEGREES
from satform.common.spec import NonNegative, Positive, Spec, Vector
from satform.common.time_window import Window
from satform.equipment.sensors.protocol import MeasurementModel, Scene, SensorChannel
from satform.equipment.sensors.timing import SensorTiming, whole_steps
from satform.equipment.sensors.visibility import Cone, Sight
from satform.numeric.directions import require_direction, unit
from satform.numeric.elementwise import Array

LONGEST_LATENCY = 1000
"""Steps from a reading to its arrival at most."""

FullAngle = Annotated[float, Field(gt=0.0, le=2.0 * math.pi), OR_DEGREES]
"""Of a cone, from edge to edge, rad."""

SmallAngle = Annotated[float, Field(ge=0.0, le=math.pi), OR_DEGREES]
"""Rad."""

Observed: TypeAlias = Callable[[Scene], Array | None]
"""True reading of a scene, shape (m,); None where the sensor does not see its target."""


@dataclass(frozen=True)
class NoisyChannel:
    """A channel whose readings are the truth with a bias and white noise.

    Attributes:
        model: what a filter knows of it.
        timing: when readings are taken and arrive.
        observed: the truth.
        noise: standard deviation of each number, shape (m,).
        bias: constant error of each number, shape (m,).
    """

    model: MeasurementModel
    timing: SensorTiming
    observed: Observed
    noise: Array
    bias: Array

    @property
    def name(self) -> str:
        """Of the model."""
        return self.model.name

    @property
    def width(self) -> int:
        """Numbers of a reading."""
        return self.model.width

    @property
    def draws(self) -> int:
        """One for each number."""
        return self.model.width

    def started(self) -> Self:
        """The channel before step 0, which remembers nothing."""
        return self

    def reading(self, scene: Scene, step: int, normals: Array) -> Array:
        """As of every channel."""
        truth = self.observed(scene) if self.timing.is_due(step) else None
        if truth is None:
            return np.full(self.width, np.nan)
        return np.asarray(truth + self.bias + self.noise * normals)


class SensorSpec(Spec):
    """A sensor of a satellite."""

    period: NonNegative = 0.0
    """Time between two readings, whole control periods [s]; 0 for one at every step."""
    latency: NonNegative = 0.0
    """Time from a reading to its arrival, whole control periods [s]."""
    outages: tuple[Window, ...] = ()
    """Stretches of time in which there is no reading."""

    def build(self, names: Sequence[str], observer: int, step: float) -> list[SensorChannel]:
        """The channels of the sensor, one for each target.

        Args:
            names: of all satellites.
            observer: index of the satellite that carries the sensor.
            step: control period, s.

        Raises:
            ValueError: it cannot be; the sentence begins with the name of the field.
        """
        raise NotImplementedError

    @property
    def needs_sun(self) -> bool:
        """Whether its readings depend on the direction of the Sun, so that the scenario needs a date."""
        return False

    def timing(self, step: float) -> SensorTiming:
        """Its schedule.

        Args:
            step: control period, s.

        Raises:
            ValueError: period or latency is not a whole number of control periods, or the latency too long.
        """
        latency = whole_steps("latency", self.latency, step)
        if latency > LONGEST_LATENCY:
            raise ValueError(f"latency {self.latency:g} s is {latency} steps; at most {LONGEST_LATENCY} fit")
        return SensorTiming(
            period=max(1, whole_steps("period", self.period, step)),
            latency=latency,
            outages=tuple(window.steps(step) for window in self.outages),
        )


class SightedSensorSpec(SensorSpec):
    """A sensor of the motion relative to satellites that have to be in sight."""

    maximum_range: Positive = 1e9
    """Distance beyond which there is no reading, m."""
    line_of_sight_margin: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    """Height above the Earth's equatorial radius that the line of sight has to keep, m."""

    def sight(self, observer: int, target: int) -> Sight:
        """When a target is seen, in all directions.

        Args:
            observer: index of the satellite that carries the sensor.
            target: index of the other one.
        """
        everywhere = Cone(np.array([1.0, 0.0, 0.0]), math.pi)
        return Sight(observer, target, self.maximum_range, self.line_of_sight_margin, everywhere)


class DirectedSensorSpec(SightedSensorSpec):
    """A sensor that looks at other satellites, with a field of view that is fixed to the body."""

    targets: Annotated[tuple[str, ...], Field(min_length=1)]
    """Names of the other satellites; one channel each, in this order."""
    boresight: Vector = (1.0, 0.0, 0.0)
    """Middle of the field of view, in body axes; its length does not matter."""
    field_of_view: FullAngle = 2.0 * math.pi
    """Full angle of the cone of directions that the sensor sees, rad or text such as `40 deg`; all directions
    when left out."""

    @model_validator(mode="after")
    def _points(self) -> "DirectedSensorSpec":
        require_direction(self.boresight, "boresight")
        return self

    def sight(self, observer: int, target: int) -> Sight:
        """When a target is seen, in the field of view."""
        cone = Cone(unit(self.boresight), 0.5 * self.field_of_view)
        return replace(super().sight(observer, target), field_of_view=cone)

    def target_indices(self, names: Sequence[str], observer: int) -> list[int]:
        """Indices of the targets among all satellites.

        Args:
            names: of all satellites.
            observer: index of the satellite that carries the sensor.

        Raises:
            ValueError: a target does not exist, is the satellite itself, or is named twice.
        """
        for number, name in enumerate(self.targets):
            if name in self.targets[:number]:
                raise ValueError(f"targets: {name} is named twice")
        return [other_satellite("targets", name, names, observer) for name in self.targets]


def other_satellite(field: str, name: str, names: Sequence[str], observer: int) -> int:
    """Index of a satellite that another one's sensor names.

    Args:
        field: in which it is named.
        name: of it.
        names: of all satellites.
        observer: index of the satellite that carries the sensor.

    Raises:
        ValueError: there is none of this name, or it is the satellite itself.
    """
    if name not in names:
        raise ValueError(f"{field}: there is no satellite {name}; there are {', '.join(names)}")
    if name == names[observer]:
        raise ValueError(f"{field}: {name} carries the sensor and cannot be its own target")
    return list(names).index(name)
