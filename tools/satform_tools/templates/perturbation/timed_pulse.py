# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""An acceleration that acts on all satellites for a while."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.common.spec import NonNegative, PerAxis, Positive
from satform.dynamics.prescribed_disturbances import PerturbationSetting, PerturbationSpec
from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class TimedPulse:
    """The perturbation: value (m/s^2, shape (N, 3)) from begin to end (s); step is the control period (s)."""

    value: Array
    begin: float
    end: float
    step: float

    def acceleration(self, step: int, offset: float) -> Array:
        time = step * self.step + offset
        return self.value if self.begin <= time < self.end else np.zeros_like(self.value)

    def bound(self) -> Array:
        return np.abs(self.value)

    def centre(self) -> Array:
        return 0.5 * self.value


class TimedPulseSpec(PerturbationSpec):
    kind: Literal["timed_pulse"] = "timed_pulse"
    value: PerAxis
    """Acceleration in LVLH, m/s^2."""
    begin: NonNegative = 0.0
    """Time at which it begins, s."""
    duration: Positive
    """Time for which it acts, s."""

    def build(self, setting: PerturbationSetting) -> TimedPulse:
        value = np.tile(np.array(self.value), (setting.satellite_count, 1))
        return TimedPulse(value, self.begin, self.begin + self.duration, setting.step)
