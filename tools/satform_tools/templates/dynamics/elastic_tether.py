# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Motion about the chief with an elastic tether to it."""

from dataclasses import dataclass
from typing import Literal

from satform.common.spec import NonNegative
from satform.dynamics.circular_gravity import CircularGravity, circular_gravity
from satform.dynamics.cw_model import CwState, LvlhStateDynamics
from satform.dynamics.held_runge_kutta import advance_held
from satform.dynamics.prescribed_disturbances import Perturbation
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.specs import PerturbedDynamicsSpec
from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class ElasticTetherDynamics(LvlhStateDynamics):
    """The model: one Runge-Kutta step in each control period; stiffness in 1/s^2, duration in s."""

    stiffness: float
    gravity: CircularGravity | None
    perturbations: tuple[Perturbation, ...]
    duration: float

    def advance(self, state: CwState, acceleration_lvlh: Array, step: int) -> CwState:
        def force(_offset: float, position: Array, velocity: Array) -> Array:
            tether = -self.stiffness * position
            return tether if self.gravity is None else tether + self.gravity.at(position, velocity)

        grid = (step, self.duration, 1)
        return advance_held(state, acceleration_lvlh, force, self.perturbations, grid)


class ElasticTetherSpec(PerturbedDynamicsSpec):
    kind: Literal["elastic_tether"] = "elastic_tether"
    stiffness: NonNegative
    """Acceleration towards the chief per distance from it, 1/s^2."""

    def build(self, setting: DynamicsSetting) -> ElasticTetherDynamics:
        gravity = circular_gravity("cw", setting.mean_motion)
        return ElasticTetherDynamics(self.stiffness, gravity, self.build_perturbations(setting), setting.step)
