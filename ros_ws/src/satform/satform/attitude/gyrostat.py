# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Attitude of a gyrostat: a rigid body with one reaction wheel on each body axis.

Attitude is described by modified Rodrigues parameters (MRP): the axis of the rotation from inertial to
body axes times the tangent of a quarter of its angle, switched to the shadow set beyond half a turn.

Equations: docs/controllers/attitude.md.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from satform.dynamics.linear import multiply
from satform.numeric.elementwise import Array, cross, dot, joined

_IDENTITY = np.eye(3)


def direction_cosines(mrp: Array) -> Array:
    """Matrix that maps inertial to body components.

    Args:
        mrp: modified Rodrigues parameters, shape (..., 3).

    Returns:
        Shape (..., 3, 3).

    Source: Schaub & Junkins, ch. 3.
    """
    squared = dot(mrp, mrp)[..., None, None]
    skew = _cross_matrix(mrp)
    skew_squared = mrp[..., :, None] * mrp[..., None, :] - squared * _IDENTITY
    larger = 1.0 + squared
    matrix: Array = _IDENTITY + (8.0 * skew_squared - 4.0 * (1.0 - squared) * skew) / (larger * larger)
    return matrix


def _cross_matrix(vector: Array) -> Array:
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    matrix = np.zeros((*x.shape, 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -z, y
    matrix[..., 1, 0], matrix[..., 1, 2] = z, -x
    matrix[..., 2, 0], matrix[..., 2, 1] = -y, x
    return matrix


def mrp_from_direction_cosines(matrix: Array) -> Array:
    """Modified Rodrigues parameters of length at most one, from a direction cosine matrix.

    Args:
        matrix: maps inertial to body components, shape (..., 3, 3).

    Returns:
        Shape (..., 3).

    Source: Shepperd 1978 for the quaternion; Schaub & Junkins, ch. 3.
    """
    xx, yy, zz = matrix[..., 0, 0], matrix[..., 1, 1], matrix[..., 2, 2]
    yz, zy = matrix[..., 1, 2], matrix[..., 2, 1]
    zx, xz = matrix[..., 2, 0], matrix[..., 0, 2]
    xy, yx = matrix[..., 0, 1], matrix[..., 1, 0]
    from_scalar = joined(1.0 + xx + yy + zz, yz - zy, zx - xz, xy - yx)
    from_x = joined(yz - zy, 1.0 + xx - yy - zz, xy + yx, zx + xz)
    from_y = joined(zx - xz, xy + yx, 1.0 - xx + yy - zz, yz + zy)
    from_z = joined(xy - yx, zx + xz, yz + zy, 1.0 - xx - yy + zz)
    candidates = np.stack((from_scalar, from_x, from_y, from_z), axis=-2)
    squares = joined(1.0 + xx + yy + zz, from_x[..., 1], from_y[..., 2], from_z[..., 3])
    best = np.argmax(squares, axis=-1)[..., None, None]
    chosen = np.take_along_axis(candidates, best, axis=-2)[..., 0, :]
    length = np.sqrt(chosen[..., 0] * chosen[..., 0] + dot(chosen[..., 1:], chosen[..., 1:]))
    return _mrp_from_quaternion(chosen[..., 0] / length, chosen[..., 1:] / length[..., None])


def quaternion(mrp: Array) -> tuple[Array, Array]:
    """Quaternion of an attitude.

    Args:
        mrp: modified Rodrigues parameters, shape (..., 3).

    Returns:
        Scalar part, shape (...), and vector part, shape (..., 3), of unit length together; in the sense
        of the parameters, whose rotation takes the axes of the first frame to those of the second.

    Source: Schaub & Junkins, ch. 3.
    """
    squared = dot(mrp, mrp)
    return (1.0 - squared) / (1.0 + squared), 2.0 * mrp / (1.0 + squared)[..., None]


def _mrp_from_quaternion(scalar: Array, vector: Array) -> Array:
    sign = np.where(scalar < 0.0, -1.0, 1.0)
    mrp: Array = vector * (sign / (1.0 + np.abs(scalar)))[..., None]
    return mrp


def relative_mrp(mrp: Array, reference_mrp: Array) -> Array:
    """Attitude relative to another attitude, of length at most one.

    Args:
        mrp: attitude, shape (..., 3).
        reference_mrp: attitude from which the other is seen, shape (..., 3).

    Returns:
        Parameters of the rotation from the reference's to the body's axes, shape (..., 3).

    Source: Schaub & Junkins, ch. 3, by way of the quaternion, which has no singular pair.
    """
    scalar, vector = quaternion(mrp)
    reference_scalar, reference_vector = quaternion(reference_mrp)
    relative_scalar = scalar * reference_scalar + dot(vector, reference_vector)
    relative_vector = (
        reference_scalar[..., None] * vector
        - scalar[..., None] * reference_vector
        + cross(vector, reference_vector)
    )
    return _mrp_from_quaternion(relative_scalar, relative_vector)


def short_way(mrp: Array) -> Array:
    """The same attitude by parameters of length at most one: the shadow set beyond a half turn.

    Args:
        mrp: shape (..., 3).

    Returns:
        Shape (..., 3).

    Source: Schaub & Junkins, ch. 3.
    """
    squared = dot(mrp, mrp)[..., None]
    beyond = squared > 1.0
    return np.where(beyond, -mrp / np.where(beyond, squared, 1.0), mrp)


def mrp_rate(mrp: Array, angular_velocity: Array) -> Array:
    """Time derivative of modified Rodrigues parameters.

    Args:
        mrp: shape (..., 3).
        angular_velocity: of the body, body components, rad/s, shape (..., 3).

    Returns:
        1/s, shape (..., 3).

    Source: Schaub & Junkins, ch. 3.
    """
    squared = dot(mrp, mrp)[..., None]
    along = dot(mrp, angular_velocity)[..., None]
    rate: Array = (
        0.25 * (1.0 - squared) * angular_velocity + 0.5 * cross(mrp, angular_velocity) + 0.5 * along * mrp
    )
    return rate


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
