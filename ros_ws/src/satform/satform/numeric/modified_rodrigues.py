# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Attitude as modified Rodrigues parameters (MRP).

They are the axis of the rotation from inertial to body axes times the tangent of a quarter of its angle,
switched to the shadow set beyond half a turn.

Equations: docs/controllers/attitude.md.
"""

import numpy as np

from satform.numeric.elementwise import Array, arctan2, blank, cross, dot, joined

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
    skew = cross_matrix(mrp)
    skew_squared = mrp[..., :, None] * mrp[..., None, :] - squared * _IDENTITY
    larger = 1.0 + squared
    matrix: Array = _IDENTITY + (8.0 * skew_squared - 4.0 * (1.0 - squared) * skew) / (larger * larger)
    return matrix


def cross_matrix(vector: Array) -> Array:
    """Matrix of the vector product with a vector from the left: shape (..., 3) to (..., 3, 3)."""
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    matrix = blank((*x.shape, 3, 3), x)
    matrix[...] = 0.0
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


def composed_mrp(second: Array, first: Array) -> Array:
    """Attitude after two rotations, of length at most one.

    Args:
        second: rotation from the axes after the first one, shape (..., 3).
        first: rotation from the first axes, shape (..., 3).

    Returns:
        Shape (..., 3).

    Source: Schaub & Junkins, ch. 3.
    """
    return relative_mrp(second, -first)


def mrp_of_rotation(rotation: Array) -> Array:
    """Modified Rodrigues parameters, of length at most one, of a rotation vector.

    Args:
        rotation: axis times angle, rad, of any length, shape (..., 3).

    Returns:
        Shape (..., 3).

    Source: Schaub & Junkins, ch. 3.
    """
    half = 0.5 * np.sqrt(dot(rotation, rotation))
    return _mrp_from_quaternion(np.cos(half), (0.5 * sine_quotient(half))[..., None] * rotation)


def rotation_of_mrp(mrp: Array) -> Array:
    """Rotation vector of modified Rodrigues parameters: axis times angle of at most half a turn.

    Args:
        mrp: of length at most one, shape (..., 3).

    Returns:
        rad, shape (..., 3).

    Source: Schaub & Junkins, ch. 3.
    """
    length = np.sqrt(dot(mrp, mrp))
    nothing = length < 1e-150
    angle = 4.0 * arctan2(length, np.ones_like(length))
    factor = np.where(nothing, 4.0, angle / np.where(nothing, 1.0, length))
    return factor[..., None] * mrp


def sine_quotient(angle: Array) -> Array:
    """Sine of an angle over the angle, 1 at zero; rad, any shape.

    Below 1e-3 it is the series up to the fourth power, whose next term is below 1e-21.
    """
    small = np.abs(angle) < 1e-3
    squared = angle * angle
    series = 1.0 - squared / 6.0 * (1.0 - squared / 20.0)
    quotient: Array = np.where(small, series, np.sin(angle) / np.where(small, 1.0, angle))
    return quotient


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
