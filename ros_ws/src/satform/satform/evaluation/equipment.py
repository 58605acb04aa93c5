# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of what a satellite is equipped with: thrusters, sensor and filter."""

import math
from typing import Literal

import numpy as np

from satform.evaluation.tracking import LargestOfSteps
from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.scenario.expectation import OverWindow, largest


class _OfThrusters(OverWindow):
    """An expectation of something that the thrusters count."""

    of_equipment = "thruster"

    def holds_in_part(self) -> bool:
        # A part of a flight counts less: it is judged where nothing at all is allowed.
        return self.largest_allowed <= 0.0

    def counted(self, series: Array, record: FlightRecord) -> float:
        """Change of a series over the stretch, the largest of the satellites."""
        chosen = self.window(series, record)
        return largest(np.abs(chosen[-1] - chosen[0])) if len(chosen) > 1 else math.nan


class PropellantUsed(_OfThrusters):
    """Propellant that a satellite's thrusters take, the largest of the satellites, in kg."""

    unit = "kg"
    kind: Literal["propellant_used"] = "propellant_used"

    def measure(self, record: FlightRecord) -> float:
        return self.counted(record.propellant, record)

    def describe(self) -> str:
        return self.label or f"propellant used{self.when()}{self.whose()}"


class SaturatedSteps(_OfThrusters):
    """Steps with a command above the thrust limit, the most of the satellites."""

    kind: Literal["saturated_steps"] = "saturated_steps"

    def measure(self, record: FlightRecord) -> float:
        return self.counted(record.saturated_steps, record)

    def describe(self) -> str:
        return self.label or f"saturated steps{self.when()}{self.whose()}"


class BelowMinimumImpulseSteps(_OfThrusters):
    """Steps with a command below the smallest impulse, the most of the satellites."""

    kind: Literal["below_minimum_impulse_steps"] = "below_minimum_impulse_steps"

    def measure(self, record: FlightRecord) -> float:
        return self.counted(record.below_minimum_impulse_steps, record)

    def describe(self) -> str:
        return self.label or f"steps below the minimum impulse{self.when()}{self.whose()}"


class PropellantDepletedSteps(_OfThrusters):
    """Steps with a command that the tank could not give, the most of the satellites."""

    kind: Literal["propellant_depleted_steps"] = "propellant_depleted_steps"

    def measure(self, record: FlightRecord) -> float:
        return self.counted(record.propellant_depleted_steps, record)

    def describe(self) -> str:
        return self.label or f"steps with an empty tank{self.when()}{self.whose()}"


def _largest_or_rms(values: Array, statistic: str) -> float:
    if statistic == "maximum" or not values.size:
        return largest(values)
    numbers = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(numbers**2))) if numbers.size else math.nan


class NavigationError(OverWindow):
    """Distance between a satellite's measured and its true position, in m."""

    unit = "m"
    of_equipment = "sensor"
    kind: Literal["navigation_error"] = "navigation_error"
    statistic: Literal["maximum", "rms"] = "maximum"
    """Largest over the stretch, or root of the mean square."""

    def holds_in_part(self) -> bool:
        return self.statistic == "maximum" and self.smallest_allowed <= 0.0

    def measure(self, record: FlightRecord) -> float:
        return _largest_or_rms(self.window(record.navigation_error, record), self.statistic)

    def describe(self) -> str:
        return self.label or f"{self.statistic} navigation error{self.when()}{self.whose()}"


class EstimationError(LargestOfSteps):
    """Distance between a satellite's estimated and its true position, in m."""

    unit = "m"
    of_equipment = "sensor"
    kind: Literal["estimation_error"] = "estimation_error"
    statistic: Literal["maximum", "rms"] = "maximum"
    """Largest over the stretch, or root of the mean square."""

    def holds_in_part(self) -> bool:
        return self.statistic == "maximum" and super().holds_in_part()

    def measure(self, record: FlightRecord) -> float:
        return _largest_or_rms(self.window(record.estimation_error, record), self.statistic)

    def describe(self) -> str:
        return self.label or f"{self.statistic} estimation error{self.when()}{self.whose()}"
