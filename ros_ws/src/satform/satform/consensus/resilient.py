# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Consensus on the generalised arc length that tolerates Byzantine neighbours.

A satellite uses a neighbour's phase and rate in one combination only: the phase that the neighbour would
have after `rate_gain / coupling_gain` seconds at its rate. This look-ahead phase is compared, sorted and
discarded. A neighbour with a plausible phase and a wrong rate is therefore as conspicuous as one with a
wrong phase.

With z the phase less nominal_rate * time, q the look-ahead phase in the same sense, and
look_ahead = rate_gain / coupling_gain, the law reads

    dz/dt = (q - z) / look_ahead
    dq/dt = (tracking_gain - 1 / look_ahead) (z - q) + rate_gain sum of (q_neighbour - q)

Where coupling_gain <= tracking_gain * rate_gain every coefficient is positive: z and q of a satellite
never leave the interval of its own look-ahead phase and of those that it uses, and the law is a consensus
of first order in which each satellite takes part twice. Discarding up to F look-ahead phases on either
side of the own one keeps those used between those of correct satellites, as in first-order consensus.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from satform.consensus.arc_length import ArcLengthConsensus, ArcLengthGainsSpec, NeighbourPhases
from satform.numeric.elementwise import Array

_SLACK = 1e-9
"""Relative, for gains whose product is meant to be the bound itself."""


@dataclass(frozen=True)
class ResilientArcLengthConsensus(ArcLengthConsensus):
    """The law of one satellite, or of many stacked along a leading axis, with Byzantine neighbours.

    Attributes:
        tolerated_byzantine: F, how many in-neighbours of a satellite may be Byzantine. Up to F neighbours
            that accelerate it and up to F that slow it down are discarded.
    """

    tolerated_byzantine: int = 0

    def weighted_couplings(
        self, arc_length: Array, rate: Array, neighbour_states: NeighbourPhases, time: float
    ) -> Array:
        """Coupling term of each neighbour, m/s^2, shape (..., K); 0 for those that are discarded.

        A value that is not finite counts as no message.

        Source: LeBlanc, Zhang, Koutsoukos & Sundaram 2013, weighted-mean subsequence-reduced (W-MSR)
            consensus; cf. Dibaji & Ishii 2017 for agents of second order, who compare positions alone
            because their agents use no neighbour's rate.
        """
        # Extreme values of a Byzantine neighbour overflow; the result is not used.
        with np.errstate(over="ignore", invalid="ignore"):
            coupling = self.couplings(arc_length, rate, neighbour_states, time)
        coupling = np.where((neighbour_states.weight > 0.0) & np.isfinite(coupling), coupling, 0.0)
        weighted: Array = neighbour_states.weight * np.where(
            outliers(coupling, self.tolerated_byzantine), 0.0, coupling
        )
        return weighted


def outliers(coupling: Array, tolerated_byzantine: int) -> NDArray[np.bool_]:
    """Which neighbours a satellite discards: those with the largest coupling terms, up to F of each sign.

    Terms of zero are never discarded and may be padding. Of equal terms at the limit, the first are
    discarded among the negative and the last among the positive ones.

    Args:
        coupling: of each neighbour, in any unit, shape (..., K).
        tolerated_byzantine: F, how many of each sign are discarded.

    Returns:
        True for those discarded, shape (..., K).
    """
    count = coupling.shape[-1]
    order = np.argsort(coupling, axis=-1, kind="stable")
    rank = np.argsort(order, axis=-1, kind="stable")
    lowest = (rank < tolerated_byzantine) & (coupling < 0.0)
    highest = (rank >= count - tolerated_byzantine) & (coupling > 0.0)
    either: NDArray[np.bool_] = lowest | highest
    return either


class ResilientArcLengthConsensusSpec(ArcLengthGainsSpec):
    """Consensus on the generalised arc length that tolerates Byzantine neighbours."""

    kind: Literal["resilient_arc_length"] = "resilient_arc_length"
    tolerated_byzantine: Annotated[int, Field(ge=0, le=10_000)]
    """F: how many in-neighbours of each satellite may be Byzantine; up to F are discarded on either side."""

    def build(self) -> ResilientArcLengthConsensus:
        """The law itself."""
        return ResilientArcLengthConsensus(
            **vars(super().build()), tolerated_byzantine=self.tolerated_byzantine
        )

    def doubts(self, largest_in_degree: int, step: float) -> list[str]:
        """Violated conditions, so that correct satellites may leave the interval of their initial phases.

        With none of these, equal nominal rates, phases of the reference, and values that are no older
        than a step, z and q of every correct satellite stay within the interval of all correct
        satellites' z and q at the start; for satellites that start at the nominal rate it is the interval
        of their phases. Extrapolated values may be as old as rate_gain / coupling_gain.

        Args:
            largest_in_degree: largest in-degree.
            step: control period, s.

        Returns:
            One sentence for each; none when the interval is guaranteed.
        """
        found = []
        product = self.tracking_gain * self.rate_gain
        if self.coupling_gain > product * (1.0 + _SLACK):
            found.append(
                f"coupling_gain {self.coupling_gain:g} is more than tracking_gain * rate_gain = {product:g}, "
                "so that satellites overshoot each other"
            )
        fastest = self.tracking_gain + largest_in_degree * self.rate_gain
        if step * fastest > 1.0 + _SLACK:
            found.append(
                f"a step of {step:g} s is longer than 1 / (tracking_gain + {largest_in_degree} neighbours * "
                f"rate_gain) = {1.0 / fastest:g} s"
            )
        return found
