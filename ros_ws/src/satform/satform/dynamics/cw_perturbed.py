# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""CW dynamics and what it leaves out of gravity, in coordinates relative to the chief.

Two models, by what the chief does:

- It is propagated under the same gravity as the satellites. Then the difference of gravity between
  satellite and chief is taken in full, of the central term and of the harmonics, and no digits are
  lost in it.
- It is ideal and keeps to its circular orbit while the satellites feel the harmonics. Then the
  central term is linear, as in CW. Where the harmonics act alike on both, as on satellites one behind
  the other on the same orbit, this is worse than CW: the ideal chief turns at the point-mass rate and
  the satellites do not. It is kept for comparison with others who compute the same.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from satform.dynamics.integrators import ExponentialStep, FixedStep, exponential_step, substeps
from satform.dynamics.orbital_forces import Gravity, gravitational_parameter
from satform.dynamics.prescribed_disturbances import Perturbation
from satform.dynamics.protocol import Dynamics, DynamicsSetting, total_perturbation
from satform.numeric.elementwise import Array, cross, dot
from satform.orbits.chief import ChiefOrbitSpec, CircularChief, semi_major_axis_of
from satform.orbits.frames import LvlhFrame, chief_frame
from satform.orbits.inertial_motion import frames_of


@dataclass(frozen=True)
class PerturbedState:
    """LVLH motion at one time.

    Attributes:
        motion: position in m and velocity in m/s, shape (N, 6).
    """

    motion: Array


@dataclass(frozen=True)
class CwPerturbedDynamics(Dynamics):
    """CW equations about an ideal chief, exact, with differential harmonics of degree 2 and higher.

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

    def chief_frames(self, steps: int) -> LvlhFrame:
        """The ideal chief's LVLH frames; as in `Dynamics.chief_frames`."""
        return frames_of([self.chief.frame(step * self.period) for step in range(steps + 1)])

    def chief_frame(self, state: PerturbedState, step: int) -> LvlhFrame:
        """The ideal chief's LVLH frame; as in `Dynamics.chief_frame`."""
        return self.chief.frame(step * self.period)

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
        positions = np.concatenate((np.zeros((1, 3)), position_lvlh))
        harmonics = self.gravity.harmonics(time, frame.origin_position + frame.vector_to_inertial(positions))
        return frame.vector_to_lvlh(harmonics[1:] - harmonics[0])

    def _remaining(self, step: int, offset: float, position_lvlh: Array) -> Array:
        rest = self.differential_gravity(step * self.period + offset, position_lvlh)
        if self.perturbations:
            rest = rest + total_perturbation(self.perturbations, step, offset)
        return rest


@dataclass(frozen=True)
class RelativeState:
    """Inertial motion of the chief and motion of the satellites relative to it, at one time.

    Attributes:
        time: since the start, s.
        motion: shape (2, 1 + N, 3). Row 0 is the chief: inertial position in m and velocity in m/s.
            The other rows are LVLH components of the position relative to the chief in m and of the
            inertial relative velocity in m/s.
        remainder: what rounding took from `motion`, same shape.
    """

    time: float
    motion: Array
    remainder: Array


@dataclass(frozen=True)
class PropagatedChiefDynamics(Dynamics):
    """Relative motion about a chief that feels the same gravity as the satellites.

    With rho the relative position, u the inertial relative velocity and w the rate of the chief's
    LVLH frame, all in LVLH components,

        rho' = u - w x rho
        u'   = g(R + rho) - g(R) + command - w x u.

    The inertial velocity is integrated and not the one in the rotating frame, because the latter
    needs the derivative of the frame's rate about x, a derivative of the harmonics.

    Attributes:
        period: control period, s.
        gravity: on chief and satellites.
        chief_position: at the start, inertial, m, shape (3,).
        chief_velocity: at the start, inertial, m/s, shape (3,).
        integrator: of fixed step.
        perturbations: added to the accelerations of the satellites.

    Source: Schaub & Junkins, ch. 14 (relative motion, transport theorem); Battin, section 8.4, for
        the difference of the central terms without cancellation.
    """

    period: float
    gravity: Gravity
    chief_position: Array
    chief_velocity: Array
    integrator: FixedStep
    perturbations: tuple[Perturbation, ...] = ()

    def start_frame(self) -> LvlhFrame:
        """The chief's frame at time zero."""
        return self._frame(0.0, self.chief_position, self.chief_velocity)[0]

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> RelativeState:
        """The state at time zero; arguments as in `Dynamics.start`."""
        frame = self.start_frame()
        carried = velocity_lvlh + cross(frame.rate, position_lvlh)
        motion = np.stack(
            (
                np.concatenate((self.chief_position[None], position_lvlh)),
                np.concatenate((self.chief_velocity[None], carried)),
            )
        )
        return RelativeState(0.0, motion, np.zeros_like(motion))

    def lvlh(self, state: RelativeState) -> tuple[Array, Array]:
        """Relative position in m and velocity in m/s, shape (N, 3) each."""
        position, velocity = state.motion
        frame, _ = self._frame(state.time, position[0], velocity[0])
        return position[1:].copy(), velocity[1:] - cross(frame.rate, position[1:])

    def chief_frames(self, steps: int) -> LvlhFrame:
        """The chief's LVLH frames, propagated without the satellites; as in `Dynamics.chief_frames`."""
        alone, none = replace(self, perturbations=()), np.zeros((0, 3))
        state = alone.start(none, none)
        frames = [alone._frame(state.time, *state.motion[:, 0])[0]]
        for step in range(steps):
            state = alone.advance(state, none, step)
            frames.append(alone._frame(state.time, *state.motion[:, 0])[0])
        return frames_of(frames)

    def chief_frame(self, state: RelativeState, step: int) -> LvlhFrame:
        """The chief's LVLH frame in a state; as in `Dynamics.chief_frame`."""
        return self._frame(state.time, *state.motion[:, 0])[0]

    def advance(self, state: RelativeState, acceleration_lvlh: Array, step: int) -> RelativeState:
        """The state one control period later; arguments as in `Dynamics.advance`."""
        begin = step * self.period

        def derivative(time: float, motion: Array) -> Array:
            position, velocity = motion
            frame, chief_acceleration = self._frame(time, position[0], velocity[0])
            total = acceleration_lvlh
            if self.perturbations:
                total = total + total_perturbation(self.perturbations, step, time - begin)
            rate = np.empty_like(motion)
            rate[0, 0] = velocity[0]
            rate[1, 0] = chief_acceleration
            rate[0, 1:] = velocity[1:] - cross(frame.rate, position[1:])
            natural = self._differential_gravity(time, frame, position[1:])
            rate[1, 1:] = natural + total - cross(frame.rate, velocity[1:])
            return rate

        motion, remainder = self.integrator.advance(
            derivative, begin, state.motion, state.remainder, self.period
        )
        return RelativeState((step + 1) * self.period, motion, remainder)

    def _frame(self, time: float, position: Array, velocity: Array) -> tuple[LvlhFrame, Array]:
        """The chief's frame at its exact rate, and its inertial acceleration in m/s^2, shape (3,)."""
        acceleration = self.gravity.acceleration(time, position[None], velocity[None], ())[0]
        return chief_frame(position, velocity, acceleration), acceleration

    def _differential_gravity(self, time: float, frame: LvlhFrame, position_lvlh: Array) -> Array:
        """Gravity at the satellites less gravity at the chief, LVLH, m/s^2, shape (N, 3)."""
        x, y, z = frame.origin_position.tolist()
        central = differential_central_gravity(
            position_lvlh, math.sqrt(x * x + y * y + z * z), gravitational_parameter()
        )
        if self.gravity.degree == 0:
            return central
        relative = np.concatenate((np.zeros((1, 3)), position_lvlh))
        inertial = frame.origin_position + frame.vector_to_inertial(relative)
        harmonics = self.gravity.harmonics(time, inertial)
        return central + frame.vector_to_lvlh(harmonics[1:] - harmonics[0])


def differential_central_gravity(position_lvlh: Array, radius: float, parameter: float) -> Array:
    """Point-mass gravity at satellites less that at their chief.

    Args:
        position_lvlh: relative to the chief, m, shape (N, 3).
        radius: of the chief, m.
        parameter: GM, m^3/s^2.

    Returns:
        m/s^2, LVLH, shape (N, 3).

    Source: Battin, An Introduction to the Mathematics and Methods of Astrodynamics, section 8.4 (Encke).
    """
    # The satellite's distance from the Earth's centre, squared, is radius^2 (1 + excess).
    excess = (2.0 * radius * position_lvlh[:, 0] + dot(position_lvlh, position_lvlh)) / (radius * radius)
    cubed = (1.0 + excess) * np.sqrt(1.0 + excess)
    difference = excess * (3.0 + 3.0 * excess + excess * excess) / (1.0 + cubed)
    shifted = position_lvlh.copy()
    shifted[:, 0] -= radius * difference
    acceleration: Array = shifted * (-parameter / (radius * radius * radius) / cubed)[:, None]
    return acceleration


def about_propagated_chief(
    setting: DynamicsSetting,
    chief: ChiefOrbitSpec,
    gravity: Gravity,
    integrator: FixedStep,
    perturbations: tuple[Perturbation, ...],
) -> PropagatedChiefDynamics:
    """The model whose chief feels the same gravity as the satellites.

    Args:
        setting: the chief's mean motion and the step.
        chief: its orbit at time zero.
        gravity: on chief and satellites.
        integrator: of chief and satellites.
        perturbations: added to the rest.
    """
    position, velocity = chief.state(setting.mean_motion, gravitational_parameter())
    return PropagatedChiefDynamics(
        period=setting.step,
        gravity=gravity,
        chief_position=position,
        chief_velocity=velocity,
        integrator=integrator,
        perturbations=perturbations,
    )


def about_circular_chief(
    setting: DynamicsSetting,
    chief: ChiefOrbitSpec,
    gravity: Gravity,
    integrator: FixedStep,
    perturbations: tuple[Perturbation, ...],
) -> CwPerturbedDynamics:
    """The model whose chief keeps to its unperturbed circle; arguments as in `about_propagated_chief`."""
    parts = substeps(setting.step, integrator.maximum_step)
    radius = semi_major_axis_of(setting.mean_motion, gravitational_parameter())
    return CwPerturbedDynamics(
        period=setting.step,
        chief=CircularChief(chief, radius, setting.mean_motion),
        gravity=gravity,
        substep=exponential_step(integrator.tableau, setting.mean_motion, setting.step / parts),
        parts=parts,
        perturbations=perturbations,
    )
