# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The classical Runge-Kutta method for motion in LVLH under a held command, in equal parts of a step."""

from collections.abc import Callable

from satform.dynamics.cw_model import CwState
from satform.dynamics.prescribed_disturbances import Perturbation
from satform.dynamics.protocol import total_perturbation
from satform.numeric.elementwise import Array

Force = Callable[[float, Array, Array], Array]
"""Acceleration (m/s^2) from the time since the start of the step (s), position (m) and velocity (m/s)."""


def advance_held(
    state: CwState,
    command: Array,
    force: Force,
    perturbations: tuple[Perturbation, ...],
    grid: tuple[int, float, int],
) -> CwState:
    """The state one control period later.

    Args:
        state: at the start of the step.
        command: held over the step, m/s^2, shape (N, 3).
        force: acceleration besides, shape (N, 3).
        perturbations: added to it, functions of time.
        grid: number of the step, its length (s), and the number of parts into which it is divided.

    Returns:
        Position and velocity at the end of the step.

    Source: Kutta 1901: the classical method of fourth order.
    """
    step, duration, parts = grid
    position, velocity = state.position, state.velocity
    part = duration / parts
    half = 0.5 * part

    def held_acceleration(offset: float) -> Array:
        return command + (total_perturbation(perturbations, step, offset) if perturbations else 0.0)

    for number in range(parts):
        begins, middles, ends = (
            number * part,
            (number + 0.5) * part,
            (number + 1.0) * part,
        )
        begin, middle, end = held_acceleration(begins), held_acceleration(middles), held_acceleration(ends)
        first = begin + force(begins, position, velocity)
        second_velocity = velocity + half * first
        second = middle + force(middles, position + half * velocity, second_velocity)
        third_velocity = velocity + half * second
        third = middle + force(middles, position + half * second_velocity, third_velocity)
        fourth_velocity = velocity + part * third
        fourth = end + force(ends, position + part * third_velocity, fourth_velocity)
        position = position + part / 6.0 * (
            velocity + 2.0 * (second_velocity + third_velocity) + fourth_velocity
        )
        velocity = velocity + part / 6.0 * (first + 2.0 * (second + third) + fourth)
    return CwState(position, velocity)
