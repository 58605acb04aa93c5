# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear-quadratic regulator of a discrete linear system whose matrices repeat after a period.

A step of the Riccati recursion and any number of them in turn have the same form, so that a whole period is
one step of it; that step is doubled until it no longer changes.

Equations: docs/controllers/eccentric.md.
"""

from dataclasses import dataclass

import numpy as np

from satform.numeric.elementwise import Array

_DOUBLINGS = 60
_CONVERGED = 1e-13
"""Relative change of the cost in a doubling, from which on it counts as converged."""

_SAME = 1e-7
"""Relative difference of the cost after a period worked through step by step."""


@dataclass(frozen=True)
class _Stretch:
    """Steps in turn: with the cost P after them, that before is H + A' P (I + G P)^-1 A.

    Attributes:
        transition: A, shape (..., m, m).
        gramian: G, likewise.
        cost: H, likewise.
    """

    transition: Array
    gramian: Array
    cost: Array

    def then(self, later: "_Stretch") -> "_Stretch":
        """This stretch and a later one as one."""
        size = self.transition.shape[-1]
        identity = np.eye(size)
        # (I + G1 H2)^-1 applied to what follows it.
        between = identity + self.gramian @ later.cost
        carried = np.linalg.solve(between, self.transition)
        gramian_ahead = np.linalg.solve(between, self.gramian @ _transposed(later.transition))
        return _Stretch(
            transition=later.transition @ carried,
            gramian=_symmetric(later.gramian + later.transition @ gramian_ahead),
            cost=_symmetric(self.cost + _transposed(self.transition) @ later.cost @ carried),
        )

    def __getitem__(self, rows: slice) -> "_Stretch":
        return _Stretch(self.transition[rows], self.gramian[rows], self.cost[rows])

    def __len__(self) -> int:
        return len(self.transition)


def periodic_gain(transition: Array, effect: Array, state_cost: Array, command_cost: Array) -> Array:
    """State feedback of each step that minimises the sum of x'Qx + u'Ru over all time to come.

    Args:
        transition: of the state over each step of the period, shape (n, m, m).
        effect: of the command held over it, shape (n, m, k).
        state_cost: Q of each step, symmetric and positive semidefinite, shape (n, m, m).
        command_cost: R of each step, symmetric and positive definite, shape (n, k, k).

    Returns:
        Gain K of u = -K x of each step, shape (n, k, m).

    Raises:
        ValueError: the recursion does not converge to one cost.

    Source: Bittanti & Colaneri, Periodic Systems: Filtering and Control, ch. 13; doubling: Anderson 1978.
    """
    gramian = effect @ np.linalg.solve(command_cost, _transposed(effect))
    period = _in_turn(_Stretch(transition, _symmetric(gramian), state_cost))
    after = _limit(period)
    gains = np.empty((len(transition), effect.shape[-1], transition.shape[-1]))
    cost = after
    for step in reversed(range(len(transition))):
        ahead, held = transition[step], effect[step]
        weighted = held.T @ cost
        gains[step] = np.linalg.solve(command_cost[step] + weighted @ held, weighted @ ahead)
        cost = _symmetric(state_cost[step] + ahead.T @ cost @ (ahead - held @ gains[step]))
    if not np.max(np.abs(cost - after)) <= _SAME * np.max(np.abs(after)):
        raise ValueError("the periodic Riccati equation does not converge for these weights")
    return gains


def product_in_turn(transitions: Array) -> Array:
    """Product of matrices, the first one on the right.

    Args:
        transitions: in the order of time, shape (n, m, m).

    Returns:
        Shape (m, m).
    """
    while len(transitions) > 1:
        even = len(transitions) // 2 * 2
        pairs = transitions[1:even:2] @ transitions[0:even:2]
        transitions = np.concatenate((pairs, transitions[even:]))
    product: Array = transitions[0]
    return product


def _in_turn(steps: _Stretch) -> _Stretch:
    while len(steps) > 1:
        even = len(steps) // 2 * 2
        pairs, rest = steps[0:even:2].then(steps[1:even:2]), steps[even:]
        steps = _Stretch(
            np.concatenate((pairs.transition, rest.transition)),
            np.concatenate((pairs.gramian, rest.gramian)),
            np.concatenate((pairs.cost, rest.cost)),
        )
    return _Stretch(steps.transition[0], steps.gramian[0], steps.cost[0])


def _limit(period: _Stretch) -> Array:
    """Cost of all time to come at the start of a period."""
    for _ in range(_DOUBLINGS):
        before = period.cost
        with np.errstate(all="ignore"):
            period = period.then(period)
        if not np.all(np.isfinite(period.cost)):
            break
        if np.max(np.abs(period.cost - before)) <= _CONVERGED * np.max(np.abs(period.cost)):
            return period.cost
    raise ValueError("the periodic Riccati equation does not converge for these weights")


def _transposed(matrices: Array) -> Array:
    return np.swapaxes(matrices, -1, -2)


def _symmetric(matrices: Array) -> Array:
    half: Array = 0.5 * (matrices + _transposed(matrices))
    return half
