# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Motion sharing: satellites send their position and velocity to their neighbours, without consensus.

Equations: docs/controllers/consensus.md.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from satform.consensus.arc_length import Announces, ConsensusSpec
from satform.control.protocol import Motion, RelativeNeighbour
from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class MotionAnnouncement:
    """Where a satellite tells its listeners that it is.

    Attributes:
        time: simulated moment at which the motion was so, s, shape (...).
        position: as the satellite believes, LVLH, m, shape (..., 3).
        velocity: as the satellite believes, LVLH, m/s, shape (..., 3).
    """

    time: Array
    position: Array
    velocity: Array


@dataclass(frozen=True)
class HeardMotion:
    """What a satellite last heard from the one neighbour that it follows.

    Attributes:
        position: of the neighbour when it spoke, LVLH, m, shape (..., 3).
        velocity: of the neighbour when it spoke, LVLH, m/s, shape (..., 3).
        stamp: simulated time to which both belong, s, shape (...).
        weight: 1 while the neighbour's word counts, 0 once it has been silent for too long, shape (...).
    """

    position: Array
    velocity: Array
    stamp: Array
    weight: Array


@dataclass(frozen=True)
class MotionSharing:
    """Telling each other the own position and velocity; each satellite follows the one that it hears.

    Attributes:
        drop_after: age of a neighbour's word from which on it no longer counts, s.
    """

    drop_after: float = math.inf

    def seen(self, motion: Motion, heard: HeardMotion, time: float) -> RelativeNeighbour:
        """The neighbour as seen from the satellite.

        Args:
            motion: own position and velocity now, LVLH, shape (..., 3) each.
            heard: from the neighbour.
            time: simulated, s.

        Returns:
            Own motion minus the neighbour's, which is carried on at the velocity it was heard with.
        """
        elapsed = (time - heard.stamp)[..., None]
        position = motion.position - (heard.position + elapsed * heard.velocity)
        return RelativeNeighbour(position, motion.velocity - heard.velocity)


class MotionSharingSpec(ConsensusSpec):
    """Satellites tell their listeners their position and velocity; nothing is agreed on."""

    announces: ClassVar[Announces] = "motion"

    kind: Literal["motion"] = "motion"

    def build(self) -> MotionSharing:
        """The sharing itself."""
        return MotionSharing(self.drop_after)
