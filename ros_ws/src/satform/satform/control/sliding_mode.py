# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Sliding-mode tracking of a desired relative motion with an exponential reaching law.

Equations: docs/controllers/sliding_mode.md.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from satform.common.spec import NonNegativePerAxis, PerAxis, PositivePerAxis
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Memoryless, Motion
from satform.dynamics.cw import NaturalAcceleration, natural_acceleration
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference

_SMALLEST_NORMAL = float(np.finfo(np.float64).tiny)
_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class SlidingMode(Memoryless):
    """The sliding-mode law of one satellite, or of many stacked along leading axes.

    Attributes:
        natural: the free motion that the command cancels.
        proportional_gain: slope of the sliding surface, 1/s, shape (..., 3).
        switching_gain: constant part of the reaching rate, m/s^2, shape (..., 3).
        reaching_gain: proportional part of the reaching rate, 1/s, shape (..., 3).
        boundary_layer: half-width within which the sign is replaced by a slope, m/s, positive,
            shape (..., 3). The smallest positive number makes it the sign.
        disturbance_centre: middle of the disturbance's bounds, cancelled outright, m/s^2, shape (..., 3).
    """

    natural: NaturalAcceleration
    proportional_gain: Array
    switching_gain: Array
    reaching_gain: Array
    boundary_layer: Array
    disturbance_centre: Array

    def act(self, motion: Motion, reference: Reference, memory: Any, step: ControlStep) -> Action:
        """The command of one step.

        Args:
            motion: measured, LVLH.
            reference: desired, LVLH.
            memory: not used.
            step: not used.

        Returns:
            Command and sliding variable s, shape (..., 3).

        Source: Chen et al. 2015, control law; exponential reaching law after Gao & Hung 1993.
        """
        velocity_error = motion.velocity - reference.velocity
        s = velocity_error + self.proportional_gain * (motion.position - reference.position)
        switch = s / np.maximum(np.abs(s), self.boundary_layer)
        acceleration = (
            reference.acceleration
            - self.natural.at(motion.position, motion.velocity)
            - self.disturbance_centre
            - self.proportional_gain * velocity_error
            - self.switching_gain * switch
            - self.reaching_gain * s
        )
        return Action(acceleration=acceleration, sliding_variable=s)


class SlidingModeSpec(ControllerSpec):
    """Sliding-mode tracking with an exponential reaching law.

    The surface is reached in finite time under any disturbance whose distance from
    `disturbance_centre` stays below `switching_gain` on each axis.
    """

    kind: Literal["sliding_mode"] = "sliding_mode"
    proportional_gain: PositivePerAxis = (0.01, 0.01, 0.01)
    """Slope of the sliding surface, 1/s: on it, errors decay with this rate."""
    switching_gain: NonNegativePerAxis = (0.1, 0.1, 0.1)
    """Constant part of the reaching rate, m/s^2; has to exceed the disturbance's bound."""
    reaching_gain: NonNegativePerAxis = (0.1, 0.1, 0.1)
    """Proportional part of the reaching rate, 1/s."""
    boundary_layer: NonNegativePerAxis = (0.0, 0.0, 0.0)
    """Half-width of the layer in which the sign is replaced by a slope, m/s; 0 keeps the sign."""
    disturbance_centre: PerAxis = (0.0, 0.0, 0.0)
    """Middle of the disturbance's lower and upper bound, cancelled outright, m/s^2."""

    def assumes_circular_chief(self) -> bool:
        """Its model is that of Clohessy and Wiltshire."""
        return True

    def build(self, setting: FlightSetting) -> SlidingMode:
        """The law for a chief of the setting's mean motion."""
        return SlidingMode(
            natural=natural_acceleration(setting.mean_motion),
            proportional_gain=np.array(self.proportional_gain),
            switching_gain=np.array(self.switching_gain),
            reaching_gain=np.array(self.reaching_gain),
            boundary_layer=np.maximum(np.array(self.boundary_layer), _SMALLEST_NORMAL),
            disturbance_centre=np.array(self.disturbance_centre),
        )


def reaching_time(
    sliding_variable: Array,
    switching_gain: Array,
    reaching_gain: Array,
    disturbance_bound: Array | float = 0.0,
) -> Array:
    """Longest time until the sliding variable first reaches zero.

    Args:
        sliding_variable: at the start, m/s, any shape.
        switching_gain: m/s^2, same shape.
        reaching_gain: 1/s, non-negative, same shape.
        disturbance_bound: on the disturbance's magnitude, m/s^2, same shape; its negative gives the
            shortest time instead.

    Returns:
        s, same shape; infinite where the disturbance can hold the variable away from zero.

    Source: the reaching law ds/dt = -switching_gain sign(s) - reaching_gain s, integrated.
    """
    distance = np.abs(np.asarray(sliding_variable, dtype=np.float64))
    authority = np.asarray(switching_gain, dtype=np.float64) - disturbance_bound
    rate = np.asarray(reaching_gain, dtype=np.float64)
    able = authority > 0.0
    linear = distance / np.where(able, authority, 1.0)
    exponent = rate * linear
    ratio = np.where(exponent > 0.0, np.log1p(exponent) / np.where(exponent > 0.0, exponent, 1.0), 1.0)
    time: Array = np.where(able, linear * ratio, np.where(distance > 0.0, np.inf, 0.0))
    return time


def boundary_layer_bounds(
    proportional_gain: Array,
    switching_gain: Array,
    reaching_gain: Array,
    boundary_layer: Array,
    disturbance_bound: Array | float,
) -> tuple[Array, Array]:
    """Largest final sliding variable and position error with a boundary layer.

    Args:
        proportional_gain: 1/s, any shape.
        switching_gain: m/s^2, same shape.
        reaching_gain: 1/s, same shape.
        boundary_layer: m/s, same shape.
        disturbance_bound: on the disturbance's magnitude, below the switching gain, m/s^2, same shape.

    Returns:
        Bounds on |s| (m/s) and on the position error (m), same shape.

    Source: Slotine & Li, Applied Nonlinear Control, ch. 7, for ds/dt linear inside the layer.
    """
    phi = np.asarray(boundary_layer, dtype=np.float64)
    stiffness = np.asarray(switching_gain, dtype=np.float64) + np.asarray(reaching_gain) * phi
    sliding = phi * disturbance_bound / stiffness
    return sliding, sliding / np.asarray(proportional_gain, dtype=np.float64)


def switching_ripple(switching_gain: Array, step: float) -> Array:
    """Size of the sampled sign law's chatter in the sliding variable.

    Args:
        switching_gain: m/s^2, any shape.
        step: control period over which the command is held, s.

    Returns:
        m/s, same shape: what the switching term alone adds in one period.
    """
    return np.asarray(switching_gain, dtype=np.float64) * step


def gain_warnings(
    spec: SlidingModeSpec, disturbance_bound: Array, disturbance_centre: Array | None = None
) -> list[str]:
    """Axes on which the disturbance can overpower the switching term.

    Args:
        spec: the gains.
        disturbance_bound: on the disturbance's magnitude, m/s^2, shape (3,).
        disturbance_centre: middle of the disturbance's lower and upper bound, m/s^2, shape (3,); zero
            when omitted.

    Returns:
        One sentence an axis, none when the surface is reached for certain.
    """
    centre = np.zeros(3) if disturbance_centre is None else np.asarray(disturbance_centre)
    residual = np.asarray(disturbance_bound) - np.abs(centre) + np.abs(centre - spec.disturbance_centre)
    return [
        f"switching_gain on axis {axis} is {gain:.6g} m/s^2, but the disturbance reaches {bound:.6g} m/s^2 "
        "about disturbance_centre; the sliding surface is not reached for certain"
        for axis, gain, bound in zip(_AXES, spec.switching_gain, residual, strict=True)
        if gain <= bound and bound > 0.0
    ]


def sampling_warnings(
    spec: SlidingModeSpec, step: float, jerk: float, feedforward_sample: Literal["midpoint", "start"]
) -> list[str]:
    """What holding the command over a control period costs, where it costs too much.

    Args:
        spec: the gains.
        step: control period, s.
        jerk: largest magnitude of the reference's jerk, m/s^3.
        feedforward_sample: where in the period the reference's acceleration is taken.

    Returns:
        One sentence for each thing that is wrong.
    """
    found = []
    gain = min(spec.switching_gain)
    lag = 0.5 * jerk * step
    if feedforward_sample == "start" and lag >= gain:
        found.append(
            f"the acceleration at the start of a {step:g} s period lags by up to {lag:.6g} m/s^2, which "
            f"switching_gain {gain:.6g} m/s^2 cannot overcome; use feedforward_sample: midpoint "
            "or a shorter step"
        )
    rate = max(spec.reaching_gain)
    if rate * step >= 2.0:
        found.append(
            f"reaching_gain {rate:.6g} 1/s times the step {step:g} s is {rate * step:.3g}; from 2 on the "
            "sampled law diverges"
        )
    return found
