# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The quantities of a flight record: their units, shapes and rows, from which all lists of them follow."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from satform.numeric.elementwise import Array

Equipment: TypeAlias = Literal["", "thruster", "attitude", "pointing", "filter", "plans", "attitude_filter"]
"""What a satellite has to have for a quantity; empty for nothing. Pointing is what follows of an attitude;
plans are those of its control law."""

_VECTOR = (3,)


@dataclass(frozen=True)
class Quantity:
    """What is known of a quantity without its numbers.

    Attributes:
        unit: of its numbers.
        shape: of what a satellite has of it in a row: () for a number, (3,) for a vector of x, y and z.
        of_states: whether it is known at the start of a step and has a row for each state, one more than
            steps; what is decided in a step has a row for each step.
        equipment: what a satellite has to have for it.
        without: the number that a record holds for satellites that do not have it.
        hashed_as: name under which a renamed quantity enters the state hash, so that equal flights keep the
            hash of 0.1.0; empty for its own name.
        inputs: quantities of a record that a derived one is made of; empty for those of a record.
    """

    unit: str
    shape: tuple[int, ...] = ()
    of_states: bool = False
    equipment: Equipment = ""
    without: float = math.nan
    hashed_as: str = ""
    inputs: tuple[str, ...] = ()

    @property
    def components(self) -> int:
        """How many numbers a satellite has of it in a row."""
        return math.prod(self.shape)


QUANTITIES: Mapping[str, Quantity] = {
    "position": Quantity("m", _VECTOR, of_states=True),
    "velocity": Quantity("m/s", _VECTOR, of_states=True),
    "measured_position": Quantity("m", _VECTOR, of_states=True),
    "measured_velocity": Quantity("m/s", _VECTOR, of_states=True),
    "acceleration": Quantity("m/s²", _VECTOR),
    "applied_acceleration": Quantity("m/s²", _VECTOR, hashed_as="given_acceleration"),
    "arc_length": Quantity("m", of_states=True),
    "rate": Quantity("m/s", of_states=True),
    "reference_position": Quantity("m", _VECTOR),
    "reference_velocity": Quantity("m/s", _VECTOR),
    "reference_acceleration": Quantity("m/s²", _VECTOR),
    "sliding_variable": Quantity("m/s", _VECTOR),
    "estimated_position_error": Quantity("m", _VECTOR, hashed_as="believed_position_error"),
    "estimated_velocity_error": Quantity("m/s", _VECTOR, hashed_as="believed_velocity_error"),
    "propellant": Quantity("kg", of_states=True, equipment="thruster"),
    "delta_v": Quantity("m/s", of_states=True, equipment="thruster"),
    "saturated_steps": Quantity("steps", (), True, "thruster", 0.0, "clipped"),
    "below_minimum_impulse_steps": Quantity("steps", (), True, "thruster", 0.0, "withheld"),
    "propellant_depleted_steps": Quantity("steps", (), True, "thruster", 0.0, "starved"),
    "mrp": Quantity("1", _VECTOR, of_states=True, equipment="attitude"),
    "angular_velocity": Quantity("rad/s", _VECTOR, of_states=True, equipment="attitude"),
    "wheel_momentum": Quantity("N m s", _VECTOR, of_states=True, equipment="attitude"),
    "wheel_torque": Quantity("N m", _VECTOR, equipment="attitude"),
    "torque_saturated_steps": Quantity("steps", (), True, "attitude", hashed_as="torque_limited"),
    "momentum_saturated_steps": Quantity("steps", (), True, "attitude", hashed_as="momentum_limited"),
    "pointing_error": Quantity("rad", equipment="pointing"),
    "panel_to_sun": Quantity("1", equipment="pointing"),
    "attitude_error": Quantity("1", equipment="pointing"),
    "attitude_rate_error": Quantity("rad/s", equipment="pointing"),
    "estimate_covariance": Quantity("m, m/s, squared", (6, 6), equipment="filter"),
    "innovation": Quantity("1", equipment="filter"),
    "rejected_measurements": Quantity("measurements", equipment="filter"),
    "unsolved_plans": Quantity("plans", equipment="plans"),
    "estimated_mrp": Quantity("1", _VECTOR, equipment="attitude_filter"),
    "estimated_angular_velocity": Quantity("rad/s", _VECTOR, equipment="attitude_filter"),
    "estimated_gyro_bias": Quantity("rad/s", _VECTOR, equipment="attitude_filter"),
    "attitude_covariance": Quantity("rad, rad/s, squared", (6, 6), equipment="attitude_filter"),
    "attitude_innovation": Quantity("1", equipment="attitude_filter"),
    "rejected_attitudes": Quantity("readings", equipment="attitude_filter"),
}
"""The arrays of a `FlightRecord` by their names, in its order; derived ones are in `derived.DERIVED`."""


ORBITAL: Mapping[str, Quantity] = {
    "inertial_position": Quantity("m", _VECTOR, of_states=True),
    "inertial_velocity": Quantity("m/s", _VECTOR, of_states=True),
    "chief_position": Quantity("m", _VECTOR, of_states=True),
    "chief_velocity": Quantity("m/s", _VECTOR, of_states=True),
    "relative_elements": Quantity("m", (6,), of_states=True),
}
"""Quantities that follow from those of a record and the chief's motion, which its scenario gives: inertial
ones in GCRF, and relative orbital elements times the chief's semi-major axis."""


def _names(equipment: Equipment) -> tuple[str, ...]:
    return tuple(name for name, quantity in QUANTITIES.items() if quantity.equipment == equipment)


PROPULSION = _names("thruster")
"""Quantities that the thrusters count."""

ATTITUDE_VECTORS = tuple(
    name for name in _names("attitude") if QUANTITIES[name].of_states and QUANTITIES[name].shape
)
"""Quantities that a satellite measures of its attitude."""

WHEEL_COUNTERS = tuple(name for name in _names("attitude") if not QUANTITIES[name].shape)
"""Quantities that the wheels count."""

POINTING = _names("pointing")
"""Quantities that follow from the attitudes, the other quantities and the scenario."""

ESTIMATES = _names("filter")
"""Quantities of the filters."""

PLANS = _names("plans")
"""Quantities of the plans of control laws."""

ATTITUDE_ESTIMATES = _names("attitude_filter")
"""Quantities of the filters of attitudes."""

OPTIONAL_EQUIPMENT: tuple[Equipment, ...] = ("filter", "plans", "attitude_filter")
"""Equipment without which a record holds nothing of these quantities, not even their names."""

OPTIONAL = (*ESTIMATES, *PLANS, *ATTITUDE_ESTIMATES)
"""Quantities that records of earlier versions do not have."""


def without(equipment: Equipment, satellites: int, steps: int | None) -> dict[str, Array]:
    """What a record holds of satellites without some equipment, or before anything is known of it.

    Args:
        equipment: that they lack.
        satellites: how many.
        steps: of the flight; None for no rows at all.

    Returns:
        The quantities that need the equipment by name, shape (K or K + 1, satellites, ...).
    """
    found: dict[str, Array] = {}
    for name in _names(equipment):
        quantity = QUANTITIES[name]
        rows = 0 if steps is None else steps + quantity.of_states
        found[name] = np.full((rows, satellites, *quantity.shape), quantity.without)
    return found
