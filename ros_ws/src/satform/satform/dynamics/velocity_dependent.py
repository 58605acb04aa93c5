# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Motion under a force that depends on the velocity, for laws that have to learn it; gravity may be added."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.common.spec import Complaint, NonNegative, Number, Positive
from satform.dynamics.circular_gravity import CircularGravity, GravityKind, circular_gravity
from satform.dynamics.cw_model import CwState, LvlhStateDynamics
from satform.dynamics.held_runge_kutta import advance_held
from satform.dynamics.integrators import substeps
from satform.dynamics.prescribed_disturbances import Perturbation
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.specs import PerturbedDynamicsSpec, substep_complaints
from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class VelocityDependentDynamics(LvlhStateDynamics):
    """The same function of the velocity on each axis, integrated by the classical Runge-Kutta method.

    Attributes:
        linear: acceleration per velocity, 1/s; this and the next three of satellites of many runs (N, 1).
        wave: amplitude of the acceleration that goes as the sine of the velocity, m/s^2.
        wave_number: angle of that sine per velocity, rad s/m.
        quadratic: acceleration per velocity times speed, 1/m.
        perturbations: added to it, functions of time.
        duration: of a control period, s.
        parts: of equal length into which it is divided.
        gravity: added to it; None for none.
    """

    linear: float | Array
    wave: float | Array
    wave_number: float | Array
    quadratic: float | Array
    perturbations: tuple[Perturbation, ...]
    duration: float
    parts: int
    gravity: CircularGravity | None = None

    def acceleration(self, velocity: Array) -> Array:
        """The force per mass at a velocity in m/s: m/s^2, of the same shape."""
        bent = self.wave * np.sin(self.wave_number * velocity) + self.quadratic * velocity * np.abs(velocity)
        total: Array = self.linear * velocity + bent
        return total

    def advance(self, state: CwState, acceleration_lvlh: Array, step: int) -> CwState:
        """The state one control period later; arguments as in `Dynamics.advance`."""

        def force(_offset: float, position: Array, velocity: Array) -> Array:
            own = self.acceleration(velocity)
            return own if self.gravity is None else own + self.gravity.at(position, velocity)

        grid = (step, self.duration, self.parts)
        return advance_held(state, acceleration_lvlh, force, self.perturbations, grid)


class VelocityDependentDynamicsSpec(PerturbedDynamicsSpec):
    """A force that is the same function of the velocity on each axis; gravity is added if asked for.

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
    gravity: GravityKind = "none"
    """Gravity that is added, with the rotation of LVLH: none; cw, linear in the distance; or point_mass,
    exact about a chief on a circular orbit."""
    maximum_step: Positive = 0.05
    """Longest sub-step of the integration [s]."""

    def complaints(self, setting: DynamicsSetting) -> list[Complaint]:
        """Why the sub-steps cannot be flown; as in `DynamicsSpec.complaints`."""
        return substep_complaints(("maximum_step",), setting.step, self.maximum_step)

    def build(self, setting: DynamicsSetting) -> VelocityDependentDynamics:
        """The truth model itself."""
        return VelocityDependentDynamics(
            linear=self.linear,
            wave=self.wave,
            wave_number=self.wave_number,
            quadratic=self.quadratic,
            perturbations=self.build_perturbations(setting),
            duration=setting.step,
            parts=substeps(setting.step, self.maximum_step),
            gravity=circular_gravity(self.gravity, setting.mean_motion),
        )
