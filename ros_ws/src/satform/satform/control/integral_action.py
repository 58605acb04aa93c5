# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Integral action added to another control law that follows a reference; removes its steady offset.

Equations: docs/controllers/lqr.md.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from satform.common.spec import NonNegativePerAxis, PositivePerAxis
from satform.control.anti_windup import Saturation
from satform.control.feedback_linearisation import FeedbackLinearisationSpec
from satform.control.lqr import LqrSpec
from satform.control.observer import ObserverSpec
from satform.control.protocol import (
    Action,
    Controller,
    ControllerSpec,
    ControlStep,
    FlightSetting,
    Gap,
    Motion,
)
from satform.control.relative_elements import ElementControlSpec
from satform.control.sampled_stability import closed_loop, require_stable_hold
from satform.control.sliding_mode import SlidingModeSpec
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference


@dataclass(frozen=True)
class IntegralMemory:
    """Memory of integral action.

    Attributes:
        acceleration: that it adds to the law's command, m/s^2, shape (..., 3).
        law: memory of the law beside it.
    """

    acceleration: Array
    law: Any


@dataclass(frozen=True)
class IntegralAction:
    """A control law whose command is joined by the integral of the measured position error.

    Attributes:
        law: the law beside it.
        growth: of the acceleration in one step for each metre of error, 1/s^2, shape (..., 3).
        limit: largest magnitude of the acceleration, m/s^2, shape (..., 3).
        integration_band: largest magnitude of an error that is integrated, m, shape (..., 3).
        saturation: detects that the thrusters did not apply the last command.
        stops: 1 for conditional integration while they are saturated, else 0, shape (...).
    """

    law: Controller
    growth: Array
    limit: Array
    integration_band: Array
    saturation: Saturation
    stops: Array

    def start(self, motion: Motion) -> IntegralMemory:
        """The added acceleration starts at zero.

        Args:
            motion: position and velocity at the first step, LVLH.

        Returns:
            Zero, and the law's own memory.
        """
        return IntegralMemory(np.zeros_like(motion.position), self.law.start(motion))

    def resume(self, memory: IntegralMemory, gap: Gap) -> IntegralMemory:
        """The integral is kept, since it compensates a lasting disturbance; nothing is integrated in the gap.

        The law's own memory is resumed as that law does it.
        """
        law = None if memory.law is None else self.law.resume(memory.law, gap)
        return replace(memory, law=law)

    def act(self, motion: Motion, reference: Reference, memory: IntegralMemory, step: ControlStep) -> Action:
        """The law's command plus the integral, which then grows by this step's error.

        On each axis nothing is integrated while the error is outside the integration band, as on the way to
        a distant reference, and the integral is limited. It does not grow either in the direction in which
        saturated thrusters applied less than commanded.

        Args:
            motion: measured position and velocity, LVLH.
            reference: desired position, velocity and acceleration, LVLH.
            memory: of the integral and of the law.
            step: with the acceleration that was applied instead of the last command.

        Returns:
            Commanded acceleration with the law's sliding variable.

        Source: Astrom & Hagglund, Advanced PID Control, ch. 3: integral action, conditional integration.
        """
        action = self.law.act(motion, reference, memory.law, step)
        error = motion.position - reference.position
        growth = -(self.growth * np.where(np.abs(error) <= self.integration_band, error, 0.0))
        lacking = self.saturation.shortfall(motion, step)
        winds_up = (lacking * growth > 0.0) & (self.stops[..., None] > 0.0)
        grown = memory.acceleration + np.where(winds_up, 0.0, growth)
        bounded = np.minimum(np.maximum(grown, -self.limit), self.limit)
        return Action(
            action.acceleration + memory.acceleration,
            action.sliding_variable,
            IntegralMemory(bounded, action.memory),
        )


FollowingLaw = Annotated[
    LqrSpec | FeedbackLinearisationSpec | SlidingModeSpec | ElementControlSpec | ObserverSpec,
    Field(discriminator="kind"),
]


class IntegralSpec(ControllerSpec):
    """Integral action added to a law that follows a reference: no steady offset under a constant disturbance.

    For a regulator, `lqi` has the optimal gain. With an observer the measured position is integrated, so
    that the bias of an estimate without the disturbance is removed too. With `relative_elements` use it on
    the z axis only: in the orbital plane a constant disturbance drives free motion in the opposite sense, so
    that integral action is unstable.
    """

    kind: Literal["integral"] = "integral"
    law: FollowingLaw = LqrSpec()
    """Law to which it is added; has to be stable with it."""
    gain: NonNegativePerAxis = (1e-7, 1e-7, 1e-7)
    """Growth of the added acceleration per metre of position error, per axis, 1/s^3; 0 for none."""
    limit: PositivePerAxis = (0.01, 0.01, 0.01)
    """Largest added acceleration, per axis, m/s^2; a constant disturbance beyond it leaves an offset."""
    integration_band: PositivePerAxis = (1000.0, 1000.0, 1000.0)
    """Largest position error that is integrated, per axis, m; larger than the offset to be removed."""
    anti_windup: Literal["conditional_integration", "none"] = "conditional_integration"
    """conditional_integration: on each axis the integral does not grow in the direction in which saturated
    thrusters apply less than commanded; none: it grows."""

    def assumes_circular_chief(self) -> bool:
        """It does if the law beside it does."""
        return self.law.assumes_circular_chief()

    def build(self, setting: FlightSetting) -> IntegralAction:
        """The law with integral action.

        Raises:
            ValueError: the law's own gains cannot fly, or its loop does not decay with this integral gain.
                A law that is not linear close to its reference, as sliding mode without a boundary layer,
                is not checked.
        """
        built = IntegralAction(
            law=self.law.build(setting),
            growth=np.asarray(self.gain, dtype=np.float64) * setting.step,
            limit=np.asarray(self.limit, dtype=np.float64),
            integration_band=np.asarray(self.integration_band, dtype=np.float64),
            saturation=Saturation.of(setting),
            stops=np.asarray(float(self.anti_windup == "conditional_integration")),
        )
        loop = closed_loop(built, setting)
        if loop is not None:
            # The integral of an axis without gain stays at zero, and is no part of the loop.
            idle = 6 + np.flatnonzero(built.growth == 0.0)
            loop = np.delete(np.delete(loop, idle, axis=0), idle, axis=1)
            require_stable_hold(loop, f"integral beside {self.law.kind}", setting.step)
        return built
