# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Consensus on the generalised arc length: the rate of each satellite along its own orbit.

Satellites compare and send their phase, xi less the satellite's own phase offset. No satellite needs the
offset of another, so that an offset can change in flight. Without offset the phase is xi itself.

Equations: docs/controllers/consensus.md.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from satform.common.spec import Positive, Spec
from satform.numeric.elementwise import Array, column

NeighbourValues = Literal["hold", "extrapolate"]
ArcLengthSource = Literal["reference", "projected"]
Announces = Literal["arc_length", "motion"]


@dataclass(frozen=True)
class NeighbourPhases:
    """Newest values received from the K in-neighbours of a satellite, in ascending order of their indices.

    An entry of weight zero is padding, or a neighbour without a valid message; its other values do not
    matter as long as they are finite.

    Attributes:
        arc_length: phase of the neighbour at the stamp, m, shape (..., K).
        rate: eta of the neighbour at the stamp, m/s, shape (..., K).
        stamp: simulated time to which both belong, s, shape (..., K).
        weight: 1 for a neighbour that counts, else 0, shape (..., K).
    """

    arc_length: Array
    rate: Array
    stamp: Array
    weight: Array


@dataclass(frozen=True)
class ArcLengthConsensus:
    """The consensus law of one satellite, or of many stacked along a leading axis.

    Attributes:
        tracking_gain: of the own rate's error, 1/s, shape (...).
        coupling_gain: of the disagreement in arc length, 1/s^2, shape (...).
        rate_gain: of the disagreement in rate, 1/s, shape (...).
        neighbour_values: `hold` uses a neighbour's phase as received, `extrapolate` propagates it from its
            stamp to the current time at the received rate.
        arc_length_source: whether xi is that of the reference point or that of the point of the
            orbit closest to the satellite, in which case the formation waits for a satellite that lags.
        neighbour_timeout: age of a neighbour's message beyond which the neighbour has weight zero, s,
            shape (...).
    """

    tracking_gain: Array
    coupling_gain: Array
    rate_gain: Array
    neighbour_values: NeighbourValues = "hold"
    arc_length_source: ArcLengthSource = "reference"
    neighbour_timeout: Array | float = math.inf

    def acceleration(
        self,
        arc_length: Array,
        rate: Array,
        nominal_rate: Array | float,
        neighbour_states: NeighbourPhases,
        time: float,
    ) -> Array:
        """Rate of change of a satellite's own eta.

        Args:
            arc_length: own phase, m, shape (...).
            rate: own eta, m/s, shape (...).
            nominal_rate: constant rate of the whole formation, m/s, shape (...).
            neighbour_states: from the neighbours, shape (..., K).
            time: simulated, s.

        Returns:
            deta/dt, m/s^2, shape (...).

        Source: Chen et al. 2015, consensus on the generalised arc length; cf. Ren & Beard, ch. 4.
            Equation (8) of docs/controllers/consensus.md.
        """
        own = -self.tracking_gain * (rate - nominal_rate)
        if neighbour_states.arc_length.shape[-1] == 0:
            return own
        weighted = self.weighted_couplings(arc_length, rate, neighbour_states, time)
        # An accumulation adds strictly one after another, which a sum over an axis does not promise.
        change: Array = own - np.add.accumulate(weighted, axis=-1)[..., -1]
        return change

    def weighted_couplings(
        self, arc_length: Array, rate: Array, neighbour_states: NeighbourPhases, time: float
    ) -> Array:
        """Weighted coupling term of each neighbour, subtracted from deta/dt, m/s^2, shape (..., K)."""
        weighted: Array = neighbour_states.weight * self.couplings(arc_length, rate, neighbour_states, time)
        return weighted

    def couplings(
        self, arc_length: Array, rate: Array, neighbour_states: NeighbourPhases, time: float
    ) -> Array:
        """Coupling term of each neighbour before weighting; positive values decelerate the satellite.

        Args:
            arc_length: own phase, m, shape (...).
            rate: own eta, m/s, shape (...).
            neighbour_states: from the neighbours, shape (..., K).
            time: simulated, s.

        Returns:
            Differences in phase and rate times their gains, m/s^2, shape (..., K).
        """
        neighbour = neighbour_states.arc_length
        if self.neighbour_values == "extrapolate":
            neighbour = neighbour + (time - neighbour_states.stamp) * neighbour_states.rate
        behind = column(arc_length) - neighbour
        slower = column(rate) - neighbour_states.rate
        coupling: Array = column(self.coupling_gain) * behind + column(self.rate_gain) * slower
        return coupling


def propagate(arc_length: Array, rate: Array, rate_change: Array, duration: float) -> tuple[Array, Array]:
    """Generalised arc length and rate after a period of constant rate of change.

    Args:
        arc_length: xi, m, shape (...).
        rate: eta, m/s, shape (...).
        rate_change: deta/dt, m/s^2, shape (...).
        duration: s.

    Returns:
        xi (m) and eta (m/s) at the end, each of shape (...).
    """
    gained = rate_change * duration
    return arc_length + (rate + 0.5 * gained) * duration, rate + gained


class ConsensusSpec(Spec):
    """Base of every consensus law's specification; subclasses set a literal `kind` and their gains.

    Attributes:
        announces: what satellites send to their out-neighbours under this law.
    """

    announces: ClassVar[Announces] = "arc_length"

    neighbour_timeout: Positive = 60.0
    """Age of the newest message beyond which a neighbour is ignored, s of simulated time."""

    def build(self) -> Any:
        """The law itself: an `ArcLengthConsensus`, or a `MotionSharing` where motion is sent."""
        raise NotImplementedError


class ArcLengthGainsSpec(ConsensusSpec):
    """Base of the laws on the generalised arc length and its rate; subclasses set a literal `kind`."""

    kind: str
    tracking_gain: Positive
    """Gain of the own rate's error to the nominal rate, 1/s."""
    coupling_gain: Positive
    """Gain of the phase differences to the neighbours, 1/s^2."""
    rate_gain: Positive
    """Gain of the rate differences to the neighbours, 1/s."""
    neighbour_values: NeighbourValues = "hold"
    """`hold` uses a neighbour's phase as received; `extrapolate` propagates it from its stamp to now."""
    arc_length_source: ArcLengthSource = "reference"
    """`reference`: of the reference point; `projected`: of the orbit's point closest to the satellite."""

    def build(self) -> ArcLengthConsensus:
        """The law itself."""
        return ArcLengthConsensus(
            tracking_gain=np.asarray(self.tracking_gain),
            coupling_gain=np.asarray(self.coupling_gain),
            rate_gain=np.asarray(self.rate_gain),
            neighbour_values=self.neighbour_values,
            arc_length_source=self.arc_length_source,
            neighbour_timeout=np.asarray(self.neighbour_timeout),
        )


class ArcLengthConsensusSpec(ArcLengthGainsSpec):
    """Consensus on the generalised arc length and its rate."""

    kind: Literal["arc_length"] = "arc_length"


def modal_roots(
    eigenvalues: Array | NDArray[np.complex128], tracking_gain: float, coupling_gain: float, rate_gain: float
) -> NDArray[np.complex128]:
    """Roots of the consensus without delay, for each mode of the graph.

    Args:
        eigenvalues: of the graph's Laplacian, shape (N,).
        tracking_gain: 1/s.
        coupling_gain: 1/s^2.
        rate_gain: 1/s.

    Returns:
        The two roots of s^2 + (tracking_gain + rate_gain lambda) s + coupling_gain lambda of each
        eigenvalue, the one further to the right first, 1/s, shape (N, 2). The law is stable when all
        but one of them, which stands for the free common phase, have a negative real part.

    Source: Ren & Beard, ch. 4, modal decomposition of second-order consensus.
    """
    modes = np.asarray(eigenvalues, dtype=np.complex128)
    half = 0.5 * (tracking_gain + rate_gain * modes)
    spread = np.sqrt(half * half - coupling_gain * modes)
    # The larger root first: the smaller one follows from the product without cancellation.
    far = np.where((np.conj(half) * spread).real >= 0.0, -half - spread, -half + spread)
    near = coupling_gain * modes / far
    roots = np.stack((near, far), axis=-1)
    swap = near.real < far.real
    roots[swap] = roots[swap][:, ::-1]
    return roots
