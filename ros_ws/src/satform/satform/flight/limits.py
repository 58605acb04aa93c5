# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The check of every step: is everything finite, and within the limits of the scenario?

What is true is checked by the plant before a step is taken; what a satellite computes in a step, by the
satellite itself. The first violation ends the flight at its step: of the truth the first satellite's, else of
what was computed, in the order of the scenario; of one satellite's quantities, the first of the table below.

The check of a step without a violation is a scalar product for each quantity: where the sum of the squares of
all satellites' components is below the square of the limit, no vector is longer than it. What is not finite
fails any comparison.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from satform.flight.plans import LimitPlan
from satform.numeric.elementwise import Array
from satform.numeric.positive_definite import NotPositiveDefiniteError
from satform.orbits.earth import EQUATORIAL_RADIUS
from satform.record.early_end import EarlyEnd
from satform.scenario.limits import LimitsSpec

if TYPE_CHECKING:
    from satform.attitude.guidance import Attitude
    from satform.flight.plant import Plant
    from satform.flight.satellite_step import Decision

LARGEST = 1e15
"""Limit of quantities that have none of their own, in SI units; no number of a scenario is larger."""

_ROUNDING = 1e-9
"""Relative distance from a limit within which it is looked at more closely."""

Bound = Literal["distance", "speed", "acceleration", "angular_rate", "altitude", ""]


@dataclass(frozen=True)
class Quantity:
    """Something that is checked.

    Attributes:
        name: in words.
        unit: of it.
        bound: the field of the scenario's limits that holds for it; empty for `LARGEST`.
        not_finite: the likely cause of a value that is not finite.
        beyond: the likely cause of one beyond the limit.
    """

    name: str
    unit: str
    bound: Bound
    not_finite: str
    beyond: str


_UNSTABLE = "a control loop that is unstable at these gains and this control period"
_DRIFT = "motion that no command held back: an error at the start, or a loop without enough authority"
_FILTER = "a filter that diverges, or measurements that are no longer those of the model"
_NO_ESTIMATE = (
    "a filter that diverges or whose covariance is lost, which a larger acceleration density or a larger "
    "noise of its sensors prevents"
)
_CURVE = "geometry that is singular at this phase of the curve, or a scale too small to be computed with"
_PHASE = "a consensus on the phase that is unstable at these gains and this control period"
_LAW = "a control law that divides by zero or overflows here"
_POINTING = "pointing that is singular here: two directions in line, or a target at the satellite's own place"
_TURNING = "pointing that is singular at the start, or attitude dynamics that overflow"
_GROUND = "an orbit that leads below the limit"

QUANTITIES: tuple[Quantity, ...] = (
    Quantity("estimated position", "m", "distance", _NO_ESTIMATE, _FILTER),
    Quantity("estimated velocity", "m/s", "speed", _FILTER, _FILTER),
    Quantity("reference position", "m", "distance", _CURVE, _PHASE),
    Quantity("reference velocity", "m/s", "speed", _CURVE, _PHASE),
    Quantity("reference acceleration", "m/s^2", "acceleration", _CURVE, _PHASE),
    Quantity("sliding variable", "m/s", "", _LAW, _UNSTABLE),
    Quantity("commanded acceleration", "m/s^2", "acceleration", _LAW, _UNSTABLE),
    Quantity("commanded wheel torque", "N m", "", _POINTING, _UNSTABLE),
    Quantity("announced phase or motion", "m, m/s", "", _PHASE, _PHASE),
)
"""What a satellite computes in a step, in the order in which one follows from the other; its number in a
command message is one more than its index here."""

_THRUST = "a thruster model that overflows"
_DYNAMICS = "dynamics that are singular here"
_APPLIED = Quantity("applied acceleration", "m/s^2", "acceleration", _THRUST, _UNSTABLE)
_POSITION = Quantity("position", "m", "distance", _DYNAMICS, _DRIFT)
_VELOCITY = Quantity("velocity", "m/s", "speed", _DYNAMICS, _DRIFT)
_ALTITUDE = Quantity("altitude", "m", "altitude", _DYNAMICS, _GROUND)
_RATE = Quantity("angular velocity", "rad/s", "angular_rate", _TURNING, _UNSTABLE)
_ATTITUDE = Quantity("attitude", "1", "", _TURNING, _UNSTABLE)
_MOMENTUM = Quantity("wheel momentum", "N m s", "", _TURNING, _UNSTABLE)

_Rows = tuple[Quantity, Array, Sequence[int]]
"""A quantity, its vectors (M, n), and the satellites that they belong to."""


def computed_values(decision: "Decision", announced: Array) -> tuple[Array | None, ...]:
    """What is checked of what satellites compute in a step.

    Args:
        decision: of one satellite, or of many stacked.
        announced: numbers that each of them announces for the next step, shape (..., width).

    Returns:
        Values of each of `QUANTITIES`, in order; None for one that the satellites do not compute.
    """
    motion, reference = decision.motion, decision.reference
    return (
        motion.position,
        motion.velocity,
        reference.position,
        reference.velocity,
        reference.acceleration,
        decision.sliding_variable,
        decision.acceleration,
        decision.wheel_torque,
        announced,
    )


def true_values(plant: "Plant") -> tuple[tuple[Quantity, Array], ...]:
    """What is checked of the true states of all satellites: quantities and their vectors, shape (N, 3).

    The second one is the position.
    """
    motion = plant.motion()
    return ((_APPLIED, plant.applied), (_POSITION, motion.position), (_VELOCITY, motion.velocity))


def attitude_values(attitude: "Attitude") -> tuple[tuple[Quantity, Array], ...]:
    """What is checked of true attitudes: quantities and their vectors, shape (M, 3)."""
    return (
        (_RATE, attitude.angular_velocity),
        (_ATTITUDE, attitude.mrp),
        (_MOMENTUM, attitude.wheel_momentum),
    )


def limit_values(limits: LimitsSpec) -> dict[Bound, float]:
    """The limit of each `Quantity.bound`, in SI units."""
    return {
        "distance": limits.distance,
        "speed": limits.speed,
        "acceleration": limits.acceleration,
        "angular_rate": limits.angular_rate,
        "altitude": limits.altitude,
        "": LARGEST,
    }


@dataclass(frozen=True)
class Violation:
    """What a satellite computed that it must not fly by.

    Attributes:
        number: of the quantity, 1 for the first of `QUANTITIES`.
        value: its length; not a number where it is not finite.
    """

    number: int
    value: float


def _not_computed(name: str) -> Violation:
    return Violation(1 + [quantity.name for quantity in QUANTITIES].index(name), math.nan)


NO_COMMAND = _not_computed("commanded acceleration")
"""Of a satellite whose computation raised an ArithmeticError, as Python's own division by zero does."""

NO_ESTIMATE = _not_computed("estimated position")
"""Of a satellite whose filter has lost its covariance."""


def violation_of(error: ArithmeticError) -> Violation:
    """What a satellite could not compute in a step.

    Args:
        error: that its computation raised.
    """
    return NO_ESTIMATE if isinstance(error, NotPositiveDefiniteError) else NO_COMMAND


class LimitCheck:
    """Checks a flight."""

    def __init__(self, plan: LimitPlan) -> None:
        """Take the limits of a flight."""
        self._names = list(plan.names)
        self._step = plan.step
        limits = plan.limits
        self._limits = limit_values(limits)
        self._squares = [self._limits[quantity.bound] ** 2 for quantity in QUANTITIES]
        self._lowest = EQUATORIAL_RADIUS + limits.altitude
        # A chief below the ground is no real one, and its satellites have no altitude.
        self._has_ground = plan.chief_radius > max(self._lowest, EQUATORIAL_RADIUS)
        self._everyone = range(len(self._names))

    # What a satellite computes

    def of_decision(self, decision: "Decision", announced: Array) -> dict[int, Violation]:
        """What satellites computed in a step that is not finite or beyond its limit.

        Args:
            decision: of one satellite, or of many stacked.
            announced: numbers that each of them announces for the next step, shape (..., width).

        Returns:
            The first violation of each satellite that has one, by its row; row 0 for one satellite alone.
        """
        computed = computed_values(decision, announced)
        for values, square in zip(computed, self._squares, strict=True):
            if values is not None and not np.vdot(values, values) <= square:
                return self._violations(computed)
        return {}

    def _violations(self, computed: Sequence[Array | None]) -> dict[int, Violation]:
        found: dict[int, Violation] = {}
        for number, (quantity, values) in enumerate(zip(QUANTITIES, computed, strict=True), start=1):
            if values is None:
                continue
            for row, length in enumerate(_lengths(values)):
                if row not in found and not length <= self._limits[quantity.bound]:
                    found[row] = Violation(number, length)
        return found

    def computed_end(self, violations: dict[int, Violation], step: int) -> EarlyEnd | None:
        """How a flight ends because of what satellites computed.

        Args:
            violations: by the satellites' indices in the scenario.
            step: in which they computed it.

        Returns:
            The end by the first of these satellites; None when there is no violation.
        """
        if not violations:
            return None
        first = min(violations)
        violation = violations[first]
        return self._end(QUANTITIES[violation.number - 1], first, violation.value, step)

    # What is true

    def of_plant(self, plant: "Plant") -> EarlyEnd | None:
        """How a flight ends because of what is true at the plant's present step; None when it goes on."""
        checked: list[_Rows] = [(*pair, self._everyone) for pair in true_values(plant)]
        for group in plant.turning:
            members = group.members.tolist()
            checked += [(*pair, members) for pair in attitude_values(group.measured())]
        squares: list[Any] = [np.vdot(values, values) for _, values, _ in checked]
        within = all(
            square <= self._limits[quantity.bound] ** 2
            for square, (quantity, _, _) in zip(squares, checked, strict=True)
        )
        if within and (not self._has_ground or not plant.may_be_below(self._lowest, squares[1])):
            return None
        if self._each_within(plant, checked):
            return None
        return self._first(plant, checked)

    def _each_within(self, plant: "Plant", checked: Iterable[_Rows]) -> bool:
        """Whether each satellite is within the limits by more than roundings.

        The sum over all satellites of a large formation may be beyond a limit though none of them is.
        """
        margin = 1.0 - _ROUNDING
        for quantity, values, _ in checked:
            limit = self._limits[quantity.bound] * margin
            if not (values * values).sum(axis=-1).max() <= limit * limit:
                return False
        return not self._has_ground or bool(plant.earth_distance().min() * margin >= self._lowest)

    def _first(self, plant: "Plant", checked: Iterable[_Rows]) -> EarlyEnd | None:
        """The end by the first satellite that has a violation."""
        found: dict[int, tuple[Quantity, float]] = {}
        for quantity, values, members in checked:
            for satellite, length in zip(members, _lengths(values), strict=True):
                if satellite not in found and not length <= self._limits[quantity.bound]:
                    found[satellite] = (quantity, length)
        if self._has_ground:
            for satellite, distance in enumerate(plant.earth_distance().tolist()):
                if satellite not in found and not distance >= self._lowest:
                    found[satellite] = (_ALTITUDE, distance - EQUATORIAL_RADIUS)
        if not found:
            return None
        first = min(found)
        quantity, value = found[first]
        drifts = quantity.beyond is _DRIFT and bool(np.any(plant.applied[first]))
        return self._end(quantity, first, value, plant.step, _UNSTABLE if drifts else None)

    def _end(
        self, quantity: Quantity, satellite: int, value: float, step: int, cause: str | None = None
    ) -> EarlyEnd:
        finite = math.isfinite(value)
        return EarlyEnd(
            satellite=self._names[satellite],
            quantity=quantity.name,
            step=step,
            time=step * self._step,
            value=value if finite else math.nan,
            limit=self._limits[quantity.bound],
            unit=quantity.unit,
            cause=(cause or quantity.beyond) if finite else quantity.not_finite,
        )


def _lengths(vectors: Array) -> list[float]:
    """Length of each vector, shape (..., n) to a list; not a number where a component is not finite."""
    rows = np.atleast_2d(vectors).tolist()
    lengths = (math.hypot(*row) for row in rows)
    return [length if math.isfinite(length) else math.nan for length in lengths]
