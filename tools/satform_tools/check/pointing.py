# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about singular attitudes of the plan: short lines of sight, the Sun, and fast turns."""

import math
from dataclasses import dataclass

import numpy as np

from satform.attitude.ground_pointing import SHORTEST_SIGHT, AttitudeReference, GroundPointing
from satform.attitude.satellite_pointing import SatellitePointingSpec, inertial_line
from satform.attitude.yaw_steering import SUN_CONE
from satform.flight.compile_satellite import flight_plan
from satform.flight.plans import FlightPlan
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Path, Reference
from satform.scenario import Scenario

_SAMPLES = 4000
"""Moments of the flight that are looked at."""

_SHORT = 1.0
"""Length of a line of sight below which its direction means little, m."""


_RATE_LEFT = 0.02
"""Rate error that a step may leave of the desired attitude's own motion, rad/s."""


@dataclass(frozen=True)
class _Sight:
    """Where a satellite points at some moments of the plan.

    Attributes:
        target: at which it points, for a sentence.
        line: of sight, inertial, m, shape (m, 3).
        wanted: desired attitude.
    """

    target: str
    line: Array
    wanted: AttitudeReference


def pointing_warnings(scenario: Scenario) -> list[str]:
    """Sentences about lines of sight and desired attitudes that the plan makes singular, or too fast."""
    steps, step = scenario.timing.steps, scenario.timing.step
    time = np.unique(np.linspace(0, steps, min(_SAMPLES, steps) + 1).round()) * step
    found = []
    for index, own in enumerate(scenario.satellites):
        orientation = flight_plan(scenario, index).orientation
        if orientation is None:
            continue
        where, now = f"attitude of {own.name}", _sight(scenario, index, time)
        found += _sentences(where, now.target, now.line, (time, orientation.pointing.sun))
        held = now.wanted
        if scenario.satellite(index).feedforward_sample == "midpoint":
            held = _sight(scenario, index, time + 0.5 * step).wanted
        change = (
            _sight(scenario, index, time + step).wanted.angular_velocity
            - now.wanted.angular_velocity
            - step * held.angular_acceleration
        )
        found += _hurried(where, change, time, step)
    return found


def _sight(scenario: Scenario, index: int, time: Array) -> _Sight:
    """What the plan has a satellite point at, at times in s of shape (m,)."""
    plan, spec = flight_plan(scenario, index), scenario.satellite(index).attitude
    assert plan.orientation is not None  # noqa: S101 - asked for those with attitude only
    assert spec is not None  # noqa: S101
    pointing = plan.orientation.pointing
    if isinstance(pointing, GroundPointing):
        return _Sight("the ground", pointing.line_of_sight(time).value, pointing.reference(time))
    assert isinstance(spec.pointing, SatellitePointingSpec)  # noqa: S101 - as it was built
    target = spec.pointing.target
    other = [satellite.name for satellite in scenario.satellites].index(target)
    here, there = _planned(plan, time), _planned(flight_plan(scenario, other), time)
    line = inertial_line(here, there, pointing.orbit, time).value
    return _Sight(target, line, pointing.reference(here, there, time))


def _hurried(where: str, left: Array, time: Array, step: float) -> list[str]:
    """A sentence about a desired attitude that a torque held over a step cannot follow.

    Args:
        where: whose attitude it is.
        left: rate that is left over at the end of the steps, rad/s, shape (m, 3).
        time: of the begin of the steps, s, shape (m,).
        step: control period, s.
    """
    rate = np.linalg.norm(left, axis=-1)
    worst = int(np.argmax(rate))
    if not rate[worst] > _RATE_LEFT:
        return []
    return [
        f"{where}: at {time[worst]:g} s the desired attitude turns so fast that a torque held for {step:g} s "
        f"leaves a rate error of {rate[worst]:.3g} rad/s; shorten the step"
    ]


def _planned(plan: FlightPlan, time: Array) -> Reference:
    """Desired motion once all agree, from the start of the satellite's own arc length."""
    path: Path = plan.path
    rate = np.full(time.shape, float(plan.nominal_rate))
    return path.reference(float(plan.arc_length) + rate * time, rate, np.zeros_like(rate))


def _sentences(where: str, target: str, line: Array, of: tuple[Array, Array]) -> list[str]:
    time, sun = of
    length = np.linalg.norm(line, axis=-1)
    nearest = int(np.argmin(length))
    if length[nearest] < _SHORT:
        return [
            f"{where}: at {time[nearest]:g} s its reference is {length[nearest]:.3g} m from that of its "
            f"target {target}; below {SHORTEST_SIGHT:g} m it takes the safe attitude"
        ]
    across = np.linalg.norm(np.cross(line, sun), axis=-1)
    angle = np.arctan2(across, np.abs(line @ sun))
    worst = int(np.argmin(angle))
    if angle[worst] > SUN_CONE:
        return []
    side = "the sun" if line[worst] @ sun > 0.0 else "the direction away from the sun"
    return [
        f"{where}: at {time[worst]:g} s the line of sight to {target} is {math.degrees(angle[worst]):.3g} "
        f"deg from {side}; within {math.degrees(SUN_CONE):g} deg the panels are not turned to the sun, and "
        "close to it the satellite may turn fast about its line of sight"
    ]
