# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What thrusters make of a command: limits, errors, and the propellant it costs.

A command that cannot be applied is applied as far as possible, and counted.
"""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from satform.common.angle_text import OR_DEGREES
from satform.common.spec import NonNegative, Positive, Spec
from satform.numeric.elementwise import Array, cross, dot, norm, over_arrays

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of free fall, m/s^2, in the definition of specific impulse."""

ERRORS_PER_STEP = 4
"""Standard normal numbers that `Thruster.fire` wants: one for magnitude, three for pointing."""


@dataclass(frozen=True)
class Propulsion:
    """The state of one satellite's propulsion, or of many stacked.

    Attributes:
        propellant: left in the tank, kg, shape (...).
        delta_v: applied so far, m/s, shape (...): lengths added, or axes added if each has its thruster.
        saturated_steps: steps in which the command was above the thrust limit, shape (...).
        below_minimum_impulse_steps: steps in which a command was below the smallest
            impulse and not applied, shape (...).
        propellant_depleted_steps: steps in which the tank could not give the rest, shape (...).
        applied: acceleration in the step before, m/s^2, shape (..., 3).
        mass: of the satellite at the start of the step before, kg, shape (...).
    """

    propellant: Array
    delta_v: Array
    saturated_steps: Array
    below_minimum_impulse_steps: Array
    propellant_depleted_steps: Array
    applied: Array
    mass: Array


@dataclass(frozen=True)
class ThrusterFault:
    """What is wrong with thrusters in a step.

    Attributes:
        factor: of the thrust that they apply, 1 for sound ones, shape (...).
        stuck: 1 for thrusters whose valves stay as they are, 0 otherwise, shape (...).
    """

    factor: Array
    stuck: Array


@dataclass(frozen=True)
class Thruster:
    """The propulsion of one satellite, or of many stacked along a leading axis.

    Attributes:
        step: control period, s, shape (...).
        dry_mass: kg, shape (...).
        propellant: at the start, kg, shape (...).
        maximum_thrust: N, infinite for no limit, shape (...).
        minimum_impulse: N s, shape (...).
        impulse_quantum: N s, 0 for none, shape (...).
        exhaust_speed: m/s, infinite for no consumption, shape (...).
        magnitude_error: standard deviation relative to the thrust, shape (...).
        pointing_error: standard deviation of the rotation about each axis, rad, shape (...).
        per_axis: 1 for a thruster pair along each axis, 0 for one thruster that is turned, shape (...).
    """

    step: Array
    dry_mass: Array
    propellant: Array
    maximum_thrust: Array
    minimum_impulse: Array
    impulse_quantum: Array
    exhaust_speed: Array
    magnitude_error: Array
    pointing_error: Array
    per_axis: Array

    def start(self) -> Propulsion:
        """The propulsion before the first step: tank full, nothing counted."""
        zero = np.zeros_like(self.propellant)
        still, mass = np.zeros((*zero.shape, 3)), self.dry_mass + self.propellant
        return Propulsion(self.propellant, zero, zero, zero, zero, still, mass)

    def fire(
        self,
        propulsion: Propulsion,
        command: Array,
        errors: Array,
        fault: ThrusterFault | None = None,
    ) -> tuple[Array, Propulsion]:
        """One step of thrust.

        Args:
            propulsion: before the step.
            command: wanted acceleration, held over the step, m/s^2, shape (..., 3).
            errors: standard normal numbers, shape (..., 4).
            fault: what is wrong with the thrusters in this step; None for nothing.

        Returns:
            The acceleration really applied, m/s^2, shape (..., 3), and the propulsion after the step. A
            command that needs no limit and meets no error is returned to the last bit. Delta-v, propellant
            and an empty tank follow what is applied, also under a fault.

        Source: Sutton & Biblarz, Rocket Propulsion Elements, ch. 4 (rocket equation).
        """
        mass = self.dry_mass + propulsion.propellant
        strength = np.where(self.per_axis[..., None] > 0.0, np.abs(command), norm(command)[..., None])
        reached, over, under = self._limited(strength, mass)
        applied = command * np.divide(reached, strength, out=np.zeros_like(strength), where=strength > 0.0)
        applied = self._disturbed(applied, errors)
        if fault is not None:
            applied = self._faulty(applied, fault, propulsion, mass)
        fraction, burnt = self._burn(applied, mass, propulsion.propellant)
        applied = applied * fraction[..., None]
        return applied, replace(
            propulsion,
            propellant=propulsion.propellant - burnt,
            delta_v=propulsion.delta_v + self._effort(applied) * self.step,
            saturated_steps=propulsion.saturated_steps + over,
            below_minimum_impulse_steps=propulsion.below_minimum_impulse_steps + under,
            propellant_depleted_steps=propulsion.propellant_depleted_steps + (fraction < 1.0),
            applied=applied,
            mass=mass,
        )

    def _faulty(self, applied: Array, fault: ThrusterFault, propulsion: Propulsion, mass: Array) -> Array:
        """What thrusters apply under a fault, as long as there is propellant.

        A factor does not lift the thrust above what the hardware gives. Stuck thrusters apply the thrust of
        the step before, whatever is commanded and whatever factor holds besides.
        """
        strength = np.where(self.per_axis[..., None] > 0.0, np.abs(applied), norm(applied)[..., None])
        limit = (self.maximum_thrust / mass)[..., None]
        most = np.divide(limit, strength, out=np.full_like(strength, np.inf), where=strength > 0.0)
        factor = np.minimum(fault.factor[..., None], np.maximum(most, 1.0))
        held = propulsion.applied * (propulsion.mass / mass)[..., None]
        return np.where(fault.stuck[..., None] > 0.0, held, applied * factor)

    def _limited(self, strength: Array, mass: Array) -> tuple[Array, Array, Array]:
        """Acceleration that the thrusters can give; whether it was above, and below, what they can."""
        impulse_mass = (mass * self.step)[..., None]
        limit = np.broadcast_to((self.maximum_thrust / mass)[..., None], strength.shape)
        quantum = self.impulse_quantum[..., None] / impulse_mass
        reached = np.minimum(strength, limit)
        coarse = quantum > 0.0
        if coarse.any():
            unit = np.where(coarse, quantum, 1.0)
            # A whole number of quanta, and never one more than the limit holds.
            count = np.minimum(np.rint(reached / unit), np.floor(limit / unit * (1.0 + 1e-12)))
            reached = np.where(coarse, count * unit, reached)
        # Rounding of the division must not withhold an impulse that equals the smallest one.
        least = self.minimum_impulse[..., None] / impulse_mass * (1.0 - 1e-12)
        reached = np.where(reached < least, 0.0, reached)
        under = (strength > 0.0) & (reached == 0.0)
        return reached, _any_axis(strength > limit), _any_axis(under)

    def _disturbed(self, acceleration: Array, errors: Array) -> Array:
        """Thrust of the wrong size (relative) in the wrong direction (turned, length kept)."""
        longer = acceleration * (1.0 + self.magnitude_error * errors[..., 0])[..., None]
        # Half the rotation vector is to first order the Gibbs vector, whose rotation needs no sine.
        gibbs = 0.5 * self.pointing_error[..., None] * errors[..., 1:4]
        across = cross(gibbs, longer)
        twice = (2.0 / (1.0 + dot(gibbs, gibbs)))[..., None]
        turned: Array = longer + twice * (across + cross(gibbs, across))
        return turned

    def _effort(self, acceleration: Array) -> Array:
        """Acceleration that costs propellant, m/s^2, shape (...)."""
        size = np.abs(acceleration)
        axes_added = size[..., 0] + size[..., 1] + size[..., 2]
        return np.where(self.per_axis > 0.0, axes_added, norm(acceleration))

    def _burn(self, acceleration: Array, mass: Array, propellant: Array) -> tuple[Array, Array]:
        """The fraction of the step that the tank can feed, and the propellant it takes, kg."""
        exponent = self._effort(acceleration) * self.step / self.exhaust_speed
        wanted = mass * _burnt_fractions(exponent)
        short = wanted > propellant
        if not short.any():
            return np.ones_like(wanted), wanted
        available = _logarithms(mass / self.dry_mass)
        fraction = np.where(short, np.divide(available, exponent, out=np.ones_like(wanted), where=short), 1.0)
        return fraction, np.where(short, propellant, wanted)


def _any_axis(flags: NDArray[np.bool_]) -> Array:
    """1 where the flag of any axis is set, shape (..., 3) to (...)."""
    any_set: Array = (flags[..., 0] | flags[..., 1] | flags[..., 2]).astype(np.float64)
    return any_set


def _burnt_fraction(exponent: float) -> float:
    return -math.expm1(-exponent)


_burnt_fractions = over_arrays(_burnt_fraction)
_logarithms = over_arrays(math.log)


class ThrusterSpec(Spec):
    """Propulsion of a satellite; what is left out is ideal: no limit, no error, no consumption."""

    dry_mass: Positive
    """Mass without propellant [kg]."""
    propellant: NonNegative = 0.0
    """Propellant at the start [kg]."""
    arrangement: Literal["per_axis", "single"] = "per_axis"
    """per_axis: a pair of thrusters along each LVLH axis; single: one thruster that is turned."""
    maximum_thrust: Positive | None = None
    """Largest thrust, of each axis or of the single thruster [N]; no limit when left out."""
    minimum_impulse: NonNegative | None = None
    """Smallest impulse that can be applied [N s]; a smaller one is not applied, and counted."""
    minimum_pulse: NonNegative | None = None
    """Shortest pulse at full thrust [s], instead of `minimum_impulse`."""
    impulse_quantum: NonNegative = 0.0
    """Impulses are whole multiples of this [N s]; 0 for any impulse."""
    specific_impulse: Positive | None = None
    """Specific impulse [s]; nothing is consumed when left out."""
    magnitude_error: Annotated[float, Field(ge=0.0, le=0.3)] = 0.0
    """Standard deviation of the thrust relative to itself, drawn anew each step."""
    pointing_error: Annotated[float, Field(ge=0.0, le=0.3), OR_DEGREES] = 0.0
    """Standard deviation of the rotation of the thrust about each axis, drawn anew each step [rad]."""

    @model_validator(mode="after")
    def _consistent(self) -> "ThrusterSpec":
        if self.minimum_impulse is not None and self.minimum_pulse is not None:
            raise ValueError("give minimum_impulse [N s] or minimum_pulse [s], not both")
        if self.minimum_pulse is not None and self.maximum_thrust is None:
            raise ValueError("minimum_pulse [s] needs maximum_thrust [N], at which the pulse is fired")
        if self.propellant > 0.0 and self.specific_impulse is None:
            raise ValueError("propellant [kg] is never used without specific_impulse [s]; give that too")
        return self

    def resolution(self, step: float) -> float:
        """Acceleration of the smallest impulse or the impulse quantum on the satellite without propellant.

        Args:
            step: control period, s.

        Returns:
            The larger of both, m/s^2; 0 for thrusters without either.
        """
        smallest = self.minimum_impulse or 0.0
        if self.minimum_pulse is not None and self.maximum_thrust is not None:
            smallest = self.minimum_pulse * self.maximum_thrust
        return max(smallest, self.impulse_quantum) / (self.dry_mass * step)

    @property
    def largest_error(self) -> float:
        """Share of a command by which the thrust hardly ever differs from it: four standard deviations."""
        return 4.0 * math.hypot(self.magnitude_error, math.sqrt(2.0) * self.pointing_error)

    def build(self, step: float) -> Thruster:
        """The propulsion itself.

        Args:
            step: control period, s.

        Raises:
            ValueError: the shortest pulse is longer than the control period.
        """
        thrust = math.inf if self.maximum_thrust is None else self.maximum_thrust
        minimum = self.minimum_impulse or 0.0
        if self.minimum_pulse is not None:
            minimum = self.minimum_pulse * thrust
        if minimum > thrust * step * (1.0 + 1e-9):
            raise ValueError(
                f"the smallest impulse, {minimum:g} N s, is above what {thrust:g} N give in a step of "
                f"{step:g} s: no command could ever be flown"
            )
        exhaust_speed = math.inf
        if self.specific_impulse is not None:
            exhaust_speed = self.specific_impulse * STANDARD_GRAVITY
        values = {
            "step": step,
            "dry_mass": self.dry_mass,
            "propellant": self.propellant,
            "maximum_thrust": thrust,
            "minimum_impulse": minimum,
            "impulse_quantum": self.impulse_quantum,
            "exhaust_speed": exhaust_speed,
            "magnitude_error": self.magnitude_error,
            "pointing_error": self.pointing_error,
            "per_axis": float(self.arrangement == "per_axis"),
        }
        return Thruster(**{name: np.asarray(value, dtype=np.float64) for name, value in values.items()})
