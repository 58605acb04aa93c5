# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a scenario says of gravity, bodies and integrator: data that the truth models are built from."""

from datetime import UTC, datetime
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from satform.common.spec import Complaint, NonNegative, Plugin, Positive, Spec
from satform.dynamics.collocation import Collocation
from satform.dynamics.integrators import TABLEAUS, Adaptive, FixedStep, substep_complaint
from satform.dynamics.prescribed_disturbances import Perturbation, PerturbationSetting, PerturbationSpec
from satform.dynamics.protocol import DynamicsSetting, DynamicsSpec
from satform.files.named_file import NamedFile
from satform.orbits.chief import Angle

Degree = Annotated[int, Field(ge=0, le=120)]

EPOCH = datetime(2024, 1, 1, tzinfo=UTC)
"""Of time zero where a scenario gives none."""

OF_SATELLITES = frozenset({"perturbations", "satellite_bodies", "linear", "wave", "wave_number", "quadratic"})
"""Fields of truth models that may differ in runs that are flown as one."""


def substep_complaints(field: tuple[str | int, ...], period: float, maximum_step: float) -> list[Complaint]:
    """Why a field's sub-steps (s) are too many in a control period (s): none or one fault."""
    sentence = substep_complaint(period, maximum_step)
    return [] if sentence is None else [(field, sentence)]


class PerturbedDynamicsSpec(DynamicsSpec):
    """What all the truth models here have in common: a list of perturbations."""

    perturbations: tuple[Annotated[PerturbationSpec, Plugin("satform.perturbations")], ...] = ()
    """Accelerations added to the model's own, in LVLH."""

    def build_perturbations(self, setting: DynamicsSetting) -> tuple[Perturbation, ...]:
        """The perturbations themselves, in the order of the list."""
        return tuple(
            spec.build(
                PerturbationSetting(
                    mean_motion=setting.mean_motion,
                    step=setting.step,
                    satellite_count=setting.satellite_count,
                    seed=setting.seed,
                    index=index,
                )
            )
            for index, spec in enumerate(self.perturbations)
        )


class GravitySpec(Spec):
    """The Earth's gravity field, EGM2008 (tide free), and the rotation that carries it."""

    degree: Degree = 10
    """Highest degree of the spherical harmonics; 0 is a point mass."""
    order: Degree | None = None
    """Highest order; the degree when left out, 0 for zonal harmonics only."""
    rotation: Literal["closed", "full"] = "closed"
    """closed: uniform about the inertial z axis; full: precession, nutation and polar motion (brahe)."""
    earth_angle: Angle | None = None
    """closed: Earth rotation angle at time zero [rad]; the epoch's when left out."""
    orientation_file: NamedFile | None = None
    """full: a file of Earth orientation parameters (IERS finals2000A or C04), its path counted from the
    scenario's folder; UT1 = UTC and no polar motion when left out. Nothing is downloaded."""

    @field_validator("orientation_file")
    @classmethod
    def _readable(cls, file: NamedFile | None) -> NamedFile | None:
        if file is not None:
            from satform.orbits.earth_orientation import from_file  # noqa: PLC0415  brahe is slow to import

            from_file(file)
        return file

    @model_validator(mode="after")
    def _consistent(self) -> "GravitySpec":
        if self.order is not None and self.order > self.degree:
            raise ValueError(
                f"order {self.order} is above degree {self.degree}; at most the degree is allowed"
            )
        if self.rotation == "full" and self.earth_angle is not None:
            raise ValueError(
                "earth_angle belongs to rotation: closed; rotation: full takes it from the epoch"
            )
        if self.rotation == "closed" and self.orientation_file is not None:
            raise ValueError("orientation_file belongs to rotation: full; rotation: closed needs none")
        return self


class BodySpec(Spec):
    """What drag and sunlight meet on a satellite."""

    mass: Positive = 100.0
    """Mass [kg], constant in these forces."""
    drag_area: NonNegative = 1.0
    """Area across the wind [m^2]."""
    drag_coefficient: NonNegative = 2.2
    """Drag coefficient."""
    radiation_area: NonNegative = 1.0
    """Area across the sunlight [m^2]."""
    reflectivity: Annotated[float, Field(ge=1.0, le=2.0)] = 1.3
    """Radiation pressure coefficient, 1 absorbs all and 2 reflects all."""


class FixedStepSpec(Spec):
    """Runge-Kutta with equal sub-steps inside the control period."""

    kind: Literal["rk4", "rk8"] = "rk8"
    """rk4: four stages, order 4, enough for steps of a few seconds; rk8: twelve stages, order 8."""
    maximum_step: Positive = 45.0
    """Longest sub-step [s]."""

    def complaints(self, period: float, longest: float) -> list[Complaint]:
        """Why no flight can be integrated with this.

        Args:
            period: control period, s.
            longest: step over which collocation is certain to converge, s.

        Returns:
            Field and sentence of each fault.
        """
        return substep_complaints(("maximum_step",), period, self.maximum_step)

    def build(self) -> FixedStep:
        """The integrator itself."""
        return FixedStep(TABLEAUS[self.kind](), self.maximum_step)


class AdaptiveSpec(Spec):
    """Dormand & Prince's method of order 8 with step control (scipy), one satellite at a time."""

    kind: Literal["dop853"] = "dop853"
    """The method."""
    relative_tolerance: Annotated[float, Field(ge=1e-13, le=1e-3)] = 1e-12
    """Of the local error."""
    absolute_tolerance: Annotated[float, Field(gt=0.0, le=1.0)] = 1e-6
    """Of the local error [m and m/s]."""

    def complaints(self, period: float, longest: float) -> list[Complaint]:
        """None; as in `FixedStepSpec.complaints`."""
        return []

    def build(self) -> Adaptive:
        """The integrator itself."""
        return Adaptive(self.relative_tolerance, self.absolute_tolerance)


class CollocationSpec(Spec):
    """Collocation at 24 Gauss-Legendre nodes over many control periods at once, where no command acts."""

    kind: Literal["collocation"]
    """The method."""
    maximum_step: Positive = 1200.0
    """Longest step by collocation [s]: a fifth of a circular orbit, less of an eccentric one."""
    thrust_step: Positive = 45.0
    """Longest sub-step of rk8 in control periods in which a command or a perturbation acts [s]."""

    def complaints(self, period: float, longest: float) -> list[Complaint]:
        """Why no flight can be integrated with this; as in `FixedStepSpec.complaints`."""
        found = substep_complaints(("maximum_step",), period, self.maximum_step)
        found += substep_complaints(("thrust_step",), period, self.thrust_step)
        if self.maximum_step > longest:
            sentence = (
                f"{self.maximum_step:g} s is too long for collocation, whose steps are at most {longest:g} s "
                "for this chief: the period of a circular orbit at the radius of its perigee"
            )
            found.append((("maximum_step",), sentence))
        return found

    def build(self) -> Collocation:
        """The integrator itself."""
        return Collocation(self.maximum_step, FixedStep(TABLEAUS["rk8"](), self.thrust_step))
