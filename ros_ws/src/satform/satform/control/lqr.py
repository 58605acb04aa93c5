# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear-quadratic regulator that tracks a reference.

Equations: docs/controllers/lqr.md.
"""

import functools
from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.common.spec import NonNegativePerAxis, PositivePerAxis
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Memoryless, Motion
from satform.control.sampled_stability import require_stable_hold
from satform.dynamics import cw
from satform.dynamics.linear import coupling
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference


def linear_quadratic_gain(state: Array, command: Array, state_weight: Array, command_weight: Array) -> Array:
    """State feedback that minimises the integral of x'Qx + u'Ru.

    Args:
        state: state matrix, shape (m, m).
        command: input matrix, shape (m, k).
        state_weight: Q, symmetric and positive semidefinite, shape (m, m).
        command_weight: R, symmetric and positive definite, shape (k, k).

    Returns:
        Gain K of u = -K x, shape (k, m).

    Raises:
        ValueError: the Riccati equation has no stabilising solution in double precision.

    Source: Anderson & Moore, Optimal Control: Linear Quadratic Methods, ch. 3.
    """
    from scipy.linalg import solve_continuous_are  # noqa: PLC0415  slow to import, and not needed in flight

    try:
        cost = solve_continuous_are(state, command, state_weight, command_weight)
    except ValueError as error:
        raise ValueError(f"these weights give no stabilising gain: {error}") from error
    gain = np.asarray(np.linalg.solve(command_weight, command.T @ cost), dtype=np.float64)
    rightmost = float(np.max(np.linalg.eigvals(state - command @ gain).real))
    if not rightmost < 0.0:
        raise ValueError(f"these weights give no stabilising gain: rightmost eigenvalue {rightmost:.3g} 1/s")
    return gain


def relative_motion_gain(
    model: tuple[Array, Array], time_powers: Array, state_weight: Array, command_weight: Array
) -> Array:
    """Optimal gain of relative motion, solved for in the time unit of the closed loop.

    In seconds the Riccati equation of a slow orbit is so badly scaled that its solution can fail.

    Args:
        model: state matrix (m, m) and input matrix (m, 3), SI units.
        time_powers: power of a second in the unit of each state (position 0, velocity -1, integral
            of position 1), shape (m,).
        state_weight: diagonal of Q, SI units, shape (m,).
        command_weight: diagonal of R, SI units, shape (3,).

    Returns:
        Gain, SI units, shape (3, m).

    Raises:
        ValueError: the weights give no stabilising gain.
    """
    scaled = _scaled(model, time_powers, state_weight, command_weight)
    gain = linear_quadratic_gain(*scaled.problem)
    return gain * scaled.second * scaled.bandwidth**2


def relative_motion_cost(
    model: tuple[Array, Array], time_powers: Array, state_weight: Array, command_weight: Array
) -> Array:
    """Least cost from any state: the matrix P of the Lyapunov function x'Px, as of `relative_motion_gain`.

    Args:
        model: state matrix (m, m) and input matrix (m, 3), SI units.
        time_powers: as of `relative_motion_gain`, shape (m,).
        state_weight: diagonal of Q, SI units, shape (m,).
        command_weight: diagonal of R, SI units, shape (3,).

    Returns:
        P in SI units, such that x'Px is in s, shape (m, m).

    Source: Anderson & Moore, Optimal Control: Linear Quadratic Methods, ch. 3.
    """
    from scipy.linalg import solve_continuous_are  # noqa: PLC0415  slow to import, and not needed in flight

    scaled = _scaled(model, time_powers, state_weight, command_weight)
    cost = np.asarray(solve_continuous_are(*scaled.problem), dtype=np.float64)
    return scaled.effort * scaled.bandwidth**3 * (scaled.second[:, None] * cost * scaled.second)


@dataclass(frozen=True)
class _Scaled:
    """A regulator's problem in the time unit of its closed loop.

    Attributes:
        problem: state and input matrix, Q and R.
        second: in which the states are, shape (m,).
        bandwidth: its reciprocal is the unit of time, 1/s.
        effort: unit of R.
    """

    problem: tuple[Array, Array, Array, Array]
    second: Array
    bandwidth: float
    effort: float


def _scaled(
    model: tuple[Array, Array], time_powers: Array, state_weight: Array, command_weight: Array
) -> _Scaled:
    state, command = model
    effort = float(np.exp(np.mean(np.log(command_weight))))
    bandwidth = float(np.max((state_weight / effort) ** (0.5 / (2.0 + time_powers))))
    second = bandwidth**time_powers
    problem = (
        second[:, None] * state / second / bandwidth,
        second[:, None] * command * bandwidth,
        np.diag(state_weight / second**2) / (effort * bandwidth**4),
        np.diag(command_weight) / effort,
    )
    return _Scaled(problem, second, bandwidth, effort)


@functools.lru_cache(maxsize=256)
def design_lqr(
    mean_motion: float,
    position_weight: tuple[float, float, float] = (1.0, 1.0, 0.5),
    velocity_weight: tuple[float, float, float] = (0.05, 0.05, 0.05),
    command_weight: tuple[float, float, float] = (1.0, 1.0, 0.5),
) -> Array:
    """Regulator gain for relative motion about a circular orbit.

    Args:
        mean_motion: of the chief's orbit, rad/s.
        position_weight: diagonal of Q for the position, 1/m^2.
        velocity_weight: diagonal of Q for the velocity, s^2/m^2.
        command_weight: diagonal of R times the squared mean motion, s^2/m^2.

    Returns:
        Gain, shape (3, 6): columns 0..2 in 1/s^2 multiply the position, 3..5 in 1/s the velocity.

    Raises:
        ValueError: the weights give no stabilising gain.

    Source: Cadic, Xu & Lu: the weights that are the defaults here.
    """
    state_weight = np.array([*position_weight, *velocity_weight], dtype=np.float64)
    effort = np.array(command_weight, dtype=np.float64) / mean_motion**2
    time_powers = np.repeat([0.0, -1.0], 3)
    gain = relative_motion_gain(cw.system_matrices(mean_motion), time_powers, state_weight, effort)
    # The same array is returned to all who ask for it.
    gain.flags.writeable = False
    return gain


@dataclass(frozen=True)
class Lqr(Memoryless):
    """State feedback on the error to the reference.

    Attributes:
        position_gain: 1/s^2.
        velocity_gain: 1/s.
        natural: acceleration of free relative motion.
        velocity_reference: "followed" or "zero".
        feedforward: whether the command that holds the reference is added.
    """

    position_gain: cw.InPlaneCoupling
    velocity_gain: cw.InPlaneCoupling
    natural: cw.NaturalAcceleration
    velocity_reference: str
    feedforward: bool

    def act(self, motion: Motion, reference: Reference, memory: None, step: ControlStep) -> Action:
        """Command that brings the position and velocity errors to zero.

        Args:
            motion: measured or estimated position and velocity, LVLH.
            reference: desired position, velocity and acceleration, LVLH.
            memory: unused.
            step: unused.

        Returns:
            Commanded acceleration; the sliding variable is zero.
        """
        position_error = motion.position - reference.position
        velocity_error = motion.velocity
        if self.velocity_reference == "followed":
            velocity_error = velocity_error - reference.velocity
        acceleration = -(self.position_gain(position_error) + self.velocity_gain(velocity_error))
        if self.feedforward:
            acceleration = acceleration + holding_acceleration(reference, self.natural)
        return Action(acceleration, np.zeros_like(acceleration))


def holding_acceleration(reference: Reference, natural: cw.NaturalAcceleration) -> Array:
    """Command under which an undisturbed satellite that is on its reference stays on it.

    Args:
        reference: desired position (m), velocity (m/s) and acceleration (m/s^2), each (..., 3).
        natural: acceleration of free relative motion.

    Returns:
        Acceleration, m/s^2, shape (..., 3).

    Source: Clohessy & Wiltshire 1960, solved for the command.
    """
    required: Array = reference.acceleration - natural.at(reference.position, reference.velocity)
    return required


class LqrSpec(ControllerSpec):
    """Linear-quadratic regulator in servo form, u = -K (x - x_reference)."""

    kind: Literal["lqr"] = "lqr"
    position_weight: PositivePerAxis = (1.0, 1.0, 0.5)
    """Cost of a position error, per axis, 1/m^2."""
    velocity_weight: NonNegativePerAxis = (0.05, 0.05, 0.05)
    """Cost of a velocity error, per axis, s^2/m^2."""
    command_weight: PositivePerAxis = (1.0, 1.0, 0.5)
    """Cost of the commanded acceleration divided by the chief's mean motion, per axis, s^2/m^2."""
    velocity_reference: Literal["followed", "zero"] = "followed"
    """Whether the velocity error is taken to the reference's velocity or to rest in LVLH."""
    feedforward: bool = False
    """Whether the command that holds the reference is added. Without it, as in the source, a reference that
    is not free motion is followed with a steady offset."""

    def assumes_circular_chief(self) -> bool:
        """Its model is that of Clohessy and Wiltshire."""
        return True

    def build(self, setting: FlightSetting) -> Lqr:
        """The regulator with its gain solved for.

        Raises:
            ValueError: the weights give no stabilising gain, or the step is too long for it.
        """
        gain = design_lqr(
            setting.mean_motion, self.position_weight, self.velocity_weight, self.command_weight
        )
        transition = cw.transition_matrix(setting.mean_motion, setting.step)
        held = cw.input_matrix(setting.mean_motion, setting.step)
        require_stable_hold(transition - held @ gain, "lqr", setting.step)
        return Lqr(
            position_gain=coupling(gain[:, :3]),
            velocity_gain=coupling(gain[:, 3:]),
            natural=cw.natural_acceleration(setting.mean_motion),
            velocity_reference=self.velocity_reference,
            feedforward=self.feedforward,
        )

    def cost_matrix(self, setting: FlightSetting) -> Array:
        """P of the Lyapunov function x'Px of the error (position, velocity), SI units, shape (6, 6)."""
        weights = np.array([*self.position_weight, *self.velocity_weight])
        effort = np.array(self.command_weight) / setting.mean_motion**2
        model = cw.system_matrices(setting.mean_motion)
        return relative_motion_cost(model, np.repeat([0.0, -1.0], 3), weights, effort)
