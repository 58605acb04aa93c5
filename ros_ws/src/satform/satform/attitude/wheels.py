# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The true attitudes of satellites with reaction wheels, and what the wheels cannot give."""

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from satform.attitude.guidance import Attitude, Orientation
from satform.attitude.gyrostat import AttitudeState, Torques, advance
from satform.numeric.elementwise import Array, Indices, constant
from satform.numeric.stacking import take


@dataclass(frozen=True)
class Wheels:
    """Limits of the reaction wheels.

    Attributes:
        torque_limit: of each motor, N m, infinite for none, shape (...).
        momentum_limit: of each wheel, N m s, infinite for none, shape (...).
    """

    torque_limit: Array
    momentum_limit: Array

    def applied(self, command: Array, momentum: Array, duration: float) -> tuple[Array, Array, Array]:
        """What the motors give of a command that is held.

        Args:
            command: N m, shape (..., 3).
            momentum: of each wheel at the start, N m s, shape (..., 3).
            duration: s.

        Returns:
            The torque (N m, shape (..., 3)); whether the torque limit took something away; whether the
            momentum limit did, shape (...) each.
        """
        limit, full = self.torque_limit[..., None], self.momentum_limit[..., None]
        torque = np.minimum(np.maximum(command, -limit), limit)
        after = momentum + torque * duration
        limited = (np.minimum(np.maximum(after, -full), full) - momentum) / duration
        # Inside the limit the command itself is applied, without the rounding of a sum and a difference.
        over = np.abs(after) > full
        torque_saturated_steps = np.any(torque != command, axis=-1)
        return np.where(over, limited, torque), torque_saturated_steps, np.any(over, axis=-1)


@dataclass(frozen=True)
class TurningState:
    """True attitudes and what was counted of their wheels.

    Attributes:
        attitude: and momenta, shape (M, 3) each.
        torque_saturated_steps: steps so far in which a torque limit took something away, shape (M,).
        momentum_saturated_steps: steps so far in which a momentum limit did, shape (M,).
    """

    attitude: AttitudeState
    torque_saturated_steps: Array
    momentum_saturated_steps: Array


class Turning:
    """The true attitudes of several satellites.

    Attributes:
        members: indices of these satellites in the formation, ascending.
        state: attitudes and counters.
    """

    def __init__(
        self, members: list[int], orientation: Orientation, wheels: Wheels, step: float, parts: int
    ) -> None:
        self.members = np.asarray(members)
        self._orientation = orientation
        self._wheels = wheels
        self._step = step
        self._parts = parts
        nothing = np.zeros(len(members))
        self.state = TurningState(orientation.start, nothing, nothing)

    def keep(self, rows: Indices) -> "Turning":
        """The attitudes of some of the satellites, by their indices in the formation, ascending."""
        held = np.isin(self.members, rows)
        own = np.flatnonzero(held)
        kept = copy(self)
        kept.members = np.searchsorted(rows, self.members[held])
        kept._orientation = take(self._orientation, own)
        kept._wheels = take(self._wheels, own)
        kept.state = take(self.state, own)
        return kept

    def measured(self) -> Attitude:
        """Measured attitude of each of these satellites: the truth, shape (M, 3)."""
        state = self.state.attitude
        body = self._orientation.law.body
        return Attitude(state.mrp, body.angular_velocity(state), state.wheel_momentum)

    def advance(self, command: Array, step: int) -> None:
        """Move on by one step.

        Args:
            command: wheel torques of these satellites, held over the step, N m, shape (M, 3).
            step: number of the step.
        """
        state = self.state
        applied, torque_saturated_steps, momentum_saturated_steps = self._wheels.applied(
            command, state.attitude.wheel_momentum, self._step
        )
        begin, part = step * self._step, self._step / self._parts
        attitude = state.attitude
        for number in range(self._parts):

            def torques(offset: float, now: AttitudeState, number: int = number) -> Torques:
                time = constant((len(self.members),), begin + (number * part + offset))
                return Torques(applied, self._orientation.external(now.mrp, time))

            attitude = advance(self._orientation.law.body, attitude, part, torques)
        self.state = replace(
            state,
            attitude=attitude,
            torque_saturated_steps=state.torque_saturated_steps + torque_saturated_steps,
            momentum_saturated_steps=state.momentum_saturated_steps + momentum_saturated_steps,
        )
