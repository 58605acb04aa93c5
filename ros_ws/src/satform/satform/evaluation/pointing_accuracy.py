"""How well satellites pointed, from what was recorded of their attitudes."""

import numpy as np

from satform.attitude.ground_pointing import (
    AttitudeReference,
    GroundPointing,
    pointing_error,
    pointing_reference,
)
from satform.attitude.gyrostat import direction_cosines
from satform.attitude.satellite_pointing import SatellitePointing, SatellitePointingSpec, inertial_line
from satform.attitude.tracking import attitude_error
from satform.dynamics.linear import multiply
from satform.flight.satellite import flight_plan
from satform.numeric.elementwise import Array, dot, norm
from satform.numeric.time_derivatives import Jet
from satform.orbits.path_reference import Reference
from satform.scenario.model import Scenario

FIGURES = ("pointing_error", "panel_to_sun", "attitude_error", "attitude_rate_error")
"""Quantities of a flight record that follow from the others and the scenario."""


def attitude_figures(scenario: Scenario, told: dict[str, Array]) -> dict[str, Array]:
    """Quantities of pointing at every step.

    Args:
        scenario: what was flown.
        told: quantities of the flight record by name: position, velocity, mrp, angular_velocity, shape
            (K + 1, N, 3), and reference_position, reference_velocity, reference_acceleration, (K, N, 3).

    Returns:
        Those of `FIGURES`, shape (K, N), not a number for satellites without attitude; of no rows when
        there are none.
    """
    steps, count = told["reference_position"].shape[:2]
    anyone = any(scenario.satellite(index).attitude is not None for index in range(count))
    figures = {name: np.full((steps if anyone else 0, count), np.nan) for name in FIGURES}
    for index in range(count):
        if scenario.satellite(index).attitude is not None and steps:
            for name, values in _of_satellite(scenario, index, told).items():
                figures[name][:, index] = values
    return figures


def _of_satellite(scenario: Scenario, index: int, told: dict[str, Array]) -> dict[str, Array]:
    orientation = flight_plan(scenario, index).orientation
    assert orientation is not None  # noqa: S101 - asked for those with attitude only
    pointing = orientation.pointing
    steps = len(told["reference_position"])
    time: Array = np.arange(steps, dtype=np.float64) * scenario.timing.step
    wanted, sight = _aim(scenario, index, pointing, told, time)
    mrp, rate = told["mrp"][:-1, index], told["angular_velocity"][:-1, index]
    matrix = direction_cosines(mrp)
    error = attitude_error(mrp, rate, wanted)
    sun = multiply(matrix, np.broadcast_to(pointing.sun, mrp.shape))
    return {
        "pointing_error": pointing_error(matrix, pointing.axes.boresight, sight),
        "panel_to_sun": np.abs(dot(sun, np.broadcast_to(pointing.axes.panel_axis, sun.shape))),
        "attitude_error": norm(error.mrp),
        "attitude_rate_error": norm(error.angular_velocity),
    }


def _aim(
    scenario: Scenario,
    index: int,
    pointing: GroundPointing | SatellitePointing,
    told: dict[str, Array],
    time: Array,
) -> tuple[AttitudeReference, Array]:
    """The desired attitude, and the true line of sight in inertial axes, at every step."""
    if isinstance(pointing, GroundPointing):
        line = pointing.line_of_sight(time)
        return pointing_reference(line, pointing.sun, pointing.axes), line.value
    spec = scenario.satellite(index).attitude
    assert spec is not None  # noqa: S101 - asked for those with attitude only
    assert isinstance(spec.pointing, SatellitePointingSpec)  # noqa: S101 - as it was built
    other = [satellite.name for satellite in scenario.satellites].index(spec.pointing.target)

    def desired(column: int) -> Reference:
        names = ("reference_position", "reference_velocity", "reference_acceleration")
        return Reference(*(told[name][:, column] for name in names))

    def flown(column: int) -> Reference:
        position = told["position"][:-1, column]
        return Reference(position, np.zeros_like(position), np.zeros_like(position))

    sight: Jet = inertial_line(flown(index), flown(other), pointing.orbit, time)
    return pointing.reference(desired(index), desired(other), time), sight.value
