# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Truth in inertial space: chief and satellites propagated side by side (Cowell's method)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from satform.dynamics.integrators import Adaptive, FixedStep
from satform.dynamics.orbital_forces import Body, ForceModel, central_gravity, gravitational_parameter
from satform.dynamics.prescribed_disturbances import Perturbation
from satform.dynamics.protocol import Dynamics, total_perturbation
from satform.numeric.elementwise import Array, norm
from satform.orbits.frames import LvlhFrame, chief_axes, chief_frame
from satform.orbits.inertial_motion import frames_of


@dataclass(frozen=True)
class InertialState:
    """Where everything is.

    Attributes:
        time: since the start, s.
        motion: inertial position in m and velocity in m/s, shape (2, 1 + N, 3); row 0 is the chief.
        remainder: what rounding took from `motion`, same shape.
    """

    time: float
    motion: Array
    remainder: Array


@dataclass(frozen=True)
class InertialDynamics(Dynamics):
    """Cowell propagation of the chief and of the satellites about it.

    Commands and perturbations are given in the chief's LVLH axes and turn with them inside the
    step. The LVLH velocity is taken in the frame that turns at the orbit rate (0, 0, h/r^2) or, with
    `exact_rate`, as the frame truly turns; see `satform.orbits.frames`.

    Attributes:
        period: control period, s.
        forces: on the satellites, and on the chief unless it is Keplerian.
        bodies: of the chief and of each satellite, 1 + N, or none if no force needs them.
        chief_position: at the start, inertial, m, shape (3,).
        chief_velocity: at the start, inertial, m/s, shape (3,).
        integrator: fixed step or adaptive.
        keplerian_chief: the chief is no satellite but a point that obeys point-mass gravity alone.
        exact_rate: which rate of the LVLH frame the velocities are taken at.
        perturbations: added to the forces on the satellites.
    """

    period: float
    forces: ForceModel
    bodies: tuple[Body, ...]
    chief_position: Array
    chief_velocity: Array
    integrator: FixedStep | Adaptive
    keplerian_chief: bool = False
    exact_rate: bool = True
    perturbations: tuple[Perturbation, ...] = ()

    def start_frame(self) -> LvlhFrame:
        """The chief's frame at time zero."""
        return self._frame(0.0, self.chief_position, self.chief_velocity)

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> InertialState:
        """The state at time zero; arguments as in `Dynamics.start`."""
        frame = self.start_frame()
        position, velocity = frame.to_inertial(position_lvlh, velocity_lvlh)
        motion = np.stack(
            (
                np.concatenate((self.chief_position[None], position)),
                np.concatenate((self.chief_velocity[None], velocity)),
            )
        )
        return InertialState(0.0, motion, np.zeros_like(motion))

    def lvlh(self, state: InertialState) -> tuple[Array, Array]:
        """Relative position in m and velocity in m/s, shape (N, 3) each."""
        position, velocity = state.motion
        return self._frame(state.time, position[0], velocity[0]).to_lvlh(position[1:], velocity[1:])

    def earth_distance(self, state: InertialState) -> Array:
        """Distance of each satellite from the Earth's centre, m, shape (N,)."""
        return norm(state.motion[0, 1:])

    def advance(self, state: InertialState, acceleration_lvlh: Array, step: int) -> InertialState:
        """The state one control period later; arguments as in `Dynamics.advance`."""
        begin = step * self.period
        end = (step + 1) * self.period
        if isinstance(self.integrator, Adaptive):
            motion = self._adaptive(self.integrator, state.motion, acceleration_lvlh, step)
            return replace(state, time=end, motion=motion)
        thrust = _HeldThrust(self, acceleration_lvlh, step)

        def derivative(time: float, motion: Array) -> Array:
            position, velocity = motion
            rate = np.empty_like(motion)
            rate[0] = velocity
            rate[1] = self.forces.acceleration(time, position, velocity, self.bodies)
            if self.keplerian_chief:
                rate[1, 0] = central_gravity(position[0], gravitational_parameter())
            if thrust.acts:
                rate[1, 1:] += thrust.inertial(time - begin, position[0], velocity[0])
            return rate

        motion, remainder = self.integrator.advance(
            derivative, begin, state.motion, state.remainder, self.period
        )
        return InertialState(end, motion, remainder)

    def chief_frames(self, steps: int) -> LvlhFrame:
        """The chief's LVLH frames, propagated without the satellites; as in `Dynamics.chief_frames`."""
        alone = replace(self, bodies=self.bodies[:1], perturbations=())
        none = np.zeros((0, 3))
        state = alone.start(none, none)
        frames = [alone._frame(state.time, *state.motion[:, 0])]
        for step in range(steps):
            state = alone.advance(state, none, step)
            frames.append(alone._frame(state.time, *state.motion[:, 0]))
        return frames_of(frames)

    def chief_frame(self, state: InertialState, step: int) -> LvlhFrame:
        """The chief's LVLH frame in a state; as in `Dynamics.chief_frame`."""
        return self._frame(state.time, *state.motion[:, 0])

    def _frame(self, time: float, position: Array, velocity: Array) -> LvlhFrame:
        if not self.exact_rate or self.keplerian_chief:
            return chief_frame(position, velocity)
        acceleration = self.forces.acceleration(time, position[None], velocity[None], self.bodies[:1])
        return chief_frame(position, velocity, acceleration[0])

    def _adaptive(self, integrator: Adaptive, motion: Array, command: Array, step: int) -> Array:
        """One satellite after another, so that no step size depends on who else flies."""
        begin, duration = step * self.period, self.period
        thrust = _HeldThrust(self, command, step)
        result = np.empty_like(motion)
        chief, result[:, 0] = integrator.solve(self._chief_rate, begin, motion[:, 0], duration)
        for row in range(1, motion.shape[1]):
            body = self.bodies[row : row + 1]

            def rate(time: float, one: Array, body: Sequence[Body] = body, row: int = row) -> Array:
                acceleration = self.forces.acceleration(time, one[:1], one[1:], body)[0]
                if thrust.acts:
                    reached = chief(time)
                    acceleration = (
                        acceleration + thrust.inertial(time - begin, reached[:3], reached[3:])[row - 1]
                    )
                return np.stack((one[1], acceleration))

            _, result[:, row] = integrator.solve(rate, begin, motion[:, row], duration)
        return result

    def _chief_rate(self, time: float, chief: Array) -> Array:
        if self.keplerian_chief:
            return np.stack((chief[1], central_gravity(chief[0], gravitational_parameter())))
        acceleration = self.forces.acceleration(time, chief[:1], chief[1:], self.bodies[:1])
        return np.stack((chief[1], acceleration[0]))


class _HeldThrust:
    """Commands and perturbations of one step, turned from LVLH into inertial space."""

    def __init__(self, dynamics: InertialDynamics, command: Array, step: int) -> None:
        self._perturbations = dynamics.perturbations
        self._command = command
        self._step = step
        self.acts = bool(self._perturbations) or bool(command.any())

    def inertial(self, offset: float, chief_position: Array, chief_velocity: Array) -> Array:
        """Inertial acceleration of the satellites, m/s^2, shape (N, 3), `offset` s into the step."""
        total = self._command
        if self._perturbations:
            total = total + total_perturbation(self._perturbations, self._step, offset)
        radial, along_track, normal = chief_axes(chief_position, chief_velocity)
        turned: Array = total[:, 0:1] * radial + total[:, 1:2] * along_track + total[:, 2:3] * normal
        return turned
