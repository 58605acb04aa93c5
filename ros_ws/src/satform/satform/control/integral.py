"""Linear-quadratic regulator with integral action: no steady offset under a constant disturbance."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.control.lqr import holding_acceleration, relative_motion_gain
from satform.control.protocol import Action, ControllerSpec, FlightSetting, Motion
from satform.control.sampling import require_stable_hold
from satform.dynamics import cw
from satform.dynamics.linear import coupling, position_matrix
from satform.elementwise import Array
from satform.reference import Reference
from satform.spec import NonNegativePerAxis, PositivePerAxis


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
    return relative_motion_gain(integral_model(mean_motion), time_powers, weights, effort)


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
    """

    position_gain: cw.InPlaneCoupling
    velocity_gain: cw.InPlaneCoupling
    integral_gain: cw.InPlaneCoupling
    inverse_integral_gain: cw.InPlaneCoupling
    natural: cw.NaturalAcceleration
    step: Array
    command_path: str
    feedforward: bool

    def start(self, motion: Motion) -> PositionIntegral:
        """Integral before the first step, such that nothing is commanded until an error builds up.

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

    def act(self, motion: Motion, reference: Reference, memory: PositionIntegral) -> Action:
        """Command of one step, and the integral grown by this step's position error.

        Args:
            motion: measured or estimated position and velocity, LVLH.
            reference: desired position, velocity and acceleration, LVLH.
            memory: integral of the position error so far.

        Returns:
            Commanded acceleration and the next integral; the sliding variable is zero.
        """
        position_error = motion.position - reference.position
        position, velocity = motion.position, motion.velocity
        if self.command_path == "error":
            position, velocity = position_error, velocity - reference.velocity
        acceleration = -(
            self.position_gain(position) + self.velocity_gain(velocity) + self.integral_gain(memory.integral)
        )
        if self.feedforward:
            acceleration = acceleration + holding_acceleration(reference, self.natural)
        integral = memory.integral + position_error * self.step[..., None]
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
        )
