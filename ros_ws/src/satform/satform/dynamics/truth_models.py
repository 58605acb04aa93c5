# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The truth models that a scenario chooses under `dynamics:`, from textbook CW to inertial space."""

import math
from collections.abc import Callable
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from satform.common.spec import Complaint
from satform.dynamics.atmosphere_specs import HarrisPriesterSpec, Nrlmsise00Spec
from satform.dynamics.collocation import Collocation
from satform.dynamics.cw import DisturbedStep
from satform.dynamics.cw_model import CwDynamics
from satform.dynamics.linear_j2 import CrossTrack, J2Rates, LinearJ2Dynamics
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.specs import (
    EPOCH,
    AdaptiveSpec,
    BodySpec,
    CollocationSpec,
    FixedStepSpec,
    GravitySpec,
    PerturbedDynamicsSpec,
)
from satform.orbits.chief import ChiefOrbitSpec, Epoch, KeplerianChief, semi_major_axis_of
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.frames import LvlhFrame

if TYPE_CHECKING:
    from satform.dynamics.cw_perturbed import CwPerturbedDynamics, PropagatedChiefDynamics
    from satform.dynamics.inertial import InertialDynamics


def _integrator_complaints(
    integrator: FixedStepSpec | AdaptiveSpec | CollocationSpec,
    chief: ChiefOrbitSpec,
    setting: DynamicsSetting,
) -> list[Complaint]:
    """Why an integrator does not go with a chief's orbit and a control period."""
    perigee = semi_major_axis_of(setting.mean_motion, GRAVITATIONAL_PARAMETER) * (1.0 - chief.eccentricity)
    # Of a circular orbit through the perigee; the iteration converges over one and a half of it.
    period = math.tau * math.sqrt(perigee**3 / GRAVITATIONAL_PARAMETER)
    found = integrator.complaints(setting.step, period)
    return [(("integrator", *field), sentence) for field, sentence in found]


class CwDynamicsSpec(PerturbedDynamicsSpec):
    """Clohessy-Wiltshire: linear motion about a circular orbit, propagated exactly."""

    kind: Literal["cw"] = "cw"

    def build(self, setting: DynamicsSetting) -> CwDynamics:
        """The truth model itself."""
        return CwDynamics(
            step=DisturbedStep.over(setting.mean_motion, setting.step),
            perturbations=self.build_perturbations(setting),
        )


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

    def keplerian_chief(self, mean_motion: float) -> KeplerianChief:
        """The chief's orbit at time zero; as in `DynamicsSpec.keplerian_chief`."""
        return self.chief.keplerian(mean_motion)

    def about(self, chief: ChiefOrbitSpec, epoch: datetime) -> Self:
        """This model about the circle of a chief's orbit; as in `DynamicsSpec.about`."""
        return super().about(chief.model_copy(update={"eccentricity": 0.0}), epoch)

    def complaints(self, setting: DynamicsSetting) -> list[Complaint]:
        """Why the chief's orbit cannot be flown; as in `DynamicsSpec.complaints`."""
        return self.chief.complaints(setting.mean_motion)

    def build(self, setting: DynamicsSetting) -> LinearJ2Dynamics:
        """The truth model itself."""
        rates = J2Rates.of(setting.mean_motion, self.chief.inclination)
        return LinearJ2Dynamics(
            period=setting.step,
            rates=rates,
            cross_track=CrossTrack(rates, self.chief.argument_of_latitude),
            perturbations=self.build_perturbations(setting),
        )


class CwPerturbedDynamicsSpec(PerturbedDynamicsSpec):
    """CW plus what it leaves out of the difference of gravity between satellite and chief."""

    kind: Literal["cw_perturbed"] = "cw_perturbed"
    epoch: Epoch = EPOCH
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

    def keplerian_chief(self, mean_motion: float) -> KeplerianChief:
        """The chief's orbit at time zero; as in `DynamicsSpec.keplerian_chief`."""
        return self.chief.keplerian(mean_motion)

    def about(self, chief: ChiefOrbitSpec, epoch: datetime) -> Self:
        """This model about a chief's orbit, or about its circle; as in `DynamicsSpec.about`."""
        if self.chief_motion == "circular":
            chief = chief.model_copy(update={"eccentricity": 0.0})
        return super().about(chief, epoch)

    def start_frame(self, setting: DynamicsSetting) -> LvlhFrame | None:
        """The chief's frame at time zero, of a propagated chief; as in `DynamicsSpec.start_frame`."""
        from satform.dynamics.cw_perturbed import PropagatedChiefDynamics  # noqa: PLC0415  imports brahe

        model = self.build(setting)
        return model.start_frame() if isinstance(model, PropagatedChiefDynamics) else None

    def complaints(self, setting: DynamicsSetting) -> list[Complaint]:
        """Why the chief's orbit cannot be flown; as in `DynamicsSpec.complaints`."""
        found = self.chief.complaints(setting.mean_motion)
        return found + _integrator_complaints(self.integrator, self.chief, setting)

    def build(self, setting: DynamicsSetting) -> "CwPerturbedDynamics | PropagatedChiefDynamics":
        """The truth model itself."""
        from satform.dynamics.cw_perturbed import about_circular_chief, about_propagated_chief  # noqa: PLC0415
        from satform.dynamics.orbital_forces import gravity_of  # noqa: PLC0415  brahe is slow to import

        gravity = gravity_of(self.gravity, self.epoch)
        perturbations = self.build_perturbations(setting)
        about = about_propagated_chief if self.chief_motion == "propagated" else about_circular_chief
        return about(setting, self.chief, gravity, self.integrator.build(), perturbations)


class InertialDynamicsSpec(PerturbedDynamicsSpec):
    """Chief and satellites in inertial space, with the forces chosen."""

    kind: Literal["inertial"] = "inertial"
    epoch: Epoch = EPOCH
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
    integrator: Annotated[FixedStepSpec | AdaptiveSpec | CollocationSpec, Field(discriminator="kind")] = (
        FixedStepSpec()
    )
    """Of chief and satellites."""
    frame_rate: Literal["exact", "orbit_rate"] = "exact"
    """exact: LVLH velocities are the derivative of LVLH positions; orbit_rate: they are taken in a
    frame that turns at (0, 0, h/r^2)."""

    def keplerian_chief(self, mean_motion: float) -> KeplerianChief:
        """The chief's orbit at time zero; as in `DynamicsSpec.keplerian_chief`."""
        return self.chief.keplerian(mean_motion)

    def start_frame(self, setting: DynamicsSetting) -> LvlhFrame:
        """The chief's frame at time zero; as in `DynamicsSpec.start_frame`."""
        return self.build(setting).start_frame()

    def complaints(self, setting: DynamicsSetting) -> list[Complaint]:
        """Why chief or bodies cannot be flown; as in `DynamicsSpec.complaints`."""
        found = self.chief.complaints(setting.mean_motion)
        if self.satellite_bodies and len(self.satellite_bodies) != setting.satellite_count:
            sentence = (
                f"satellite_bodies has {len(self.satellite_bodies)} entries for {setting.satellite_count} "
                "satellites; leave it out or give one for each"
            )
            found.append((("satellite_bodies",), sentence))
        return found + _integrator_complaints(self.integrator, self.chief, setting)

    def build(self, setting: DynamicsSetting) -> "InertialDynamics":
        """The truth model itself.

        Raises:
            ValueError: the list of bodies does not fit the satellites, or the chief hits the Earth.
        """
        from satform.dynamics.coasting import CoastingDynamics  # noqa: PLC0415  brahe is slow to import
        from satform.dynamics.inertial import InertialDynamics  # noqa: PLC0415
        from satform.dynamics.orbital_forces import body_of, forces_of, gravitational_parameter  # noqa: PLC0415

        position, velocity = self.chief.state(setting.mean_motion, gravitational_parameter())
        complaints = self.complaints(setting)
        if complaints:
            raise ValueError("; ".join(sentence for _, sentence in complaints))
        of_satellites = self.satellite_bodies or (self.body,) * setting.satellite_count
        forces = forces_of(
            self.epoch,
            self.gravity,
            sun=self.sun,
            moon=self.moon,
            atmosphere=self.atmosphere if self.drag else None,
            solar_pressure=self.solar_pressure,
        )
        integrator = self.integrator.build()
        model: Callable[..., InertialDynamics] = InertialDynamics
        if isinstance(integrator, Collocation):
            model = partial(CoastingDynamics, collocation=integrator)
            integrator = integrator.thrust
        return model(
            period=setting.step,
            forces=forces,
            bodies=tuple(body_of(body) for body in (self.body, *of_satellites)),
            chief_position=position,
            chief_velocity=velocity,
            integrator=integrator,
            keplerian_chief=self.chief_motion == "keplerian",
            exact_rate=self.frame_rate == "exact",
            perturbations=self.build_perturbations(setting),
        )
