"""CW dynamics with differential gravity about an ideal circular chief.

Between the exact linear equations and a full propagation: each satellite feels, besides the CW
terms, the difference between the harmonics of gravity at its own place and at the chief's. The
chief itself keeps to its circular orbit. What is left out is the two-body term's second order in
the distance and the drift of the chief.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from satform.dynamics.chief import CircularChief, semi_major_axis_of
from satform.dynamics.forces import Gravity, gravitational_parameter, gravity_of
from satform.dynamics.integrators import ExponentialStep, exponential_step, substeps
from satform.dynamics.perturbations import Perturbation
from satform.dynamics.protocol import DynamicsSetting, total_perturbation
from satform.elementwise import Array

if TYPE_CHECKING:
    from satform.dynamics.models import CwPerturbedDynamicsSpec


@dataclass(frozen=True)
class PerturbedState:
    """LVLH motion at one time.

    Attributes:
        motion: position in m and velocity in m/s, shape (N, 6).
    """

    motion: Array


@dataclass(frozen=True)
class CwPerturbedDynamics:
    """CW equations, exact, with differential gravity harmonics of degree 2 and higher.

    Attributes:
        period: control period, s.
        chief: the ideal circular chief.
        gravity: whose central term is left to the CW equations.
        substep: one exponential step; `parts` of them make a control period.
        parts: how many.
        perturbations: added to the rest.
    """

    period: float
    chief: CircularChief
    gravity: Gravity
    substep: ExponentialStep
    parts: int
    perturbations: tuple[Perturbation, ...] = ()

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> PerturbedState:
        """The state at time zero; arguments as in `Dynamics.start`."""
        return PerturbedState(np.concatenate((position_lvlh, velocity_lvlh), axis=-1))

    def lvlh(self, state: PerturbedState) -> tuple[Array, Array]:
        """Relative position in m and velocity in m/s, shape (N, 3) each."""
        return state.motion[:, :3].copy(), state.motion[:, 3:].copy()

    def advance(self, state: PerturbedState, acceleration_lvlh: Array, step: int) -> PerturbedState:
        """The state one control period later; arguments as in `Dynamics.advance`."""
        motion = state.motion
        for part in range(self.parts):
            start = part * self.substep.step

            def remaining(offset: float, reached: Array, start: float = start) -> Array:
                return self._remaining(step, start + offset, reached[:, :3])

            motion = self.substep.advance(motion, acceleration_lvlh, remaining)
        return PerturbedState(motion)

    def differential_gravity(self, time: float, position_lvlh: Array) -> Array:
        """Harmonics at the satellites less those at the chief.

        Args:
            time: since the start, s.
            position_lvlh: m, shape (N, 3).

        Returns:
            m/s^2, LVLH components, shape (N, 3).
        """
        frame = self.chief.frame(time)
        places = np.concatenate((np.zeros((1, 3)), position_lvlh))
        harmonics = self.gravity.harmonics(time, frame.origin_position + frame.vector_to_inertial(places))
        return frame.vector_to_lvlh(harmonics[1:] - harmonics[0])

    def _remaining(self, step: int, offset: float, position_lvlh: Array) -> Array:
        rest = self.differential_gravity(step * self.period + offset, position_lvlh)
        if self.perturbations:
            rest = rest + total_perturbation(self.perturbations, step, offset)
        return rest


def build(spec: "CwPerturbedDynamicsSpec", setting: DynamicsSetting) -> CwPerturbedDynamics:
    """The perturbed CW model that a scenario describes.

    Args:
        spec: what the scenario says.
        setting: the chief's mean motion, the step, the satellites and the perturbations.
    """
    method = spec.integrator.build()
    parts = substeps(setting.step, method.maximum_step)
    radius = semi_major_axis_of(setting.mean_motion, gravitational_parameter())
    return CwPerturbedDynamics(
        period=setting.step,
        chief=CircularChief(spec.chief, radius, setting.mean_motion),
        gravity=gravity_of(spec.gravity, spec.epoch),
        substep=exponential_step(method.tableau, setting.mean_motion, setting.step / parts),
        parts=parts,
        perturbations=spec.build_perturbations(setting),
    )
