# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Quantities that follow from those of a flight: one formula for a whole record and for a block of steps.

All arrays have rows first, then any axes of runs and satellites (...). Of quantities known at the start of a
step only the rows of the steps are used where a formula also takes something that is decided in a step.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from satform.equipment.kalman_filter import normalised_error_squared
from satform.numeric.elementwise import Array, norm

DERIVED: Mapping[str, tuple[str, ...]] = {
    "position_error": ("position", "reference_position"),
    "velocity_error": ("velocity", "reference_velocity"),
    "tracking_error": ("position", "reference_position"),
    "control": ("acceleration",),
    "effort": ("delta_v", "applied_acceleration"),
    "navigation_error": ("measured_position", "position"),
    "estimation_error": ("estimated_position_error", "position", "reference_position"),
    "estimation_error_squared": (
        *("estimate_covariance", "estimated_position_error", "position", "reference_position"),
        *("estimated_velocity_error", "velocity", "reference_velocity"),
    ),
    "absent": ("reference_position", "acceleration"),
}
"""Names of derived quantities, and the quantities of a record that each is made of."""


def error(values: Array, reference: Array) -> Array:
    """A motion less its reference.

    Args:
        values: position or velocity at the start of each step, shape (K or K + 1, ..., 3).
        reference: of each step, in the same unit, shape (K, ..., 3).

    Returns:
        Shape (K, ..., 3).
    """
    difference: Array = values[: len(reference)] - reference
    return difference


def effort(delta_v: Array, applied_acceleration: Array, step: float) -> Array:
    """Delta-v of each step: as the thrusters count it, or of the applied acceleration where they do not.

    Args:
        delta_v: counted so far, m/s, shape (K + 1, ...); NaN where there is no thruster.
        applied_acceleration: m/s^2, shape (K, ..., 3).
        step: control period, s.

    Returns:
        m/s, shape (K, ...).
    """
    counted = np.diff(delta_v, axis=0)
    uncounted = np.isnan(counted)
    if not uncounted.any():
        return counted
    return np.where(uncounted, step * norm(applied_acceleration), counted)


def navigation_error(measured_position: Array, position: Array) -> Array:
    """Distance between measured and true position, m; shapes (rows, ..., 3), gives (rows, ...)."""
    return norm(measured_position - position)


def estimation_error(estimated_position_error: Array, position_error: Array) -> Array:
    """Distance between estimated and true position, m; shapes (K, ..., 3), gives (K, ...)."""
    return norm(estimated_position_error - position_error)


def estimation_error_squared(
    estimate_covariance: Array,
    estimated_position_error: Array,
    position_error: Array,
    estimated_velocity_error: Array,
    velocity_error: Array,
) -> Array:
    """Normalised estimation error squared (NEES) of the filters.

    Args:
        estimate_covariance: of (position, velocity) in m and m/s, shape (K, ..., 6, 6); or without rows.
        estimated_position_error: estimated position less reference, m, shape (K, ..., 3).
        position_error: true position less reference, m, shape (K, ..., 3).
        estimated_velocity_error: estimated velocity less reference, m/s, shape (K, ..., 3).
        velocity_error: true velocity less reference, m/s, shape (K, ..., 3).

    Returns:
        Shape (K, ...), NaN where there is no filter; no rows where nobody has one.
    """
    if not len(estimate_covariance):
        return np.empty((0, *position_error.shape[1:-1]))
    off = (estimated_position_error - position_error, estimated_velocity_error - velocity_error)
    return normalised_error_squared(np.concatenate(off, axis=-1), estimate_covariance)


def absent(reference_position: Array, acceleration: Array) -> NDArray[np.bool_]:
    """In which steps a satellite does not fly: it commands nothing and has no reference.

    Args:
        reference_position: m, shape (K, ..., 3).
        acceleration: commanded, m/s^2, shape (K, ..., 3).

    Returns:
        Shape (K, ...).
    """
    without: NDArray[np.bool_] = np.isnan(reference_position[..., 0])
    if without.any():
        for axis in range(3):
            without &= np.isnan(reference_position[..., axis])
            without &= acceleration[..., axis] == 0.0
    return without


def absent_of_rows(absent_steps: NDArray[np.bool_], rows: int) -> NDArray[np.bool_]:
    """Where a satellite does not fly, for rows of steps or of states.

    Args:
        absent_steps: in which steps it does not, shape (K, ...).
        rows: how many, K or K + 1.

    Returns:
        Shape (rows, ...); the state after the last step is like that step.
    """
    whole = np.zeros((rows, *absent_steps.shape[1:]), dtype=np.bool_)
    whole[: len(absent_steps)] = absent_steps[:rows]
    if len(absent_steps):
        # What a satellite would have sent of the state after the last step.
        whole[len(absent_steps) :] = absent_steps[-1:]
    return whole
