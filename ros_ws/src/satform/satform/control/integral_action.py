"""Integral action beside any control law that follows a reference: its steady offset goes away."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from satform.control.hill_pd import HillPdSpec
from satform.control.loop import closed_loop
from satform.control.lqr import LqrSpec
from satform.control.observer import ObserverSpec
from satform.control.protocol import Action, Controller, ControllerSpec, FlightSetting, Motion
from satform.control.roe import ElementControlSpec
from satform.control.sampling import require_stable_hold
from satform.control.sliding_mode import SlidingModeSpec
from satform.elementwise import Array
from satform.reference import Reference
from satform.spec import NonNegativePerAxis, PositivePerAxis


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
        reach: largest magnitude of an error that is integrated, m, shape (..., 3).
    """

    law: Controller
    growth: Array
    limit: Array
    reach: Array

    def start(self, motion: Motion) -> IntegralMemory:
        """Nothing is added until an error has lasted.

        Args:
            motion: position and velocity at the first step, LVLH.

        Returns:
            Zero, and the law's own memory.
        """
        return IntegralMemory(np.zeros_like(motion.position), self.law.start(motion))

    def act(self, motion: Motion, reference: Reference, memory: IntegralMemory) -> Action:
        """The law's command with what has been integrated, which grows by this step's error.

        On each axis the integral stands still while the error is out of reach, as on the way to a distant
        reference, and stops at its limit; so it has little to unwind once the satellite arrives or a
        disturbance that was too large has gone.

        Args:
            motion: measured position and velocity, LVLH.
            reference: desired position, velocity and acceleration, LVLH.
            memory: of the integral and of the law.

        Returns:
            Commanded acceleration with the law's sliding variable.

        Source: Astrom & Hagglund, Advanced PID Control, ch. 3: integral action, conditional integration.
        """
        action = self.law.act(motion, reference, memory.law)
        error = motion.position - reference.position
        grown = memory.acceleration - self.growth * np.where(np.abs(error) <= self.reach, error, 0.0)
        bounded = np.minimum(np.maximum(grown, -self.limit), self.limit)
        return Action(
            action.acceleration + memory.acceleration,
            action.sliding_variable,
            IntegralMemory(bounded, action.memory),
        )


FollowingLaw = Annotated[
    LqrSpec | HillPdSpec | SlidingModeSpec | ElementControlSpec | ObserverSpec, Field(discriminator="kind")
]


class IntegralSpec(ControllerSpec):
    """Integral action beside a law that follows a reference: under a constant disturbance no offset stays.

    The best gain for a regulator alone is that of `lqi`. Around an observer it takes the measured position,
    so that the bias of an estimate that knows nothing of the disturbance goes away too. `relative_elements`
    takes it across the orbital plane alone: in the plane it leaves the answer to a steady push to free
    motion, which answers the other way, so that integral action would drive the satellite off.
    """

    kind: Literal["integral"] = "integral"
    law: FollowingLaw = LqrSpec()
    """Law beside it, which has to be stable with it."""
    gain: NonNegativePerAxis = (1e-7, 1e-7, 1e-7)
    """Growth of the added acceleration for each metre of position error, per axis, 1/s^3; 0 leaves an axis
    to the law alone."""
    limit: PositivePerAxis = (0.01, 0.01, 0.01)
    """Largest added acceleration, per axis, m/s^2; a constant disturbance beyond it leaves an offset."""
    reach: PositivePerAxis = (1000.0, 1000.0, 1000.0)
    """Largest position error that is integrated, per axis, m; has to exceed the offset that is to go."""

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
            reach=np.asarray(self.reach, dtype=np.float64),
        )
        loop = closed_loop(built, setting)
        if loop is not None:
            # The integral of an axis without gain stays at zero, and is no part of the loop.
            idle = 6 + np.flatnonzero(built.growth == 0.0)
            loop = np.delete(np.delete(loop, idle, axis=0), idle, axis=1)
            require_stable_hold(loop, f"integral beside {self.law.kind}", setting.step)
        return built
