# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a sensor sees of another satellite: range, the Earth in between, fields of view, sunlight."""

import math
from dataclasses import dataclass

import numpy as np

from satform.equipment.sensors.protocol import Scene
from satform.numeric.directions import within
from satform.numeric.elementwise import Array
from satform.orbits.earth import EQUATORIAL_RADIUS
from satform.orbits.line_of_sight import blocked_by_earth, from_earth_centre, in_body_axes, line_of_sight
from satform.orbits.sun import in_cylindrical_shadow


@dataclass(frozen=True)
class Cone:
    """Directions that a sensor or terminal sees, about an axis that is fixed to the body.

    Attributes:
        axis: unit vector in body axes, shape (3,).
        half_angle: between the axis and the edge, rad; pi for all directions.
    """

    axis: Array
    half_angle: float

    def has(self, body: Array | None, direction: Array) -> bool:
        """Whether a direction lies in the cone.

        Args:
            body: rows are the body axes in LVLH, shape (3, 3); None where they are the axes of LVLH.
            direction: unit vector, LVLH, shape (3,).
        """
        return bool(within(in_body_axes(body, direction), self.axis, self.half_angle))


@dataclass(frozen=True)
class Sight:
    """When one satellite sees another one.

    Attributes:
        observer: index of the satellite that looks.
        target: index of the other one.
        maximum_range: m.
        margin: height above the Earth's equatorial radius that the line of sight keeps, m.
        field_of_view: of the observer.
        target_field_of_view: of what the target carries, such as a reflector or transponder; None where the
            target needs none.
    """

    observer: int
    target: int
    maximum_range: float
    margin: float
    field_of_view: Cone
    target_field_of_view: Cone | None = None

    def is_free(self, scene: Scene) -> bool:
        """Whether the target is in range, in the fields of view, and not hidden by the Earth.

        Args:
            scene: truth at the step.
        """
        position = scene.position
        distance, direction = line_of_sight(position[self.observer], position[self.target])
        if not 0.0 < float(distance) <= self.maximum_range:
            return False
        if not self.field_of_view.has(_body(scene, self.observer), direction):
            return False
        back = self.target_field_of_view
        if back is not None and not back.has(_body(scene, self.target), -direction):
            return False
        from_earth = from_earth_centre(position, scene.chief_radius)
        return not bool(blocked_by_earth(from_earth[self.observer], from_earth[self.target], self.margin))


@dataclass(frozen=True)
class Contrast:
    """When a camera makes out a target that it sees: lit, not in front of the Earth, not near the Sun.

    Attributes:
        sunlit: whether the target is visible in sunlight alone.
        limb: least angle between the line of sight and the edge of the Earth's disc, rad.
        sun: least angle between the line of sight and the Sun, rad.
    """

    sunlit: bool
    limb: float
    sun: float

    def is_enough(self, scene: Scene, observer: int, target: int) -> bool:
        """Whether the target stands out.

        Args:
            scene: truth at the step; without the Sun's direction the target counts as lit.
            observer: index of the satellite with the camera.
            target: index of the satellite that is looked at.
        """
        _, direction = line_of_sight(scene.position[observer], scene.position[target])
        from_earth = from_earth_centre(scene.position, scene.chief_radius)
        height, up = line_of_sight(np.zeros(3), from_earth[observer])
        disc = math.asin(min(1.0, EQUATORIAL_RADIUS / float(height)))
        if bool(within(direction, -up, disc + self.limb)):
            return False
        if scene.sun is None:
            return True
        if self.sun > 0.0 and bool(within(direction, scene.sun, self.sun)):
            return False
        return not (self.sunlit and in_cylindrical_shadow(from_earth[target], scene.sun))


def _body(scene: Scene, satellite: int) -> Array | None:
    return None if scene.body is None else scene.body[satellite]
