# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Attitude tracking law with reaction wheels (`kind: mrp_tracking`), stable from any attitude.

The attitude error is in modified Rodrigues parameters (MRP). The figures of attitude that a flight is
evaluated by are in `satform.evaluation.attitude`.

Equations: docs/controllers/attitude.md.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.attitude.ground_pointing import AttitudeReference
from satform.attitude.gyrostat import AttitudeState, Gyrostat, gyrostat
from satform.common.spec import Positive, PositivePerAxis, Spec, Vector
from satform.dynamics.linear import multiply
from satform.numeric.elementwise import Array, cross, dot
from satform.numeric.modified_rodrigues import direction_cosines, relative_mrp


@dataclass(frozen=True)
class AttitudeError:
    """Attitude and rate relative to the reference.

    Attributes:
        mrp: reference to body axes, of length at most one, shape (..., 3).
        angular_velocity: body components, rad/s, shape (..., 3).
        reference_rate: the reference's rate in body components, rad/s, shape (..., 3).
        reference_acceleration: the reference's angular acceleration in body components, rad/s^2,
            shape (..., 3).
    """

    mrp: Array
    angular_velocity: Array
    reference_rate: Array
    reference_acceleration: Array


def attitude_error(mrp: Array, angular_velocity: Array, reference: AttitudeReference) -> AttitudeError:
    """Error of an attitude and its rate.

    Args:
        mrp: inertial to body, shape (..., 3).
        angular_velocity: body components, rad/s, shape (..., 3).
        reference: desired attitude and its motion.

    Returns:
        The error, with the reference's motion in body components.

    Source: Schaub & Junkins, ch. 8.
    """
    error = relative_mrp(mrp, reference.mrp)
    matrix = direction_cosines(error)
    rate = multiply(matrix, reference.angular_velocity)
    acceleration = multiply(matrix, reference.angular_acceleration)
    return AttitudeError(error, angular_velocity - rate, rate, acceleration)


@dataclass(frozen=True)
class AttitudeTracking:
    """Wheel torques that track a moving attitude.

    Attributes:
        body: the gyrostat that is flown.
        attitude_gain: N m, shape (...).
        rate_gain: N m s, shape (...).
    """

    body: Gyrostat
    attitude_gain: Array
    rate_gain: Array

    def wheel_torque(
        self, state: AttitudeState, reference: AttitudeReference, external: Array, ahead: float = 0.0
    ) -> Array:
        """Torque of the motors on the wheels.

        Args:
            state: measured attitude and momenta.
            reference: desired attitude and its motion; its angular acceleration is that `ahead` s later.
            external: known external torque, body components, N m, shape (..., 3).
            ahead: time from the measurement to the middle of the hold, s; the torque that follows the
                reference is taken there. 0 for a torque that is not held.

        Returns:
            N m, shape (..., 3); the body feels its opposite.

        Source: Long & Hall; Schaub & Junkins, ch. 8, for the Lyapunov function that it decreases.
        """
        angular_velocity = self.body.angular_velocity(state)
        error = attitude_error(state.mrp, angular_velocity, reference)
        momentum, body_rate, reference_rate = state.momentum, angular_velocity, error.reference_rate
        if ahead:
            faster = ahead * error.reference_acceleration
            momentum = momentum + ahead * (cross(momentum, body_rate) + external)
            body_rate, reference_rate = body_rate + faster, reference_rate + faster
        turning = cross(body_rate, reference_rate) - error.reference_acceleration
        torque: Array = (
            cross(momentum, body_rate)
            + external
            + multiply(self.body.platform_inertia, turning)
            + self.rate_gain[..., None] * error.angular_velocity
            + self.attitude_gain[..., None] * error.mrp
        )
        return torque

    def lyapunov(self, state: AttitudeState, reference: AttitudeReference) -> Array:
        """Function of the error that never increases while the law flies undisturbed.

        Args:
            state: attitude and momenta.
            reference: desired attitude and its motion.

        Returns:
            J, shape (...).

        Source: Schaub & Junkins, ch. 8: logarithmic attitude potential.
        """
        error = attitude_error(state.mrp, self.body.angular_velocity(state), reference)
        rate = error.angular_velocity
        value: Array = 0.5 * dot(rate, multiply(self.body.platform_inertia, rate))
        return value + 2.0 * self.attitude_gain * np.log1p(dot(error.mrp, error.mrp))


class AttitudeTrackingSpec(Spec):
    """Attitude tracking with three reaction wheels along the body axes."""

    kind: Literal["mrp_tracking"] = "mrp_tracking"
    attitude_gain: Positive = 14.0
    """Torque per unit of the attitude error's modified Rodrigues parameters, N m."""
    rate_gain: Positive = 40.0
    """Torque per unit of the rate error, N m s."""
    inertia: PositivePerAxis = (86.0, 85.0, 113.0)
    """Principal moments of inertia of the whole satellite about the body axes, kg m^2."""
    products_of_inertia: Vector = (0.0, 0.0, 0.0)
    """Off-diagonal elements xy, yz, zx of the inertia matrix, kg m^2."""
    wheel_inertia: PositivePerAxis = (0.5, 0.5, 0.5)
    """Moment of inertia of each wheel about its spin axis, kg m^2."""

    def build(self) -> AttitudeTracking:
        """The law and the body that it flies.

        Raises:
            ValueError: these inertias belong to no body.
        """
        xy, yz, zx = self.products_of_inertia
        products = np.array([[0.0, xy, zx], [xy, 0.0, yz], [zx, yz, 0.0]])
        body = gyrostat(np.diag(self.inertia) + products, np.array(self.wheel_inertia))
        return AttitudeTracking(body, np.asarray(self.attitude_gain), np.asarray(self.rate_gain))


def attitude_transition(law: AttitudeTracking, step: float) -> Array:
    """How the attitude error goes from step to step under a held wheel torque, close to the reference.

    Args:
        law: of one satellite, with its body.
        step: control period, s.

    Returns:
        Transition of (modified Rodrigues parameters, angular velocity in rad/s) of the error, (6, 6).

    Source: Schaub & Junkins, ch. 8: the closed loop's linear part, d(mrp)/dt = rate / 4 and
        J d(rate)/dt = -attitude_gain mrp - rate_gain rate; Franklin, Powell & Workman, Digital Control of
        Dynamic Systems, ch. 4, for the command that is held.
    """
    inverse, unit = law.body.inverse_platform_inertia, np.eye(3)
    stiffness, damping = float(law.attitude_gain) * inverse, float(law.rate_gain) * inverse
    eighth = 0.125 * step * step
    return np.block(
        [
            [unit - eighth * stiffness, 0.25 * step * unit - eighth * damping],
            [-step * stiffness, unit - step * damping],
        ]
    )
