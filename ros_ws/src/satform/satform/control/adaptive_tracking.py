# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Adaptive tracking under unknown forces of the velocity and of a periodic phase, with a proved bound.

Equations: docs/controllers/adaptive_tracking.md.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from satform.common.spec import NonNegative, Positive
from satform.control.adaptive_approximation import (
    ApproximationSpec,
    Approximator,
    Frequency,
    PartitionOfUnitySpec,
)
from satform.control.anti_windup import Saturation
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Gap, Motion
from satform.dynamics.cw import NaturalAcceleration, natural_acceleration
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference


@dataclass(frozen=True)
class TrackingAdaptation:
    """Memory of the law.

    Attributes:
        weights: of the approximation of the unknown acceleration, m/s^2, shape (..., 3, m).
        values: of its functions in the step before, shape (..., 3, m); zero where there was none.
        integral: of the position error over time, m s, shape (..., 3).
        functions: numbers that tell which functions the weights belong to, shape (..., k).
    """

    weights: Array
    values: Array
    integral: Array
    functions: Array


@dataclass(frozen=True)
class AdaptiveTracking:
    """Feedback of a filtered error, and adaptation of the unknown acceleration.

    Attributes:
        error_rate: double pole of the error once the filtered error is zero, 1/s, shape (...).
        surface_gain: decay rate of the filtered error, 1/s, shape (...).
        approximator: functions that approximate the unknown acceleration.
        leakage: decay rate of the weights, 1/s, shape (...).
        weight_limit: largest magnitude of a weight, m/s^2, shape (...).
        frequency: of the periodic force, rad/s, shape (...).
        natural: acceleration of free relative motion, which is known; None for none.
        step: control period, s, shape (...).
        saturation: detects that the thrusters did not apply the last command.
    """

    error_rate: Array
    surface_gain: Array
    approximator: Approximator
    leakage: Array
    weight_limit: Array
    frequency: Array
    natural: NaturalAcceleration | None
    step: Array
    saturation: Saturation

    def start(self, motion: Motion) -> TrackingAdaptation:
        """Weights and integral of zero."""
        shape = motion.velocity.shape
        weights = np.zeros((*shape, self.approximator.rates.shape[-1]))
        own = self.approximator.functions
        functions = np.broadcast_to(own, (*shape[:-1], own.shape[-1])).copy()
        return TrackingAdaptation(weights, np.zeros_like(weights), np.zeros(shape), functions)

    def resume(self, memory: TrackingAdaptation, gap: Gap) -> TrackingAdaptation:
        """Weights and integral are kept; the step before the gap says nothing of the error after it."""
        return replace(memory, values=np.zeros_like(memory.values))

    def act(
        self, motion: Motion, reference: Reference, memory: TrackingAdaptation, step: ControlStep
    ) -> Action:
        """Command of one step, and the adapted weights.

        Weights are adapted by the error that they have led to, that of this step. On an axis on which
        saturated thrusters did not apply the last command, neither weights nor integral change.

        Args:
            motion: measured position and velocity, LVLH.
            reference: desired position and velocity, and acceleration in the middle of the step, LVLH.
            memory: weights, and the functions that they were multiplied by in the step before.
            step: with its time, and the acceleration that was applied instead of the last command.

        Returns:
            Commanded acceleration, the filtered error as sliding variable, the next memory.
        """
        memory = self._of_these_functions(memory, motion)
        duration, slope = self.step[..., None], self.error_rate[..., None]
        error = motion.position - reference.position
        rate = motion.velocity - reference.velocity
        filtered = rate + 2.0 * slope * error + slope * slope * memory.integral
        follows = self.saturation.shortfall(motion, step) == 0.0
        weights = np.where(follows[..., None], self._adapted(memory, filtered), memory.weights)

        half = 0.5 * duration
        velocity = motion.velocity + half * reference.acceleration
        phase = self.frequency * (step.time + 0.5 * self.step)
        values = self.approximator.values(velocity, phase, filtered)
        acceleration = (
            reference.acceleration
            - 2.0 * slope * rate
            - slope * slope * error
            - self.surface_gain[..., None] * filtered
            - _sum_of_products(weights, values)
        )
        if self.natural is not None:
            position = motion.position + half * motion.velocity
            acceleration = acceleration - self.natural.at(position, velocity)
        integral = memory.integral + np.where(follows, duration * error, 0.0)
        return Action(acceleration, filtered, TrackingAdaptation(weights, values, integral, memory.functions))

    def _of_these_functions(self, memory: TrackingAdaptation, motion: Motion) -> TrackingAdaptation:
        """The memory, with weights of zero where they belong to an approximation flown before."""
        own = self.approximator.functions
        if memory.functions.shape[-1] == own.shape[-1]:
            same = np.all(memory.functions == own, axis=-1)
            if np.all(same):
                return memory
        else:
            same = np.zeros(motion.velocity.shape[:-1], dtype=np.bool_)
        begun = self.start(motion)
        if memory.weights.shape != begun.weights.shape:
            return replace(begun, integral=memory.integral)
        kept = same[..., None, None]
        return TrackingAdaptation(
            np.where(kept, memory.weights, begun.weights),
            np.where(kept, memory.values, begun.values),
            memory.integral,
            begun.functions,
        )

    def _adapted(self, memory: TrackingAdaptation, filtered: Array) -> Array:
        """Weights after the step before, within their limits, m/s^2, shape (..., 3, m)."""
        duration, leak = self.step[..., None, None], self.leakage[..., None, None]
        gain = duration * self.approximator.rates[..., None, :]
        moved = memory.weights - duration * leak * memory.weights + gain * memory.values * filtered[..., None]
        limit = self.weight_limit[..., None, None]
        return np.minimum(np.maximum(moved, -limit), limit)


def _sum_of_products(weights: Array, values: Array) -> Array:
    product = weights * values
    total: Array = product[..., 0]
    for index in range(1, product.shape[-1]):
        total = total + product[..., index]
    return total


class AdaptiveTrackingSpec(ControllerSpec):
    """Tracking under an unknown acceleration that depends on the velocity and, periodically, on time."""

    kind: Literal["adaptive_tracking"] = "adaptive_tracking"
    error_rate: Positive = 0.2
    """Rate at which the position error decays once the filtered error is zero, 1/s."""
    surface_gain: Positive = 1.0
    """Decay rate of the filtered error, 1/s."""
    approximation: ApproximationSpec = PartitionOfUnitySpec()
    """Functions that approximate the unknown acceleration on each axis."""
    weight_rate: NonNegative = 5.0
    """Adaptation rate of the weights, 1/s^2; zero for none."""
    leakage_rate: NonNegative = 0.01
    """Decay rate of the weights (sigma-modification), 1/s."""
    weight_limit: Positive = 5.0
    """Largest magnitude of a weight (projection), m/s^2."""
    angular_frequency: Frequency | None = None
    """Known angular frequency of the periodic force, rad/s; the chief's mean motion when left out."""
    natural_motion: Literal["cw", "none"] = "cw"
    """Known acceleration of free relative motion that the command cancels: that of Clohessy and Wiltshire, or
    none."""

    def assumes_circular_chief(self) -> bool:
        """It does where free relative motion is cancelled."""
        return self.natural_motion == "cw"

    def build(self, setting: FlightSetting) -> AdaptiveTracking:
        """The law.

        Raises:
            ValueError: the step is too long for the gains.
        """
        built = AdaptiveTracking(
            error_rate=np.asarray(self.error_rate),
            surface_gain=np.asarray(self.surface_gain),
            approximator=self.approximation.build(self.weight_rate),
            leakage=np.asarray(self.leakage_rate),
            weight_limit=np.asarray(self.weight_limit),
            frequency=np.asarray(
                setting.mean_motion if self.angular_frequency is None else self.angular_frequency,
                dtype=np.float64,
            ),
            natural=natural_acceleration(setting.mean_motion) if self.natural_motion == "cw" else None,
            step=np.asarray(setting.step, dtype=np.float64),
            saturation=Saturation.of(setting),
        )
        for name, rate in (("error_rate", self.error_rate), ("leakage_rate", self.leakage_rate)):
            if rate * setting.step >= 1.0:
                raise ValueError(
                    f"adaptive_tracking: {name} {rate:g} 1/s needs a step below {1.0 / rate:g} s, got "
                    f"{setting.step:g} s"
                )
        if not decay_margin(built) > 0.0:
            adapted = setting.step * built.approximator.largest_rate()
            allowed = self.surface_gain * (2.0 - self.surface_gain * setting.step)
            raise ValueError(
                f"adaptive_tracking: with steps of {setting.step:g} s the filtered error does not decay for "
                f"certain: step times adaptation rates, {adapted:.4g} 1/s, has to be below surface_gain "
                f"times (2 - surface_gain times step), {allowed:.4g} 1/s; shorten the step or lower the rates"
            )
        return built

    def linearisation(self, setting: FlightSetting) -> Array:
        """The loop of one axis at a constant velocity and phase, at which adaptation is fastest."""
        law, h = self.build(setting), setting.step
        slope, rate = self.error_rate, law.approximator.largest_rate()
        filtered = np.array([2.0 * slope, 1.0, slope * slope, 0.0])
        compensation = (1.0 - self.leakage_rate * h) * np.eye(4)[3] + h * rate * filtered
        command = (
            np.array([-slope * slope, -2.0 * slope, 0.0, 0.0]) - self.surface_gain * filtered - compensation
        )
        transition = np.eye(4)
        transition[0, 1], transition[2, 0] = h, h
        transition[0] += 0.5 * h * h * command
        transition[1] += h * command
        transition[3] = compensation
        return transition


def decay_margin(law: AdaptiveTracking) -> float:
    """Rate at which the filtered error decays for certain whatever the weights are, 1/s.

    Args:
        law: of one satellite.

    Returns:
        Rate kappa of the page of equations; not positive if held commands with this adaptation need not
        decay.
    """
    gain, step = float(law.surface_gain), float(law.step)
    return gain * (1.0 - 0.5 * gain * step) - 0.5 * step * law.approximator.largest_rate()


@dataclass(frozen=True)
class UltimateBounds:
    """What the errors on an axis do not exceed in the end.

    Attributes:
        filtered_error: largest, m/s.
        mean_filtered_error: root mean square over a long time, m/s.
        position_error: largest, m.
        mean_position_error: root mean square over a long time, m.
    """

    filtered_error: float
    mean_filtered_error: float
    position_error: float
    mean_position_error: float


def ultimate_bounds(
    law: AdaptiveTracking, residual: float, weights: Array, acceleration_error: float = 0.0
) -> UltimateBounds:
    """Bounds on an axis for an unknown acceleration that some weights approximate.

    Args:
        law: of one satellite.
        residual: largest magnitude of what these weights leave of the unknown acceleration, with the changes
            of accelerations within a step, m/s^2.
        weights: within the law's limit, m/s^2, shape (m,).
        acceleration_error: largest difference of acceleration and desired acceleration, by which the
            velocity changes within a step, m/s^2.

    Returns:
        The bounds; infinite without leakage where the projection gives none.

    Raises:
        ValueError: a weight exceeds the law's limit, or is not zero although it is not adapted.

    Source: Ioannou & Sun, Robust Adaptive Control, ch. 8, for leakage and projection; for held commands the
    proof is on the page of equations.
    """
    limit, step, leak = float(law.weight_limit), float(law.step), float(law.leakage)
    if not np.all(np.abs(weights) <= limit):
        raise ValueError(
            f"a weight of {float(np.max(np.abs(weights))):g} m/s^2 exceeds the limit of {limit:g}"
        )
    if np.any(weights[law.approximator.rates == 0.0]):
        raise ValueError("weights that are not adapted have to be zero")
    margin, slope = decay_margin(law), float(law.error_rate)
    rates = law.approximator.rates
    adapted = rates > 0.0
    distance = float(np.sum(weights[adapted] ** 2 / rates[adapted]))
    furthest = float(np.sum((limit + np.abs(weights[adapted])) ** 2 / rates[adapted]))
    most = math.sqrt(len(weights)) * limit * math.sqrt(law.approximator.largest_square())
    push = residual + leak * step * most
    growth = push * push / (2.0 * margin) + 0.5 * leak * distance
    kept = 1.0 + step * margin
    by_leakage = growth / min(margin / kept, leak) if leak > 0.0 else math.inf
    by_projection = growth * kept / margin + 0.5 * furthest
    largest = math.sqrt(2.0 * min(by_leakage, by_projection) / kept)
    mean = math.sqrt(2.0 * growth / margin)
    kept, between = 1.0 - slope * step, 0.5 * step * acceleration_error
    return UltimateBounds(
        filtered_error=largest,
        mean_filtered_error=mean,
        position_error=2.0 / (math.e * slope * kept) * (largest + between),
        mean_position_error=(mean + between) / (2.0 * slope * math.sqrt(kept)),
    )
