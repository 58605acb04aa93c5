# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Motion far from any orbit under a force that depends on the velocity, for laws that have to learn it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.common.spec import NonNegative, Number, Positive
from satform.dynamics.cw_model import CwState
from satform.dynamics.prescribed_disturbances import Perturbation
from satform.dynamics.protocol import Dynamics, DynamicsSetting, total_perturbation
from satform.dynamics.specs import PerturbedDynamicsSpec
from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class VelocityDependentDynamics(Dynamics):
    """The same function of the velocity on each axis, integrated by the classical Runge-Kutta method.

    Attributes:
        linear: acceleration per velocity, 1/s; this and the next three of satellites of many runs (N, 1).
        wave: amplitude of the acceleration that goes as the sine of the velocity, m/s^2.
        wave_number: angle of that sine per velocity, rad s/m.
        quadratic: acceleration per velocity times speed, 1/m.
        perturbations: added to it, functions of time.
        duration: of a control period, s.
        parts: of equal length into which it is divided.
    """

    linear: float | Array
    wave: float | Array
    wave_number: float | Array
    quadratic: float | Array
    perturbations: tuple[Perturbation, ...]
    duration: float
    parts: int

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> CwState:
        """The state at time zero; arguments as in `Dynamics.start`."""
        return CwState(position_lvlh, velocity_lvlh)

    def lvlh(self, state: CwState) -> tuple[Array, Array]:
        """Position in m and velocity in m/s, shape (N, 3) each."""
        return state.position, state.velocity

    def acceleration(self, velocity: Array) -> Array:
        """The force per mass at a velocity in m/s: m/s^2, of the same shape."""
        bent = self.wave * np.sin(self.wave_number * velocity) + self.quadratic * velocity * np.abs(velocity)
        total: Array = self.linear * velocity + bent
        return total

    def advance(self, state: CwState, acceleration_lvlh: Array, step: int) -> CwState:
        """The state one control period later; arguments as in `Dynamics.advance`."""
        position, velocity = state.position, state.velocity
        part = self.duration / self.parts
        half = 0.5 * part
        for number in range(self.parts):
            begin, middle, end = (
                acceleration_lvlh + self._disturbance(step, (number + share) * part)
                for share in (0.0, 0.5, 1.0)
            )
            first = begin + self.acceleration(velocity)
            second_velocity = velocity + half * first
            second = middle + self.acceleration(second_velocity)
            third_velocity = velocity + half * second
            third = middle + self.acceleration(third_velocity)
            fourth_velocity = velocity + part * third
            fourth = end + self.acceleration(fourth_velocity)
            position = position + part / 6.0 * (
                velocity + 2.0 * (second_velocity + third_velocity) + fourth_velocity
            )
            velocity = velocity + part / 6.0 * (first + 2.0 * (second + third) + fourth)
        return CwState(position, velocity)

    def _disturbance(self, step: int, offset: float) -> Array | float:
        return total_perturbation(self.perturbations, step, offset) if self.perturbations else 0.0


class VelocityDependentDynamicsSpec(PerturbedDynamicsSpec):
    """A force that is the same function of the velocity on each axis; there is no gravity.

    The acceleration is linear v + wave sin(wave_number v) + quadratic v |v|.
    """

    kind: Literal["velocity_dependent"] = "velocity_dependent"
    linear: Number = -0.2
    """Acceleration per velocity, negative for drag [1/s]."""
    wave: Number = 0.4
    """Amplitude of the acceleration that goes as the sine of the velocity [m/s^2]."""
    wave_number: NonNegative = 1.5
    """Angle of that sine per velocity [rad s/m]."""
    quadratic: Number = 0.05
    """Acceleration per velocity times speed [1/m]."""
    maximum_step: Positive = 0.05
    """Longest sub-step of the integration [s]."""

    def build(self, setting: DynamicsSetting) -> VelocityDependentDynamics:
        """The truth model itself."""
        return VelocityDependentDynamics(
            linear=self.linear,
            wave=self.wave,
            wave_number=self.wave_number,
            quadratic=self.quadratic,
            perturbations=self.build_perturbations(setting),
            duration=setting.step,
            parts=max(1, int(np.ceil(setting.step / self.maximum_step * (1.0 - 1e-12)))),
        )
