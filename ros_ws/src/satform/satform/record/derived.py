# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Quantities that follow from those of a flight: one formula for a whole record and for a block of steps.

All arrays have rows first, then any axes of runs and satellites (...). Of quantities known at the start of a
step only the rows of the steps are used where a formula also takes something that is decided in a step.
"""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Generic, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from satform.navigation.kalman_filter import normalised_error_squared
from satform.numeric.elementwise import Array, norm
from satform.numeric.modified_rodrigues import relative_mrp, rotation_of_mrp
from satform.record.quantities import QUANTITIES, Quantity

Values = TypeVar("Values")


class Derived(Generic[Values]):
    """A derived quantity, as an attribute of a flight.

    Attributes:
        quantity: its unit and shape, and the quantities of a record that it is made of.
    """

    def __init__(self, formula: Callable[[Any], Values], quantity: Quantity, *, cached: bool) -> None:
        """Nothing is computed yet.

        Args:
            formula: takes the flight.
            quantity: what is known of it without its numbers.
            cached: whether every flight caches it after its first use, not only those that cache all.
        """
        self.quantity = quantity
        self.__doc__ = formula.__doc__
        self._formula = formula
        self._cached = cached

    def __repr__(self) -> str:
        return f"<derived from {', '.join(self.quantity.inputs)}>"

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, flight: None, owner: type) -> "Derived[Values]": ...

    @overload
    def __get__(self, flight: "DerivedQuantities", owner: type) -> Values: ...

    def __get__(self, flight: "DerivedQuantities | None", owner: type) -> "Derived[Values] | Values":
        if flight is None:
            return self
        values = self._formula(flight)
        if self._cached or flight.keeps_derived:
            # Python looks here first from now on.
            vars(flight)[self._name] = values
        return values


def derived(
    unit: str, *inputs: str, shape: tuple[int, ...] = (), of_states: bool = False, cached: bool = False
) -> Callable[[Callable[[Any], Values]], Derived[Values]]:
    """Make a method a derived quantity.

    Args:
        unit: of its numbers.
        inputs: quantities of a record that it is made of.
        shape: of what a satellite has of it in a row.
        of_states: whether it has a row for each state.
        cached: whether every flight caches it after its first use, not only those that cache all.
    """
    quantity = Quantity(unit, shape, of_states, inputs=inputs)
    return lambda formula: Derived(formula, quantity, cached=cached)


_POSITION_ERROR = ("position", "reference_position")
_VELOCITY_ERROR = ("velocity", "reference_velocity")


class DerivedQuantities:
    """Derived quantities of whatever has those of a flight: its record, or a block of its steps.

    Shapes are of K steps and of the columns (...): N satellites in a record, R runs of N in a block.
    """

    keeps_derived: ClassVar[bool] = False
    """Whether each is computed once and cached, for the memory of its array."""

    step: float
    clocked: bool
    position: Array
    velocity: Array
    measured_position: Array
    acceleration: Array
    applied_acceleration: Array
    reference_position: Array
    reference_velocity: Array
    estimated_position_error: Array
    estimated_velocity_error: Array
    delta_v: Array
    estimate_covariance: Array
    mrp: Array
    estimated_mrp: Array
    attitude_covariance: Array

    @derived("m", *_POSITION_ERROR, shape=(3,))
    def position_error(self) -> Array:
        """Position less reference, m, shape (K, ..., 3)."""
        return _error(self.position, self.reference_position)

    @derived("m/s", *_VELOCITY_ERROR, shape=(3,))
    def velocity_error(self) -> Array:
        """Velocity less reference, m/s, shape (K, ..., 3)."""
        return _error(self.velocity, self.reference_velocity)

    @derived("m", *_POSITION_ERROR)
    def tracking_error(self) -> Array:
        """Length of the position error, m, shape (K, ...)."""
        return norm(self.position_error)

    @derived("m/s²", "acceleration")
    def control(self) -> Array:
        """Length of the commanded acceleration, m/s^2, shape (K, ...)."""
        return norm(self.acceleration)

    @derived("m/s", "delta_v", "applied_acceleration")
    def effort(self) -> Array:
        """Delta-v of each step, m/s, shape (K, ...): as the thrusters count it, or of the command.

        It takes the state after each step, so that only a record and a block with K + 1 states have it: the
        last block of a flight, and those of `StepEnds`.
        """
        if len(self.delta_v) != len(self.applied_acceleration) + 1:
            raise ValueError("the delta-v of a block's last step needs the state after it; see StepEnds")
        counted = np.diff(self.delta_v, axis=0)
        uncounted = np.isnan(counted)
        if not uncounted.any():
            return counted
        return np.where(uncounted, self.step * norm(self.applied_acceleration), counted)

    @derived("m", "measured_position", "position", of_states=True)
    def navigation_error(self) -> Array:
        """Distance between measured and true position, m, shape (K or K + 1, ...): a row for each state."""
        return norm(self.measured_position - self.position)

    @derived("m", "estimated_position_error", *_POSITION_ERROR)
    def estimation_error(self) -> Array:
        """Distance between estimated and true position, m, shape (K, ...)."""
        return norm(self.estimated_position_error - self.position_error)

    @derived(
        "1",
        *("estimate_covariance", "estimated_position_error", *_POSITION_ERROR),
        *("estimated_velocity_error", *_VELOCITY_ERROR),
        cached=True,
    )
    def estimation_error_squared(self) -> Array:
        """Normalised estimation error squared (NEES) of the filters, shape (K, ...); no rows without one.

        Mean 6 for a consistent filter; not a number where there is none.
        """
        if not len(self.estimate_covariance):
            return np.empty((0, *self.position_error.shape[1:-1]))
        off = (
            self.estimated_position_error - self.position_error,
            self.estimated_velocity_error - self.velocity_error,
        )
        return normalised_error_squared(np.concatenate(off, axis=-1), self.estimate_covariance)

    @derived("rad", "estimated_mrp", "mrp", cached=True)
    def attitude_estimation_error(self) -> Array:
        """Angle between estimated and true attitude, rad, shape (K, ...); no rows without a filter of it."""
        return norm(rotation_of_mrp(self._attitude_off()))

    @derived("1", "estimated_mrp", "mrp", "attitude_covariance", cached=True)
    def attitude_error_squared(self) -> Array:
        """Normalised error squared of estimated attitudes, shape (K, ...); no rows without a filter.

        Mean 3 for a consistent filter; not a number where there is none.
        """
        return normalised_error_squared(
            rotation_of_mrp(self._attitude_off()), self.attitude_covariance[..., :3, :3]
        )

    def _attitude_off(self) -> Array:
        """Modified Rodrigues parameters from estimated to true body axes, shape (K, ..., 3)."""
        estimated = self.estimated_mrp
        return relative_mrp(self.mrp[: len(estimated)], estimated) if len(estimated) else estimated

    @derived("", "reference_position", "acceleration", cached=True)
    def absent(self) -> NDArray[np.bool_]:
        """In which steps a satellite does not fly, shape (K, ...): no command and no reference."""
        without: NDArray[np.bool_] = np.isnan(self.reference_position[..., 0])
        if without.any():
            for axis in range(3):
                without &= np.isnan(self.reference_position[..., axis])
                without &= self.acceleration[..., axis] == 0.0
        return without

    @derived("", "reference_position", "acceleration", cached=True)
    def not_flown(self) -> NDArray[np.bool_]:
        """In which steps a satellite computes nothing, shape (K, ...): it does not fly, or skips the step.

        On the wall clock a step is skipped when its state comes too late; the command before it is held. A
        satellite of which no step has a reference does not publish it, and skips none.
        """
        if not self.clocked:
            return self.absent
        skipped: NDArray[np.bool_] = np.isnan(self.reference_position[..., 0])
        if not skipped.any():
            return skipped
        for axis in (1, 2):
            skipped &= np.isnan(self.reference_position[..., axis])
        return self.absent | (skipped & ~skipped.all(axis=0))


DERIVED: Mapping[str, Quantity] = {
    name: made.quantity for name, made in vars(DerivedQuantities).items() if isinstance(made, Derived)
}
"""Derived quantities by their names."""

COLUMNS: Mapping[str, Quantity] = {**QUANTITIES, **DERIVED}
"""All that a record has for each satellite, by name."""


def _error(values: Array, reference: Array) -> Array:
    """A motion less its reference.

    Args:
        values: position or velocity at the start of each step, shape (K or K + 1, ..., 3).
        reference: of each step, in the same unit, shape (K, ..., 3).

    Returns:
        Shape (K, ..., 3).
    """
    difference: Array = values[: len(reference)] - reference
    return difference


def excusable_rows(not_flown: NDArray[np.bool_], rows: int, *, clocked: bool) -> NDArray[np.bool_]:
    """Where what a satellite does not give may be left out, for rows of steps or of states.

    Args:
        not_flown: in which steps it computes nothing, shape (K, ...).
        rows: how many, K or K + 1.
        clocked: whether the flight went by the wall clock. A step that is skipped lacks the phase for the
            next one, too, which is computed in it.

    Returns:
        Shape (rows, ...).
    """
    whole = absent_of_rows(not_flown, rows)
    if clocked:
        whole[1:] |= not_flown[: rows - 1]
    return whole


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
