# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Star tracker: the attitude with small errors, while neither Sun nor Earth is in its view.

Equations: docs/attitude_estimation.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from satform.common.angle_text import OR_DEGREES
from satform.common.spec import LEAST_DEVIATION, Vector
from satform.equipment.sensors.protocol import Scene, SensorChannel
from satform.equipment.sensors.sensor_spec import SensorSpec, SmallAngle
from satform.equipment.sensors.timing import SensorTiming
from satform.numeric.directions import require_direction, unit, within
from satform.numeric.elementwise import Array, dot, norm
from satform.numeric.modified_rodrigues import composed_mrp, mrp_of_rotation
from satform.orbits.earth import EQUATORIAL_RADIUS
from satform.orbits.line_of_sight import from_earth_centre, in_body_axes

Noise = Annotated[float, Field(ge=LEAST_DEVIATION, le=1.0), OR_DEGREES]
ErrorAngle = Annotated[float, Field(ge=-1.0, le=1.0), OR_DEGREES]


@dataclass(frozen=True)
class StarTrackerChannel:
    """Readings of a star tracker: modified Rodrigues parameters, inertial to measured body axes.

    Attributes:
        timing: when readings are taken and arrive.
        observer: index of the satellite.
        axes: two across the boresight and the boresight, unit vectors in body axes, shape (3, 3).
        noise: standard deviation of the small rotation about each of these axes, rad, shape (3,).
        bias: constant small rotation, body axes, rad, shape (3,).
        sun_exclusion: least angle between boresight and Sun, rad; 0 for none.
        earth_exclusion: least angle between boresight and the edge of the Earth's disc, rad.
    """

    timing: SensorTiming
    observer: int
    axes: Array
    noise: Array
    bias: Array
    sun_exclusion: float
    earth_exclusion: float

    name = "star_tracker"
    width = 3
    model = None
    draws = 3

    def started(self) -> "StarTrackerChannel":
        """As of every channel."""
        return self

    def reading(self, scene: Scene, step: int, normals: Array) -> Array:
        """As of every channel: the true attitude, turned by bias and noise."""
        if scene.mrp is None or not self.timing.is_due(step) or self.is_blinded(scene):
            return np.full(3, np.nan)
        about = self.noise * normals
        error = self.bias + (about[0] * self.axes[0] + about[1] * self.axes[1] + about[2] * self.axes[2])
        return composed_mrp(mrp_of_rotation(error), scene.mrp[self.observer])

    def is_blinded(self, scene: Scene) -> bool:
        """Whether Sun or Earth is too close to the boresight.

        Args:
            scene: truth at the step; without the Sun's direction the Sun does not matter.
        """
        body = None if scene.body is None else scene.body[self.observer]
        from_earth = from_earth_centre(scene.position, scene.chief_radius)[self.observer]
        height = norm(from_earth)
        disc = math.asin(min(1.0, EQUATORIAL_RADIUS / float(height)))
        nearest = disc + self.earth_exclusion
        if bool(within(in_body_axes(body, -from_earth / height), self.axes[2], nearest)):
            return True
        if scene.sun is None or not self.sun_exclusion > 0.0:
            return False
        return bool(within(in_body_axes(body, scene.sun), self.axes[2], self.sun_exclusion))


def tracker_axes(boresight: Array) -> Array:
    """Axes of a star tracker: two across its boresight, and the boresight.

    Args:
        boresight: unit vector, shape (3,).

    Returns:
        Unit vectors, square to each other, rows, shape (3, 3).
    """
    across = np.eye(3)[int(np.argmin(np.abs(boresight)))]
    across = across - dot(across, boresight) * boresight
    first = across / norm(across)
    return np.stack((first, np.cross(boresight, first), boresight))


class StarTrackerSpec(SensorSpec):
    """A star tracker that measures the attitude while neither Sun nor Earth is near its boresight."""

    kind: Literal["star_tracker"] = "star_tracker"
    boresight: Vector = (0.0, 0.0, 1.0)
    """Direction in which it looks, in body axes; its length does not matter."""
    cross_axis_noise: Noise = math.radians(10.0 / 3600.0)
    """Standard deviation of the small rotation about each axis across the boresight, rad or text such as
    `0.003 deg`."""
    boresight_noise: Noise = math.radians(60.0 / 3600.0)
    """Standard deviation of the small rotation about the boresight, rad or text such as `0.02 deg`."""
    bias: tuple[ErrorAngle, ErrorAngle, ErrorAngle] = (0.0, 0.0, 0.0)
    """Constant small rotation, about the body axes, rad or text."""
    sun_exclusion: SmallAngle = 0.0
    """Least angle between boresight and Sun, rad or text; above zero the scenario needs a date."""
    earth_exclusion: SmallAngle = 0.0
    """Least angle between boresight and the edge of the Earth's disc, rad or text; with the boresight on the
    disc there is no reading in any case."""

    @model_validator(mode="after")
    def _looks(self) -> "StarTrackerSpec":
        require_direction(self.boresight, "boresight")
        return self

    @property
    def needs_sun(self) -> bool:
        """Whether the Sun has a part in what it sees."""
        return self.sun_exclusion > 0.0

    def build(self, names: Sequence[str], observer: int, step: float) -> list[SensorChannel]:
        """As of every sensor."""
        across, about = self.cross_axis_noise, self.boresight_noise
        return [
            StarTrackerChannel(
                timing=self.timing(step),
                observer=observer,
                axes=tracker_axes(unit(self.boresight)),
                noise=np.array([across, across, about]),
                bias=np.array(self.bias),
                sun_exclusion=self.sun_exclusion,
                earth_exclusion=self.earth_exclusion,
            )
        ]
