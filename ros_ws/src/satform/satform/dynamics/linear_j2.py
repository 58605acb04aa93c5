# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear relative motion under J2 about a circular mean orbit (Schweighart and Sedwick).

Clohessy-Wiltshire with the mean effect of the Earth's oblateness: the chief turns at n c, in-plane
motion keeps constant coefficients, and cross-track motion follows the two orbit planes, whose nodes
drift apart with the difference of their inclinations. The chief is the mean orbit: what oblateness
does to it within one revolution is left out, and so is the second order in the distance.

Frame: LVLH of the chief (x radial outward, y along-track, z orbit normal).

The state transition matrix under J2 for any eccentricity is `orbits/j2_elements.py` (relative elements), and
`dynamics/j2_element_model.py` in positions and velocities.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from satform.dynamics.cw import InPlaneCoupling, sinc, sine_remainder
from satform.dynamics.prescribed_disturbances import Perturbation
from satform.dynamics.protocol import Dynamics, total_perturbation
from satform.numeric.elementwise import Array
from satform.orbits.chief import semi_major_axis_of
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER, OBLATENESS

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_LONGEST_ARC = 0.25
"""Angle in rad over which three-point quadrature of an orbit's sine is good to 1e-13."""


@dataclass(frozen=True)
class J2Rates:
    """What oblateness makes of the rates of a circular mean orbit.

    Attributes:
        mean_motion: of the unperturbed circle of the same radius n, rad/s.
        orbit_rate: of the chief's LVLH frame n c, rad/s.
        stiffness: of radial motion (5 c^2 - 2) n^2, 1/s^2.
        latitude_rate: of the argument of latitude k, rad/s.
        plane_rate: by which an orbit plane inclined by one radian more drifts away, rad/s: the rate
            of the node, per difference of inclination, times the sine of the inclination.

    Source: Schweighart & Sedwick 2002, J. Guidance 25(6), their s, c and k; the last from the
        derivative of the secular rate of the node.
    """

    mean_motion: float
    orbit_rate: float
    stiffness: float
    latitude_rate: float
    plane_rate: float

    @classmethod
    def of(cls, mean_motion: float, inclination: float) -> "J2Rates":
        """The rates of a circular mean orbit.

        Args:
            mean_motion: of the unperturbed circle of the same radius, rad/s.
            inclination: rad.
        """
        n = mean_motion
        radius = semi_major_axis_of(n, GRAVITATIONAL_PARAMETER)
        oblateness = OBLATENESS * (EQUATORIAL_RADIUS / radius) ** 2
        c2 = 1.0 + 0.375 * oblateness * (1.0 + 3.0 * math.cos(2.0 * inclination))
        orbit_rate = n * math.sqrt(c2)
        node = 1.5 * n * oblateness
        return cls(
            mean_motion=n,
            orbit_rate=orbit_rate,
            stiffness=(5.0 * c2 - 2.0) * n * n,
            latitude_rate=orbit_rate + node * math.cos(inclination) ** 2,
            plane_rate=node * math.sin(inclination) ** 2,
        )


@dataclass(frozen=True)
class InPlaneStep:
    """The exact in-plane motion over a fixed time with the acceleration held.

    Each map leaves z at zero: cross-track motion is none of its business.

    Attributes:
        from_position: of position (dimensionless) and velocity (1/s).
        from_velocity: of position (s) and velocity (dimensionless).
        from_input: of position (s^2) and velocity (s).
    """

    from_position: tuple[InPlaneCoupling, InPlaneCoupling]
    from_velocity: tuple[InPlaneCoupling, InPlaneCoupling]
    from_input: tuple[InPlaneCoupling, InPlaneCoupling]

    @classmethod
    def over(cls, rates: J2Rates, duration: float) -> "InPlaneStep":
        """The closed solution over `duration` in s, without cancellation where the angle is small."""
        t, rate, stiffness = duration, rates.orbit_rate, rates.stiffness
        kappa2 = 4.0 * rate * rate - stiffness
        angle = math.sqrt(kappa2) * t
        half = np.asarray(0.5 * angle)
        sine = t * float(sinc(np.asarray(angle)))
        versine = 0.5 * t * t * float(sinc(half)) ** 2
        lag = t**3 * float(sine_remainder(np.asarray(angle)))
        # (angle^2/2 - 1 + cos(angle)) / angle^4, the along-track lag of a held along-track acceleration.
        fourth = t**4 * float(sine_remainder(half) * (1.0 + sinc(half))) / 8.0
        w2 = 2.0 * rate
        return cls(
            from_position=(
                _in_plane(1.0 + stiffness * versine, 1.0, 0.0, -w2 * stiffness * lag),
                _in_plane(stiffness * sine, 0.0, 0.0, -w2 * stiffness * versine),
            ),
            from_velocity=(
                _in_plane(sine, t - w2 * w2 * lag, w2 * versine, -w2 * versine),
                _in_plane(1.0 - kappa2 * versine, 1.0 - w2 * w2 * versine, w2 * sine, -w2 * sine),
            ),
            from_input=(
                _in_plane(versine, 0.5 * t * t - w2 * w2 * fourth, w2 * lag, -w2 * lag),
                _in_plane(sine, t - w2 * w2 * lag, w2 * versine, -w2 * versine),
            ),
        )

    def advance(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
        """Position (m) and velocity (m/s) at the end, z left at zero; all arguments of shape (N, 3)."""
        end = [
            self.from_position[row](position)
            + self.from_velocity[row](velocity)
            + self.from_input[row](acceleration)
            for row in range(2)
        ]
        return end[0], end[1]


@dataclass(frozen=True)
class CrossTrack:
    """Cross-track motion by the difference of the orbit planes.

    z = X sin u - Y cos u with u the chief's argument of latitude: X is the radius times the
    difference of inclination, Y the radius times the sine of the inclination times the difference of
    the node, and Y grows at the plane's rate times X. An acceleration along z changes both.

    Attributes:
        rates: of the chief.
        latitude: argument of latitude at time zero, rad.

    Source: Schweighart & Sedwick 2002, section on cross-track motion, to first order in the difference
        of the planes; Gauss's equations for the planes.
    """

    rates: J2Rates
    latitude: float

    def transition(self, begin: float, end: float) -> tuple[float, float, float, float]:
        """Transition matrix of (z in m, its rate in m/s), row by row, between two times in s."""
        k, plane = self.rates.latitude_rate, self.rates.plane_rate
        first, last = self.latitude + k * begin, self.latitude + k * end
        s0, c0, s1, c1 = math.sin(first), math.cos(first), math.sin(last), math.cos(last)
        scale = 1.0 / (k - plane * c0 * c0)
        drift = plane * (end - begin)
        # X and Y at the end, from z and its rate at the beginning.
        x_z, x_v = scale * k * s0, scale * c0
        y_z, y_v = -scale * (k - plane) * c0 + drift * x_z, scale * s0 + drift * x_v
        return (
            x_z * s1 - y_z * c1,
            x_v * s1 - y_v * c1,
            (k - plane) * c1 * x_z + k * s1 * y_z,
            (k - plane) * c1 * x_v + k * s1 * y_v,
        )

    def response(self, begin: float, end: float) -> tuple[float, float]:
        """Position in s^2 and rate in s at the end, per acceleration held between two times in s."""
        parts = max(1, math.ceil(self.rates.latitude_rate * (end - begin) / _LONGEST_ARC))
        length = (end - begin) / parts
        position = velocity = 0.0
        for part in range(parts):
            middle = begin + (part + 0.5) * length
            for node, weight in zip(_NODES.tolist(), _WEIGHTS.tolist(), strict=True):
                _, z, _, rate = self.transition(middle + 0.5 * length * node, end)
                position += 0.5 * length * weight * z
                velocity += 0.5 * length * weight * rate
        return position, velocity


@dataclass(frozen=True)
class LinearJ2State:
    """LVLH motion at one time.

    Attributes:
        position: m, shape (N, 3).
        velocity: m/s, in the frame that turns at the chief's rate, shape (N, 3).
    """

    position: Array
    velocity: Array


@dataclass(frozen=True)
class LinearJ2Dynamics(Dynamics):
    """Schweighart and Sedwick's equations, by their closed solution.

    Exact for any step with the command held. Perturbations are held at the mean of three nodes of
    Gauss-Legendre quadrature, each carried to the end of the step.

    Attributes:
        period: control period, s.
        rates: of the chief.
        cross_track: motion along the orbit normal.
        perturbations: added to the equations.
    """

    period: float
    rates: J2Rates
    cross_track: CrossTrack
    perturbations: tuple[Perturbation, ...] = ()

    @cached_property
    def _step(self) -> InPlaneStep:
        return InPlaneStep.over(self.rates, self.period)

    @cached_property
    def _nodes(self) -> tuple[tuple[float, float, InPlaneStep], ...]:
        """Offset in s, weight in s, and motion from there to the end of the step."""
        offsets = (0.5 * self.period * (1.0 + _NODES)).tolist()
        weights = (0.5 * self.period * _WEIGHTS).tolist()
        return tuple(
            (offset, weight, InPlaneStep.over(self.rates, self.period - offset))
            for offset, weight in zip(offsets, weights, strict=True)
        )

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> LinearJ2State:
        """The state at time zero; arguments as in `Dynamics.start`."""
        return LinearJ2State(position_lvlh, velocity_lvlh)

    def lvlh(self, state: LinearJ2State) -> tuple[Array, Array]:
        """Relative position in m and velocity in m/s, shape (N, 3) each."""
        return state.position, state.velocity

    def advance(self, state: LinearJ2State, acceleration_lvlh: Array, step: int) -> LinearJ2State:
        """The state one control period later; arguments as in `Dynamics.advance`."""
        begin, end = step * self.period, (step + 1) * self.period
        position, velocity = self._step.advance(state.position, state.velocity, acceleration_lvlh)
        zz, zv, vz, vv = self.cross_track.transition(begin, end)
        z_input, v_input = self.cross_track.response(begin, end)
        z, rate, command = state.position[:, 2], state.velocity[:, 2], acceleration_lvlh[:, 2]
        position[:, 2] = zz * z + zv * rate + z_input * command
        velocity[:, 2] = vz * z + vv * rate + v_input * command
        if self.perturbations:
            self._disturb(position, velocity, step)
        return LinearJ2State(position, velocity)

    def _disturb(self, position: Array, velocity: Array, step: int) -> None:
        """Add to the state at the end of a step what the perturbations have done to it."""
        begin, end = step * self.period, (step + 1) * self.period
        for offset, weight, rest in self._nodes:
            kick = weight * total_perturbation(self.perturbations, step, offset)
            _, zv, _, vv = self.cross_track.transition(begin + offset, end)
            position += rest.from_velocity[0](kick)
            velocity += rest.from_velocity[1](kick)
            position[:, 2] += zv * kick[:, 2]
            velocity[:, 2] += vv * kick[:, 2]


def _in_plane(x_from_x: float, y_from_y: float, x_from_y: float, y_from_x: float) -> InPlaneCoupling:
    """A map of x and y that makes nothing of z; arguments of one unit."""
    return InPlaneCoupling(own=np.array([x_from_x, y_from_y, 0.0]), swapped=np.array([x_from_y, y_from_x]))
