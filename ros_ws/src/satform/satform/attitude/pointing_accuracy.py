# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How well satellites pointed, from what was recorded of their attitudes."""

from collections.abc import Sequence

import numpy as np

from satform.attitude.ground_pointing import (
    AttitudeReference,
    GroundPointing,
    pointing_error,
    pointing_reference,
)
from satform.attitude.guidance import Orientation
from satform.attitude.mrp_tracking import attitude_error
from satform.attitude.satellite_pointing import inertial_line
from satform.dynamics.linear import multiply
from satform.numeric.elementwise import Array, dot, norm
from satform.numeric.modified_rodrigues import direction_cosines
from satform.numeric.time_derivatives import Jet
from satform.orbits.path_reference import Reference

FIGURES = ("pointing_error", "panel_to_sun", "attitude_error", "attitude_rate_error")
"""Quantities of a flight record that follow from the others and the scenario."""


def attitude_figures(
    orientations: Sequence[Orientation | None],
    step: float,
    measured: dict[str, Array],
    first_step: int = 0,
) -> dict[str, Array]:
    """Quantities of pointing at every step.

    Args:
        orientations: where each satellite points; None for one without attitude.
        step: control period, s.
        measured: quantities of the flight record by name: position, velocity, mrp, angular_velocity, shape
            (K + 1, N, 3), and reference_position, reference_velocity, reference_acceleration, (K, N, 3).
        first_step: number of the step that the first row belongs to.

    Returns:
        Those of `FIGURES`, shape (K, N), not a number for satellites without attitude; of no rows when
        there are none.
    """
    steps, count = measured["reference_position"].shape[:2]
    anyone = any(orientation is not None for orientation in orientations)
    figures = {name: np.full((steps if anyone else 0, count), np.nan) for name in FIGURES}
    for index, orientation in enumerate(orientations):
        if orientation is not None and steps:
            time: Array = (first_step + np.arange(steps, dtype=np.float64)) * step
            for name, values in _of_satellite(orientation, index, measured, time).items():
                figures[name][:, index] = values
    return figures


def _of_satellite(
    orientation: Orientation, index: int, measured: dict[str, Array], time: Array
) -> dict[str, Array]:
    pointing = orientation.pointing
    wanted, sight = _aim(orientation, index, measured, time)
    mrp, rate = measured["mrp"][:-1, index], measured["angular_velocity"][:-1, index]
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
    orientation: Orientation, index: int, measured: dict[str, Array], time: Array
) -> tuple[AttitudeReference, Array]:
    """The desired attitude, and the true line of sight in inertial axes, at every step."""
    pointing, target = orientation.pointing, orientation.target
    if isinstance(pointing, GroundPointing):
        line = pointing.line_of_sight(time)
        return pointing_reference(line, pointing.sun, pointing.axes), line.value
    assert target is not None  # noqa: S101 - built together
    other = int(target.satellite)

    def desired(column: int) -> Reference:
        names = ("reference_position", "reference_velocity", "reference_acceleration")
        return Reference(*(measured[name][:, column] for name in names))

    def flown(column: int) -> Reference:
        position = measured["position"][:-1, column]
        return Reference(position, np.zeros_like(position), np.zeros_like(position))

    sight: Jet = inertial_line(flown(index), flown(other), pointing.orbit, time)
    return pointing.reference(desired(index), desired(other), time), sight.value
