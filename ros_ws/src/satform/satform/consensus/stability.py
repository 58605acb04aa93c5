# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Stability of the consensus: its sampled modes, and the delay margin of its messages.

Own values are current; neighbour values are delayed by the links. With the delay T of all links, the
graph's adjacency A and its in-degrees D, the characteristic equation of the law in continuous time is

    det[(s^2 + k1 s) I + (k2 + k3 s) D - n(s) exp(-s T) A] = 0

    n(s) = k2 + k3 s                 neighbour_values: hold
    n(s) = k2 (1 + T s) + k3 s       neighbour_values: extrapolate

with k1 the tracking gain, k2 the coupling gain and k3 the rate gain. A root crosses the imaginary axis at
s = j w where n(j w) q = exp(j w T) for an eigenvalue q of inv((k1 j w - w^2) I + (k2 + k3 j w) D) A.

Equations: docs/controllers/consensus.md.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from satform.consensus.arc_length import NeighbourValues
from satform.consensus.graph import Graph
from satform.numeric.elementwise import Array

Complex = NDArray[np.complex128]

MOST_ALIKE = 200
"""Satellites of a graph with equal in-degrees up to which a delay margin is worked out."""

MOST_UNLIKE = 24
"""Satellites of any other graph up to which a delay margin is worked out."""

_PER_DECADE = 1500
_PER_DECADE_UNLIKE = 250
"""Frequencies at which a root is looked for, with an eigenvalue problem at each in the second case."""

_WIDEST = 1e-10
"""Ratio of the lowest to the highest of them, where gains differ by so much that it matters."""

_FREE = 1e-9
"""Part of the largest eigenvalue of a Laplacian below which another one is zero."""


@dataclass(frozen=True)
class Gains:
    """Gains of the consensus on the generalised arc length.

    Attributes:
        tracking: 1/s.
        coupling: 1/s^2.
        rate: 1/s.
    """

    tracking: float
    coupling: float
    rate: float


def sampled_modes(eigenvalues: Array | Complex, gains: Gains, step: float) -> Array:
    """Spectral radius of each mode of the consensus with values exchanged once a step.

    Each mode of the graph moves as `propagate` moves a satellite: its rate changes at a constant rate over
    the step. The common phase is free, so that of an eigenvalue of zero the rate's factor alone counts.

    Args:
        eigenvalues: of the graph's Laplacian, shape (N,).
        gains: of the law.
        step: control period, s.

    Returns:
        Factor by which the mode grows in a step, shape (N,); below 1 where it decays.

    Source: Ren & Beard, ch. 4, modal decomposition, with the exact discretisation of a double integrator.
    """
    modes = np.asarray(eigenvalues, dtype=np.complex128)
    free = np.abs(modes) <= _FREE * max(1.0, float(np.max(np.abs(modes), initial=0.0)))
    stiffness, damping = gains.coupling * modes, gains.tracking + gains.rate * modes
    # Transition [[1 - p h^2 / 2, h - d h^2 / 2], [-p h, 1 - d h]]: its trace and determinant.
    half_trace = 1.0 - 0.5 * step * damping - 0.25 * step * step * stiffness
    determinant = 1.0 - step * damping + 0.5 * step * step * stiffness
    spread = np.sqrt(half_trace * half_trace - determinant)
    radius: Array = np.maximum(np.abs(half_trace + spread), np.abs(half_trace - spread))
    return np.where(free, abs(1.0 - step * gains.tracking), radius)


def delay_margin(graph: Graph, gains: Gains, neighbour_values: NeighbourValues) -> float | None:
    """Delay of all messages up to which the consensus that flies is stable.

    Args:
        graph: who receives whom, directed or not.
        gains: of the law, stable without delay.
        neighbour_values: what is made of a late value.

    Returns:
        s; infinite where no delay makes it unstable; None for more satellites than are worked out.

    Source: the first root of the characteristic equation above on the imaginary axis; for `hold` and gains
        with tracking * rate >= coupling there is none, as every row of inv(...) A is then smaller than one.
    """
    degrees = graph.adjacency.sum(axis=1)
    if not degrees.any():
        return math.inf
    if neighbour_values == "hold" and gains.coupling <= gains.tracking * gains.rate:
        return math.inf
    alike = bool(np.all(degrees == degrees[0]))
    if len(graph) > (MOST_ALIKE if alike else MOST_UNLIKE):
        return None
    frequency = _frequencies(gains, float(degrees.max()), _PER_DECADE if alike else _PER_DECADE_UNLIKE)
    found = math.inf
    crossing = _held if neighbour_values == "hold" else _extrapolated
    # Gains of any size are allowed; a frequency at which they overflow is none at which a root crosses.
    with np.errstate(all="ignore"):
        for branch in _branches(graph.adjacency, degrees, gains, frequency, alike=alike):
            found = min(found, crossing(branch, frequency, gains))
    return found


@dataclass(frozen=True)
class _Branch:
    """An eigenvalue of inv((k1 j w - w^2) I + (k2 + k3 j w) D) A as a function of the frequency.

    Attributes:
        values: at the frequencies of the grid.
        at: the one near a given number at another frequency.
    """

    values: Complex
    at: Callable[[float, complex], complex]


def _frequencies(gains: Gains, degree: float, per_decade: int) -> Array:
    """Frequencies among which roots cross the imaginary axis, rad/s."""
    damping = gains.tracking + gains.rate * degree
    natural = (damping, math.sqrt(gains.coupling * degree), gains.coupling * degree / damping)
    high = 10.0 * max(natural)
    low = max(1e-3 * min(*natural, gains.tracking), _WIDEST * high)
    return np.geomspace(low, high, int(per_decade * math.log10(high / low)))


def _own(frequency: Array | float, degree: Array | float, gains: Gains) -> Complex:
    along = 1j * np.asarray(frequency)
    found: Complex = along * along + gains.tracking * along + (gains.coupling + gains.rate * along) * degree
    return found


def _branches(
    adjacency: Array, degrees: Array, gains: Gains, frequency: Array, *, alike: bool
) -> list[_Branch]:
    if alike:
        own, degree = _own(frequency, degrees[0], gains), float(degrees[0])
        modes = np.unique(np.round(np.linalg.eigvals(adjacency).astype(np.complex128), 9))

        def at(mode: complex) -> Callable[[float, complex], complex]:
            return lambda at_frequency, near: complex(mode / _own(at_frequency, degree, gains))

        return [_Branch(mode / own, at(complex(mode))) for mode in modes if abs(mode) > _FREE * degree]

    def eigenvalues(at_frequencies: Array) -> Complex:
        scaled = adjacency / _own(at_frequencies[:, None], degrees, gains)[..., None]
        return np.asarray(np.linalg.eigvals(scaled), dtype=np.complex128)

    tracked = eigenvalues(frequency)
    for row in range(1, len(tracked)):
        tracked[row] = _matched(tracked[row], tracked[row - 1])

    def nearest(at_frequency: float, near: complex) -> complex:
        found = eigenvalues(np.array([at_frequency]))[0]
        return complex(found[np.argmin(np.abs(found - near))])

    return [_Branch(values, nearest) for values in tracked.T]


def _matched(found: Complex, before: Complex) -> Complex:
    """Eigenvalues in the order of those at the frequency before."""
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415  slow to import, and not needed in flight

    return found[linear_sum_assignment(np.abs(before[:, None] - found[None, :]))[1]]


def _held(branch: _Branch, frequency: Array, gains: Gains) -> float:
    """The smallest delay at which a root of a branch is on the imaginary axis, values held."""

    def loop(one: float, near: complex) -> complex:
        return (gains.coupling + 1j * gains.rate * one) * branch.at(one, near)

    size = np.log(np.abs((gains.coupling + 1j * gains.rate * frequency) * branch.values) + 1e-300)
    smallest = math.inf
    for index in np.flatnonzero(np.signbit(size[:-1]) != np.signbit(size[1:])).tolist():
        near = complex(branch.values[index])
        one = _root(lambda near, w: math.log(abs(loop(w, near))), near, frequency[index : index + 2])
        angle = float(np.angle(loop(one, near))) % (2.0 * math.pi)
        smallest = min(smallest, angle / one)
    return smallest


def _extrapolated(branch: _Branch, frequency: Array, gains: Gains) -> float:
    """The smallest delay at which a root of a branch is on the imaginary axis, values extrapolated."""
    k2, k3 = gains.coupling, gains.rate

    def delay(one: Array | float, value: Complex | complex) -> Array:
        """At which the loop's magnitude is one; negative where there is none."""
        lead = np.asarray(1.0 / (np.abs(value) + 1e-100)) ** 2 - k2 * k2
        found: Array = (np.sqrt(np.maximum(lead, 0.0)) / one - k3) / k2
        return np.where(lead > 0.0, found, -1.0)

    def phase(one: Array | float, value: Complex | complex) -> Array:
        late = delay(one, value)
        turn = np.angle(value) + np.angle(k2 + 1j * (k3 + k2 * late) * one) - one * late
        wrapped: Array = np.remainder(turn + math.pi, 2.0 * math.pi) - math.pi
        return wrapped

    late, turn = delay(frequency, branch.values), phase(frequency, branch.values)
    there = (late[:-1] > 0.0) & (late[1:] > 0.0)
    crosses = (np.signbit(turn[:-1]) != np.signbit(turn[1:])) & (np.abs(turn[1:] - turn[:-1]) < math.pi)
    smallest, least = math.inf, np.minimum(late[:-1], late[1:])
    crossings = np.flatnonzero(there & crosses)
    for index in crossings[np.argsort(least[crossings], kind="stable")].tolist():
        if least[index] >= smallest:
            break
        near = complex(branch.values[index])
        one = _root(lambda near, w: float(phase(w, branch.at(w, near))), near, frequency[index : index + 2])
        smallest = min(smallest, float(delay(one, branch.at(one, near))))
    return smallest


def _root(function: Callable[[complex, float], float], near: complex, between: Array) -> float:
    """Where a function of an eigenvalue's neighbourhood and a frequency changes its sign, by halving."""
    low, high = (float(end) for end in between)
    negative = function(near, low) < 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if (function(near, middle) < 0.0) == negative:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
