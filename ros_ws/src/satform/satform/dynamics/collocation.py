# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Collocation at Gauss-Legendre nodes: motion over a long step from accelerations at its nodes alone.

The acceleration of a satellite is a polynomial in time through its values at the nodes, the motion its first
and second integral. The values follow from the motion by iteration (Picard). Most iterations change only the
gravity of an oblate Earth, which is cheap; what all other forces add is computed anew only for the motion
that these have settled to, twice for a low orbit. So a step needs two evaluations of the forces at each node,
and its nodes can lie as far apart as those of a multi-step method, without its start.

A satellite's numbers do not depend on who else is integrated: every operation is element-wise, and a
satellite that has converged takes no part in further iterations.

Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, II.7 and II.14 (collocation,
Nystrom methods); Bradley, Jones, Beylkin & Axelrad 2014, Celest. Mech. Dyn. Astron. 119 (iteration with a
part of the forces).
"""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from satform.dynamics.integrators import FixedStep, substeps
from satform.numeric.elementwise import Array, Indices
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER, OBLATENESS

NODES = 24
"""Of a step; enough for a fifth of a low orbit under gravity of degree 20."""

FullAcceleration = Callable[[Sequence[int], Array, Array, Indices], Array]
"""Numbers of K nodes, positions in m and velocities in m/s at these, shape (K, M, 3), and numbers of the M
satellites, to their accelerations in m/s^2, shape (K, M, 3)."""

Flags = NDArray[np.bool_]
"""Of satellites, shape (M,)."""

_ALL = tuple(range(NODES))
_SOME = tuple(number for number in _ALL if number not in (3, 5, 7, 9, 14, 16, 18, 20))
"""Nodes at which all forces are evaluated for the first time: two thirds of them."""

_COARSE, _MEDIUM, _FINE = 30.0, 1e-3, 1e-6
"""Changes of the position, m, at which iterations with a part of the forces end: before all forces are
evaluated at some of the nodes, before they are at all of them, and after it. The next one would change it by
less than a hundredth of that."""

_SETTLED = 2e-6
"""Change of the position, m, by another evaluation of all forces, below which there is none."""

_MOST_PERIODS = 10_000
"""Control periods of a long step, at whose ends motion is kept; more would take much memory at once."""

_MOST_ITERATIONS, _MOST_EVALUATIONS = 60, 12


@dataclass(frozen=True)
class Collocation:
    """Long steps by collocation where nothing but the forces of nature acts, shorter ones elsewhere.

    Attributes:
        maximum_step: longest step by collocation, s; it extends over as many control periods as fit.
        thrust: integrator of control periods in which a command or a perturbation acts.
    """

    maximum_step: float
    thrust: FixedStep

    def division(self, period: float) -> tuple[int, int]:
        """How many control periods a long step extends over, and how many parts it is computed in.

        Args:
            period: control period, s.

        Returns:
            One of them is 1: a control period longer than the maximum is cut into equal parts. A long step
            extends over at most 10,000 control periods.
        """
        periods = max(1, int(min(self.maximum_step / period * (1.0 + 1e-12), _MOST_PERIODS)))
        return periods, substeps(period, self.maximum_step) if periods == 1 else 1


@functools.cache
def nodes() -> tuple[float, ...]:
    """Nodes of a step as fractions of it, in ascending order."""
    from numpy.polynomial import legendre  # noqa: PLC0415  slow to import, and only this integrator needs it

    return tuple((0.5 * (1.0 + legendre.leggauss(NODES)[0])).tolist())


@functools.lru_cache(maxsize=256)
def weights(fractions: tuple[float, ...]) -> tuple[Array, Array]:
    """Weights of the accelerations at the nodes in velocity and position at other instants.

    Args:
        fractions: n instants as fractions of the step.

    Returns:
        Those of the first and of the second integral over a step of unit length, shape (K, n, 1) each.
    """
    from numpy.polynomial import legendre  # noqa: PLC0415  slow to import, and only this integrator needs it

    points, quadrature = legendre.leggauss(NODES)
    degrees = np.arange(NODES)
    # The polynomial that is 1 at one node and 0 at the others, as a series of Legendre polynomials.
    series = legendre.legvander(points, NODES - 1) * (degrees + 0.5) * quadrature[:, None]
    at = 2.0 * np.array(fractions) - 1.0
    first = legendre.legint(np.eye(NODES), lbnd=-1)
    second = legendre.legint(first, lbnd=-1)
    return (
        (series @ (0.5 * legendre.legval(at, first)))[..., None],
        (series @ (0.25 * legendre.legval(at, second)))[..., None],
    )


@functools.cache
def between() -> Array:
    """Weights that carry values at some of the nodes to all of them, shape (2 K / 3, K, 1)."""
    from numpy.polynomial import legendre  # noqa: PLC0415  slow to import, and only this integrator needs it

    points = legendre.leggauss(NODES)[0]
    some = points[list(_SOME)]
    columns = []
    for number, point in enumerate(some):
        others = np.delete(some, number)
        columns.append(np.prod((points[:, None] - others) / (point - others), axis=1))
    return np.array(columns)[..., None]


def change(fractions: tuple[float, ...], length: float, velocity: Array, rates: Array) -> Array:
    """How far satellites get within a step.

    Args:
        fractions: n instants as fractions of the step.
        length: of the step, s.
        velocity: at its start, m/s, shape (M, 3).
        rates: accelerations at the nodes, m/s^2, shape (K, M, 3).

    Returns:
        What the instants add to position in m and velocity in m/s at the start, shape (n, 2, M, 3).
    """
    first, second = weights(fractions)
    gained = length * _sum(first, rates)
    moved = (length * length) * _sum(second, rates)
    moved += velocity * (length * np.array(fractions))[:, None, None]
    return np.stack((moved, gained), axis=1)


def oblate_gravity(position: Array) -> Array:
    """Gravity of an oblate Earth whose axis is the inertial z axis: central term and J2.

    Args:
        position: inertial, m, shape (..., 3).

    Returns:
        m/s^2, shape (..., 3).
    """
    squares = position * position
    z_squared = squares[..., 2]
    inverse = 1.0 / (squares[..., 0] + squares[..., 1] + z_squared)
    central = inverse * np.sqrt(inverse) * -GRAVITATIONAL_PARAMETER
    oblate = inverse * (1.5 * OBLATENESS * EQUATORIAL_RADIUS * EQUATORIAL_RADIUS) * central
    radial = central + oblate - oblate * (5.0 * z_squared * inverse)
    result: Array = position * radial[..., None]
    result[..., 2] += (oblate + oblate) * position[..., 2]
    return result


def accelerations(motion: Array, length: float, full: FullAcceleration) -> tuple[Array, Flags]:
    """Accelerations of satellites at the nodes of a step.

    Args:
        motion: inertial position in m and velocity in m/s at the start, shape (2, M, 3).
        length: of the step, s.
        full: all forces, at the nodes.

    Returns:
        m/s^2, shape (K, M, 3), and for each satellite whether the iteration has converged, shape (M,).
    """
    with np.errstate(all="ignore"):
        # What does not converge may leave the range of numbers.
        return _iterate(_Step(motion, length), motion.shape[1], full)


def _iterate(step: "_Step", satellites: int, full: FullAcceleration) -> tuple[Array, Flags]:
    found = np.full((NODES, satellites, 3), np.nan)
    rows = np.arange(satellites)
    position, rates, settled = step.settle(rows, step.guess(), np.zeros_like(found), _COARSE)
    some = list(_SOME)
    velocity = step.velocity(rows, rates)
    first = full(_SOME, position[some], velocity[some], rows) - oblate_gravity(position[some])
    before = position
    position, rates, ended = step.settle(rows, position, _sum(between(), first), _MEDIUM)
    settled &= ended
    moved = _moved(before, position)
    for evaluation in range(_MOST_EVALUATIONS):
        if not settled.all():
            rows, position, rates, moved = (
                rows[settled],
                position[:, settled],
                rates[:, settled],
                moved[settled],
            )
        if not rows.size:
            break
        rest = full(_ALL, position, step.velocity(rows, rates), rows) - oblate_gravity(position)
        before, earlier = position, moved
        position, rates, settled = step.settle(rows, position, rest, _FINE)
        moved = _moved(before, position)
        # Another evaluation would move it less by the factor by which this one did. The first one at all
        # nodes also mends what some of them did not see: there it is the relative change of the forces.
        if evaluation == 0:
            final = _largest(rest[some] - first[:, rows]) * moved <= _SETTLED * _largest(first[:, rows])
        else:
            final = moved * moved <= _SETTLED * earlier
        final &= settled
        found[:, rows[final]] = rates[:, final]
        settled &= ~final
    return found, np.isfinite(found).all(axis=(0, 2))


def _largest(rates: Array) -> Array:
    """Largest component at any node, shape (M,), of accelerations of shape (K, M, 3)."""
    largest: Array = np.abs(rates).max(axis=(0, 2))
    return largest


def _moved(before: Array, after: Array) -> Array:
    """Change of positions at the nodes, m, shape (M,): that at the last one, where it is largest."""
    distance: Array = np.abs(after[-1] - before[-1]).max(axis=-1)
    return distance


class _Step:
    """Start of a step and the integrals from there."""

    def __init__(self, motion: Array, length: float) -> None:
        self._motion = motion
        self._length = length
        self._times = length * np.array(nodes())[:, None, None]
        self._straight = motion[0] + motion[1] * self._times
        self._first, self._second = weights(nodes())

    def guess(self) -> Array:
        """Positions at the nodes on a circle, which is a sine and a cosine, as far as their series go."""
        position, velocity = self._motion
        squared = position[:, 0] * position[:, 0] + position[:, 1] * position[:, 1]
        squared = squared + position[:, 2] * position[:, 2]
        # The square of the angle that a satellite on a circle covers.
        angle = self._times * self._times * (GRAVITATIONAL_PARAMETER / (squared * np.sqrt(squared)))[:, None]
        cosine, sine = np.ones_like(angle), np.ones_like(angle)
        for index in range(10, 0, -2):
            cosine = 1.0 - angle / (index * (index - 1)) * cosine
            sine = 1.0 - angle / (index * (index + 1)) * sine
        positions: Array = position * cosine + velocity * (self._times * sine)
        return positions

    def velocity(self, rows: Indices, rates: Array) -> Array:
        """Velocities at the nodes, m/s, shape (K, M, 3), of some satellites with these accelerations."""
        gained: Array = self._motion[1, rows] + self._length * _sum(self._first, rates)
        return gained

    def settle(self, rows: Indices, position: Array, rest: Array, bound: float) -> tuple[Array, Array, Flags]:
        """Iterate with the gravity of an oblate Earth alone.

        Args:
            rows: numbers of M satellites.
            position: at the nodes, to begin with, m, shape (K, M, 3).
            rest: acceleration that is kept, m/s^2, shape (K, M, 3).
            bound: change of the position at which a satellite's iteration ends, m.

        Returns:
            Position and acceleration at the nodes, and for each satellite whether the iteration has ended.
        """
        straight, squared = self._straight[:, rows], self._length * self._length
        ended = np.zeros(len(rows), bool)
        whole: tuple[Array, Array] | None = None
        left = np.arange(len(rows))
        for _ in range(_MOST_ITERATIONS):
            rates = oblate_gravity(position) + rest
            before, position = position, straight + squared * _sum(self._second, rates)
            done = _moved(before, position) < bound
            if whole is None:
                if done.all():
                    return position, rates, done
                whole = (position.copy(), rates.copy())
            if not done.any():
                continue
            whole[0][:, left[done]], whole[1][:, left[done]] = position[:, done], rates[:, done]
            ended[left[done]] = True
            if done.all():
                break
            left, position, rest, straight = (
                left[~done],
                position[:, ~done],
                rest[:, ~done],
                straight[:, ~done],
            )
        assert whole is not None  # noqa: S101 - there is an iteration
        return *whole, ended


def _sum(factors: Array, rates: Array) -> Array:
    """Sum over the nodes, one after another: factors (K, n, 1) and rates (K, M, 3) to shape (n, M, 3)."""
    flat = rates.reshape(len(rates), 1, -1)
    total: Array = (factors * flat).sum(axis=0).reshape(-1, *rates.shape[1:])
    return total
