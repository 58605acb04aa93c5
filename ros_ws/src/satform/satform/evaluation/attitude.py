# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of attitude: how well satellites point, and what their wheels give.

Of a satellite without attitude every figure is not a number, and what is expected of it is missed. Steps in
which a satellite does not fly, or in which the one that it points at does not, are left out.
"""

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np

from satform.common.spec import Positive
from satform.evaluation.tracking import LargestOfSteps
from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.scenario.expectation import AtTime, Event, OfSatellites, OverWindow, largest
from satform.scenario.parts import SatelliteSpec


class PointingError(LargestOfSteps):
    """Largest angle between a satellite's boresight and its target, in rad."""

    unit = "rad"
    of_equipment = "attitude"
    kind: Literal["pointing_error"] = "pointing_error"

    def measure(self, record: FlightRecord) -> float:
        return _largest_known(self, record.pointing_error, record)

    def describe(self) -> str:
        return self.label or f"largest pointing error{self.when()}{self.whose()}"


class PanelToSun(LargestOfSteps):
    """Largest cosine of the angle between panel axis and sun; zero when panels face the sun."""

    of_equipment = "attitude"
    kind: Literal["panel_to_sun"] = "panel_to_sun"

    def measure(self, record: FlightRecord) -> float:
        return _largest_known(self, record.panel_to_sun, record)

    def describe(self) -> str:
        return self.label or f"largest cosine of panel axis to sun{self.when()}{self.whose()}"


class AttitudeSettling(Event):
    """Time after which pointing error or panels never exceed a level again, in s; the latest."""

    unit = "s"
    of_equipment = "attitude"
    kind: Literal["attitude_settling"] = "attitude_settling"
    quantity: Literal["pointing_error", "panel_to_sun"]
    """What has to settle."""
    level: Positive
    """What counts as settled, rad for the pointing error, without unit for the panels."""

    def measure(self, record: FlightRecord) -> float:
        series: Array = getattr(record, self.quantity)
        if not series.size:
            return math.nan
        columns = self.columns(record)
        excused = record.excluded(series, of_others=True)[:, columns]
        within = np.all((series[:, columns] <= self.level) | excused, axis=1) & ~excused.all(axis=1)
        outside = np.flatnonzero(~within)
        first = int(outside[-1]) + 1 if outside.size else 0
        return first * record.step if first < len(series) else math.nan

    def describe(self) -> str:
        words = self.quantity.replace("_", " ")
        return self.label or f"{words} settles to {self.level:g}{self.whose()}"


class AttitudeErrorAt(AtTime, OfSatellites):
    """Length of the modified Rodrigues parameters to the desired attitude at one moment; the largest."""

    of_steps = True
    of_equipment = "attitude"
    kind: Literal["attitude_error_at"] = "attitude_error_at"

    def measure(self, record: FlightRecord) -> float:
        return _known_at(self, record.attitude_error, record)

    def describe(self) -> str:
        return self.label or f"attitude error (MRP){self.moment()}{self.whose()}"


class AttitudeRateErrorAt(AtTime, OfSatellites):
    """Angular velocity relative to the desired one at one moment, in rad/s; the largest."""

    unit = "rad/s"
    of_steps = True
    of_equipment = "attitude"
    kind: Literal["attitude_rate_error_at"] = "attitude_rate_error_at"

    def measure(self, record: FlightRecord) -> float:
        return _known_at(self, record.attitude_rate_error, record)

    def describe(self) -> str:
        return self.label or f"angular velocity error{self.moment()}{self.whose()}"


class _OfWheels(OverWindow):
    """An expectation of one wheel, or of the one that does most."""

    of_equipment = "attitude"

    axis: Literal["x", "y", "z"] | None = None
    """Body axis of the wheel; all three when left out."""

    def peak(self, series: Array, record: FlightRecord) -> float:
        """Largest magnitude of the wheels that are meant."""
        if not series.size:
            return math.nan
        chosen = np.abs(self.window(series, record))
        return largest(chosen if self.axis is None else chosen[..., "xyz".index(self.axis)])

    def wheel(self) -> str:
        """The wheel, as part of a label."""
        return "of a wheel" if self.axis is None else f"of the {self.axis} wheel"


class WheelTorque(_OfWheels, LargestOfSteps):
    """Largest torque that is commanded to a wheel, in N m."""

    unit = "N m"
    kind: Literal["wheel_torque"] = "wheel_torque"

    def measure(self, record: FlightRecord) -> float:
        return self.peak(record.wheel_torque, record)

    def describe(self) -> str:
        return self.label or f"largest torque {self.wheel()}{self.when()}{self.whose()}"


class WheelMomentum(_OfWheels):
    """Largest momentum of a wheel, in N m s."""

    unit = "N m s"
    kind: Literal["wheel_momentum"] = "wheel_momentum"

    def holds_in_part(self) -> bool:
        return self.smallest_allowed <= 0.0

    def measure(self, record: FlightRecord) -> float:
        return self.peak(record.wheel_momentum, record)

    def describe(self) -> str:
        return self.label or f"largest momentum {self.wheel()}{self.when()}{self.whose()}"


class WheelSaturation(OverWindow):
    """Steps in which a limit of a wheel took something away, the most of the satellites."""

    of_equipment = "attitude"
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

    def measure(self, record: FlightRecord) -> float:
        series: Array = getattr(record, f"{self.limit}_saturated_steps")
        chosen = self.window(series, record) if series.size else series
        return largest(chosen[-1] - chosen[0]) if len(chosen) > 1 else math.nan

    def describe(self) -> str:
        return self.label or f"steps at the {self.limit} limit of the wheels{self.when()}{self.whose()}"


def _largest_known(expectation: OverWindow, series: Array, record: FlightRecord) -> float:
    return largest(expectation.window(series, record, of_others=True)) if series.size else math.nan


def _known_at(
    expectation: AttitudeErrorAt | AttitudeRateErrorAt, series: Array, record: FlightRecord
) -> float:
    if not series.size:
        return math.nan
    columns = expectation.columns(record)
    return largest(expectation.sample(series, record, columns, of_others=True))
