# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A truth model that a scenario gives by formulas of the acceleration.

A model that needs more than formulas is a package of one's own with an entry point in `satform.dynamics`.
"""

import keyword
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.common.spec import Complaint, Number, Positive, Spec
from satform.dynamics.circular_gravity import CircularGravity, GravityKind, circular_gravity
from satform.dynamics.cw_model import CwState, LvlhStateDynamics
from satform.dynamics.held_runge_kutta import advance_held
from satform.dynamics.integrators import substeps
from satform.dynamics.prescribed_disturbances import Perturbation
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.specs import PerturbedDynamicsSpec, substep_complaints
from satform.numeric.elementwise import Array
from satform.numeric.formula import FUNCTIONS, LONGEST, Formula, parse_formula

QUANTITIES = ("x", "y", "z", "vx", "vy", "vz", "t", "n")
"""What a formula may depend on: position (m), velocity (m/s), time (s), the chief's mean motion (rad/s)."""

Text = Annotated[str, Field(min_length=1, max_length=LONGEST)]


@dataclass(frozen=True)
class FormulaDynamics(LvlhStateDynamics):
    """Motion in LVLH by formulas, integrated by the classical Runge-Kutta method.

    Attributes:
        formulas: of the acceleration along x, y and z.
        mean_motion: of the chief, rad/s.
        gravity: added to them; None for none.
        perturbations: added to them, functions of time.
        duration: of a control period, s.
        parts: of equal length into which it is divided.
    """

    formulas: tuple[Formula, ...]
    mean_motion: float
    gravity: CircularGravity | None
    perturbations: tuple[Perturbation, ...]
    duration: float
    parts: int

    def acceleration(self, time: float, position: Array, velocity: Array) -> Array:
        """Acceleration without command and perturbations.

        Args:
            time: simulated, s.
            position: m, LVLH, shape (N, 3).
            velocity: m/s, shape (N, 3).

        Returns:
            m/s^2, shape (N, 3).
        """
        columns = (*np.ascontiguousarray(position.T), *np.ascontiguousarray(velocity.T))
        quantities = dict(zip(QUANTITIES, (*columns, np.float64(time), self.mean_motion), strict=True))
        total = np.empty(position.shape)
        for axis, formula in enumerate(self.formulas):
            total[:, axis] = formula(quantities)
        return total if self.gravity is None else total + self.gravity.at(position, velocity)

    def advance(self, state: CwState, acceleration_lvlh: Array, step: int) -> CwState:
        """The state one control period later; arguments as in `Dynamics.advance`."""
        begin = step * self.duration

        def force(offset: float, position: Array, velocity: Array) -> Array:
            return self.acceleration(begin + offset, position, velocity)

        grid = (step, self.duration, self.parts)
        return advance_held(state, acceleration_lvlh, force, self.perturbations, grid)


class FormulaConstantSpec(Spec):
    """A number that formulas use by its name."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
    """Name in the formulas; none of the quantities and functions that they have, no keyword of Python."""
    value: Number
    """The number, in SI units."""


class FormulaDynamicsSpec(PerturbedDynamicsSpec):
    """A truth model of one's own: the acceleration along x, y and z of LVLH as formulas.

    A formula has numbers, + - * / **, parentheses, the quantities x, y, z (position, m), vx, vy, vz
    (velocity, m/s), t (time, s), n (mean motion of the chief, rad/s) and those of `constants`, and the
    functions abs, atan2, cos, exp, max, min, sign, sin, sqrt and tanh. Exponents are whole or half numbers up
    to 12.
    """

    kind: Literal["formula"] = "formula"
    acceleration: tuple[Text, Text, Text]
    """Formulas of the acceleration along x, y and z of LVLH, m/s^2; "0" for none."""
    constants: tuple[FormulaConstantSpec, ...] = ()
    """Numbers that the formulas use by name."""
    gravity: GravityKind = "none"
    """Gravity that is added, with the rotation of LVLH: none; cw, linear in the distance; or point_mass,
    exact about a chief on a circular orbit. With none, LVLH does not rotate unless the formulas say so."""
    maximum_step: Positive = 1.0
    """Longest sub-step of the integration [s]."""

    def complaints(self, setting: DynamicsSetting) -> list[Complaint]:
        """What is wrong with formulas and sub-steps; as in `DynamicsSpec.complaints`."""
        found = substep_complaints(("maximum_step",), setting.step, self.maximum_step)
        names = [constant.name for constant in self.constants]
        for index, name in enumerate(names):
            if name in (*QUANTITIES, *FUNCTIONS) or name in names[:index]:
                found.append((("constants", index, "name"), f"the name '{name}' is taken"))
            elif keyword.iskeyword(name):
                sentence = (
                    f"'{name}' is a keyword of Python, in whose syntax formulas are read; choose another"
                )
                found.append((("constants", index, "name"), f"{sentence} name"))
        for axis, text in enumerate(self.acceleration):
            try:
                self._parsed(text)
            except ValueError as error:
                found.append((("acceleration", axis), str(error)))
        return found

    def _parsed(self, text: str) -> Formula:
        return parse_formula(text, QUANTITIES, {constant.name: constant.value for constant in self.constants})

    def build(self, setting: DynamicsSetting) -> FormulaDynamics:
        """The truth model itself.

        Raises:
            ValueError: a formula cannot be read.
        """
        return FormulaDynamics(
            formulas=tuple(self._parsed(text) for text in self.acceleration),
            mean_motion=setting.mean_motion,
            gravity=circular_gravity(self.gravity, setting.mean_motion),
            perturbations=self.build_perturbations(setting),
            duration=setting.step,
            parts=substeps(setting.step, self.maximum_step),
        )
