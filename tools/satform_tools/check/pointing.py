"""Warnings about pointing whose geometry is singular along the plan: into the sun, or at the own position."""

import math

import numpy as np

from satform.control.pointing import SHORTEST_SIGHT, GroundPointing
from satform.control.satellite_pointing import SatellitePointingSpec, inertial_line
from satform.control.yaw_steering import SUN_CONE
from satform.elementwise import Array
from satform.reference import Path, Reference
from satform.satellite import FlightPlan, flight_plan
from satform.scenario import Scenario

_SAMPLES = 4000
"""Moments of the flight that are looked at."""

_SHORT = 1.0
"""Length of a line of sight below which its direction means little, m."""


def pointing_warnings(scenario: Scenario) -> list[str]:
    """Sentences about lines of sight that come near the sun's direction, or to nothing, by the plan."""
    steps = scenario.timing.steps
    time = np.unique(np.linspace(0, steps, min(_SAMPLES, steps) + 1).round()) * scenario.timing.step
    found = []
    for index, own in enumerate(scenario.satellites):
        spec = scenario.satellite(index).attitude
        if spec is None:
            continue
        plan = flight_plan(scenario, index)
        assert plan.orientation is not None  # noqa: S101 - it has an attitude
        pointing = plan.orientation.pointing
        if isinstance(pointing, GroundPointing):
            target, line = "the ground", pointing.line_of_sight(time).value
        else:
            assert isinstance(spec.pointing, SatellitePointingSpec)  # noqa: S101 - as it was built
            target = spec.pointing.target
            other = [satellite.name for satellite in scenario.satellites].index(target)
            motions = (_planned(plan, time), _planned(flight_plan(scenario, other), time))
            line = inertial_line(*motions, pointing.orbit, time).value
        found += _sentences(f"attitude of {own.name}", target, line, (time, pointing.sun))
    return found


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
            f"{where}: at {time[nearest]:g} s the plan has it {length[nearest]:.3g} m from {target}, at "
            f"which it points. Below {SHORTEST_SIGHT:g} m it has its safe attitude"
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
        "on the way there the satellite may turn fast about its line of sight"
    ]
