# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Closed relative orbits as a scenario describes them."""

from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from satform.common.spec import Positive, Spec, Vector
from satform.numeric.elementwise import Array
from satform.orbits.curve import Curve, FixedPoint
from satform.orbits.ellipse import Ellipse, ellipse
from satform.orbits.turning_axes import AxesName

_LEAST_DIRECTION = 1e-9
"""Length of a vector above which it has a direction."""

_LEAST_LENGTH = 1e-6
"""Shortest semi-axis, m."""

_FLATTEST = 1e-6
"""Least ratio of the shorter semi-axis to the longer one."""


class CurveSpec(Spec):
    """Base of every curve's specification; subclasses set a literal `kind` and their geometry."""

    def build(self) -> Curve:
        """The curve itself."""
        raise NotImplementedError


class EllipseSpec(CurveSpec):
    """An ellipse in any plane, given by two semi-axis vectors or by lengths, normal and direction."""

    kind: Literal["ellipse"] = "ellipse"
    centre: Vector = (0.0, 0.0, 0.0)
    """Centre in LVLH, m."""
    first_axis: Vector | None = None
    """Semi-axis from the centre to the point of zero arc length, m. Comes with `second_axis`."""
    second_axis: Vector | None = None
    """Semi-axis from the centre to the point at a quarter of the perimeter, perpendicular to the first, m."""
    semi_axes: tuple[Positive, Positive] | None = None
    """Lengths of the first and the second semi-axis, m. Comes with `normal` and `direction`."""
    normal: Vector | None = None
    """Normal of the plane about which the arc length runs counter-clockwise; any length."""
    direction: Vector | None = None
    """Direction from the centre to the point of zero arc length, perpendicular to `normal`; any length."""

    @model_validator(mode="after")
    def _one_complete_form(self) -> Self:
        vectors = [name for name in ("first_axis", "second_axis") if getattr(self, name) is not None]
        lengths = [name for name in ("semi_axes", "normal", "direction") if getattr(self, name) is not None]
        if (len(vectors), len(lengths)) not in ((2, 0), (0, 3)):
            given = ", ".join(vectors + lengths) or "neither"
            raise ValueError(
                "an ellipse takes either first_axis and second_axis, or semi_axes, normal and direction; "
                f"given: {given}"
            )
        if vectors:
            axes = _require_perpendicular("first_axis", self.first_axis, "second_axis", self.second_axis)
            _require_curve(*axes)
        else:
            _require_perpendicular("normal", self.normal, "direction", self.direction)
            assert self.semi_axes is not None  # noqa: S101 - one of the three that are given together
            _require_curve(*self.semi_axes)
        return self

    def build(self) -> Ellipse:
        """The ellipse itself."""
        if self.first_axis is not None and self.second_axis is not None:
            return ellipse(np.array(self.centre), np.array(self.first_axis), np.array(self.second_axis))
        if self.semi_axes is None:
            raise ValueError("an ellipse without axes cannot be built")
        first, second = _plane_directions(self.normal, self.direction)
        return ellipse(np.array(self.centre), self.semi_axes[0] * first, self.semi_axes[1] * second)


class CircleSpec(CurveSpec):
    """A circle in any plane."""

    kind: Literal["circle"] = "circle"
    centre: Vector = (0.0, 0.0, 0.0)
    """Centre in LVLH, m."""
    radius: Positive
    """Radius, m."""
    normal: Vector = (0.0, 0.0, -1.0)
    """Normal of the plane about which the arc length runs counter-clockwise; any length."""
    direction: Vector = (0.0, 1.0, 0.0)
    """Direction from the centre to the point of zero arc length, perpendicular to `normal`; any length."""

    @model_validator(mode="after")
    def _direction_lies_in_plane(self) -> Self:
        _require_perpendicular("normal", self.normal, "direction", self.direction)
        _require_curve(self.radius, self.radius)
        return self

    def build(self) -> Ellipse:
        """The circle itself."""
        first, second = _plane_directions(self.normal, self.direction)
        return ellipse(np.array(self.centre), self.radius * first, self.radius * second)


class FixedPointSpec(CurveSpec):
    """A fixed point."""

    kind: Literal["fixed_point"] = "fixed_point"
    position: Vector
    """Position in LVLH, m."""

    def build(self) -> FixedPoint:
        """The point as a curve without extent."""
        return FixedPoint(position=np.array(self.position), perimeter=np.zeros(()))


class InertialPointSpec(CurveSpec):
    """A point at rest in inertial axes, or in axes that point from the chief to the Sun."""

    kind: Literal["inertial_point"] = "inertial_point"
    position: Vector
    """Position relative to the chief, along `axes`, m."""
    axes: AxesName = "inertial"
    """inertial: those of GCRF; sun: x from the chief to the Sun, z square to it on the side of the inertial z
    axis, y completing them, so that a baseline along x points at the Sun."""

    def build(self) -> FixedPoint:
        """The point in its own axes."""
        return FixedPoint(position=np.array(self.position), perimeter=np.zeros(()))


def _require_perpendicular(
    first_name: str, first: Vector | None, second_name: str, second: Vector | None
) -> tuple[float, float]:
    """Lengths of two vectors that are square to each other.

    Raises:
        ValueError: they are not, or one of them is too short to have a direction.
    """
    a, b = np.array(first, dtype=np.float64), np.array(second, dtype=np.float64)
    lengths = {first_name: float(np.linalg.norm(a)), second_name: float(np.linalg.norm(b))}
    for name, length in lengths.items():
        if not length > _LEAST_DIRECTION:
            found = "the zero vector" if length == 0.0 else f"of length {length:.3g}"
            raise ValueError(f"{name} is {found}; it has to have a length of more than {_LEAST_DIRECTION:g}")
    cosine = float(np.dot(a, b)) / (lengths[first_name] * lengths[second_name])
    if abs(cosine) > 1e-9:
        angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        raise ValueError(
            f"{first_name} {first} and {second_name} {second} have to be perpendicular; "
            f"the angle between them is {angle:.9g} deg"
        )
    return lengths[first_name], lengths[second_name]


def _require_curve(first: float, second: float) -> None:
    """Refuse semi-axes of a curve that bends without bound, so that nothing could follow it."""
    short, long = min(first, second), max(first, second)
    if short < _LEAST_LENGTH or short < _FLATTEST * long:
        raise ValueError(
            f"semi-axes of {first:.6g} and {second:.6g} m make a curve with a turn of radius "
            f"{short * (short / long):.3g} m; they have to be at least {_LEAST_LENGTH:g} m, and the shorter "
            f"one at least {_FLATTEST:g} of the other (a point at which to stay is kind: fixed_point)"
        )


def _plane_directions(normal: Vector | None, direction: Vector | None) -> tuple[Array, Array]:
    third = np.array(normal, dtype=np.float64) / np.linalg.norm(np.array(normal, dtype=np.float64))
    first = np.array(direction, dtype=np.float64) / np.linalg.norm(np.array(direction, dtype=np.float64))
    second = np.cross(third, first)
    return first, second / np.linalg.norm(second)
