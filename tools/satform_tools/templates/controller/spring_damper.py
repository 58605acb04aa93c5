# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A control law with a spring and a damper between the satellite and its reference."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.common.spec import PositivePerAxis
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Memoryless, Motion
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference


@dataclass(frozen=True)
class SpringDamper(Memoryless):
    """The control law; arrays of shape (..., 3), with satellites on the leading axes."""

    stiffness: Array  # 1/s^2
    damping: Array  # 1/s

    def act(self, motion: Motion, reference: Reference, memory: None, step: ControlStep) -> Action:
        spring = self.stiffness * (motion.position - reference.position)
        damper = self.damping * (motion.velocity - reference.velocity)
        return Action(-(spring + damper), np.zeros_like(spring))


class SpringDamperSpec(ControllerSpec):
    kind: Literal["spring_damper"] = "spring_damper"
    stiffness: PositivePerAxis = (1e-4, 1e-4, 1e-4)
    """Acceleration per position error, per axis, 1/s^2."""
    damping: PositivePerAxis = (2e-2, 2e-2, 2e-2)
    """Acceleration per velocity error, per axis, 1/s."""

    def build(self, setting: FlightSetting) -> SpringDamper:
        return SpringDamper(np.array(self.stiffness), np.array(self.damping))
