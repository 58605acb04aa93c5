# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Newest message from each neighbour, stored until a newer one is received."""

from dataclasses import dataclass

import numpy as np

from satform.numeric.elementwise import Array, column


@dataclass(frozen=True)
class Received:
    """What arrives at a satellite in one step, from each of its K possible neighbours.

    Attributes:
        values: numbers of each announcement, shape (..., K, width); any finite number where none came.
        stamp: simulated time to which they belong, s, shape (..., K).
        fresh: 1 where an announcement arrived in this step, else 0, shape (..., K).
        linked: 1 where the communication graph has the edge in this step, else 0, shape (..., K).
        complete: whether a message sent for this very step came over every edge.
    """

    values: Array
    stamp: Array
    fresh: Array
    linked: Array
    complete: bool

    @classmethod
    def whole(cls, values: Array, stamp: Array, linked: Array | None = None) -> "Received":
        """What arrives when every linked neighbour is received in the same step; all without `linked`."""
        everyone = np.ones_like(stamp) if linked is None else linked
        return cls(values, stamp, everyone, everyone, complete=True)

    def shifted(self, offset: Array) -> "Received":
        """The same with stamps moved by an offset in s, shape (..., K)."""
        # By a wrong clock a message may seem older than the timeout, so that it no longer counts.
        return Received(self.values, self.stamp + offset, self.fresh, self.linked, complete=False)


@dataclass(frozen=True)
class NeighbourBuffer:
    """The newest message of each possible neighbour.

    Attributes:
        values: numbers of the announcements, shape (..., K, width).
        stamp: simulated time to which they belong, s, shape (..., K).
        known: 1 where there is such a message, else 0, shape (..., K).
    """

    values: Array
    stamp: Array
    known: Array

    @classmethod
    def empty(cls, shape: tuple[int, ...], width: int) -> "NeighbourBuffer":
        """An inbox in which nothing has arrived yet.

        Args:
            shape: of the satellites and their possible neighbours, (..., K).
            width: numbers of an announcement.
        """
        return cls(np.zeros((*shape, width)), np.zeros(shape), np.zeros(shape))

    def after(self, received: Received) -> "NeighbourBuffer":
        """The inbox once this step's post has been taken in; who is no longer linked is forgotten."""
        if received.complete:
            return NeighbourBuffer(received.values, received.stamp, received.linked)
        fresh = received.fresh > 0.0
        return NeighbourBuffer(
            values=np.where(fresh[..., None], received.values, self.values),
            stamp=np.where(fresh, received.stamp, self.stamp),
            known=np.where(fresh, 1.0, self.known) * received.linked,
        )

    def counted(self, time: float, neighbour_timeout: Array | float) -> Array:
        """Whose message still counts, as weights of 1 and 0, shape (..., K).

        Args:
            time: simulated, s.
            neighbour_timeout: age of a message from which on it no longer counts, s, shape (...).
        """
        # A stamp on the grid of steps may be off by a rounding, which is not to decide.
        old = time - self.stamp > column(np.asarray(neighbour_timeout)) * (1.0 + 1e-12)
        weight: Array = np.where(old, 0.0, self.known)
        return weight

    def first(self, count: int) -> "NeighbourBuffer":
        """The inbox for the first so many possible neighbours alone."""
        return NeighbourBuffer(self.values[..., :count, :], self.stamp[..., :count], self.known[..., :count])

    def rearranged(self, previous: list[int | None]) -> "NeighbourBuffer":
        """The inbox of one satellite for another list of possible neighbours.

        Args:
            previous: for each of the new list, its index in the old one; None for one that was not in it.
        """
        count = len(previous)
        whole = NeighbourBuffer.empty((count,), self.values.shape[-1])
        for new, old in enumerate(previous):
            if old is not None:
                whole.values[new] = self.values[old]
                whole.stamp[new] = self.stamp[old]
                whole.known[new] = self.known[old]
        return whole
