# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions that a planned motion stays out of, as half-spaces along the motion.

Equations: docs/controllers/model_predictive.md.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from satform.common.spec import Number, Positive, Spec, Vector, require_consistent
from satform.numeric.elementwise import Array, dot

_NO_DIRECTION = 1e-9
"""Length, m, below which a vector has no direction."""


@dataclass(frozen=True)
class KeepOut:
    """Regions of one satellite, or of several.

    A region is a ball, a cylinder about the along-track axis, or one side of a plane.

    Attributes:
        centre: of a ball or cylinder, or a point of the plane, LVLH, m, shape (..., K, 3).
        counted: 1 for a component of which the distance is made, 0 for the y of a cylinder, (..., K, 3).
        radius: of a ball or cylinder, 0 for a plane, m, shape (..., K).
        normal: unit vector of a plane that points out of the region, zero for the others, (..., K, 3).
    """

    centre: Array
    counted: Array
    radius: Array
    normal: Array

    def depth(self, position: Array) -> Array:
        """How far a position is inside each region, negative outside.

        Args:
            position: LVLH, m, shape (..., 3).

        Returns:
            m, shape (..., K).
        """
        apart = self.counted * (position[..., None, :] - self.centre)
        distance = np.sqrt(dot(apart, apart))
        plane = dot(self.normal, apart)
        depth: Array = np.where(self.radius > 0.0, self.radius - distance, -plane)
        return depth

    def turning(self, start: Array, goals: Array, fraction: Array) -> Array:
        """Normals that turn at a constant rate from the start's direction to the goal's, before a first plan.

        Args:
            start: position now, LVLH, m, shape (3,).
            goals: desired position at the end of each interval, LVLH, m, shape (N, 3).
            fraction: how much of the turn is made in each interval, 0 to 1, shape (N,).

        Returns:
            Unit normals, shape (N, K, 3).
        """
        found = np.broadcast_to(self.normal, (len(goals), *self.normal.shape)).copy()
        for region in np.flatnonzero(self.radius > 0.0):
            counted, centre = self.counted[region], self.centre[region]
            first = _direction(counted * (start - centre), counted)
            for step, goal in enumerate(goals):
                last = _direction(counted * (goal - centre), counted)
                found[step, region] = _between(first, last, float(fraction[step]), counted)
        return found

    def swept(self, positions: Array) -> float:
        """The largest angle by which a motion turns about the centre of a ball or cylinder, whichever way.

        Args:
            positions: one after the other, LVLH, m, shape (N, 3).

        Returns:
            rad; the sum of the angles between positions, 0 without a ball or cylinder.
        """
        apart = self.counted[:, None] * (positions - self.centre[:, None])
        before, after = apart[:, :-1], apart[:, 1:]
        lengths = np.sqrt(dot(before, before) * dot(after, after))
        cosine = dot(before, after) / np.maximum(lengths, _NO_DIRECTION * _NO_DIRECTION)
        angles = np.where(self.radius[:, None] > 0.0, np.arccos(np.clip(cosine, -1.0, 1.0)), 0.0)
        return float(np.max(np.sum(angles, axis=-1), initial=0.0))

    def along(self, positions: Array) -> Array:
        """Normals at the points of a motion's chords that are nearest to the centres.

        A motion whose chords are outside of a region meets the half-spaces of these normals, so that what
        is planned with them is never worse than the motion that they are taken from.

        Args:
            positions: now and at the end of each interval, LVLH, m, shape (N + 1, 3).

        Returns:
            Unit normals, shape (N, K, 3).
        """
        found = np.broadcast_to(self.normal, (len(positions) - 1, *self.normal.shape)).copy()
        for region in np.flatnonzero(self.radius > 0.0):
            counted, centre = self.counted[region], self.centre[region]
            apart = counted * (positions - centre)
            for step in range(len(apart) - 1):
                chord = apart[step + 1] - apart[step]
                length = float(dot(chord, chord))
                fraction = -float(dot(apart[step], chord)) / length if length > 0.0 else 0.0
                nearest = apart[step] + min(1.0, max(0.0, fraction)) * chord
                found[step, region] = _direction(nearest, counted)
        return found

    def offsets(self, normals: Array, sag: Array) -> Array:
        """What a position's component along each normal has to be at least.

        Args:
            normals: of each interval, shape (N, K, 3).
            sag: largest distance between the motion and its chord along each normal, m, shape (N, K).

        Returns:
            m, shape (N, K).
        """
        least: Array = self.radius + dot(normals, self.centre) + sag
        return least


def _direction(vector: Array, counted: Array) -> Array:
    """Unit vector; the first counted axis for a vector without a direction."""
    length = float(np.sqrt(dot(vector, vector)))
    if length > _NO_DIRECTION:
        return np.asarray(vector / length)
    return np.asarray(np.eye(3)[int(np.argmax(counted))], dtype=np.float64)


def _between(first: Array, last: Array, fraction: float, counted: Array) -> Array:
    """The unit vector that has turned by a fraction of the angle from one unit vector to another."""
    cosine = min(1.0, max(-1.0, float(dot(first, last))))
    across = last - cosine * first
    if float(np.sqrt(dot(across, across))) < _NO_DIRECTION:
        if cosine > 0.0:
            return first
        # Opposite: turn over the counted axis that is furthest from the first direction.
        axis = int(np.argmin(np.where(counted > 0.0, np.abs(first), np.inf)))
        across = np.eye(3)[axis] - first[axis] * first
    angle = fraction * float(np.arccos(cosine))
    turned = np.cos(angle) * first + np.sin(angle) * _direction(across, counted)
    return np.asarray(turned)


class HalfSpaceSpec(Spec):
    """The side of a plane that the satellite has to stay off."""

    kind: Literal["half_space"] = "half_space"
    normal: Vector
    """Direction out of the region, LVLH; its length does not matter."""
    offset: Number = 0.0
    """Least component of the position along the normal, m."""

    @model_validator(mode="after")
    def _has_direction(self) -> "HalfSpaceSpec":
        if not any(self.normal):
            require_consistent([(("normal",), "a normal of zero has no direction")])
        return self

    def region(self) -> tuple[Array, Array, float, Array]:
        """Centre, counted components, radius and normal, as in `KeepOut`."""
        normal = np.array(self.normal, dtype=np.float64)
        # Scaled by a power of two, which is exact: the squares of very small components are 0.
        normal = np.ldexp(normal, -np.frexp(np.max(np.abs(normal)))[1])
        normal = normal / np.sqrt(dot(normal, normal))
        return self.offset * normal, np.ones(3), 0.0, normal


class SphereSpec(Spec):
    """A ball that the satellite has to stay out of."""

    kind: Literal["sphere"] = "sphere"
    radius: Positive
    """Least distance from the centre, m."""
    centre: Vector = (0.0, 0.0, 0.0)
    """LVLH, m; the chief by default."""

    def region(self) -> tuple[Array, Array, float, Array]:
        """Centre, counted components, radius and normal, as in `KeepOut`."""
        return np.array(self.centre, dtype=np.float64), np.ones(3), self.radius, np.zeros(3)


class RadialNormalSpec(Spec):
    """Least separation in the radial/normal plane, which an error along the track cannot take away."""

    kind: Literal["radial_normal"] = "radial_normal"
    separation: Positive
    """Least distance from the centre in the x-z plane, m."""
    centre: Vector = (0.0, 0.0, 0.0)
    """LVLH, m; the chief by default. Its y does not matter."""

    def region(self) -> tuple[Array, Array, float, Array]:
        """Centre, counted components, radius and normal, as in `KeepOut`."""
        centre = np.array(self.centre, dtype=np.float64)
        return centre, np.array([1.0, 0.0, 1.0]), self.separation, np.zeros(3)


KeepOutSpec = Annotated[HalfSpaceSpec | SphereSpec | RadialNormalSpec, Field(discriminator="kind")]


def keep_out_of(specs: tuple[HalfSpaceSpec | SphereSpec | RadialNormalSpec, ...]) -> KeepOut:
    """The regions of one satellite."""
    regions = [spec.region() for spec in specs]
    return KeepOut(
        centre=np.array([region[0] for region in regions], dtype=np.float64).reshape(-1, 3),
        counted=np.array([region[1] for region in regions], dtype=np.float64).reshape(-1, 3),
        radius=np.array([region[2] for region in regions], dtype=np.float64),
        normal=np.array([region[3] for region in regions], dtype=np.float64).reshape(-1, 3),
    )
