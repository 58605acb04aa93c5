# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Luenberger observer: another control law on the state estimated from measured positions.

Equations: docs/controllers/lqr.md.
"""

import functools
import math
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from satform.common.spec import Positive, Vector
from satform.control.feedback_linearisation import FeedbackLinearisationSpec
from satform.control.lqi import LqiSpec
from satform.control.lqr import LqrSpec
from satform.control.protocol import (
    Action,
    Controller,
    ControllerSpec,
    ControlStep,
    FlightSetting,
    Gap,
    Motion,
)
from satform.dynamics import cw
from satform.dynamics.linear import multiply, position_matrix
from satform.dynamics.relative_motion_models import ModelName
from satform.dynamics.stepwise_model import StepwiseModel, stepwise_model
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference

DecayRates = tuple[Positive, Positive, Positive, Positive, Positive, Positive]


def observer_gain(transition: Array, eigenvalues: tuple[float, ...]) -> Array:
    """Observer gain that gives the estimation error the wanted eigenvalues.

    Works on a continuous state matrix with eigenvalues in 1/s as on the transition matrix of one
    step with eigenvalues inside the unit circle. The gain is not unique; its spectrum is.

    Args:
        transition: state or transition matrix, shape (6, 6).
        eigenvalues: six distinct real eigenvalues of transition - gain times output matrix.

    Returns:
        Gain, shape (6, 3).

    Raises:
        ValueError: the eigenvalues cannot be placed.

    Source: Luenberger 1971; pole placement by Tits & Yang 1996.
    """
    from scipy.signal import place_poles  # noqa: PLC0415  slow to import, and not needed in flight

    gain: Array = place_poles(transition.T, position_matrix().T, np.asarray(eigenvalues)).gain_matrix.T
    return gain


@functools.lru_cache(maxsize=256)
def _designed(mean_motion: float, step: float, decay_rates: DecayRates) -> Array:
    """Observer gain over one control period, shape (6, 3); not to be changed, as others are given it, too."""
    eigenvalues = tuple(float(np.exp(-rate * step)) for rate in decay_rates)
    return observer_gain(cw.transition_matrix(mean_motion, step), eigenvalues)


@dataclass(frozen=True)
class ObserverMemory:
    """Memory of the observer.

    Attributes:
        position: estimated before this step's measurement is used, LVLH, m, shape (..., 3).
        velocity: estimated likewise, LVLH, m/s, shape (..., 3).
        law: memory of the control law that flies on the estimate.
        commanded: acceleration with which the estimate was carried to this step, m/s^2, shape (..., 3).
    """

    position: Array
    velocity: Array
    law: Any
    commanded: Array


@dataclass(frozen=True)
class Observed:
    """A control law fed by an observer of the position measurements.

    The measured velocity is not used after the start.

    Attributes:
        law: control law that flies on the estimate.
        model: motion about a circular chief over one step with the command held.
        motion: likewise about a chief of any eccentricity, which takes the place of `model`; None for none.
        position_gain: correction of the position per unit of its miss, shape (..., 3, 3).
        velocity_gain: correction of the velocity per unit of the position's miss, 1/s, (..., 3, 3).
        initial_position_error: of the first estimate, m, shape (..., 3).
        initial_velocity_error: of the first estimate, m/s, shape (..., 3).
        decay_rate: mean of the estimation error's decay rates, 1/s, shape (...).
    """

    law: Controller
    model: cw.HeldInputStep
    motion: StepwiseModel | None
    position_gain: Array
    velocity_gain: Array
    initial_position_error: Array
    initial_velocity_error: Array
    decay_rate: Array

    def start(self, motion: Motion) -> ObserverMemory:
        """First estimate: the state handed over plus the chosen error.

        Args:
            motion: position and velocity at the first step, LVLH.

        Returns:
            The estimate, and the first memory of the law on it.
        """
        position = motion.position + self.initial_position_error
        velocity = motion.velocity + self.initial_velocity_error
        law = self.law.start(Motion(position, velocity))
        return ObserverMemory(position, velocity, law, np.zeros_like(position))

    def resume(self, memory: ObserverMemory, gap: Gap) -> ObserverMemory:
        """The estimate propagated over the gap, and corrected with the gain of a measurement so rare.

        The estimate is carried through the gap by the model with what was applied in it. The gains of `act`
        belong to a measurement at each step: they would take what the model missed in a long gap for a
        velocity gained within one step. The first measurement after the gap is worked in with the gains that
        a double integrator, measured once in the duration T of the gap, needs for the same decay: with
        z = exp(-decay rate T) these are 1 - z^2 for the position and (1 - z)^2 / T for the velocity, which
        goes from the usual small correction to the position as measured and the mean velocity since.

        Args:
            memory: estimate for the first step of the gap.
            gap: the steps, with the measurement after them.

        Returns:
            The estimate for the first step after it; the law's own memory as that law resumes it.

        Source: Franklin, Powell & Workman, Digital Control of Dynamic Systems, ch. 8 (current estimators),
        for a double integrator with both poles at z.
        """
        position, velocity = memory.position, memory.velocity
        for number in range(gap.first, gap.first + gap.count):
            position, velocity = self._advanced(position, velocity, gap.applied_acceleration, number)
        duration = (gap.count + 1) * gap.length
        remaining = self.held_errors(duration)[..., None]
        miss = gap.motion.position - position
        corrected = 1.0 - remaining
        position = position + (1.0 - remaining * remaining) * miss
        velocity = velocity + (corrected * corrected / duration) * miss
        law = memory.law
        if law is not None:
            law = self.law.resume(law, replace(gap, motion=Motion(position, velocity)))
        return ObserverMemory(position, velocity, law, gap.applied_acceleration)

    def held_errors(self, duration: float) -> Array:
        """Share of an estimation error that is left after a duration in s, shape (...)."""
        left = [math.exp(-rate * duration) for rate in np.ravel(self.decay_rate).tolist()]
        return np.asarray(left, dtype=np.float64).reshape(np.shape(self.decay_rate))

    def _advanced(
        self, position: Array, velocity: Array, acceleration: Array, number: int
    ) -> tuple[Array, Array]:
        """Position and velocity at the end of the step of a number, with an acceleration held over it."""
        if self.motion is None:
            return self.model.advance(position, velocity, acceleration)
        own = self.motion.over(number)
        state = multiply(own.transition, np.concatenate((position, velocity), axis=-1))
        state = state + multiply(own.response, acceleration)
        return state[..., :3], state[..., 3:]

    def _corrected(self, memory: ObserverMemory, applied: Array | None, number: int) -> tuple[Array, Array]:
        """The estimate for the step of a number, with what was applied before it instead of the command."""
        position, velocity = memory.position, memory.velocity
        if applied is None:
            return position, velocity
        missing = applied - memory.commanded
        rest = np.zeros_like(position)
        moved, gained = self._advanced(rest, rest, missing, number - 1)
        return position + moved, velocity + gained

    def act(self, motion: Motion, reference: Reference, memory: ObserverMemory, step: ControlStep) -> Action:
        """Command from the estimate, and the estimate carried to the next step.

        Args:
            motion: measured position, LVLH; the velocity is ignored.
            reference: desired position, velocity and acceleration, LVLH.
            memory: estimate for this step, made with the command of the step before.
            step: with the acceleration that was applied instead of that command; corrects the estimate.

        Returns:
            The law's action with the next estimate as memory.

        Source: Luenberger 1971, in discrete time, so that the estimate is free of bias between samples.
        """
        position, velocity = self._corrected(memory, step.applied_acceleration, step.number)
        action = self.law.act(Motion(position, velocity), reference, memory.law, step)
        miss = motion.position - position
        position, velocity = self._advanced(position, velocity, action.acceleration, step.number)
        position = position + multiply(self.position_gain, miss)
        velocity = velocity + multiply(self.velocity_gain, miss)
        estimate = ObserverMemory(position, velocity, action.memory, action.acceleration)
        return Action(action.acceleration, action.sliding_variable, estimate)


class ObserverSpec(ControllerSpec):
    """A control law on the state estimated from measured positions."""

    kind: Literal["observer"] = "observer"
    law: Annotated[LqrSpec | LqiSpec | FeedbackLinearisationSpec, Field(discriminator="kind")] = LqrSpec()
    """Control law that uses the estimated position and velocity."""
    model: ModelName = "cw"
    """Relative motion by which the estimate is carried from step to step: cw about a circular chief,
    yamanaka_ankersen about an eccentric one, j2_elements also under the Earth's oblateness."""
    decay_rates: DecayRates = (0.050, 0.052, 0.054, 0.056, 0.058, 0.060)
    """Observer poles: decay rates of the estimation error, real and distinct, 1/s."""
    initial_position_error: Vector = (0.0, 0.0, 0.0)
    """Error of the first estimated position, LVLH, m."""
    initial_velocity_error: Vector = (0.0, 0.0, 0.0)
    """Error of the first estimated velocity, LVLH, m/s."""

    def assumes_circular_chief(self) -> bool:
        """It does with the model `cw`, and with a law on it that does."""
        return self.model == "cw" or self.law.assumes_circular_chief()

    def build(self, setting: FlightSetting) -> Observed:
        """The law and its observer.

        Raises:
            ValueError: two decay rates coincide, the law's gains cannot fly, or the model does not know the
                chief's orbit.
        """
        if len(set(self.decay_rates)) < len(self.decay_rates):
            raise ValueError(f"observer: decay_rates have to differ from each other, got {self.decay_rates}")
        gain = _designed(setting.mean_motion, setting.step, self.decay_rates)
        return Observed(
            law=self.law.build(setting),
            model=cw.HeldInputStep.over(setting.mean_motion, setting.step),
            motion=stepwise_model(self.model, setting.chief, setting.step),
            position_gain=gain[:3].copy(),
            velocity_gain=gain[3:].copy(),
            initial_position_error=np.array(self.initial_position_error),
            initial_velocity_error=np.array(self.initial_velocity_error),
            decay_rate=np.asarray(sum(self.decay_rates) / len(self.decay_rates)),
        )
