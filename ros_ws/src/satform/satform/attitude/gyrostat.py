# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Attitude of a gyrostat: a rigid body with one reaction wheel on each body axis.

Equations: docs/controllers/attitude.md.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from satform.dynamics.linear import multiply
from satform.numeric.elementwise import Array, cross
from satform.numeric.modified_rodrigues import mrp_rate, short_way


def gravity_gradient_torque(
    inertia: Array, nadir_body: Array, radius: Array, gravitational_parameter: float
) -> Array:
    """Torque of a central body's gravity on a satellite.

    Args:
        inertia: of the whole satellite, body axes, kg m^2, shape (..., 3, 3).
        nadir_body: unit vector to the central body, body components, shape (..., 3).
        radius: distance to the central body's centre, m, shape (...).
        gravitational_parameter: of the central body, m^3/s^2.

    Returns:
        Body components, N m, shape (..., 3).

    Source: Hughes, Spacecraft Attitude Dynamics, ch. 8.
    """
    strength = np.asarray(3.0 * gravitational_parameter / radius**3)
    torque: Array = strength[..., None] * cross(nadir_body, multiply(inertia, nadir_body))
    return torque


@dataclass(frozen=True)
class Gyrostat:
    """A rigid body with three reaction wheels along its axes.

    Attributes:
        inertia: of the whole satellite, wheels included, kg m^2, shape (..., 3, 3).
        wheel_inertia: of each wheel about its spin axis, kg m^2, shape (..., 3).
        platform_inertia: `inertia` without the wheels' spin, kg m^2, shape (..., 3, 3).
        inverse_platform_inertia: 1/(kg m^2), shape (..., 3, 3).
    """

    inertia: Array
    wheel_inertia: Array
    platform_inertia: Array
    inverse_platform_inertia: Array

    def angular_velocity(self, state: "AttitudeState") -> Array:
        """Body rate from the momenta, body components, rad/s, shape (..., 3).

        Source: Hughes, Spacecraft Attitude Dynamics, ch. 6.
        """
        return multiply(self.inverse_platform_inertia, state.momentum - state.wheel_momentum)

    def wheel_speed(self, state: "AttitudeState") -> Array:
        """Speed of each wheel relative to the body, rad/s, shape (..., 3)."""
        speed: Array = state.wheel_momentum / self.wheel_inertia - self.angular_velocity(state)
        return speed

    def at_rate(self, mrp: Array, angular_velocity: Array, wheel_speed: Array) -> "AttitudeState":
        """State of a satellite whose body and wheels turn at given rates.

        Args:
            mrp: attitude, shape (..., 3).
            angular_velocity: of the body, body components, rad/s, shape (..., 3).
            wheel_speed: relative to the body, rad/s, shape (..., 3).

        Returns:
            Attitude and momenta.
        """
        spin = self.wheel_inertia * wheel_speed
        momentum = multiply(self.inertia, angular_velocity) + spin
        return AttitudeState(mrp, momentum, self.wheel_inertia * angular_velocity + spin)


def gyrostat(inertia: Array, wheel_inertia: Array) -> Gyrostat:
    """A gyrostat from its inertias.

    Args:
        inertia: of the whole satellite, wheels included, body axes, kg m^2, shape (3, 3).
        wheel_inertia: of each wheel about its spin axis, kg m^2, shape (3,).

    Returns:
        The gyrostat.

    Raises:
        ValueError: the inertia is not symmetric, or not positive definite without the wheels' spin.
    """
    inertia = np.asarray(inertia, dtype=np.float64)
    wheel_inertia = np.asarray(wheel_inertia, dtype=np.float64)
    if not np.array_equal(inertia, inertia.T):
        raise ValueError(f"an inertia matrix is symmetric, got {inertia.tolist()}")
    platform = inertia - np.diag(wheel_inertia)
    smallest = float(np.min(np.linalg.eigvalsh(platform)))
    if not smallest > 0.0 or not np.all(wheel_inertia > 0.0):
        raise ValueError(
            "inertias have to be positive, and the body's without the wheels' spin as well: its smallest "
            f"principal value is {smallest:g} kg m^2 and the wheels have {wheel_inertia.tolist()} kg m^2"
        )
    return Gyrostat(inertia, wheel_inertia, platform, np.asarray(np.linalg.inv(platform), dtype=np.float64))


@dataclass(frozen=True)
class AttitudeState:
    """Attitude and momenta of a gyrostat.

    Attributes:
        mrp: inertial to body, shape (..., 3).
        momentum: total angular momentum, body components, N m s, shape (..., 3).
        wheel_momentum: absolute momentum of each wheel about its spin axis, N m s, shape (..., 3).
    """

    mrp: Array
    momentum: Array
    wheel_momentum: Array


@dataclass(frozen=True)
class Torques:
    """What acts on a gyrostat.

    Attributes:
        wheel: of the motors on the wheels, N m, shape (..., 3).
        external: body components, N m, shape (..., 3).
    """

    wheel: Array
    external: Array


TorqueLaw = Callable[[float, AttitudeState], Torques]


def advance(body: Gyrostat, state: AttitudeState, duration: float, torques: TorqueLaw) -> AttitudeState:
    """State after one fixed step of the classical fourth-order Runge-Kutta method.

    Args:
        body: the gyrostat.
        state: at the start of the step.
        duration: of the step, s.
        torques: called with the offset within the step (s) and the state there.

    Returns:
        State at the end of the step, its attitude by the shadow set beyond a half turn.

    Source: Hughes, Spacecraft Attitude Dynamics, ch. 6, for the equations of motion.
    """

    def rate(offset: float, now: AttitudeState) -> AttitudeState:
        acting = torques(offset, now)
        angular_velocity = body.angular_velocity(now)
        return AttitudeState(
            mrp_rate(now.mrp, angular_velocity),
            cross(now.momentum, angular_velocity) + acting.external,
            acting.wheel,
        )

    half = 0.5 * duration
    first = rate(0.0, state)
    second = rate(half, _moved(state, first, half))
    third = rate(half, _moved(state, second, half))
    fourth = rate(duration, _moved(state, third, duration))
    end = AttitudeState(
        *(
            start + duration / 6.0 * (a + 2.0 * (b + c) + d)
            for start, a, b, c, d in zip(
                _parts(state), _parts(first), _parts(second), _parts(third), _parts(fourth), strict=True
            )
        )
    )
    return AttitudeState(short_way(end.mrp), end.momentum, end.wheel_momentum)


def _parts(state: AttitudeState) -> tuple[Array, Array, Array]:
    return state.mrp, state.momentum, state.wheel_momentum


def _moved(state: AttitudeState, rate: AttitudeState, duration: float) -> AttitudeState:
    return AttitudeState(
        state.mrp + duration * rate.mrp,
        state.momentum + duration * rate.momentum,
        state.wheel_momentum + duration * rate.wheel_momentum,
    )
