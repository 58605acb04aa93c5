# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Consensus in which no neighbour can pull with more than a limit."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.common.spec import Positive
from satform.consensus.arc_length import ArcLengthConsensus, ArcLengthGainsSpec, NeighbourPhases
from satform.numeric.elementwise import Array, column


@dataclass(frozen=True)
class LimitedCoupling(ArcLengthConsensus):
    """The law; gains and limit have shape (...), values of neighbours (..., K)."""

    limit: Array | float = np.inf  # m/s^2

    def couplings(
        self, arc_length: Array, rate: Array, neighbour_states: NeighbourPhases, time: float
    ) -> Array:
        limit = column(np.asarray(self.limit))
        return np.clip(super().couplings(arc_length, rate, neighbour_states, time), -limit, limit)


class LimitedCouplingSpec(ArcLengthGainsSpec):
    kind: Literal["limited_coupling"] = "limited_coupling"
    limit: Positive = 1.0e-3
    """Largest coupling of one neighbour, m/s^2."""

    def build(self) -> LimitedCoupling:
        return LimitedCoupling(**vars(super().build()), limit=np.asarray(self.limit))
