# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Motion sharing: satellites send their position and velocity to their neighbours, without consensus.

Equations: docs/controllers/consensus.md.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from satform.consensus.arc_length import Announces, ConsensusSpec
from satform.control.protocol import Motion, RelativeNeighbour
from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class MotionMessage:
    """Position and velocity that a satellite sends to its out-neighbours.

    Attributes:
        time: simulated time of validity, s, shape (...).
        position: measured or estimated, LVLH, m, shape (..., 3).
        velocity: measured or estimated, LVLH, m/s, shape (..., 3).
    """

    time: Array
    position: Array
    velocity: Array


@dataclass(frozen=True)
class NeighbourMotion:
    """Newest motion received from the one in-neighbour that a satellite follows.

    Attributes:
        position: of the neighbour at the stamp, LVLH, m, shape (..., 3).
        velocity: of the neighbour at the stamp, LVLH, m/s, shape (..., 3).
        stamp: simulated time to which both belong, s, shape (...).
        weight: 1 while the newest message is valid, 0 after the neighbour timeout, shape (...).
    """

    position: Array
    velocity: Array
    stamp: Array
    weight: Array


@dataclass(frozen=True)
class MotionSharing:
    """Exchange of position and velocity; each satellite follows its one in-neighbour.

    Attributes:
        neighbour_timeout: age of the newest message beyond which the neighbour is not followed, s,
            shape (...).
    """

    neighbour_timeout: Array | float = math.inf

    def observed(self, motion: Motion, neighbour_states: NeighbourMotion, time: float) -> RelativeNeighbour:
        """Relative motion of a satellite to its neighbour.

        Args:
            motion: own position and velocity now, LVLH, shape (..., 3) each.
            neighbour_states: from the neighbour.
            time: simulated, s.

        Returns:
            Own motion minus the neighbour's, which is extrapolated at the received velocity.
        """
        elapsed = (time - neighbour_states.stamp)[..., None]
        position = motion.position - (neighbour_states.position + elapsed * neighbour_states.velocity)
        return RelativeNeighbour(position, motion.velocity - neighbour_states.velocity)


class MotionSharingSpec(ConsensusSpec):
    """Satellites send position and velocity to their out-neighbours; there is no consensus."""

    announces: ClassVar[Announces] = "motion"

    kind: Literal["motion"] = "motion"

    def build(self) -> MotionSharing:
        """The sharing itself."""
        return MotionSharing(np.asarray(self.neighbour_timeout))
