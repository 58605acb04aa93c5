# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The parts of a scenario file that are described by themselves: orbit, timing, sources, satellites."""

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from satform.attitude.guidance import AttitudeSpec
from satform.common.angle_text import OR_DEGREES_PER_SECOND
from satform.common.spec import Number, PerAxis, Plugin, Positive, Spec
from satform.control.protocol import ControllerSpec, FlightSetting
from satform.equipment.sensors.relative_motion import NavigationSpec
from satform.equipment.sensors.sensor_spec import SensorSpec
from satform.equipment.thruster import ThrusterSpec
from satform.navigation.navigation_spec import NavigationFilterSpec
from satform.navigation.relative_state_filter import FilterSpec
from satform.orbits.curve_specs import CurveSpec
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER
from satform.orbits.orbit_specs import OrbitSpec
from satform.orbits.start_specs import StartSpec

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
Sentence = Annotated[str, Field(min_length=1, max_length=20_000)]


class Orbit(Spec):
    """The chief's orbit: circular by its period, mean motion or semi-major axis, or whole by `chief`."""

    period: Annotated[float, Field(ge=1e-3, le=1e12, strict=True)] | None = None
    """Time of one revolution, s."""
    mean_motion: Annotated[float, Field(ge=1e-12, le=1e4, strict=True), OR_DEGREES_PER_SECOND] | None = None
    """Angular rate, rad/s."""
    semi_major_axis: Annotated[float, Field(ge=1.0, le=1e12, strict=True)] | None = None
    """Radius of the orbit about the Earth's centre, m."""
    chief: OrbitSpec | None = None
    """The whole orbit at time zero, by elements, a state or a file; the mean motion, the truth model's chief
    and the date of time zero follow from it."""
    allow_below_surface: bool = False
    """Whether the orbit may lie below the Earth's surface, where a source prints such a period."""

    @model_validator(mode="after")
    def _one_of_three(self) -> "Orbit":
        names = ("period", "mean_motion", "semi_major_axis", "chief")
        given = [name for name in names if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                "give exactly one of period [s], mean_motion [rad/s, or deg/s as text], semi_major_axis [m], "
                f"chief; found {' and '.join(given) if given else 'none'}"
            )
        if self.radius < EQUATORIAL_RADIUS and not self.allow_below_surface:
            shortest = 2.0 * math.pi * math.sqrt(EQUATORIAL_RADIUS**3 / GRAVITATIONAL_PARAMETER)
            raise ValueError(
                f"the orbit of period {2.0 * math.pi / self.rate:.6g} s has a radius of "
                f"{self.radius / 1e3:.1f} km, below the Earth's surface at {EQUATORIAL_RADIUS / 1e3:.1f} km; "
                f"give a period above {shortest:.1f} s, or allow_below_surface: true where a source prints it"
            )
        return self

    @property
    def rate(self) -> float:
        """Mean motion in rad/s, whichever way the orbit was given."""
        if self.period is not None:
            return 2.0 * math.pi / self.period
        if self.mean_motion is not None:
            return self.mean_motion
        if self.chief is not None:
            return self.chief.mean_motion
        assert self.semi_major_axis is not None  # noqa: S101 - the validator has seen to it
        return math.sqrt(GRAVITATIONAL_PARAMETER / self.semi_major_axis**3)

    @property
    def radius(self) -> float:
        """Radius in m of the circular orbit about a point-mass Earth."""
        if self.semi_major_axis is not None:
            return self.semi_major_axis
        return float((GRAVITATIONAL_PARAMETER / self.rate**2) ** (1.0 / 3.0))

    @property
    def altitude(self) -> float:
        """Height in m of the circular orbit above the equator."""
        return self.radius - EQUATORIAL_RADIUS


class Timing(Spec):
    """The control period and how long the flight lasts."""

    step: Annotated[float, Field(ge=1e-6, le=3600.0)]
    """Control period over which commands are held, s; a whole number of nanoseconds."""
    duration: Annotated[float, Field(gt=0.0, le=1e9)]
    """Length of the flight, s; a whole number of steps."""

    @model_validator(mode="after")
    def _whole_steps(self) -> "Timing":
        if abs(self.step * 1e9 - round(self.step * 1e9)) > 1e-3:
            raise ValueError(f"step {self.step:g} s is not a whole number of nanoseconds")
        ratio = self.duration / self.step
        if abs(ratio - round(ratio)) > 1e-6 * max(1.0, ratio) or round(ratio) < 1:
            raise ValueError(
                f"duration {self.duration:g} s is {ratio:g} steps of {self.step:g} s; it has to be a whole "
                f"number, for example {max(1, round(ratio)) * self.step:g} s"
            )
        if round(ratio) > 100_000_000:
            raise ValueError(f"{round(ratio)} steps; at most 100000000 are allowed")
        return self

    @property
    def steps(self) -> int:
        """Number of control steps of the flight."""
        return round(self.duration / self.step)

    @property
    def step_nanoseconds(self) -> int:
        """The control period in whole nanoseconds, from which every stamp is computed."""
        return round(self.step * 1e9)


class NominalMotion(Spec):
    """How fast satellites go round their curves once they agree: by period or by rate."""

    period: Positive | None = None
    """Time of one revolution along the curve, s; all satellites need the same perimeter per scale."""
    rate: Number | None = None
    """Rate of the generalised arc length, m/s."""

    @model_validator(mode="after")
    def _one_of_two(self) -> "NominalMotion":
        if (self.period is None) == (self.rate is None):
            raise ValueError("give exactly one of period [s] or rate [m/s]")
        return self

    def rate_along(self, period: float) -> float:
        """Rate of the generalised arc length along a path, m/s.

        Args:
            period: growth of the generalised arc length in one revolution along the path, m.
        """
        if self.rate is not None:
            return self.rate
        assert self.period is not None  # noqa: S101 - the validator has seen to it
        return period / self.period


class Source(Spec):
    """Where the scenario comes from: what the source printed and what was chosen here."""

    reference: Sentence
    """Paper or book, with its equation or section."""
    printed: Sentence | None = None
    """The numbers that the source prints."""
    chosen: Sentence | None = None
    """The numbers that the source leaves open or lost, chosen for this scenario."""


class SatelliteFields(Spec):
    """What may be said of one satellite, or of every satellite that does not say otherwise."""

    curve: Annotated[CurveSpec, Plugin("satform.curves")] | None = None
    """The closed relative orbit to be flown."""
    controller: Annotated[ControllerSpec, Plugin("satform.controllers")] | None = None
    """The control law."""
    scale: Positive = 1.0
    """Metres of arc length per metre of generalised arc length."""
    path_parameter: Literal["arc_length", "angle"] = "arc_length"
    """What advances evenly along the curve: its arc length, or its angle (natural motion)."""
    feedforward_sample: Literal["midpoint", "start"] = "midpoint"
    """Where in the hold the acceleration of the reference is taken, and the torque that follows the desired
    attitude."""
    arc_length: Number = 0.0
    """Generalised arc length at the start, m."""
    rate: Number | None = None
    """Rate of the generalised arc length at the start, m/s; that of `nominal_motion` when left out."""
    phase_offset: Number = 0.0
    """Generalised arc length by which this satellite shall lead the formation's agreement, m."""
    position_error: PerAxis = (0.0, 0.0, 0.0)
    """Position at the start minus the reference, in LVLH, m."""
    velocity_error: PerAxis = (0.0, 0.0, 0.0)
    """Velocity at the start minus the reference, in rotating LVLH, m/s."""
    thruster: ThrusterSpec | None = None
    """Limits and errors of thrust; when left out the commanded acceleration is applied unchanged."""
    sensor: NavigationSpec | None = None
    """Noise, bias, rate and latency of its navigation sensor; when left out the true motion is measured
    without delay."""
    filter: FilterSpec | None = None
    """What the satellite makes of its measurements; when left out it takes them as they are."""
    sensors: tuple[Annotated[SensorSpec, Plugin("satform.sensors")], ...] = ()
    """Sensors with a field of view, noise and outages, for `navigation` and for the attitude."""
    navigation: Annotated[NavigationFilterSpec, Plugin("satform.navigation")] | None = None
    """The filter that estimates motion from the readings of `sensors`, by which the satellite flies; when
    left out it flies by its `sensor` and `filter`."""
    attitude: AttitudeSpec | None = None
    """Its attitude, wheels and pointing; when left out the satellite is a point."""

    @property
    def measures_motion(self) -> bool:
        """Whether the satellite knows its motion by measurements alone."""
        return self.sensor is not None or self.navigation is not None

    @property
    def estimates_motion(self) -> bool:
        """Whether a filter estimates the motion of the satellite."""
        return self.filter is not None or self.navigation is not None

    @property
    def estimates_attitude(self) -> bool:
        """Whether a filter estimates the attitude of the satellite."""
        return self.attitude is not None and self.attitude.filter is not None

    def equipment_complaints(self, setting: FlightSetting) -> list[tuple[str, str]]:
        """What thruster, sensor and filter cannot do in this setting.

        Args:
            setting: the chief's orbit and the control period.

        Returns:
            Field and sentence of each fault.
        """
        faults: list[tuple[str, str]] = []
        for name, part in (("thruster", self.thruster), ("sensor", self.sensor)):
            try:
                if part is not None:
                    part.build(setting.step)
            except ValueError as error:
                faults.append((name, str(error)))
        if self.filter is None or any(name == "sensor" for name, _ in faults):
            return faults
        if self.sensor is None:
            return [*faults, ("filter", "a filter needs a sensor, whose measurements it works with")]
        try:
            self.filter.build(setting.mean_motion, setting.step, self.sensor, setting.chief)
        except ValueError as error:
            faults.append(("filter", str(error)))
        return faults


class SatelliteSpec(SatelliteFields):
    """One satellite; what it leaves out is taken from `satellite_defaults`."""

    name: Name
    """Name of the satellite's node and topics: lower case letters, digits and underscores."""
    start: StartSpec | None = None
    """Where it starts; on its reference, off by `position_error` and `velocity_error`, when left out."""
    external: bool = False
    """Whether its node is started by somebody else, as an own program that follows the interface; a run waits
    for it. In one process and in campaigns the controller of the scenario flies it."""
