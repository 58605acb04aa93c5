# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear-quadratic regulator with integral action: no steady offset under a constant disturbance.

Equations: docs/controllers/lqr.md.
"""

import functools
from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.common.spec import NonNegativePerAxis, PositivePerAxis
from satform.control.anti_windup import Saturation
from satform.control.lqr import holding_acceleration, relative_motion_cost, relative_motion_gain
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Gap, Motion
from satform.control.sampled_stability import require_stable_hold
from satform.dynamics import cw
from satform.dynamics.linear import coupling, position_matrix
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference


def integral_model(mean_motion: float) -> tuple[Array, Array]:
    """Relative motion augmented by the integral of the position.

    Args:
        mean_motion: of the chief's orbit, rad/s.

    Returns:
        State matrix (9, 9) and input matrix (9, 3) for (position, velocity, integral of position).

    Source: Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic Systems, integral control.
    """
    motion, command = cw.system_matrices(mean_motion)
    state = np.zeros((9, 9))
    state[:6, :6] = motion
    state[6:, :6] = position_matrix()
    return state, np.vstack((command, np.zeros((3, 3))))


@functools.lru_cache(maxsize=256)
def design_lqi(
    mean_motion: float,
    position_weight: tuple[float, float, float] = (10.0, 10.0, 5.0),
    velocity_weight: tuple[float, float, float] = (0.05, 0.05, 0.05),
    integral_weight: tuple[float, float, float] = (1e-3, 1e-3, 5e-4),
    command_weight: tuple[float, float, float] = (1.0, 1.0, 0.5),
) -> Array:
    """Regulator gain with integral action for relative motion about a circular orbit.

    Args:
        mean_motion: of the chief's orbit, rad/s.
        position_weight: diagonal of Q for the position, 1/m^2.
        velocity_weight: diagonal of Q for the velocity, s^2/m^2.
        integral_weight: diagonal of Q for the integral of the position error, 1/(m^2 s^2).
        command_weight: diagonal of R times the squared mean motion, s^2/m^2.

    Returns:
        Gain, shape (3, 9): columns 0..2 in 1/s^2 multiply the position, 3..5 in 1/s the velocity,
        6..8 in 1/s^3 the integral.

    Raises:
        ValueError: the weights give no stabilising gain.

    Source: Cadic, Xu & Lu for the structure; the weights are not printed there and were chosen here.
    """
    weights = np.array([*position_weight, *velocity_weight, *integral_weight], dtype=np.float64)
    effort = np.array(command_weight, dtype=np.float64) / mean_motion**2
    time_powers = np.repeat([0.0, -1.0, 1.0], 3)
    gain = relative_motion_gain(integral_model(mean_motion), time_powers, weights, effort)
    # The same array is returned to all who ask for it.
    gain.flags.writeable = False
    return gain


@dataclass(frozen=True)
class PositionIntegral:
    """Memory of the law.

    Attributes:
        integral: of the position error over time, m s, shape (..., 3).
    """

    integral: Array


@dataclass(frozen=True)
class Lqi:
    """State feedback with integral action.

    Attributes:
        position_gain: 1/s^2.
        velocity_gain: 1/s.
        integral_gain: 1/s^3.
        inverse_integral_gain: s^3.
        natural: acceleration of free relative motion.
        step: control period, s, shape (...).
        command_path: "integral" or "error".
        feedforward: whether the command that holds the reference is added.
        saturation: detects that the thrusters did not apply the last command.
        tracking: share of the unapplied command by which the integral is corrected in one step, shape (...);
            0 for no anti-windup.
    """

    position_gain: cw.InPlaneCoupling
    velocity_gain: cw.InPlaneCoupling
    integral_gain: cw.InPlaneCoupling
    inverse_integral_gain: cw.InPlaneCoupling
    natural: cw.NaturalAcceleration
    step: Array
    command_path: str
    feedforward: bool
    saturation: Saturation
    tracking: Array

    def start(self, motion: Motion) -> PositionIntegral:
        """Integral before the first step, such that the first command is zero.

        Args:
            motion: position and velocity at the first step, LVLH.

        Returns:
            The integral that cancels the state feedback when the reference enters through the
            integral alone, zero otherwise.
        """
        if self.command_path == "error":
            return PositionIntegral(np.zeros_like(motion.position))
        feedback = self.position_gain(motion.position) + self.velocity_gain(motion.velocity)
        return PositionIntegral(-self.inverse_integral_gain(feedback))

    def resting(self, reference: Reference) -> Array:
        """Integral with which the law holds a reference on which the satellite is, m s, shape (..., 3)."""
        wanted = np.zeros_like(reference.position)
        if self.command_path == "integral":
            wanted = wanted - (
                self.position_gain(reference.position) + self.velocity_gain(reference.velocity)
            )
        if not self.feedforward:
            wanted = wanted - holding_acceleration(reference, self.natural)
        return self.inverse_integral_gain(wanted)

    def resume(self, memory: PositionIntegral, gap: Gap) -> PositionIntegral:
        """The integral is kept, since it compensates a lasting disturbance; the gap is not integrated."""
        return memory

    def act(
        self, motion: Motion, reference: Reference, memory: PositionIntegral, step: ControlStep
    ) -> Action:
        """Command of one step, and the integral increased by this step's position error.

        The integral is first corrected by the part of the last command that saturated thrusters did not
        apply, so that it is the one with which the law would have commanded what was applied.

        Args:
            motion: measured or estimated position and velocity, LVLH.
            reference: desired position, velocity and acceleration, LVLH.
            memory: integral of the position error so far.
            step: with the acceleration that was applied instead of the last command.

        Returns:
            Commanded acceleration and the next integral; the sliding variable is zero.

        Source: Astrom & Hagglund, Advanced PID Control, ch. 3 (back-calculation); with the whole shortfall
        taken out it is the conditioning technique of Hanus, Kinnaert & Henrotte 1987.
        """
        position_error = motion.position - reference.position
        position, velocity = motion.position, motion.velocity
        if self.command_path == "error":
            position, velocity = position_error, velocity - reference.velocity
        lacking = self.saturation.shortfall(motion, step)
        begun = memory.integral + self.inverse_integral_gain(self.tracking[..., None] * lacking)
        acceleration = -(
            self.position_gain(position) + self.velocity_gain(velocity) + self.integral_gain(begun)
        )
        if self.feedforward:
            acceleration = acceleration + holding_acceleration(reference, self.natural)
        integral = begun + position_error * self.step[..., None]
        return Action(acceleration, np.zeros_like(acceleration), PositionIntegral(integral))


class LqiSpec(ControllerSpec):
    """Linear-quadratic regulator with integral action, u = -K1 x - K2 q, dq/dt = position error."""

    kind: Literal["lqi"] = "lqi"
    position_weight: PositivePerAxis = (10.0, 10.0, 5.0)
    """Cost of a position error, per axis, 1/m^2."""
    velocity_weight: NonNegativePerAxis = (0.05, 0.05, 0.05)
    """Cost of a velocity error, per axis, s^2/m^2."""
    integral_weight: PositivePerAxis = (1e-3, 1e-3, 5e-4)
    """Cost of the integral of the position error, per axis, 1/(m^2 s^2)."""
    command_weight: PositivePerAxis = (1.0, 1.0, 0.5)
    """Cost of the commanded acceleration divided by the chief's mean motion, per axis, s^2/m^2."""
    command_path: Literal["integral", "error"] = "integral"
    """Whether the reference enters through the integral alone, which does not overshoot, or through
    the state error as well, which follows a moving reference without lag."""
    feedforward: bool = False
    """Whether the command that holds the reference is added."""
    anti_windup: Literal["back_calculation", "none"] = "back_calculation"
    """back_calculation: the integral is corrected by what saturated thrusters did not apply of a command;
    none: it is not."""

    def assumes_circular_chief(self) -> bool:
        """Its model is that of Clohessy and Wiltshire."""
        return True

    def build(self, setting: FlightSetting) -> Lqi:
        """The regulator with its gain solved for.

        Raises:
            ValueError: the weights give no stabilising gain, or the step is too long for it.
        """
        gain = design_lqi(
            setting.mean_motion,
            self.position_weight,
            self.velocity_weight,
            self.integral_weight,
            self.command_weight,
        )
        transition, held = np.eye(9), np.zeros((9, 3))
        transition[:6, :6] = cw.transition_matrix(setting.mean_motion, setting.step)
        transition[6:, :3] = setting.step * np.eye(3)
        held[:6] = cw.input_matrix(setting.mean_motion, setting.step)
        require_stable_hold(transition - held @ gain, "lqi", setting.step)
        return Lqi(
            position_gain=coupling(gain[:, :3]),
            velocity_gain=coupling(gain[:, 3:6]),
            integral_gain=coupling(gain[:, 6:]),
            inverse_integral_gain=coupling(np.asarray(np.linalg.inv(gain[:, 6:]), dtype=np.float64)),
            natural=cw.natural_acceleration(setting.mean_motion),
            step=np.asarray(setting.step, dtype=np.float64),
            command_path=self.command_path,
            feedforward=self.feedforward,
            saturation=Saturation.of(setting),
            tracking=np.asarray(float(self.anti_windup == "back_calculation")),
        )

    def cost_matrix(self, setting: FlightSetting) -> Array:
        """P of the Lyapunov function x'Px of the error (position, velocity, integral), SI units, (9, 9)."""
        weights = np.array([*self.position_weight, *self.velocity_weight, *self.integral_weight])
        effort = np.array(self.command_weight) / setting.mean_motion**2
        model = integral_model(setting.mean_motion)
        return relative_motion_cost(model, np.repeat([0.0, -1.0, 1.0], 3), weights, effort)
