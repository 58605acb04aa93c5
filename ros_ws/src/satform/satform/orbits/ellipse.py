# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Ellipses and circles in any plane, with arc length by elliptic integrals."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from satform.numeric.elementwise import Array, arctan2, column, dot, scalar
from satform.orbits.curve import CurvePoint

_INVERSION_STEPS = 3
_PROJECTION_STEPS = 7
_NEAR = 4e-6
_TINY = 1e-300
# Far below any length in metres, and its inverse times any length is still finite.
_NEGLIGIBLE = 1e-200


@dataclass(frozen=True)
class Ellipse:
    """An ellipse in any plane: centre + first_axis cos(theta) + second_axis sin(theta).

    Built by `ellipse`, which works out the derived attributes. A circle is an ellipse with equal
    axes. "Apex" below means an end of the longer axis, where the curvature is greatest.

    Attributes:
        centre: m, LVLH, shape (..., 3).
        first_axis: semi-axis to the point of theta = 0, m, shape (..., 3).
        second_axis: semi-axis to the point of theta = pi/2, perpendicular to the first, m, shape (..., 3).
        first_direction: unit vector along the first axis, shape (..., 3).
        second_direction: unit vector along the second axis, shape (..., 3).
        first_length: length of the first semi-axis, m, shape (...).
        second_length: length of the second semi-axis, m, shape (...).
        semi_major: the longer of the two, m, shape (...).
        semi_minor: the shorter of the two, m, shape (...).
        linear_eccentricity: distance of a focus from the centre, m, shape (...).
        elliptic_parameter: 1 - (semi_major / semi_minor)^2, parameter m of the elliptic integral,
            shape (...).
        quarter: arc length of a quarter of the ellipse, m, shape (...).
        perimeter: of the ellipse, m, shape (...).
        apex_shift: quarters of the perimeter from the apex before theta = 0 to theta = 0: 0 when the first
            axis is the longer, else 1, shape (...).
    """

    centre: Array
    first_axis: Array
    second_axis: Array
    first_direction: Array
    second_direction: Array
    first_length: Array
    second_length: Array
    semi_major: Array
    semi_minor: Array
    linear_eccentricity: Array
    elliptic_parameter: Array
    quarter: Array
    perimeter: Array
    apex_shift: Array

    def arc_length_at(self, angle: Array) -> Array:
        """Arc length from theta = 0.

        Args:
            angle: theta, rad, shape (...), any number of revolutions.

        Returns:
            m, shape (...).

        Source: incomplete elliptic integral of the second kind, DLMF 19.30(i).
        """
        from_apex = angle + self._apex_angle
        half_periods = np.rint(from_apex / np.pi)
        part = self._arc_from_apex(from_apex - half_periods * np.pi)
        total: Array = (2.0 * half_periods - self.apex_shift) * self.quarter + part
        return total

    def angle_at(self, arc_length: Array) -> Array:
        """Angle at an arc length: the inverse of `arc_length_at`, to rounding.

        Args:
            arc_length: from theta = 0, m, shape (...), any number of revolutions.

        Returns:
            theta, rad, shape (...).

        Source: Halley's iteration on the elliptic integral, whose first two derivatives are closed.
        """
        part, turned = self._from_apex(arc_length)
        angle = np.sign(part) * self._angle_guess(np.abs(part))
        for _ in range(_INVERSION_STEPS):
            angle, _ = self._closer(angle, part)
        total: Array = turned + angle - self._apex_angle
        return total

    def angle_after(self, angle: Array, here: CurvePoint, ahead: Array, arc_length: Array) -> Array:
        """Angle at an arc length a little after a known point: `angle_at`, to rounding, in less time.

        Args:
            angle: theta of the known point, rad, shape (...), any number of revolutions.
            here: the curve's local shape there.
            ahead: arc length from there on, m, shape (...), of either sign.
            arc_length: of the point that is asked for, from theta = 0, m, shape (...).

        Returns:
            theta, rad, shape (...).

        Source: one step of `angle_at`'s iteration from a Taylor series of second order; where that step is
        so long that the iteration's cubic convergence does not leave rounding alone, `angle_at` itself.
        """
        onward = ahead / here.speed
        onward = onward - 0.5 * onward * onward * (here.speed_slope / here.speed)
        part, turned = self._from_apex(arc_length)
        guess = angle + onward + self._apex_angle - turned
        closer, newton = self._closer(guess, part)
        near = np.abs(newton) < self._near
        after: Array = turned + closer - self._apex_angle
        all_near = near.all() if near.ndim else near
        return after if all_near else np.where(near, after, self.angle_at(arc_length))

    def point(self, angle: Array) -> CurvePoint:
        """Position, Frenet frame and speed.

        Args:
            angle: theta, rad, shape (...).

        Returns:
            The curve's local shape, vectors of shape (..., 3).
        """
        a, b = self.first_length, self.second_length
        sine, cosine = np.sin(angle), np.cos(angle)
        radial, along = a * sine, b * cosine
        speed = np.sqrt(radial * radial + along * along)
        backward, forward = column(radial / speed), column(along / speed)
        first, second = self.first_direction, self.second_direction
        return CurvePoint(
            position=self.centre + self.first_axis * column(cosine) + self.second_axis * column(sine),
            tangent=forward * second - backward * first,
            normal=-backward * second - forward * first,
            curvature=self._area / (speed * speed * speed),
            speed=speed,
            speed_slope=self._unevenness * sine * cosine / speed,
        )

    def nearest(self, position: Array) -> Array:
        """Angle of the point of the ellipse closest to a position, the global minimum.

        The plane's first quadrant holds one closest point for a position in it, and the others
        follow by symmetry. Where several points are equally close the one with non-negative
        coordinates along the two axes is taken; the centre of a circle goes to theta = pi/2.

        Args:
            position: m, LVLH, shape (..., 3).

        Returns:
            theta, rad, shape (...), in [-pi, pi].

        Source: the multiplier form of the closest-point problem, solved like the trust-region
        subproblem of Moré & Sorensen 1983 with a fixed number of steps.
        """
        offset = position - self.centre
        first, second = dot(offset, self.first_direction), dot(offset, self.second_direction)
        swapped = self.apex_shift > 0.5
        along_major = np.abs(np.where(swapped, second, first))
        along_minor = np.abs(np.where(swapped, first, second))
        cosine, sine = _closest_in_quadrant(
            along_major / self.semi_major, along_minor / self.semi_major, self.semi_minor / self.semi_major
        )
        first_part, second_part = np.where(swapped, sine, cosine), np.where(swapped, cosine, sine)
        return arctan2(
            np.where(second < 0.0, -second_part, second_part), np.where(first < 0.0, -first_part, first_part)
        )

    def _arc_from_apex(self, angle: Array) -> Array:
        return self.semi_minor * _elliptic_integral(angle, self.elliptic_parameter)

    def _from_apex(self, arc_length: Array) -> tuple[Array, Array]:
        """Arc length from the nearest apex, m, up to a quarter either way, and that apex's angle, rad."""
        half_period = self._half_period
        from_apex = arc_length + self._apex_arc_length
        half_periods = np.rint(from_apex / half_period)
        return from_apex - half_periods * half_period, half_periods * np.pi

    def _closer(self, angle: Array, arc_length: Array) -> tuple[Array, Array]:
        """A step towards the inverse of `_arc_from_apex`, and by how much Newton's would have gone, rad."""
        sine = np.sin(angle)
        weighted = self._excess * sine
        speed_square = self._minor_square + weighted * sine
        newton = (self._arc_from_apex(angle) - arc_length) / np.sqrt(speed_square)
        bend = weighted * np.cos(angle) / speed_square
        return angle - newton / (1.0 - 0.5 * newton * bend), newton

    def _angle_guess(self, arc_length: Array) -> Array:
        """Start of the inversion, for non-negative arc lengths up to a quarter.

        The speed is at least semi_minor and at least linear_eccentricity sin(angle). Either gives an upper
        bound of the angle, from which the iteration on a convex function closes in.
        """
        ratio = np.minimum(arc_length / self._focal_distance, 0.5)
        guess: Array = np.minimum(arc_length / self.semi_minor, 2.0 * np.arcsin(np.sqrt(ratio)))
        return guess

    # What every step of a flight needs of the shape, worked out once.

    @cached_property
    def _apex_angle(self) -> Array:
        return self.apex_shift * (0.5 * np.pi)

    @cached_property
    def _apex_arc_length(self) -> Array:
        return self.apex_shift * self.quarter

    @cached_property
    def _half_period(self) -> Array:
        return 2.0 * self.quarter

    @cached_property
    def _minor_square(self) -> Array:
        return self.semi_minor * self.semi_minor

    @cached_property
    def _excess(self) -> Array:
        return self.linear_eccentricity * self.linear_eccentricity

    @cached_property
    def _near(self) -> Array:
        """Length of a step of the inversion whose error is below rounding, rad.

        It is at most its cube times the largest third derivative of arc length over the first, which is at
        an apex and (semi_major / semi_minor)^2 - 1.
        """
        near: Array = _NEAR * np.cbrt((self.semi_minor / self.semi_major) ** 2)
        return near

    @cached_property
    def _focal_distance(self) -> Array:
        """Between the foci; of a circle something negligible to divide by."""
        return 2.0 * self.linear_eccentricity + _NEGLIGIBLE

    @cached_property
    def _area(self) -> Array:
        """Of the rectangle of both semi-axes."""
        return self.first_length * self.second_length

    @cached_property
    def _unevenness(self) -> Array:
        return self.first_length * self.first_length - self.second_length * self.second_length


def ellipse(centre: Array, first_axis: Array, second_axis: Array) -> Ellipse:
    """An ellipse from its centre and its two perpendicular semi-axes.

    Args:
        centre: m, LVLH, shape (3,).
        first_axis: from the centre to the point of zero arc length, m, shape (3,).
        second_axis: from the centre to the point a quarter of the perimeter on, m, shape (3,).

    Returns:
        The ellipse with everything that does not depend on the place along it worked out.
    """
    first_length, second_length = float(np.linalg.norm(first_axis)), float(np.linalg.norm(second_axis))
    first_direction, second_direction = first_axis / first_length, second_axis / second_length
    semi_major, semi_minor = max(first_length, second_length), min(first_length, second_length)
    parameter = 1.0 - (semi_major / semi_minor) ** 2
    quarter = semi_minor * float(_elliptic_integral(np.array(0.5 * np.pi), np.array(parameter)))
    return Ellipse(
        centre=np.asarray(centre, dtype=np.float64),
        first_axis=np.asarray(first_axis, dtype=np.float64),
        second_axis=np.asarray(second_axis, dtype=np.float64),
        first_direction=first_direction,
        second_direction=second_direction,
        first_length=scalar(first_length),
        second_length=scalar(second_length),
        semi_major=scalar(semi_major),
        semi_minor=scalar(semi_minor),
        linear_eccentricity=scalar(((semi_major - semi_minor) * (semi_major + semi_minor)) ** 0.5),
        elliptic_parameter=scalar(parameter),
        quarter=scalar(quarter),
        perimeter=scalar(4.0 * quarter),
        apex_shift=scalar(0.0 if first_length >= second_length else 1.0),
    )


def _elliptic_integral(angle: Array, parameter: Array) -> Array:
    """Incomplete elliptic integral of the second kind."""
    from scipy.special import ellipeinc  # noqa: PLC0415  slow to import, and only curves need it

    integral: Array = ellipeinc(angle, parameter)
    return integral


def _closest_in_quadrant(along_major: Array, along_minor: Array, ratio: Array) -> tuple[Array, Array]:
    """Cosine and sine of the angle (from the apex) of the closest point of an ellipse of axes 1, ratio.

    With multiplier s the closest point is (u, ratio v), u = along_major / (s + 1 - ratio^2) and
    v = ratio along_minor / s, where s > 0 makes (u, v) a unit vector. The length of (u, v) is at
    least one at the start and its inverse is almost linear in s, so the steps never overshoot. The
    start is the best of three lower bounds: v <= 1, u <= 1, and, near the centre of curvature of the
    apex where those two are far off, v^2 = 1 - u^2 <= 2 (s + shortfall) / (s + gap).
    """
    gap = 1.0 - ratio * ratio
    scaled_minor = ratio * along_minor
    shortfall = np.maximum(gap - along_major, _TINY)
    near_apex_centre = np.minimum(
        np.cbrt(0.25 * scaled_minor * scaled_minor * gap), 0.5 * scaled_minor * np.sqrt(gap / shortfall)
    )
    s = np.maximum(np.maximum(scaled_minor, along_major - gap), np.maximum(near_apex_centre, _TINY))
    for _ in range(_PROJECTION_STEPS):
        u, v = along_major / (s + gap), scaled_minor / s
        square = u * u + v * v
        slope = u * u / (s + gap) + v * v / s
        s = s + np.maximum(np.sqrt(square) - 1.0, 0.0) * square / np.maximum(slope, _TINY)
    u, v = np.minimum(along_major / (s + gap), 1.0), scaled_minor / s
    return u, np.where(scaled_minor > 0.0, v, np.sqrt(1.0 - u * u))
