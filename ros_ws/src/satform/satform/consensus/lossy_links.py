# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Consensus over links that lose messages at random: mean-square convergence and its border.

Every satellite keeps the newest value of each in-neighbour, so that the state of the consensus in the nominal
motion is x = (z, eta, z_held, eta_held), with z_held and eta_held for each edge. Messages are sent every m
steps; each arrives with the probability 1 - p, independently. From one message to the next

    x' = A(b) x,    A(b) = A_0 + sum_e b_e B_e,    b_e = 1 with probability 1 - p, else 0

    E[x' x'^T] = M P M^T + p (1 - p) sum_e B_e P B_e^T,    M = A_0 + (1 - p) sum_e B_e,    P = E[x x^T]

The disagreement decays in the mean square where the spectral radius of this map of P, without the common
phase, is below one.

Equations: docs/controllers/consensus.md.
"""

import math
from dataclasses import dataclass

import numpy as np

from satform.consensus.arc_length import NeighbourValues
from satform.consensus.graph import Graph
from satform.consensus.stability import Gains
from satform.control.sampled_stability import border_between
from satform.numeric.elementwise import Array

MOST_NUMBERS = 200
"""Numbers of a whole state up to which the mean square is worked out, which has the square of them."""


@dataclass(frozen=True)
class LossyConsensus:
    """Disagreement of the consensus from one message to the next, relative to the first satellite's phase.

    A state has the phases of the other satellites, N - 1 numbers, the rates off the nominal one, N, and the
    held phases and rates, E each; n of them in all.

    Attributes:
        without: transition when no message arrives, shape (n, n).
        arrivals: what the arrival over each edge adds to it, shape (E, n, n).
        receivers: index of the receiver of each edge.
        senders: index of the sender of each edge.
        satellites: number of them, N.
        neighbour_values: what is made of a value that is not of this step.
    """

    without: Array
    arrivals: Array
    receivers: tuple[int, ...]
    senders: tuple[int, ...]
    satellites: int
    neighbour_values: NeighbourValues

    @classmethod
    def of(
        cls,
        graph: Graph,
        gains: Gains,
        step: float,
        every: int = 1,
        neighbour_values: NeighbourValues = "extrapolate",
    ) -> "LossyConsensus":
        """The consensus over a graph.

        Args:
            graph: who receives from whom.
            gains: of the law.
            step: control period, s.
            every: steps from one message to the next.
            neighbour_values: what is made of a value that is not of this step.

        Raises:
            ValueError: the state has more than `MOST_NUMBERS` numbers.
        """
        receivers, senders = (tuple(found.tolist()) for found in np.nonzero(graph.adjacency))
        count, edges = len(graph), len(receivers)
        size = 2 * (count + edges)
        if size > MOST_NUMBERS:
            raise ValueError(
                f"{count} satellites with {edges} edges make states of {size} numbers; mean-square "
                f"convergence is worked out for at most {MOST_NUMBERS}"
            )
        moved = _step(receivers, count, gains, step, neighbour_values)
        between = np.linalg.matrix_power(moved, every)
        taken = np.zeros((edges, size, size))
        for edge, sender in enumerate(senders):
            for held, value in ((2 * count + edge, sender), (2 * count + edges + edge, count + sender)):
                taken[edge, held, value] = 1.0
                taken[edge, held, held] = -1.0
        relative, back = _relative(count, edges)
        return cls(
            relative @ between @ back,
            relative @ (between @ taken) @ back,
            receivers,
            senders,
            count,
            neighbour_values,
        )

    def mean(self, loss: float) -> Array:
        """Transition of the mean of a state from one message to the next, shape (n, n).

        Args:
            loss: probability with which each message is lost.
        """
        found: Array = self.without + (1.0 - loss) * self.arrivals.sum(axis=0)
        return found

    def second_moment(self, moment: Array, loss: float) -> Array:
        """The second moment of a state one message later.

        Args:
            moment: E[x x^T], shape (n, n).
            loss: probability with which each message is lost.

        Returns:
            Shape (n, n).
        """
        mean = self.mean(loss)
        spread = (self.arrivals @ moment @ self.arrivals.transpose(0, 2, 1)).sum(axis=0)
        found: Array = mean @ moment @ mean.T + loss * (1.0 - loss) * spread
        return found

    def mean_square_radius(self, loss: float) -> float:
        """Factor by which the mean square of the disagreement changes over a message, in the long run.

        Args:
            loss: probability with which each message is lost.

        Returns:
            Below one where the disagreement decays in the mean square.
        """
        from scipy.sparse.linalg import LinearOperator, eigs  # noqa: PLC0415  slow to import

        size = len(self.without)

        def after(vector: Array) -> Array:
            found: Array = self.second_moment(vector.reshape(size, size), loss).ravel()
            return found

        operator = LinearOperator((size * size, size * size), matvec=after, dtype=np.float64)
        # The map keeps matrices positive semidefinite, so that its largest eigenvalue is real.
        found = eigs(operator, k=1, which="LM", v0=np.eye(size).ravel(), return_eigenvectors=False)
        return float(np.abs(found[0]))

    def largest_loss(self) -> float:
        """Loss up to which the disagreement decays in the mean square.

        Returns:
            Probability; 1 where it decays for every smaller one, 0 where it does not without loss.
        """
        if self.mean_square_radius(0.0) >= 1.0:
            return 0.0
        return border_between(lambda loss: self.mean_square_radius(loss) < 1.0, 0.0, 1.0)[1]

    def start(self, phases: Array, rates: Array) -> Array:
        """The state in which every satellite holds its neighbours' own values.

        Args:
            phases: m, shape (N,).
            rates: off the nominal rate, m/s, shape (N,).

        Returns:
            Shape (n,).
        """
        senders = list(self.senders)
        relative = np.asarray(phases, dtype=np.float64) - phases[0]
        return np.concatenate((relative[1:], rates, relative[senders], np.asarray(rates)[senders]))

    def rms_disagreement(self, phases: Array, rates: Array, loss: float, messages: int) -> Array:
        """Root mean square of the disagreement, from when every satellite holds its neighbours' own values.

        Args:
            phases: at the start, m, shape (N,).
            rates: at the start, off the nominal rate, m/s, shape (N,).
            loss: probability with which each message is lost.
            messages: number of them, K.

        Returns:
            Of a phase less the mean of all phases, over satellites and losses, m, shape (K + 1,).

        Raises:
            ValueError: values are held, so that the age of each is an error of its own.
        """
        if self.neighbour_values == "hold":
            raise ValueError("with neighbour_values: hold a lost message leaves an error at the nominal rate")
        state = self.start(phases, rates)
        moment = np.outer(state, state)
        found = [self._deviation(moment)]
        for _ in range(messages):
            moment = self.second_moment(moment, loss)
            found.append(self._deviation(moment))
        return np.array(found)

    def _deviation(self, moment: Array) -> float:
        """Root mean square of the phases less their mean, by the second moment of a state."""
        count = self.satellites
        phases = np.zeros((count, count))
        phases[1:, 1:] = moment[: count - 1, : count - 1]
        mean_square = np.trace(phases) / count - phases.sum() / count**2
        return math.sqrt(max(0.0, float(mean_square)))


def _step(
    receivers: tuple[int, ...], count: int, gains: Gains, step: float, neighbour_values: NeighbourValues
) -> Array:
    """Transition of (phases, rates, held phases, held rates) over a step in which nothing arrives.

    In the nominal motion; that of held values, a constant, is left out.
    """
    edges = len(receivers)
    size = 2 * (count + edges)
    acceleration = np.zeros((count, size))
    for satellite in range(count):
        acceleration[satellite, count + satellite] -= gains.tracking
    for edge, receiver in enumerate(receivers):
        acceleration[receiver, receiver] -= gains.coupling
        acceleration[receiver, 2 * count + edge] += gains.coupling
        acceleration[receiver, count + receiver] -= gains.rate
        acceleration[receiver, 2 * count + edges + edge] += gains.rate
    moved = np.eye(size)
    moved[:count, count : 2 * count] += step * np.eye(count)
    moved[:count] += 0.5 * step * step * acceleration
    moved[count : 2 * count] += step * acceleration
    if neighbour_values == "extrapolate":
        moved[2 * count : 2 * count + edges, 2 * count + edges :] += step * np.eye(edges)
    return moved


def _relative(count: int, edges: int) -> tuple[Array, Array]:
    """From a whole state to one relative to the first satellite's phase, and back to one with that phase 0.

    All phases can be shifted together without a change of anything else.
    """
    size = 2 * (count + edges)
    relative, back = np.eye(size), np.eye(size)
    relative[:count, 0] -= 1.0
    relative[2 * count : 2 * count + edges, 0] -= 1.0
    return relative[1:], back[:, 1:]
