# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Error of an angular velocity that is held while a gyro gives none, beside those of attitude and bias.

The angular acceleration beyond that of the rigid body is white noise, so that the error of the held rate
walks and the attitude integrates it. Over a step with a reading of the gyro the rate is the reading less the
bias.

Equations: docs/attitude_estimation.md. Source: Bar-Shalom, Li & Kirubarajan 2001, Estimation with
Applications to Tracking and Navigation, ch. 6.2.2 (white noise acceleration), about each body axis.
"""

import numpy as np

from satform.attitude.yaw_steering import Mask
from satform.numeric.elementwise import Array

_UNIT = np.eye(3)


def held_transition(transition: Array, measured: Mask) -> Array:
    """How the errors of attitude, bias and held rate go through a step.

    Args:
        transition: of the errors of attitude and bias at a constant rate, shape (..., 6, 6).
        measured: whether there is a reading of the gyro over the step, shape (...).

    Returns:
        Shape (..., 9, 9).
    """
    by_gyro = measured[..., None, None]
    turned = transition[..., :3, 3:]
    whole = np.zeros((*measured.shape, 9, 9))
    whole[..., :6, :6] = transition
    whole[..., :3, 3:6] = np.where(by_gyro, turned, 0.0)
    whole[..., :3, 6:] = np.where(by_gyro, 0.0, -turned)
    whole[..., 6:, 3:6] = np.where(by_gyro, -_UNIT, 0.0)
    whole[..., 6:, 6:] = np.where(by_gyro, 0.0, _UNIT)
    return whole


def held_process(
    process: Array, measured: Mask, times: tuple[float, float], densities: tuple[Array, Array, Array]
) -> Array:
    """Covariance that a step adds to the errors of attitude, bias and held rate.

    Args:
        process: of the errors of attitude and bias by a gyro, shape (..., 6, 6).
        measured: whether there is a reading of the gyro over the step, shape (...).
        times: control period, and period of the gyro, s.
        densities: of the gyro's white noise (rad^2/s), of the rate of its bias and of the angular
            acceleration (rad^2/s^3), shape (...) each.

    Returns:
        Shape (..., 9, 9).
    """
    (step, period), (angle, bias, acceleration) = times, densities
    added = np.zeros((*measured.shape, 9, 9))
    added[..., :6, :6] = process
    # The reading less the bias is off by its noise, by half the bias's walk, and by what the rate has
    # changed from its mean over the gyro's period to the end.
    noise = angle / step + bias * (step / 3.0)
    for axis in range(3):
        turn, drift, rate = axis, axis + 3, axis + 6
        added[..., turn, turn] = np.where(
            measured, process[..., turn, turn], acceleration * (step * step * step / 3.0)
        )
        added[..., turn, drift] = np.where(measured, process[..., turn, drift], 0.0)
        added[..., drift, turn] = added[..., turn, drift]
        added[..., turn, rate] = np.where(measured, step * noise, acceleration * (0.5 * step * step))
        added[..., rate, turn] = added[..., turn, rate]
        added[..., drift, rate] = np.where(measured, -0.5 * step * bias, 0.0)
        added[..., rate, drift] = added[..., drift, rate]
        added[..., rate, rate] = np.where(
            measured, noise + acceleration * (period / 3.0), acceleration * step
        )
    return added
