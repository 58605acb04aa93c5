# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Direction of the Sun in the chief's frame, step by step."""

from dataclasses import dataclass
from datetime import datetime

import numpy as np

from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief
from satform.orbits.frames import LvlhFrame
from satform.orbits.inertial_motion import unperturbed
from satform.orbits.sun import days_at, sun_direction


@dataclass(frozen=True)
class SunStates:
    """What the direction of the Sun in LVLH follows from.

    Attributes:
        epoch: date and time of time zero.
        chief: whose unperturbed orbit is the chief's where the truth model does not propagate one; None where
            it does.
    """

    epoch: datetime
    chief: KeplerianChief | None

    def at(self, time: float, frame: LvlhFrame | None) -> Array:
        """Unit vector from the Earth to the Sun, LVLH, shape (3,).

        Args:
            time: simulated, s.
            frame: of the chief by the truth model; None for one that does not know its chief.
        """
        if frame is None:
            assert self.chief is not None  # noqa: S101 - otherwise there is no plan of the Sun
            frame = unperturbed(self.chief, np.array([time]))
        direction = sun_direction(days_at(self.epoch) + time / 86400.0)
        return frame.vector_to_lvlh(direction).reshape(3)
