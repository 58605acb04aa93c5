# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""No control: the satellite moves freely under the truth model."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Memoryless, Motion
from satform.orbits.path_reference import Reference


@dataclass(frozen=True)
class Coast(Memoryless):
    """The law that commands zero, of one satellite or of many."""

    def act(self, motion: Motion, reference: Reference, memory: Any, step: ControlStep) -> Action:
        """Zero command and zero sliding variable, shape (..., 3); arguments as in `Controller.act`."""
        still = np.zeros_like(motion.position)
        return Action(still, still)


class CoastSpec(ControllerSpec):
    """No thrust: free motion under the truth model."""

    kind: Literal["coast"] = "coast"

    def linearisation(self, setting: FlightSetting) -> str:
        """No loop is closed."""
        return "which commands nothing"

    def build(self, setting: FlightSetting) -> Coast:
        """The law itself."""
        return Coast()
