# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints plans between relative orbital elements; `satform.planning.impulsive_elements` has the formulas."""

import math
from dataclasses import dataclass

import numpy as np

from satform.control.relative_elements import RelativeElements
from satform.planning.impulsive_elements import ElementsPlan, plan_elements
from satform_tools import console
from satform_tools.console import Table
from satform_tools.errors import CommandError
from satform_tools.plan.options import numbers, require_period

NAMES = ("a da", "a dlambda", "a dex", "a dey", "a dix", "a diy")


@dataclass(frozen=True)
class ElementsTask:
    """What `plan elements` takes, as the command line gives it.

    Attributes:
        start: six relative elements at the start, with commas, m.
        wanted: likewise at the end.
        argument: mean argument of latitude of the chief at the start, deg.
        orbits: time that the change takes.
        period: of the chief's orbit, s.
    """

    start: str
    wanted: str
    argument: float
    orbits: float
    period: float


def elements(task: ElementsTask, *, as_json: bool) -> None:
    """Print the pulses from present to wanted relative elements.

    Args:
        task: what is asked.
        as_json: whether to print JSON.

    Raises:
        CommandError: a text is not of its form, or there is no such plan.
    """
    require_period(task.period)
    if not math.isfinite(task.argument):
        raise CommandError(f"--argument {task.argument:g}: takes a finite angle in deg")
    try:
        plan = plan_elements(
            _elements("--start", task.start),
            _elements("--wanted", task.wanted),
            math.tau / task.period,
            # Of large angles no digits would be left for the places of the pulses.
            math.radians(math.fmod(task.argument, 360.0)),
            task.orbits * task.period,
        )
    except ValueError as error:
        raise CommandError(f"--orbits {task.orbits:g}: {error}") from None
    if as_json:
        console.as_json(
            {
                "impulses": [
                    {"time": time, "velocity_change": impulse}
                    for time, impulse in zip(plan.times.tolist(), plan.impulses.tolist(), strict=True)
                ],
                "duration": plan.duration,
                "delta_v": plan.delta_v(),
                "delta_v_bound": plan.bound.total(),
                "tangential_delta_v": plan.tangential_delta_v(),
                "tangential_bound": plan.bound.tangential,
                "normal_delta_v": plan.normal_delta_v(),
                "normal_bound": plan.bound.normal,
                "end_elements": plan.end.as_array().tolist(),
            }
        )
        return
    _print(plan)


def _elements(option: str, text: str) -> RelativeElements:
    try:
        found = numbers(option, text, len(NAMES))
    except CommandError:
        found = [math.inf]
    if not all(abs(number) <= 1e9 for number in found):
        raise CommandError(
            f"{option} {text}: takes six numbers up to 1e9 m with commas between them: {', '.join(NAMES)}"
        )
    return RelativeElements.from_array(np.array(found))


def _print(plan: ElementsPlan) -> None:
    arguments = np.degrees(plan.arguments) % 360.0
    rows = [
        (f"{time:.3f}", f"{argument:.3f}", *(f"{part:.6f}" for part in impulse))
        for time, argument, impulse in zip(
            plan.times.tolist(), arguments.tolist(), plan.impulses.tolist(), strict=True
        )
    ]
    headings = ("time [s]", "argument of latitude [deg]", "x [m/s]", "y [m/s]", "z [m/s]")
    console.table(Table(headings, rows, frozenset(range(5))))
    for axis, spent, bound in (
        ("along the track", plan.tangential_delta_v(), plan.bound.tangential),
        ("along the normal", plan.normal_delta_v(), plan.bound.normal),
        ("together", plan.delta_v(), plan.bound.total()),
    ):
        console.line(f"delta-v {axis}: {spent:.6g} m/s, lower bound {bound:.6g} m/s")
    reached = plan.end.as_array().tolist()
    end = ", ".join(f"{name} {round(value, 3) + 0.0:.3f}" for name, value in zip(NAMES, reached, strict=True))
    console.line(f"after {plan.duration:g} s: {end} (m)")
