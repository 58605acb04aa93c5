# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages between satellites, as data and as the plain numbers that are sent."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from satform.consensus.arc_length import Announces, NeighbourPhases
from satform.consensus.motion_sharing import MotionMessage, NeighbourMotion
from satform.numeric.elementwise import Array, joined


@dataclass(frozen=True)
class PhaseMessage:
    """Phase that a satellite sends its neighbours: how far it has come along its orbit.

    Attributes:
        time: simulated moment at which the values hold, s, shape (...).
        arc_length: generalised arc length less the satellite's phase offset, m, shape (...).
        rate: of the generalised arc length, m/s, shape (...).
    """

    time: Array
    arc_length: Array
    rate: Array


NeighbourMessage: TypeAlias = PhaseMessage | MotionMessage
NeighbourStates: TypeAlias = NeighbourPhases | NeighbourMotion

WIDTH: dict[Announces, int] = {"arc_length": 2, "motion": 6}
"""How many numbers an announcement has beside its time."""

AROUND_NUMBERS: dict[Announces, tuple[tuple[int, ...], tuple[float, ...]]] = {
    "arc_length": ((), ()),
    "motion": ((0,), (0.0, 0.0, 0.0)),
}
"""Fields of a neighbour message before its numbers (the formation version) and after them (the applied
acceleration), by its kind; only the plant fills these in."""


def encode(message: NeighbourMessage) -> Array:
    """The numbers of an announcement beside its time, shape (..., width)."""
    if isinstance(message, PhaseMessage):
        return joined(message.arc_length, message.rate)
    return np.concatenate((message.position, message.velocity), axis=-1)


def decode(announces: Announces, values: Array, stamp: Array, weight: Array) -> NeighbourStates:
    """What a satellite receives, from the values that its neighbours sent.

    Args:
        announces: what they send.
        values: numbers of each neighbour, shape (..., K, width or more); an estimate may follow.
        stamp: simulated time to which they belong, s, shape (..., K).
        weight: 1 for a neighbour that counts, 0 for padding, shape (..., K).

    Returns:
        All neighbours' phases; or the motion of the single in-neighbour.
    """
    if announces == "arc_length":
        return NeighbourPhases(values[..., 0], values[..., 1], stamp, weight)
    return NeighbourMotion(values[..., 0, :3], values[..., 0, 3:6], stamp[..., 0], weight[..., 0])
