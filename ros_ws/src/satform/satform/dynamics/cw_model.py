# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Truth by the Clohessy-Wiltshire equations, exact for any step, with perturbations added."""

from dataclasses import dataclass
from functools import cached_property

from satform.dynamics.cw import DisturbedStep
from satform.dynamics.prescribed_disturbances import Perturbation
from satform.dynamics.protocol import Dynamics, total_perturbation
from satform.numeric.elementwise import Array, blank


@dataclass(frozen=True)
class CwState:
    """LVLH motion at one time.

    Attributes:
        position: m, shape (N, 3).
        velocity: m/s, in the rotating frame, shape (N, 3).
    """

    position: Array
    velocity: Array


class LvlhStateDynamics(Dynamics):
    """Base of models whose state is position and velocity in LVLH as they are."""

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> CwState:
        """The state at time zero; arguments as in `Dynamics.start`."""
        return CwState(position_lvlh, velocity_lvlh)

    def lvlh(self, state: CwState) -> tuple[Array, Array]:
        """Relative position in m and velocity in m/s, shape (N, 3) each."""
        return state.position, state.velocity


@dataclass(frozen=True)
class CwDynamics(LvlhStateDynamics):
    """The CW equations, exact for any step with the command held.

    Perturbations enter by three-point Gauss-Legendre quadrature over the step.

    Attributes:
        step: the exact step.
        perturbations: added to the CW equations.
    """

    step: DisturbedStep
    perturbations: tuple[Perturbation, ...] = ()

    @cached_property
    def _offsets(self) -> tuple[float, ...]:
        """Times since the start of a step at which the perturbations are wanted, s."""
        return tuple(self.step.nodes.tolist())

    def advance(self, state: CwState, acceleration_lvlh: Array, step: int) -> CwState:
        """The state one control period later; arguments as in `Dynamics.advance`."""
        if not self.perturbations:
            return CwState(*self.step.undisturbed(state.position, state.velocity, acceleration_lvlh))
        disturbance = blank((len(self._offsets), *state.position.shape), state.position)
        for node, offset in enumerate(self._offsets):
            disturbance[node] = total_perturbation(self.perturbations, step, offset)
        return CwState(*self.step.advance(state.position, state.velocity, acceleration_lvlh, disturbance))
