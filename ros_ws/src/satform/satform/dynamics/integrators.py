# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Integrators of the truth models: fixed step, adaptive, and exponential about the CW equations.

The fixed-step and exponential ones do the same operations, in the same order, for every satellite,
whatever flies beside it; the adaptive one is meant to be called with one satellite at a time.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.dynamics.cw import input_matrix, transition_matrix
from satform.numeric.elementwise import Array

Derivative = Callable[[float, Array], Array]
"""Time in s and state of any shape, to the state's rate of change of the same shape."""


@dataclass(frozen=True)
class Tableau:
    """Coefficients of an explicit Runge-Kutta method of `s` stages.

    Attributes:
        order: of convergence.
        nodes: fractions of the step at which the stages stand, s of them.
        stages: row i weighs the rates of stages 0..i-1, shape (i, 1).
        weights: of the rates in the step, shape (s, 1).
    """

    order: int
    nodes: tuple[float, ...]
    stages: tuple[Array, ...]
    weights: Array


def _tableau(order: int, nodes: Any, stages: Any, weights: Any) -> Tableau:
    rows = tuple(np.array(stages[i][:i], dtype=np.float64)[:, None] for i in range(len(nodes)))
    return Tableau(order, tuple(float(c) for c in nodes), rows, np.array(weights, dtype=np.float64)[:, None])


@functools.cache
def rk4() -> Tableau:
    """The classical method of order 4: four stages (Kutta 1901)."""
    stages = ((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0))
    return _tableau(4, (0.0, 0.5, 0.5, 1.0), stages, (1 / 6, 1 / 3, 1 / 3, 1 / 6))


@functools.cache
def rk8() -> Tableau:
    """The twelve-stage method of order 8 of Dormand & Prince (Hairer, Norsett & Wanner, II.5)."""
    from scipy.integrate import DOP853  # noqa: PLC0415  half a second to import, not needed by rk4

    return _tableau(8, DOP853.C, DOP853.A, DOP853.B)


TABLEAUS: dict[str, Callable[[], Tableau]] = {"rk4": rk4, "rk8": rk8}
"""Fixed-step methods by the name under which a scenario chooses them."""


def substeps(duration: float, maximum_step: float) -> int:
    """How many equal parts a control period is cut into, none longer than the maximum.

    Args:
        duration: control period, s.
        maximum_step: s.

    Returns:
        At least 1.
    """
    return max(1, math.ceil(duration / maximum_step * (1.0 - 1e-12)))


MOST_SUBSTEPS = 1_000_000
"""Sub-steps of one control period; more are refused, since a flight with them would not end."""


def substep_complaint(duration: float, maximum_step: float) -> str | None:
    """Why a control period is not divided into sub-steps of some length.

    Args:
        duration: control period, s.
        maximum_step: longest sub-step, s.

    Returns:
        A sentence, or None where there are at most `MOST_SUBSTEPS`.
    """
    count = duration / maximum_step
    if count <= MOST_SUBSTEPS * (1.0 + 1e-9):
        return None
    return (
        f"sub-steps of at most {maximum_step:g} s are {count:.3g} in a control period of {duration:g} s, and "
        f"at most {MOST_SUBSTEPS:g} are allowed; give at least {duration / MOST_SUBSTEPS:g} s"
    )


def weighted_sum(weights: Array, rates: Array) -> Array:
    """Sum of stage rates, in the order of the stages for every component.

    Args:
        weights: shape (s, 1).
        rates: shape (s, ...) with at least two components a stage.

    Returns:
        Shape (...). Summing over the slow axis adds whole stages one after another, so a component's
        bits do not depend on how many components there are.
    """
    count = len(weights)
    total: Array = (weights * rates[:count].reshape(count, -1)).sum(axis=0).reshape(rates.shape[1:])
    return total


def increment(tableau: Tableau, derivative: Derivative, time: float, state: Array, step: float) -> Array:
    """Change of the state over one Runge-Kutta step.

    The sums run over what each stage's rate has more than the first: the rounded coefficients of an
    eighth-order method do not add up to its nodes, which on the full rates costs a tenth of a
    millimetre in a week of low orbit.

    Args:
        tableau: the method.
        derivative: right-hand side.
        time: at the start of the step, s.
        state: any shape with at least two components.
        step: s.

    Returns:
        What has to be added to the state, same shape.
    """
    first = derivative(time, state)
    excess = np.zeros((len(tableau.nodes), *state.shape))
    for index in range(1, len(tableau.nodes)):
        node = tableau.nodes[index]
        reached = state + step * (node * first + weighted_sum(tableau.stages[index], excess))
        excess[index] = derivative(time + node * step, reached) - first
    change: Array = step * (first + weighted_sum(tableau.weights, excess))
    return change


def add_compensated(state: Array, remainder: Array, change: Array) -> tuple[Array, Array]:
    """Sum that carries what rounding took away.

    Without it the rounding of a position of 7e6 m, a nanometre a step, drifts to a tenth of a
    millimetre in a week.

    Args:
        state: any shape.
        remainder: lost so far, same shape.
        change: to be added, same shape.

    Returns:
        The new state and the new remainder.

    Source: Kahan 1965; Hairer, Lubich & Wanner, Geometric Numerical Integration, VIII.5.
    """
    addend = change + remainder
    total = state + addend
    return total, addend - (total - state)


@dataclass(frozen=True)
class FixedStep:
    """A Runge-Kutta method with equal sub-steps inside the control period.

    Attributes:
        tableau: the method.
        maximum_step: longest sub-step, s.
    """

    tableau: Tableau
    maximum_step: float

    def advance(
        self, derivative: Derivative, time: float, state: Array, remainder: Array, duration: float
    ) -> tuple[Array, Array]:
        """The state after `duration`.

        Args:
            derivative: right-hand side.
            time: at the start, s.
            state: any shape with at least two components.
            remainder: rounding carried along (zeros at first), same shape.
            duration: s.

        Returns:
            The new state and the new remainder.
        """
        parts = substeps(duration, self.maximum_step)
        step = duration / parts
        for part in range(parts):
            change = increment(self.tableau, derivative, time + part * step, state, step)
            state, remainder = add_compensated(state, remainder, change)
        return state, remainder


@dataclass(frozen=True)
class Adaptive:
    """Dormand & Prince's method of order 8 with step control, by scipy.

    Attributes:
        relative_tolerance: of the local error.
        absolute_tolerance: of the local error, in the state's unit.
    """

    relative_tolerance: float
    absolute_tolerance: float

    def solve(self, derivative: Derivative, time: float, state: Array, duration: float) -> Any:
        """The solution from `time` to `time + duration`.

        Args:
            derivative: right-hand side.
            time: at the start, s.
            state: any shape.
            duration: s.

        Returns:
            Callable of the time in s that gives the state as a flat array, and the final state in
            the shape given.

        Raises:
            ArithmeticError: the step became too small for the tolerances.
        """
        from scipy.integrate import solve_ivp  # noqa: PLC0415  half a second to import

        def flat(at: float, values: Array) -> Array:
            return derivative(at, values.reshape(state.shape)).ravel()

        solution = solve_ivp(
            flat,
            (time, time + duration),
            state.ravel(),
            method="DOP853",
            rtol=self.relative_tolerance,
            atol=self.absolute_tolerance,
            dense_output=True,
        )
        if not solution.success:
            raise ArithmeticError(f"adaptive integration stopped at {solution.t[-1]} s: {solution.message}")
        return solution.sol, solution.y[:, -1].reshape(state.shape)


def _apply(columns: tuple[Array, ...], values: Array) -> Array:
    """A matrix, given by its columns, times row vectors; element-wise, in the order of the columns."""
    total = columns[0] * values[..., 0:1]
    for index in range(1, len(columns)):
        total = total + columns[index] * values[..., index : index + 1]
    return total


def _columns(matrix: Array) -> tuple[Array, ...]:
    return tuple(np.ascontiguousarray(matrix[:, index]) for index in range(matrix.shape[1]))


@dataclass(frozen=True)
class ExponentialStep:
    """A Runge-Kutta step that takes the CW equations exactly and approximates only the rest.

    The state is carried along the exact solution of the linear part with the command held; the
    method's weights act on what the remaining acceleration adds to it (integrating factor). Without
    a remaining acceleration the step is exact, whatever its length.

    Attributes:
        tableau: the method.
        step: length, s.
        transitions: for each stage and for the end, columns of the transition matrix from the start.
        inputs: for each stage and for the end, columns of the held command's response.
        returns: for each stage, columns that carry its acceleration back to the start of the step.

    Source: Lawson 1967 (generalised Runge-Kutta processes); Clohessy & Wiltshire 1960.
    """

    tableau: Tableau
    step: float
    transitions: tuple[tuple[Array, ...], ...]
    inputs: tuple[tuple[Array, ...], ...]
    returns: tuple[tuple[Array, ...], ...]

    def advance(self, state: Array, held: Array, remaining: Callable[[float, Array], Array]) -> Array:
        """The state after one step.

        Args:
            state: LVLH position in m and velocity in m/s, shape (N, 6).
            held: acceleration held over the step, m/s^2, shape (N, 3).
            remaining: time since the start of the step in s and state (N, 6), to the acceleration
                that the CW equations leave out, m/s^2, shape (N, 3).

        Returns:
            Shape (N, 6).
        """
        method, step = self.tableau, self.step
        rates = np.empty((len(method.nodes), *state.shape))
        rates[0] = _apply(self.returns[0], remaining(0.0, state))
        for index in range(1, len(method.nodes)):
            carried = state + step * weighted_sum(method.stages[index], rates)
            reached = _apply(self.transitions[index], carried) + _apply(self.inputs[index], held)
            rest = remaining(method.nodes[index] * step, reached)
            rates[index] = _apply(self.returns[index], rest)
        carried = state + step * weighted_sum(method.weights, rates)
        return _apply(self.transitions[-1], carried) + _apply(self.inputs[-1], held)


def exponential_step(tableau: Tableau, mean_motion: float, step: float) -> ExponentialStep:
    """The exponential step of one length about one CW orbit.

    Args:
        tableau: the method.
        mean_motion: of the chief's circular orbit, rad/s.
        step: s.

    Returns:
        The step with all its coefficients.
    """
    offsets = [node * step for node in tableau.nodes]
    return ExponentialStep(
        tableau=tableau,
        step=step,
        transitions=tuple(_columns(transition_matrix(mean_motion, at)) for at in (*offsets, step)),
        inputs=tuple(_columns(input_matrix(mean_motion, at)) for at in (*offsets, step)),
        returns=tuple(_columns(transition_matrix(mean_motion, -at)[:, 3:]) for at in offsets),
    )
