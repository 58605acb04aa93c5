# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Fuel-optimal plans against closed forms and another solver."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.optimize import linprog

from satform.control.fuel_optimal_plan import FuelPlan, FuelProblem, solve

PERIOD = 6000.0
RATE = math.tau / PERIOD
EXACT = np.full(6, 1e-7)


def held_motion(rate: float, interval: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition and input of the Clohessy-Wiltshire equations, by a matrix exponential of both at once."""
    motion = np.zeros((9, 9))
    motion[:3, 3:6] = motion[3:6, 6:] = np.eye(3)
    motion[3, 0], motion[5, 2] = 3.0 * rate**2, -(rate**2)
    motion[3, 4], motion[4, 3] = 2.0 * rate, -2.0 * rate
    whole = expm(motion * interval)
    return whole[:6, :6], whole[:6, 6:]


def arrive(
    start: Any, goal: Any, limit: float, *, rate: float, interval: float, count: int, **others: Any
) -> FuelProblem:
    """To be at rest in a place at the end of the last interval."""
    transition, held = held_motion(rate, interval)
    return FuelProblem(
        **{
            "state": np.asarray(start, dtype=np.float64),
            "transitions": np.broadcast_to(transition, (count, 6, 6)),
            "inputs": np.broadcast_to(held, (count, 6, 3)),
            "interval": interval,
            "reference": np.broadcast_to(np.asarray(goal, dtype=np.float64), (count, 6)),
            "tolerance": EXACT,
            "first_bound": count - 1,
            "limit": np.full(3, limit),
            "normals": np.zeros((count, 0, 3)),
            "offsets": np.zeros((count, 0)),
            **others,
        }
    )


def solved(problem: FuelProblem) -> FuelPlan:
    plan = solve(problem, 60)
    assert plan is not None
    return plan


def by_highs(problem: FuelProblem) -> float:
    """Least delta-v by the simplex method, with the commands as the only unknowns."""
    count = len(problem.inputs)
    free, effects = problem.state, np.zeros((6, count, 3))
    for step in range(count):
        free = problem.transitions[step] @ free
        effects = np.einsum("ab,bcd->acd", problem.transitions[step], effects)
        effects[:, step] = problem.inputs[step]
    effect = effects.reshape(6, -1)
    both = np.hstack((effect, -effect))
    scale = np.array([1.0, 1.0, 1.0, 1e3, 1e3, 1e3])
    error = problem.reference[-1] - free
    found = linprog(
        np.full(6 * count, problem.interval),
        A_ub=np.vstack((both, -both)) * np.tile(scale, 2)[:, None],
        b_ub=np.concatenate((problem.tolerance + error, problem.tolerance - error)) * np.tile(scale, 2),
        bounds=list(zip(np.zeros(6 * count), np.tile(problem.limit, 2 * count), strict=True)),
        method="highs-ds",
    )
    return float(found.fun) if found.status == 0 else math.inf


def test_a_move_of_a_double_integrator_is_bang_coast_bang() -> None:
    # Kirk, Optimal Control Theory, ch. 5.5: full thrust, coast, full thrust; 0.2 m/s by 20 s at 0.01 m/s^2,
    # then 60 s of coast, make 16 m in 100 s.
    plan = solved(arrive([0] * 6, [16.0, 0, 0, 0, 0, 0], 0.01, rate=1e-12, interval=10.0, count=10))
    assert plan.commands[:, 0] == pytest.approx([0.01] * 2 + [0.0] * 6 + [-0.01] * 2, abs=1e-7)
    assert np.abs(plan.commands[:, 1:]).max() == 0.0
    assert plan.delta_v == pytest.approx(0.4, rel=1e-6)
    assert plan.states[-1] == pytest.approx([16.0, 0, 0, 0, 0, 0], abs=1e-6)


# Of thrust over a length of time T around the best moment a share of sin(n T / 2) / (n T / 2) acts. The best
# moments are between two intervals of 60 s here.
EFFICIENCY = math.sin(RATE * 60.0) / (RATE * 60.0)


def test_an_inclination_is_removed_at_the_bound_of_normal_impulses() -> None:
    # D'Amico 2010, section 2.4: n times the amplitude, at the nodes.
    start = [0, 0, 100.0, 0, 0, 0]
    plan = solved(arrive(start, [0] * 6, 0.01, rate=RATE, interval=60.0, count=100))
    bound = RATE * 100.0
    assert bound <= plan.delta_v <= bound / EFFICIENCY * (1.0 + 1e-5)


def test_an_eccentricity_is_removed_at_the_bound_of_tangential_impulses() -> None:
    # D'Amico 2010, section 2.4: n/2 times the length of the vector; half an orbit apart they leave no drift.
    amplitude = 100.0
    start = [-amplitude, 0, 0, 0, 2.0 * RATE * amplitude, 0]
    # Where along the track it ends does not matter.
    free = np.array([1e-6, 1e6, 1e-6, 1e-9, 1e-9, 1e-9])
    problem = arrive(start, [0] * 6, 0.01, rate=RATE, interval=60.0, count=150, tolerance=free)
    plan = solved(problem)
    bound = 0.5 * RATE * amplitude
    assert bound <= plan.delta_v <= bound / EFFICIENCY * (1.0 + 1e-5)
    assert np.abs(plan.commands[:, 0]).sum() < 1e-3 * np.abs(plan.commands[:, 1]).sum()


metres = st.floats(-500.0, 500.0)
speeds = st.floats(-0.2, 0.2)


@settings(max_examples=12, deadline=None)
@given(
    st.tuples(metres, metres, metres, speeds, speeds, speeds),
    st.tuples(metres, metres, metres),
    st.floats(2e-4, 5e-3),
)
def test_no_plan_costs_less_than_another_solver_s_and_none_exceeds_the_limits(
    start: Any, goal: Any, limit: float
) -> None:
    wide = np.array([0.5, 0.5, 0.5, 1e-3, 1e-3, 1e-3])
    problem = arrive(start, [*goal, 0, 0, 0], limit, rate=RATE, interval=150.0, count=20, tolerance=wide)
    plan, least = solved(problem), by_highs(problem)
    assert np.abs(plan.commands).max() <= limit
    if math.isinf(least):
        assert plan.outside > 0.0 or np.abs(plan.states[-1, 3:]).max() > 1e-3
    else:
        assert plan.delta_v == pytest.approx(least, rel=1e-5, abs=1e-6)
        assert plan.outside < 1e-4


def test_a_goal_out_of_reach_is_missed_by_no_more_than_full_thrust_leaves() -> None:
    # A double integrator under full thrust all the time: a t^2 / 2.
    free = np.array([1e-3, 1e-3, 1e-3, 1e6, 1e6, 1e6])
    plan = solved(
        arrive([0] * 6, [100.0, 0, 0, 0, 0, 0], 1e-3, rate=1e-12, interval=10.0, count=10, tolerance=free)
    )
    assert plan.outside == pytest.approx(100.0 - 0.5 * 1e-3 * 100.0**2 - 1e-3, rel=1e-6)


def test_a_half_space_is_kept_out_of_at_the_cost_of_a_detour() -> None:
    problem = arrive(
        [0, -200.0, 0, 0, 0, 0], [0, 200.0, 0, 0, 0, 0], 1e-3, rate=1e-12, interval=50.0, count=20
    )
    straight = solved(problem)
    # x at least 30 m in the middle of the way.
    normals = np.broadcast_to(np.array([1.0, 0.0, 0.0]), (20, 1, 3))
    offsets = np.full((20, 1), -1e3)
    offsets[8:12] = 30.0
    detour = solved(replace(problem, normals=normals, offsets=offsets))
    assert np.abs(straight.states[:, 0]).max() < 1e-6
    assert detour.states[7:12, 0].min() > 30.0 - 1e-5
    assert detour.inside < 1e-5
    assert detour.delta_v > straight.delta_v


def test_a_start_within_a_region_leaves_it_first_and_says_so() -> None:
    normals = np.broadcast_to(np.array([1.0, 0.0, 0.0]), (20, 1, 3))
    plan = solved(
        arrive(
            [0.0] * 6, [0.0] * 6, 1e-3, rate=1e-12, interval=50.0, count=20,
            normals=normals, offsets=np.full((20, 1), 50.0),
        )
    )  # fmt: skip
    assert plan.inside > 40.0
    # Not to rest at the goal, which is in the region: the region is dearer.
    assert plan.states[-1, 0] == pytest.approx(50.0, abs=1e-3)


def test_without_iterations_enough_there_is_no_plan() -> None:
    problem = arrive([0] * 6, [16.0, 0, 0, 0, 0, 0], 0.01, rate=1e-12, interval=10.0, count=10)
    assert solve(problem, 2) is None


def test_the_same_problem_has_a_plan_with_the_same_bits() -> None:
    problem = arrive(
        [30.0, -200, 20, 0, 0, 0.01], [0, -50, 0, 0, 0, 0], 1e-3, rate=RATE, interval=100, count=40
    )
    first, again = solved(problem), solved(problem)
    assert first.commands.tobytes() == again.commands.tobytes()
    assert first.iterations == again.iterations
