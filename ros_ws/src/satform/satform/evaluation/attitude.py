# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of attitude: how well satellites point, and what their wheels give.

Of a satellite without attitude every figure is not a number, and what is expected of it is missed. Steps in
which a satellite does not fly, or in which the one that it points at does not, are left out.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from satform.common.spec import Positive
from satform.evaluation.equipment import LargestOrRms, OfFilter
from satform.evaluation.event_reducers import SettlingOf
from satform.evaluation.reducers import ExtremeOf, LargestChange
from satform.evaluation.tracking import LargestOfSteps
from satform.record.reducer import FlightShape, Reducer
from satform.record.stretch import Stretch
from satform.scenario.parts import SatelliteSpec
from satform.scenario.windowed_expectation import AtTime, Event, OfSatellites, OverWindow


class _LargestOfPointing(LargestOfSteps):
    """Largest value of a quantity of each step that depends on where the satellite points."""

    of_equipment = "attitude"
    quantity_name: ClassVar[str]
    """Of the record."""

    def reducer(self, flight: FlightShape) -> Reducer:
        return ExtremeOf(self.stretch(flight, flight.steps, of_others=True), self.quantity_name)


class PointingError(_LargestOfPointing):
    """Largest angle between a satellite's boresight and its target, in rad."""

    unit = "rad"
    figure_name = "largest pointing error"
    quantity_name = "pointing_error"
    kind: Literal["pointing_error"] = "pointing_error"


class PanelToSun(_LargestOfPointing):
    """Largest cosine of the angle between panel axis and sun; zero when panels face the sun."""

    figure_name = "largest cosine of panel axis to sun"
    quantity_name = "panel_to_sun"
    kind: Literal["panel_to_sun"] = "panel_to_sun"


class AttitudeEstimationError(LargestOrRms):
    """Angle between a satellite's estimated and its true attitude, in rad."""

    unit = "rad"
    of_equipment = "attitude_filter"
    figure_name = "{0.statistic} attitude estimation error"
    quantity_name = "attitude_estimation_error"
    kind: Literal["attitude_estimation_error"] = "attitude_estimation_error"


class AttitudeErrorSquared(OfFilter):
    """Normalised error squared (NEES) of a satellite's estimated attitude: mean 3 if it is consistent."""

    of_equipment = "attitude_filter"
    figure_name = "{0.statistic} NEES of the attitude"
    kind: Literal["attitude_nees"] = "attitude_nees"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.over("attitude_error_squared", flight)


class AttitudeSettling(Event):
    """Time after which pointing error or panels never exceed a level again, in s; the latest."""

    unit = "s"
    of_equipment = "attitude"
    kind: Literal["attitude_settling"] = "attitude_settling"
    quantity: Literal["pointing_error", "panel_to_sun"]
    """What has to settle."""
    level: Positive
    """What counts as settled, rad for the pointing error, without unit for the panels."""

    def reducer(self, flight: FlightShape) -> Reducer:
        whole = self.whole(flight, flight.steps, of_others=True)
        return SettlingOf(whole, self.quantity, self.level, flight.step)

    def describe(self) -> str:
        words = self.quantity.replace("_", " ")
        return self.label or f"{words} settles to {self.level:g}{self.whose()}"


class AttitudeErrorAt(AtTime, OfSatellites):
    """Length of the modified Rodrigues parameters to the desired attitude at one moment; the largest."""

    of_steps = True
    of_equipment = "attitude"
    figure_name = "attitude error (MRP)"
    kind: Literal["attitude_error_at"] = "attitude_error_at"

    def reducer(self, flight: FlightShape) -> Reducer:
        instant = self.instant(flight, flight.steps, self.satellites)
        return ExtremeOf(replace(instant, of_others=True), "attitude_error")


class AttitudeRateErrorAt(AtTime, OfSatellites):
    """Angular velocity relative to the desired one at one moment, in rad/s; the largest."""

    unit = "rad/s"
    of_steps = True
    of_equipment = "attitude"
    figure_name = "angular velocity error"
    kind: Literal["attitude_rate_error_at"] = "attitude_rate_error_at"

    def reducer(self, flight: FlightShape) -> Reducer:
        instant = self.instant(flight, flight.steps, self.satellites)
        return ExtremeOf(replace(instant, of_others=True), "attitude_rate_error")


class _OfWheels(OverWindow):
    """An expectation of one wheel, or of the one that does most."""

    of_equipment = "attitude"

    axis: Literal["x", "y", "z"] | None = None
    """Body axis of the wheel; all three when left out."""

    def peak(self, stretch: Stretch, series: str) -> Reducer:
        """Largest magnitude of the wheels that are meant."""
        wheels = slice(None) if self.axis is None else "xyz".index(self.axis)
        return ExtremeOf(stretch, series, transform=lambda values: np.abs(values[..., wheels]))

    def wheel(self) -> str:
        """The wheel, as part of a label."""
        return "of a wheel" if self.axis is None else f"of the {self.axis} wheel"


class WheelTorque(_OfWheels, LargestOfSteps):
    """Largest torque that is commanded to a wheel, in N m."""

    unit = "N m"
    kind: Literal["wheel_torque"] = "wheel_torque"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.peak(self.stretch(flight, flight.steps), "wheel_torque")

    def describe(self) -> str:
        return self.label or f"largest torque {self.wheel()}{self.when()}{self.whose()}"


class WheelMomentum(_OfWheels):
    """Largest momentum of a wheel, in N m s."""

    unit = "N m s"
    kind: Literal["wheel_momentum"] = "wheel_momentum"

    def holds_in_part(self) -> bool:
        return self.smallest_allowed <= 0.0

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.peak(self.stretch(flight, flight.states), "wheel_momentum")

    def describe(self) -> str:
        return self.label or f"largest momentum {self.wheel()}{self.when()}{self.whose()}"


class WheelSaturation(OverWindow):
    """Steps in which a limit of a wheel took something away, the most of the satellites."""

    of_equipment = "attitude"
    figure_name = "steps at the {0.limit} limit of the wheels"
    kind: Literal["wheel_saturation"] = "wheel_saturation"
    limit: Literal["torque", "momentum"]
    """Which limit is meant."""

    def complaints_about_satellites(
        self, satellites: Mapping[str, SatelliteSpec], announces: str
    ) -> list[str]:
        found = super().complaints_about_satellites(satellites, announces)
        if found:
            return found
        limit = f"wheel_{self.limit}_limit"
        free = [
            name
            for name in self.satellites or satellites
            if getattr(satellites[name].attitude, limit) is None
        ]
        return (
            [f"{', '.join(free)} {'has' if len(free) == 1 else 'have'} no {limit} to be met"] if free else []
        )

    def holds_in_part(self) -> bool:
        # A part of a flight counts less: it is judged where nothing at all is allowed.
        return self.largest_allowed <= 0.0

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.stretch(flight, flight.states)
        return LargestChange(stretch, f"{self.limit}_saturated_steps", magnitude=False)
