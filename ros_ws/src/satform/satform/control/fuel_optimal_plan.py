# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The fuel-optimal plan of held accelerations as a linear program, solved by Clarabel.

Equations: docs/controllers/model_predictive.md.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.dynamics.linear import multiply
from satform.numeric.elementwise import Array, Indices, dot

_BOX_PRICE = 10.0
"""Cost of an error outside of its box, in delta-v for a change of velocity by it within one interval."""

_KEEP_OUT_PRICE = 1000.0
"""Likewise of a position within a region to keep out of: dearer, so that a box gives way to a region."""

_NEGLIGIBLE = 1e-6
"""Part of the largest acceleration below which a command is the solver's tolerance and none."""


@dataclass(frozen=True)
class FuelProblem:
    """What a plan of N intervals has to do, of one satellite.

    Attributes:
        state: position and velocity now, LVLH, m and m/s, shape (6,).
        transitions: of the state over each interval, shape (N, 6, 6).
        inputs: effect of an acceleration held over each interval, shape (N, 6, 3).
        interval: length of each, s.
        reference: desired state at the end of each interval, shape (N, 6).
        tolerance: largest error of position and velocity, per axis, shape (6,).
        first_bound: index of the first interval whose end has to be within the tolerance; N for none.
        limit: largest acceleration, per axis, m/s^2, shape (3,).
        normals: of half-spaces that both ends of each interval have to be in, shape (N, K, 3).
        offsets: least component of the position along each normal, m, shape (N, K).
    """

    state: Array
    transitions: Array
    inputs: Array
    interval: float
    reference: Array
    tolerance: Array
    first_bound: int
    limit: Array
    normals: Array
    offsets: Array

    def propagated(self, commands: Array) -> Array:
        """States at the ends of the intervals under held accelerations.

        Args:
            commands: LVLH, m/s^2, shape (N, 3).

        Returns:
            Shape (N, 6).
        """
        state, states = self.state, np.empty((len(commands), 6))
        for step, command in enumerate(commands):
            state = multiply(self.transitions[step], state) + multiply(self.inputs[step], command)
            states[step] = state
        return states


@dataclass(frozen=True)
class FuelPlan:
    """A solution.

    Attributes:
        commands: acceleration to hold over each interval, LVLH, m/s^2, shape (N, 3).
        states: to which they lead, at the ends of the intervals, shape (N, 6).
        delta_v: sum of the magnitudes of all components times the interval, m/s.
        cost: delta-v and the prices of all that is violated, m/s.
        outside: largest distance of a position from its box, 0 within all of them, m.
        inside: largest depth of a position behind its half-space, 0 for none, m.
        iterations: that the solver took.
    """

    commands: Array
    states: Array
    delta_v: float
    cost: float
    outside: float
    inside: float
    iterations: int


class _Rows:
    """Rows of a sparse matrix with their right-hand sides, gathered block by block."""

    def __init__(self) -> None:
        self._entries: list[tuple[Indices, Indices, Array]] = []
        self._sides: list[Array] = []
        self.count = 0

    def add(self, parts: list[tuple[Indices, Array]], side: Array) -> None:
        """Rows whose r-th has, in each part, the coefficients `part[1][r]` in the columns `part[0][r]`.

        Args:
            parts: columns and coefficients, each of shape (rows, entries).
            side: shape (rows,).
        """
        rows = np.arange(self.count, self.count + len(side), dtype=np.int64)
        for columns, values in parts:
            where = np.broadcast_to(rows[:, None], columns.shape)
            self._entries.append(
                (where.ravel(), columns.ravel(), np.broadcast_to(values, columns.shape).ravel())
            )
        self._sides.append(side)
        self.count += len(side)

    def matrix(self, columns: int) -> Any:
        """The matrix in compressed columns, without explicit zeros."""
        from scipy.sparse import csc_matrix  # noqa: PLC0415  slow to import, and few laws need it

        row, column, value = (np.concatenate([entry[part] for entry in self._entries]) for part in range(3))
        found = csc_matrix((value, (row, column)), shape=(self.count, columns))
        found.eliminate_zeros()
        found.sort_indices()
        return found

    def side(self) -> Array:
        """All right-hand sides."""
        return np.concatenate(self._sides)


@dataclass(frozen=True)
class _Columns:
    """Which unknowns are what.

    Attributes:
        states: at the ends of the intervals, shape (N, 6).
        up: commands along the axes, shape (N, 3).
        down: commands against them, shape (N, 3).
        excess: of the states over their boxes, for the bound intervals, shape (N - first, 6).
        depth: of the positions behind their half-spaces, shape (N, K).
        count: of all.
    """

    states: Indices
    up: Indices
    down: Indices
    excess: Indices
    depth: Indices
    count: int

    @classmethod
    def of(cls, problem: FuelProblem) -> "_Columns":
        """Of a problem."""
        steps, regions = problem.offsets.shape
        shapes = ((steps, 6), (steps, 3), (steps, 3), (steps - problem.first_bound, 6), (steps, regions))
        blocks, count = [], 0
        for rows, each in shapes:
            blocks.append(count + np.arange(rows * each, dtype=np.int64).reshape(rows, each))
            count += rows * each
        states, up, down, excess, depth = blocks
        return cls(states, up, down, excess, depth, count)


def solve(problem: FuelProblem, iterations: int) -> FuelPlan | None:
    """The plan with the least sum of the commands' magnitudes, in each component, that meets the bounds.

    Bounds on the commands and the equations of motion hold in every plan. Boxes and half-spaces that no
    plan can meet are violated as little as their prices say, so that there is a plan for every state.

    Args:
        problem: what it has to do.
        iterations: largest number of the solver's iterations.

    Returns:
        The plan; None if the solver has not reached its tolerance within the iterations.

    Source: sum of 1-norms as in Tillerson, Inalhan & How 2002; exact penalties as in Kerrigan & Maciejowski
    2000. The solver: Goulart & Chen, Clarabel, an interior-point method.
    """
    columns = _Columns.of(problem)
    rows = _Rows()
    _motion_rows(rows, problem, columns)
    equations = rows.count
    _limit_rows(rows, problem, columns)
    _box_rows(rows, problem, columns)
    _region_rows(rows, problem, columns)
    found = _solved(rows, equations, _cost(problem, columns), iterations)
    return None if found is None else _plan(problem, columns, found)


def _motion_rows(rows: _Rows, problem: FuelProblem, columns: _Columns) -> None:
    """Each state follows from the one before: x - A x' - B (up - down) = 0."""
    for part in (slice(0, 1), slice(1, None)):
        states, inputs = columns.states[part].reshape(-1, 1), problem.inputs[part].reshape(-1, 3)
        parts = [
            (states, np.ones(states.shape)),
            (np.repeat(columns.up[part], 6, axis=0), -inputs),
            (np.repeat(columns.down[part], 6, axis=0), inputs),
        ]
        if part.start:
            before = np.repeat(columns.states[:-1], 6, axis=0)
            parts.append((before, -problem.transitions[part].reshape(-1, 6)))
            rows.add(parts, np.zeros(len(states)))
        else:
            rows.add(parts, multiply(problem.transitions[0], problem.state))


def _limit_rows(rows: _Rows, problem: FuelProblem, columns: _Columns) -> None:
    """All accelerations are within 0 and the limit, and all excess is positive."""
    accelerations = np.concatenate((columns.up.ravel(), columns.down.ravel()))
    limits = np.tile(problem.limit, 2 * len(columns.up))
    rows.add([(accelerations[:, None], np.ones((len(accelerations), 1)))], limits)
    positive = np.concatenate((accelerations, columns.excess.ravel(), columns.depth.ravel()))
    rows.add([(positive[:, None], -np.ones((len(positive), 1)))], np.zeros(len(positive)))


def _box_rows(rows: _Rows, problem: FuelProblem, columns: _Columns) -> None:
    """|state - reference| <= tolerance + excess, from the first bound interval on."""
    if columns.excess.size == 0:
        return
    states = columns.states[problem.first_bound :].ravel()[:, None]
    excess = columns.excess.ravel()[:, None]
    desired = problem.reference[problem.first_bound :].ravel()
    tolerance = np.tile(problem.tolerance, len(columns.excess))
    one = np.ones((len(states), 1))
    rows.add([(states, one), (excess, -one)], tolerance + desired)
    rows.add([(states, -one), (excess, -one)], tolerance - desired)


def _region_rows(rows: _Rows, problem: FuelProblem, columns: _Columns) -> None:
    """Normal . position + depth >= offset at both ends of each interval but where it is now."""
    for region in range(columns.depth.shape[1]):
        normals, offsets = problem.normals[:, region], problem.offsets[:, region]
        depth = columns.depth[:, region][:, None]
        rows.add([(columns.states[:, :3], -normals), (depth, -np.ones(depth.shape))], -offsets)
        if len(depth) > 1:
            rows.add(
                [
                    (columns.states[:-1, :3], -normals[1:]),
                    (depth[1:], -np.ones((len(columns.up) - 1, 1))),
                ],
                -offsets[1:],
            )


def _cost(problem: FuelProblem, columns: _Columns) -> Array:
    """Delta-v, and prices in m/s."""
    cost = np.zeros(columns.count)
    cost[columns.up] = cost[columns.down] = problem.interval
    cost[columns.excess] = _BOX_PRICE * np.repeat([1.0 / problem.interval, 1.0], 3)
    cost[columns.depth] = _KEEP_OUT_PRICE / problem.interval
    return cost


def _solved(rows: _Rows, equations: int, cost: Array, iterations: int) -> tuple[Array, float, int] | None:
    """Unknowns, their cost and the iterations taken; None short of the tolerance."""
    import clarabel  # noqa: PLC0415  an extra that only this law needs
    from scipy.sparse import csc_matrix  # noqa: PLC0415  slow to import, and few laws need it

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = iterations
    # Its own factorisation runs in one thread and has no code for some processors only: same bits everywhere.
    settings.direct_solve_method = "qdldl"
    settings.max_threads = 1
    size = len(cost)
    cones = [clarabel.ZeroConeT(equations), clarabel.NonnegativeConeT(rows.count - equations)]
    # A solver of its own for each plan: one that is updated keeps the scaling of its first problem.
    solver = clarabel.DefaultSolver(
        csc_matrix((size, size)), cost, rows.matrix(size), rows.side(), cones, settings
    )
    solution = solver.solve()
    if solution.status != clarabel.SolverStatus.Solved:
        return None
    return np.array(solution.x, dtype=np.float64), float(solution.obj_val), int(solution.iterations)


def _plan(problem: FuelProblem, columns: _Columns, solution: tuple[Array, float, int]) -> FuelPlan:
    """Commands within their limits, and the motion that they lead to."""
    unknowns, cost, iterations = solution
    commands = unknowns[columns.up] - unknowns[columns.down]
    commands = np.where(np.abs(commands) < _NEGLIGIBLE * problem.limit, 0.0, commands)
    commands = np.minimum(np.maximum(commands, -problem.limit), problem.limit)
    states = problem.propagated(commands)
    error = np.abs(states - problem.reference)[problem.first_bound :, :3] - problem.tolerance[:3]
    behind = problem.offsets - dot(problem.normals, states[:, None, :3])
    return FuelPlan(
        commands=commands,
        states=states,
        delta_v=float(np.sum(np.abs(commands)) * problem.interval),
        cost=cost,
        outside=max(0.0, float(np.max(error, initial=0.0))),
        inside=max(0.0, float(np.max(behind, initial=0.0))),
        iterations=iterations,
    )
