# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Bearing-only camera: two angles of the direction of another satellite, while it stands out.

Equations: docs/sensors.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.common.angle_text import OR_DEGREES
from satform.common.spec import LEAST_DEVIATION
from satform.equipment.sensors.protocol import PairModel, Scene, SensorChannel
from satform.equipment.sensors.sensor_spec import DirectedSensorSpec, NoisyChannel, SmallAngle
from satform.equipment.sensors.visibility import Contrast, Sight
from satform.numeric.elementwise import Array, arctan2, joined

_NEAREST = 1e-3
"""Distance below which angles are not computed any more, m."""

_LARGEST_ELEVATION = math.radians(89.0)
"""Beyond it the azimuth is taken for undefined, rad."""

Angle = Annotated[float, Field(ge=-math.pi, le=math.pi), OR_DEGREES]


@dataclass(frozen=True)
class BearingModel(PairModel):
    """Azimuth and elevation of the direction from one satellite to another, in LVLH axes.

    The variance is that of the direction across the line of sight, towards larger azimuth and towards larger
    elevation, rad^2.
    """

    @property
    def width(self) -> int:
        """Two angles."""
        return 2

    def predicted(self, own: Array, other: Array) -> Array:
        """As of every model: azimuth from the radial axis towards the along-track axis, elevation, rad."""
        x, y, z, across = _components(own, other)
        return joined(arctan2(y, x), arctan2(z, across))

    def jacobian(self, own: Array, other: Array) -> tuple[Array, Array]:
        """As of every model."""
        x, y, z, across = _components(own, other)
        across = np.maximum(across, _NEAREST)
        in_plane = across * across
        squared = in_plane + z * z
        by_other = np.zeros((*x.shape, 2, 6))
        by_other[..., 0, 0] = -y / in_plane
        by_other[..., 0, 1] = x / in_plane
        by_other[..., 1, 0] = -x * z / (across * squared)
        by_other[..., 1, 1] = -y * z / (across * squared)
        by_other[..., 1, 2] = across / squared
        return -by_other, by_other

    def variance_at(self, reading: Array) -> Array:
        """Of azimuth and elevation: off the orbit plane, an angle across the line is a larger azimuth.

        Args:
            reading: azimuth and elevation, rad, shape (..., 2).
        """
        return np.asarray(self.variance * np.square(_stretch(reading)))

    def residual(self, measured: Array, predicted: Array) -> Array:
        """As of every model: the azimuth's in [-pi, pi]."""
        difference = measured - predicted
        return np.asarray(difference - 2.0 * math.pi * np.round(difference / (2.0 * math.pi)))


def _components(own: Array, other: Array) -> tuple[Array, Array, Array, Array]:
    """Components of the vector to the other satellite, and the length of its part in the orbit plane."""
    between = other[..., :3] - own[..., :3]
    x, y, z = between[..., 0], between[..., 1], between[..., 2]
    return x, y, z, np.sqrt(x * x + y * y)


def _stretch(angles: Array) -> Array:
    """Angles of azimuth and elevation to angles across the line of sight, shape (..., 2)."""
    elevation = np.clip(angles[..., 1], -_LARGEST_ELEVATION, _LARGEST_ELEVATION)
    return joined(1.0 / np.cos(elevation), np.ones_like(elevation))


@dataclass(frozen=True)
class CameraChannel(NoisyChannel):
    """A channel whose white noise is the same in all directions across the line of sight."""

    def reading(self, scene: Scene, step: int, normals: Array) -> Array:
        """As of every channel."""
        truth = self.observed(scene) if self.timing.is_due(step) else None
        if truth is None:
            return np.full(self.width, np.nan)
        return np.asarray(truth + self.bias + _stretch(truth) * self.noise * normals)


@dataclass(frozen=True)
class _Seen:
    """Truth of a camera's channel."""

    sight: Sight
    contrast: Contrast
    model: BearingModel

    def __call__(self, scene: Scene) -> Array | None:
        """Azimuth and elevation; None where the target is not seen."""
        pair = [self.sight.observer, self.sight.target]
        own, other = np.concatenate((scene.position[pair], scene.velocity[pair]), axis=-1)
        if not (self.sight.is_free(scene) and self.contrast.is_enough(scene, *pair)):
            return None
        angles = self.model.predicted(own, other)
        return angles if abs(float(angles[1])) <= _LARGEST_ELEVATION else None


class BearingCameraSpec(DirectedSensorSpec):
    """A camera that measures the direction of other satellites against the stars, and no distance.

    Azimuth is the angle in the chief's orbit plane from the radial axis x towards the along-track axis y,
    elevation the angle from this plane towards the orbit normal z. Within 1 deg of the normal there is no
    reading.
    """

    kind: Literal["bearing_camera"] = "bearing_camera"
    angle_noise: Annotated[float, Field(ge=LEAST_DEVIATION, le=1.0), OR_DEGREES] = 1e-4
    """Standard deviation of the white noise on the direction, along each of two axes across the line of
    sight, rad or text such as `0.01 deg`; on the azimuth it is larger by 1/cos(elevation)."""
    azimuth_bias: Angle = 0.0
    """Constant error of the azimuth, rad or text."""
    elevation_bias: Angle = 0.0
    """Constant error of the elevation, rad or text."""
    sunlit_only: bool = True
    """Whether a target in the Earth's shadow is invisible; the scenario then needs a date."""
    limb_exclusion: SmallAngle = 0.0
    """Least angle between the line of sight and the edge of the Earth's disc, rad or text; in front of the
    disc there is no reading."""
    sun_exclusion: SmallAngle = 0.0
    """Least angle between the line of sight and the Sun, rad or text; above zero the scenario needs a
    date."""

    @property
    def needs_sun(self) -> bool:
        """Whether the Sun has a part in what the camera sees."""
        return self.sunlit_only or self.sun_exclusion > 0.0

    def build(self, names: Sequence[str], observer: int, step: float) -> list[SensorChannel]:
        """As of every sensor."""
        timing = self.timing(step)
        noise, bias = np.full(2, self.angle_noise), np.array([self.azimuth_bias, self.elevation_bias])
        contrast = Contrast(self.sunlit_only, self.limb_exclusion, self.sun_exclusion)
        found: list[SensorChannel] = []
        for target in self.target_indices(names, observer):
            model = BearingModel(f"{self.kind} {names[target]}", observer, target, noise * noise)
            truth = _Seen(self.sight(observer, target), contrast, model)
            found.append(CameraChannel(model, timing, truth, noise, bias))
        return found
