# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reference motion along a curve, driven by a generalised arc length.

The generalised arc length xi is the phase that satellites compare. It is in metres on every path and
grows by xi_period in one revolution. It determines the place on the curve in one of two ways:

- `arc_length`: l = scale xi, so that a constant rate of xi is constant speed;
- `angle`: theta = 2 pi xi / xi_period, so that a constant rate of xi is a constant rate of the
  ellipse's angle, which on a centred 2:1 ellipse is free Clohessy-Wiltshire motion.

In both, xi_period = perimeter / scale: paths with the same xi_period have the same period at equal rates.

Equations: docs/controllers/consensus.md.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from satform.numeric.elementwise import Array, column, dot
from satform.orbits.curve import Curve, CurvePoint, QuickCurve

Parameter = Literal["arc_length", "angle"]
FeedForward = Literal["midpoint", "start"]

LEAST_CONDITION = 0.1
"""Part of the radius of curvature to its centre, below which the closest point of a curve is given up."""


@dataclass(frozen=True)
class Reference:
    """Desired motion in the chief's rotating LVLH frame.

    Attributes:
        position: m, shape (..., 3).
        velocity: m/s, shape (..., 3).
        acceleration: m/s^2, shape (..., 3).
    """

    position: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True)
class Path:
    """A curve together with the generalised arc length that moves along it.

    Attributes:
        curve: the reference orbit, m, LVLH.
        scale: dl/dxi, averaged over a revolution where it is not constant, dimensionless, shape (...).
        parameter: which quantity is proportional to xi, `arc_length` or `angle`.
        feedforward_sample: where within a control period the reference's acceleration is taken. `middle`
            leaves no first-order error of a command that is held; `start` adds an equivalent
            disturbance of half the period times the reference's jerk.
    """

    curve: Curve
    scale: Array
    parameter: Parameter = "arc_length"
    feedforward_sample: FeedForward = "midpoint"

    @property
    def period(self) -> Array:
        """Growth of xi in one revolution, m, shape (...); zero for a fixed point."""
        period: Array = self.curve.perimeter / self.scale
        return period

    def angle(self, generalised_arc_length: Array) -> Array:
        """The curve's angle (rad, shape (...)) at xi (m, shape (...)), over any number of revolutions."""
        if self.parameter == "arc_length":
            return self.curve.angle_at(self.scale * generalised_arc_length)
        return self._angle_rate() * generalised_arc_length

    def generalised_arc_length(self, angle: Array) -> Array:
        """Phase xi (m, shape (...)) at the curve's angle (rad, shape (...)), any number of revolutions."""
        if self.parameter == "arc_length":
            return self.curve.arc_length_at(angle) / self.scale
        return angle * self.period / (2.0 * np.pi)

    def reference(self, generalised_arc_length: Array, rate: Array, rate_change: Array) -> Reference:
        """Desired motion for a state of the generalised arc length.

        Args:
            generalised_arc_length: xi, m, shape (...).
            rate: eta = dxi/dt, m/s, shape (...).
            rate_change: deta/dt, m/s^2, shape (...).

        Returns:
            Desired motion, shape (..., 3).

        Source: Chen et al. 2015, desired motion in the tangent and normal directions of the orbit.
        """
        point = self.curve.point(self.angle(generalised_arc_length))
        return Reference(
            position=point.position,
            velocity=column(self._arc_slope(point) * rate) * point.tangent,
            acceleration=self._acceleration(point, rate, rate_change),
        )

    def at_step(
        self,
        generalised_arc_length: Array,
        rate: Array,
        rate_change: Array,
        duration: float,
        number: int = 0,
    ) -> Reference:
        """Desired motion for one control period: position and velocity at its start, acceleration to hold.

        Args:
            generalised_arc_length: xi at the start, m, shape (...).
            rate: eta at the start, m/s, shape (...).
            rate_change: deta/dt over the period, m/s^2, shape (...).
            duration: of the period, s.
            number: of the step; without effect on a path that lies still in LVLH, as this one.

        Returns:
            Position and velocity at the start, acceleration as `feedforward_sample` says, shape (..., 3).
        """
        if self.feedforward_sample == "start":
            return self.reference(generalised_arc_length, rate, rate_change)
        half = 0.5 * duration
        to_middle = (rate + rate_change * (0.5 * half)) * half
        start_angle = self.angle(generalised_arc_length)
        start_point = self.curve.point(start_angle)
        middle = generalised_arc_length + to_middle
        quick = self._quick_curve
        if quick is None:
            middle_angle = self.angle(middle)
        else:
            ahead, arc_length = self.scale * to_middle, self.scale * middle
            middle_angle = quick.angle_after(start_angle, start_point, ahead, arc_length)
        middle_point = self.curve.point(middle_angle)
        return Reference(
            position=start_point.position,
            velocity=column(self._arc_slope(start_point) * rate) * start_point.tangent,
            acceleration=self._acceleration(middle_point, rate + rate_change * half, rate_change),
        )

    @cached_property
    def _quick_curve(self) -> QuickCurve | None:
        """The curve, if it can compute a point near a known one in less time."""
        curve = self.curve
        return curve if self.parameter == "arc_length" and isinstance(curve, QuickCurve) else None

    def projected(self, position: Array, velocity: Array, near: Array) -> tuple[Array, Array]:
        """Generalised arc length of the point of the curve closest to a moving satellite, and its rate.

        Args:
            position: m, LVLH, shape (..., 3).
            velocity: m/s, in the rotating frame, shape (..., 3).
            near: xi, m, shape (...); of all revolutions the result is the one closest to it.

        Returns:
            xi (m) and eta (m/s), each of shape (...); both zero for a fixed point. Towards the centre of
            curvature, where a small move turns the closest point by a large angle, the rate is bounded by
            `1 / LEAST_CONDITION` times the velocity, and xi goes over into `near`.

        Source: rate of a Frenet frame's foot point, (v . T) / (1 - curvature d_normal).
        """
        angle = self.curve.nearest(position)
        point = self.curve.point(angle)
        first_period = self.generalised_arc_length(angle)
        period = self.period
        periods = np.rint((near - first_period) / (period + (period == 0.0)))
        offset = dot(position - point.position, point.normal)
        condition = 1.0 - point.curvature * offset
        arc_rate = dot(velocity, point.tangent) / np.maximum(condition, LEAST_CONDITION)
        slope = self._arc_slope(point)
        found = first_period + periods * period
        weight = np.minimum(np.maximum(condition / LEAST_CONDITION, 0.0), 1.0)
        found = np.where(weight < 1.0, near + weight * (found - near), found)
        return found, arc_rate / (slope + (slope == 0.0))

    def _angle_rate(self) -> Array:
        """dtheta/dxi in the `angle` parameter, rad/m; of a fixed point any finite number will do."""
        perimeter = self.curve.perimeter
        rate: Array = 2.0 * np.pi * self.scale / (perimeter + (perimeter == 0.0))
        return rate

    def _arc_slope(self, point: CurvePoint) -> Array:
        """dl/dxi at a point of the curve."""
        return self.scale if self.parameter == "arc_length" else point.speed * self._angle_rate()

    def _acceleration(self, point: CurvePoint, rate: Array, rate_change: Array) -> Array:
        if self.parameter == "arc_length":
            speed, along = self.scale * rate, self.scale * rate_change
        else:
            slope = self._angle_rate()
            angular_rate = slope * rate
            speed = point.speed * angular_rate
            along = point.speed * (slope * rate_change) + point.speed_slope * (angular_rate * angular_rate)
        across = point.curvature * speed * speed
        total: Array = column(along) * point.tangent + column(across) * point.normal
        return total


@dataclass(frozen=True)
class SteadyMotion:
    """Extremes of acceleration and jerk of steady motion along a path, over one revolution.

    Attributes:
        acceleration_max: largest magnitude of the desired acceleration, m/s^2.
        jerk_max: largest magnitude of its time derivative, m/s^3.
    """

    acceleration_max: float
    jerk_max: float


def steady_motion(path: Path, rate: float, samples: int = 4096) -> SteadyMotion:
    """Extremes of acceleration and jerk at a constant rate of the generalised arc length.

    Args:
        path: of a single satellite.
        rate: eta, m/s.
        samples: points of a revolution, equally spaced in the curve's angle; a multiple of four includes
            both ends of both axes of an ellipse.

    Returns:
        The extremes over the samples. In the `arc_length` parameter the acceleration is centripetal.
    """
    period = float(path.period)
    if period == 0.0 or rate == 0.0:
        return SteadyMotion(0.0, 0.0)
    arc_lengths = path.generalised_arc_length(np.linspace(0.0, 2.0 * np.pi, samples, endpoint=False))
    apart = 1e-6 * period
    rates, still = np.full(samples, rate), np.zeros(samples)
    here = np.linalg.norm(path.reference(arc_lengths, rates, still).acceleration, axis=-1)
    ahead = path.reference(arc_lengths + apart, rates, still).acceleration
    behind = path.reference(arc_lengths - apart, rates, still).acceleration
    jerk = np.linalg.norm(ahead - behind, axis=-1) * abs(rate) / (2.0 * apart)
    return SteadyMotion(float(here.max()), float(jerk.max()))
