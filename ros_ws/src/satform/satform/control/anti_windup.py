# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Saturation of the thrusters, as laws with integral action need it for anti-windup.

Equations: docs/controllers/lqr.md.
"""

from dataclasses import dataclass

import numpy as np

from satform.control.protocol import ControlStep, FlightSetting, Motion
from satform.numeric.elementwise import Array, norm


@dataclass(frozen=True)
class Saturation:
    """Detects saturation of the thrusters from the commanded and the applied acceleration.

    Attributes:
        resolution: acceleration of the thrusters' smallest impulse or quantum, m/s^2, shape (...).
        error: share of a command by which what is applied may differ from it at random, shape (...).
    """

    resolution: Array
    error: Array

    @classmethod
    def of(cls, setting: FlightSetting) -> "Saturation":
        """For the thrusters of a setting."""
        return cls(np.asarray(setting.thrust_resolution), np.asarray(setting.thrust_error))

    def shortfall(self, motion: Motion, step: ControlStep) -> Array:
        """Part of the last command that saturated thrusters did not apply.

        Differences within the thrusters' resolution and random errors do not count.

        Args:
            motion: of the satellites, for the shape.
            step: with the commanded and the applied acceleration of the step before.

        Returns:
            Commanded minus applied acceleration, m/s^2, shape (..., 3); zero where the command was applied,
            or where that is not known.
        """
        commanded = step.commanded_acceleration
        if commanded is None or step.applied_acceleration is None:
            return np.zeros_like(motion.velocity)
        lacking = commanded - step.applied_acceleration
        tolerated = self.resolution + self.error * norm(commanded)
        return np.where(np.abs(lacking) > tolerated[..., None], lacking, 0.0)
