# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear-quadratic regulator about an eccentric chief: its gain repeats with the chief's anomaly.

Equations: docs/controllers/eccentric.md.
"""

import functools
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from satform.common.spec import NonNegativePerAxis, PositivePerAxis
from satform.control.periodic_riccati import periodic_gain, product_in_turn
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Memoryless, Motion
from satform.control.sampled_stability import spectral_radius
from satform.dynamics.linear import multiply
from satform.dynamics.relative_motion_models import (
    ModelName,
    RelativeMotionModel,
    input_matrix,
    relative_motion_model,
)
from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief, mean_anomaly, semi_major_axis_of, true_anomaly
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.path_reference import Reference

ANOMALIES = 720
"""True anomalies for which gains are stored, evenly from 0."""

MOST_STEPS = 2048
"""Steps of an orbit in the design; with a shorter control period the gain is that of longer steps."""

LEAST_STEPS = 16
"""Steps of an orbit below which a command held in LVLH has little to do with the model."""

_MOST_ANALYSED = 4096
"""Steps of an orbit up to which each is worked out in the monodromy; else groups of alike ones are."""


@dataclass(frozen=True)
class PeriodicLqr(Memoryless):
    """State feedback on the error to the reference, with gains by the chief's true anomaly.

    Attributes:
        mean_anomaly: of the chief at time zero, rad, shape (...).
        mean_motion: of the chief, rad/s, shape (...).
        eccentricity: of the chief, shape (...).
        gain: at true anomalies evenly from 0; columns 0 to 2 in 1/s^2 multiply the position error, 3 to 5 in
            1/s the velocity error, shape (..., n, 3, 6).
        natural: acceleration of free relative motion at the same anomalies, with the same columns.
        feedforward: whether the command that holds the reference is added.
    """

    mean_anomaly: Array
    mean_motion: Array
    eccentricity: Array
    gain: Array
    natural: Array
    feedforward: bool

    def act(self, motion: Motion, reference: Reference, memory: None, step: ControlStep) -> Action:
        """Command that brings the position and velocity errors to zero.

        Args:
            motion: measured or estimated position and velocity, LVLH.
            reference: desired position and velocity, and acceleration over the step, LVLH.
            memory: unused.
            step: whose time says where the chief is.

        Returns:
            Commanded acceleration; the sliding variable is zero.
        """
        error = (motion.position - reference.position, motion.velocity - reference.velocity)
        acceleration = -multiply(self._at(self.gain, step.time), np.concatenate(error, axis=-1))
        if self.feedforward:
            half = 0.5 * step.length
            velocity = reference.velocity + half * reference.acceleration
            position = reference.position + half * (reference.velocity + 0.5 * half * reference.acceleration)
            free = multiply(
                self._at(self.natural, step.time + half), np.concatenate((position, velocity), axis=-1)
            )
            acceleration = acceleration + (reference.acceleration - free)
        return Action(acceleration, np.zeros_like(acceleration))

    def _at(self, table: Array, time: float) -> Array:
        """Value of a table at a time, linear between two anomalies, shape (..., 3, 6)."""
        mean = self.mean_anomaly + self.mean_motion * time
        fractions = [
            true_anomaly(anomaly, e) / math.tau
            for anomaly, e in zip(np.ravel(mean).tolist(), np.ravel(self.eccentricity).tolist(), strict=True)
        ]
        return _interpolated(table, np.asarray(fractions, dtype=np.float64).reshape(np.shape(mean)))


def _interpolated(table: Array, fraction: Array) -> Array:
    """Values of tables over a revolution, linear between two rows, shape (..., 3, 6).

    Args:
        table: shape (..., n, 3, 6), or one for all, (n, 3, 6).
        fraction: of a revolution, shape (...).
    """
    count = table.shape[-3]
    table = np.broadcast_to(table, (*fraction.shape, *table.shape[-3:]))
    position = np.asarray(fraction % 1.0 * count)
    first = np.floor(position)
    weight, index = (position - first)[..., None, None], np.asarray(first.astype(np.int64) % count)
    value: Array = (1.0 - weight) * _row(table, index) + weight * _row(table, np.asarray((index + 1) % count))
    return value


def _row(table: Array, index: NDArray[np.int64]) -> Array:
    """Row of each table, shape (..., n, 3, 6), by an index of shape (...)."""
    return np.take_along_axis(table, index[..., None, None, None], axis=-3)[..., 0, :, :]


class PeriodicLqrSpec(ControllerSpec):
    """Linear-quadratic regulator about a chief of any eccentricity, with a gain that repeats every orbit."""

    kind: Literal["periodic_lqr"] = "periodic_lqr"
    model: Literal["cw", "yamanaka_ankersen"] = "yamanaka_ankersen"
    """Relative motion that gain and feed-forward are computed from."""
    position_weight: PositivePerAxis = (1.0, 1.0, 0.5)
    """Cost of a position error, per axis, 1/m^2."""
    velocity_weight: NonNegativePerAxis = (0.05, 0.05, 0.05)
    """Cost of a velocity error, per axis, s^2/m^2."""
    command_weight: PositivePerAxis = (1.0, 1.0, 0.5)
    """Cost of the commanded acceleration divided by the chief's mean motion, per axis, s^2/m^2."""
    feedforward: bool = True
    """Whether the command that holds the reference is added."""

    def assumes_circular_chief(self) -> bool:
        """It does with the model `cw` alone."""
        return self.model == "cw"

    def build(self, setting: FlightSetting) -> PeriodicLqr:
        """The regulator with its gains solved for.

        Raises:
            ValueError: the weights give no gain, or the closed loop does not decay over an orbit.
        """
        chief, design = known_chief(setting), self._design(setting)
        radius = spectral_radius(design.monodromy)
        if not radius < 1.0:
            raise ValueError(
                f"periodic_lqr: with the command held for {setting.step:g} s the closed loop does not decay "
                f"over the {design.steps} steps of an orbit of eccentricity {chief.eccentricity:g} (spectral "
                f"radius {radius:.6g}, has to be below 1); shorten the step or change the weights"
            )
        return PeriodicLqr(
            mean_anomaly=np.asarray(chief.mean_anomaly),
            mean_motion=np.asarray(chief.mean_motion),
            eccentricity=np.asarray(chief.eccentricity),
            gain=design.gain,
            natural=design.natural,
            feedforward=self.feedforward,
        )

    def linearisation(self, setting: FlightSetting) -> Array:
        """A transition over one step that decays and turns as the loop does over an orbit, evenly spread."""
        design = self._design(setting)
        transition = np.zeros((6, 6))
        roots = [
            abs(pole) ** (1.0 / design.steps) * np.exp(1j * np.angle(pole) / design.steps)
            for pole in np.linalg.eigvals(design.monodromy)
        ]
        for row, root in enumerate(roots):
            # Of a pair each has a row, with the other's column beside it; a real one has no such column.
            transition[row, row] = root.real if abs(root.imag) > 0.0 else abs(root)
            pair = next((k for k, other in enumerate(roots) if k != row and other == np.conj(root)), None)
            if pair is not None and root.imag:
                transition[row, pair] = root.imag
        return transition

    def _design(self, setting: FlightSetting) -> "PeriodicDesign":
        weights = (self.position_weight, self.velocity_weight, self.command_weight)
        return design_periodic_lqr(known_chief(setting), self.model, setting.step, *weights)


@dataclass(frozen=True)
class PeriodicDesign:
    """A regulator for one chief and control period.

    Attributes:
        gain: at true anomalies evenly from 0, SI units, shape (n, 3, 6).
        natural: acceleration of free relative motion at the same anomalies, shape (n, 3, 6).
        monodromy: transition of the closed loop over an orbit, with commands held, shape (6, 6), positions in
            m and velocities in m per radian of the mean motion.
        steps: control periods of the orbit.
    """

    gain: Array
    natural: Array
    monodromy: Array
    steps: int


def known_chief(setting: FlightSetting) -> KeplerianChief:
    """The chief's orbit; a circular one where the truth model knows no other."""
    if setting.chief is not None:
        return setting.chief
    axis = semi_major_axis_of(setting.mean_motion, GRAVITATIONAL_PARAMETER)
    return KeplerianChief(axis, 0.0, 0.0, 0.0, 0.0, 0.0)


@functools.lru_cache(maxsize=64)
def design_periodic_lqr(
    chief: KeplerianChief,
    model: ModelName,
    step: float,
    position_weight: tuple[float, float, float],
    velocity_weight: tuple[float, float, float],
    command_weight: tuple[float, float, float],
) -> PeriodicDesign:
    """Gains by the chief's true anomaly, and the closed loop with them over an orbit.

    Args:
        chief: its orbit.
        model: of the relative motion.
        step: control period over which a command is held, s.
        position_weight: diagonal of Q for the position, 1/m^2.
        velocity_weight: diagonal of Q for the velocity, s^2/m^2.
        command_weight: diagonal of R times the squared mean motion, s^2/m^2.

    Raises:
        ValueError: the weights give no gain, or an orbit has too few steps.
    """
    if not chief.period >= LEAST_STEPS * step:
        raise ValueError(
            f"periodic_lqr: the control period of {step:g} s is more than 1/{LEAST_STEPS} of the orbit of "
            f"{chief.period:.6g} s; shorten the step"
        )
    effort = np.array(command_weight) / chief.mean_motion**2
    cost = np.array([*position_weight, *velocity_weight])
    motion, perigee = relative_motion_model(model, chief), -chief.mean_anomaly / chief.mean_motion
    count = min(MOST_STEPS, round(chief.period / step))
    edges = perigee + chief.period * np.arange(count + 1) / count
    # Lengths and times of the closed loop as units, so that no number is far larger than another.
    second = math.sqrt(math.sqrt(max(position_weight) / float(np.min(effort))))
    scale = np.repeat([1.0, 1.0 / second], 3)
    ahead = scale[:, None] * motion.transition(edges[:-1], edges[1:]) / scale
    held = second**2 * scale[:, None] * input_matrix(motion, edges[:-1], edges[1:])
    largest = max(position_weight)
    by_step = periodic_gain(
        ahead,
        held,
        np.broadcast_to(np.diag(cost / scale**2 / largest), (count, 6, 6)),
        np.broadcast_to(np.diag(effort * second**4 / largest), (count, 3, 3)),
    )
    by_step = second**2 * by_step * scale
    anomalies = math.tau * np.arange(ANOMALIES) / ANOMALIES
    means = np.array([mean_anomaly(anomaly, chief.eccentricity) for anomaly in anomalies.tolist()])
    gain = _interpolated(by_step, means / math.tau)
    natural = motion.system_matrix(perigee + means / chief.mean_motion)[:, 3:]
    monodromy, steps = _monodromy(motion, chief, gain, step)
    for table in (gain, natural, monodromy):
        # The same arrays are returned to all who ask for them.
        table.flags.writeable = False
    return PeriodicDesign(gain, natural, monodromy, steps)


def _monodromy(
    motion: RelativeMotionModel, chief: KeplerianChief, gain: Array, step: float
) -> tuple[Array, int]:
    """Closed loop over the steps of an orbit, and how many there are."""
    steps = round(chief.period / step)
    alike = math.ceil(steps / _MOST_ANALYSED)
    begins: Array = step * np.arange(0, steps, alike, dtype=np.float64)
    ends: Array = begins + step
    fractions = [chief.true_anomaly(begin) / math.tau for begin in begins.tolist()]
    feedback = _interpolated(gain, np.array(fractions))
    loops: Array = motion.transition(begins, ends) - input_matrix(motion, begins, ends) @ feedback
    unit = np.repeat([1.0, 1.0 / chief.mean_motion], 3)
    loops = np.linalg.matrix_power(unit[:, None] * loops / unit, alike)
    return product_in_turn(loops), steps
