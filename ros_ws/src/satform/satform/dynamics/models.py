"""The truth models that a scenario chooses under `dynamics:`, from textbook CW to inertial space."""

from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from satform.common.spec import NonNegative, Plugin, Positive, Spec
from satform.dynamics.atmosphere_specs import HarrisPriesterSpec, Nrlmsise00Spec
from satform.dynamics.cw import DisturbedStep
from satform.dynamics.integrators import TABLEAUS, Adaptive, FixedStep
from satform.dynamics.linear_j2 import LinearJ2Dynamics
from satform.dynamics.linear_j2 import build as build_linear_j2
from satform.dynamics.perturbations import Perturbation, PerturbationSetting, PerturbationSpec
from satform.dynamics.protocol import DynamicsSetting, DynamicsSpec, total_perturbation
from satform.files.named_file import NamedFile
from satform.numeric.elementwise import Array
from satform.orbits.chief import Angle, ChiefOrbitSpec

if TYPE_CHECKING:
    from satform.dynamics.cw_perturbed import CwPerturbedDynamics, PropagatedChiefDynamics
    from satform.dynamics.inertial import InertialDynamics

Degree = Annotated[int, Field(ge=0, le=120)]


@dataclass(frozen=True)
class CwState:
    """LVLH motion at one time.

    Attributes:
        position: m, shape (N, 3).
        velocity: m/s, in the rotating frame, shape (N, 3).
    """

    position: Array
    velocity: Array


@dataclass(frozen=True)
class CwDynamics:
    """The CW equations, exact for any step with the command held.

    Perturbations enter by three-point Gauss-Legendre quadrature over the step.

    Attributes:
        step: the exact step.
        perturbations: added to the CW equations.
    """

    step: DisturbedStep
    perturbations: tuple[Perturbation, ...] = ()

    @cached_property
    def _offsets(self) -> tuple[float, ...]:
        """Times since the start of a step at which the perturbations are wanted, s."""
        return tuple(self.step.nodes.tolist())

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> CwState:
        """The state at time zero; arguments as in `Dynamics.start`."""
        return CwState(position_lvlh, velocity_lvlh)

    def lvlh(self, state: CwState) -> tuple[Array, Array]:
        """Relative position in m and velocity in m/s, shape (N, 3) each."""
        return state.position, state.velocity

    def advance(self, state: CwState, acceleration_lvlh: Array, step: int) -> CwState:
        """The state one control period later; arguments as in `Dynamics.advance`."""
        if not self.perturbations:
            return CwState(*self.step.undisturbed(state.position, state.velocity, acceleration_lvlh))
        disturbance = np.empty((len(self._offsets), *state.position.shape))
        for node, offset in enumerate(self._offsets):
            disturbance[node] = total_perturbation(self.perturbations, step, offset)
        return CwState(*self.step.advance(state.position, state.velocity, acceleration_lvlh, disturbance))


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


class CwDynamicsSpec(PerturbedDynamicsSpec):
    """Clohessy-Wiltshire: linear motion about a circular orbit, propagated exactly."""

    kind: Literal["cw"] = "cw"

    def build(self, setting: DynamicsSetting) -> CwDynamics:
        """The truth model itself."""
        return CwDynamics(
            step=DisturbedStep.over(setting.mean_motion, setting.step),
            perturbations=self.build_perturbations(setting),
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

    def build(self) -> Adaptive:
        """The integrator itself."""
        return Adaptive(self.relative_tolerance, self.absolute_tolerance)


class LinearJ2DynamicsSpec(PerturbedDynamicsSpec):
    """CW with the mean effect of oblateness (Schweighart and Sedwick), about a circular mean orbit."""

    kind: Literal["linear_j2"] = "linear_j2"
    chief: ChiefOrbitSpec = ChiefOrbitSpec()
    """Mean orbit of the chief, circular; its inclination and argument of latitude matter."""

    @model_validator(mode="after")
    def _circular(self) -> "LinearJ2DynamicsSpec":
        if self.chief.eccentricity > 0.0:
            raise ValueError(
                f"chief.eccentricity {self.chief.eccentricity:g} has to be 0: linear_j2 is about a circular "
                "mean orbit"
            )
        return self

    def faults(self, setting: DynamicsSetting) -> list[tuple[tuple[str | int, ...], str]]:
        """Why the chief's orbit cannot be flown; as in `DynamicsSpec.faults`."""
        return self.chief.faults(setting.mean_motion)

    def build(self, setting: DynamicsSetting) -> LinearJ2Dynamics:
        """The truth model itself."""
        return build_linear_j2(self, setting)


EPOCH = datetime(2024, 1, 1, tzinfo=UTC)


class CwPerturbedDynamicsSpec(PerturbedDynamicsSpec):
    """CW plus what it leaves out of the difference of gravity between satellite and chief."""

    kind: Literal["cw_perturbed"] = "cw_perturbed"
    epoch: datetime = EPOCH
    """Date and time of time zero; without a time zone it is UTC."""
    chief: ChiefOrbitSpec = ChiefOrbitSpec()
    """Osculating orbit of the chief at time zero; circular where `chief_motion` is."""
    chief_motion: Literal["propagated", "circular"] = "propagated"
    """propagated: the chief feels the same gravity as the satellites; circular: it keeps to the
    unperturbed circle, which satellites that feel the harmonics leave, and its central term is
    linear."""
    gravity: GravitySpec = GravitySpec()
    """Gravity of the Earth; with a circular chief its degrees 2 and higher."""
    integrator: FixedStepSpec = FixedStepSpec()
    """Of chief and satellites. With a circular chief it approximates the harmonics alone, and the CW
    part is exact."""

    @model_validator(mode="after")
    def _circular(self) -> "CwPerturbedDynamicsSpec":
        if self.chief_motion == "circular" and self.chief.eccentricity > 0.0:
            raise ValueError(
                f"chief.eccentricity {self.chief.eccentricity:g} does not go with chief_motion: circular; "
                "set it to 0, or chief_motion to propagated"
            )
        return self

    def faults(self, setting: DynamicsSetting) -> list[tuple[tuple[str | int, ...], str]]:
        """Why the chief's orbit cannot be flown; as in `DynamicsSpec.faults`."""
        return self.chief.faults(setting.mean_motion)

    def build(self, setting: DynamicsSetting) -> "CwPerturbedDynamics | PropagatedChiefDynamics":
        """The truth model itself."""
        from satform.dynamics.cw_perturbed import build  # noqa: PLC0415  brahe is slow to import

        return build(self, setting)


class InertialDynamicsSpec(PerturbedDynamicsSpec):
    """Chief and satellites in inertial space, with the forces chosen."""

    kind: Literal["inertial"] = "inertial"
    epoch: datetime = EPOCH
    """Date and time of time zero; without a time zone it is UTC."""
    chief: ChiefOrbitSpec = ChiefOrbitSpec()
    """Osculating orbit of the chief at time zero."""
    chief_motion: Literal["propagated", "keplerian"] = "propagated"
    """propagated: the chief feels all forces, as a satellite does; keplerian: it is a point on the
    unperturbed orbit."""
    gravity: GravitySpec = GravitySpec()
    """Gravity of the Earth."""
    drag: bool = False
    """Drag in an atmosphere that turns with the Earth."""
    atmosphere: Annotated[HarrisPriesterSpec | Nrlmsise00Spec, Field(discriminator="kind")] = (
        HarrisPriesterSpec()
    )
    """Whose density drag is computed with."""
    solar_pressure: bool = False
    """Pressure of sunlight, with the Earth's conical shadow."""
    sun: bool = False
    """Gravity of the Sun."""
    moon: bool = False
    """Gravity of the Moon."""
    body: BodySpec = BodySpec()
    """The chief, and every satellite that is not in `satellite_bodies`."""
    satellite_bodies: tuple[BodySpec, ...] = ()
    """Either none or one for each satellite, in their order."""
    integrator: Annotated[FixedStepSpec | AdaptiveSpec, Field(discriminator="kind")] = FixedStepSpec()
    """Of chief and satellites."""
    frame_rate: Literal["exact", "orbit_rate"] = "exact"
    """exact: LVLH velocities are the derivative of LVLH positions; orbit_rate: they are taken in a
    frame that turns at (0, 0, h/r^2)."""

    def faults(self, setting: DynamicsSetting) -> list[tuple[tuple[str | int, ...], str]]:
        """Why chief or bodies cannot be flown; as in `DynamicsSpec.faults`."""
        found = self.chief.faults(setting.mean_motion)
        if self.satellite_bodies and len(self.satellite_bodies) != setting.satellite_count:
            sentence = (
                f"satellite_bodies has {len(self.satellite_bodies)} entries for {setting.satellite_count} "
                "satellites; leave it out or give one for each"
            )
            found.append((("satellite_bodies",), sentence))
        return found

    def build(self, setting: DynamicsSetting) -> "InertialDynamics":
        """The truth model itself.

        Raises:
            ValueError: the list of bodies does not fit the satellites, or the chief hits the Earth.
        """
        from satform.dynamics.inertial import build  # noqa: PLC0415  brahe is slow to import

        return build(self, setting)
