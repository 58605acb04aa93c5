# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of what a satellite is equipped with: thrusters, sensor and filter."""

from typing import ClassVar, Literal

import numpy as np

from satform.evaluation.reducers import ExtremeOf, LargestChange, LargestSum, MeanOf
from satform.evaluation.tracking import LargestOfSteps
from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock
from satform.record.reducer import FlightShape, Reducer
from satform.record.stretch import Stretch
from satform.scenario.windowed_expectation import OverWindow


class _OfThrusters(OverWindow):
    """An expectation of something that the thrusters count."""

    of_equipment = "thruster"

    def holds_in_part(self) -> bool:
        # A part of a flight counts less: it is judged where nothing at all is allowed.
        return self.largest_allowed <= 0.0

    def counted(self, series: str, flight: FlightShape) -> Reducer:
        """Change of a quantity over the stretch, the largest of the satellites."""
        return LargestChange(self.stretch(flight, flight.states), series)


class PropellantUsed(_OfThrusters):
    """Propellant that a satellite's thrusters take, the largest of the satellites, in kg."""

    unit = "kg"
    figure_name = "propellant used"
    kind: Literal["propellant_used"] = "propellant_used"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.counted("propellant", flight)


class SaturatedSteps(_OfThrusters):
    """Steps with a command above the thrust limit, the most of the satellites."""

    figure_name = "saturated steps"
    kind: Literal["saturated_steps"] = "saturated_steps"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.counted("saturated_steps", flight)


class BelowMinimumImpulseSteps(_OfThrusters):
    """Steps with a command below the smallest impulse, the most of the satellites."""

    figure_name = "steps below the minimum impulse"
    kind: Literal["below_minimum_impulse_steps"] = "below_minimum_impulse_steps"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.counted("below_minimum_impulse_steps", flight)


class PropellantDepletedSteps(_OfThrusters):
    """Steps with a command that the tank could not give, the most of the satellites."""

    figure_name = "steps with an empty tank"
    kind: Literal["propellant_depleted_steps"] = "propellant_depleted_steps"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.counted("propellant_depleted_steps", flight)


class UnsolvedPlans(OverWindow):
    """Plans of `model_predictive` that its solver did not finish, the most of the satellites.

    Instead of such a plan the one before is flown on.
    """

    of_equipment = "plans"
    unit = "plans"
    figure_name = "unsolved plans"
    kind: Literal["unsolved_plans"] = "unsolved_plans"

    def holds_in_part(self) -> bool:
        # A part of a flight counts less: it is judged where nothing at all is allowed.
        return self.largest_allowed <= 0.0

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.stretch(flight, flight.steps, held=True)
        return LargestSum(stretch, _unsolved_while_flying, ("unsolved_plans", "absent"))


def _unsolved_while_flying(block: FlightBlock) -> Array:
    """Unsolved plans of each step, none while a satellite computes nothing."""
    plans: Array = block.unsolved_plans
    return np.where(block.not_flown, 0.0, plans) if len(plans) else plans


def largest_or_rms(stretch: Stretch, series: str, statistic: Literal["maximum", "rms"]) -> Reducer:
    """Largest value of a quantity over a stretch, or root of the mean square."""
    return (
        ExtremeOf(stretch, series)
        if statistic == "maximum"
        else MeanOf(stretch, series, root_of_squares=True)
    )


class NavigationError(OverWindow):
    """Distance between a satellite's measured and its true position, in m."""

    unit = "m"
    of_equipment = "sensor"
    figure_name = "{0.statistic} navigation error"
    kind: Literal["navigation_error"] = "navigation_error"
    statistic: Literal["maximum", "rms"] = "maximum"
    """Largest over the stretch, or root of the mean square."""

    def holds_in_part(self) -> bool:
        return self.statistic == "maximum" and self.smallest_allowed <= 0.0

    def reducer(self, flight: FlightShape) -> Reducer:
        return largest_or_rms(self.stretch(flight, flight.states), "navigation_error", self.statistic)


class LargestOrRms(LargestOfSteps):
    """Largest value of a quantity of each step, or root of the mean square."""

    quantity_name: ClassVar[str]
    """Of the record."""
    statistic: Literal["maximum", "rms"] = "maximum"
    """Largest over the stretch, or root of the mean square."""

    def holds_in_part(self) -> bool:
        return self.statistic == "maximum" and super().holds_in_part()

    def reducer(self, flight: FlightShape) -> Reducer:
        return largest_or_rms(self.stretch(flight, flight.steps), self.quantity_name, self.statistic)


class EstimationError(LargestOrRms):
    """Distance between a satellite's estimated and its true position, in m."""

    unit = "m"
    of_equipment = "motion_sensor"
    figure_name = "{0.statistic} estimation error"
    quantity_name = "estimation_error"
    kind: Literal["estimation_error"] = "estimation_error"


class OfFilter(LargestOfSteps):
    """A figure of how well the errors of a filter agree with the covariance that it states."""

    of_equipment: ClassVar[Literal["filter", "attitude_filter"]] = "filter"
    statistic: Literal["mean", "maximum"] = "mean"
    """Mean over the stretch, or largest."""

    def holds_in_part(self) -> bool:
        return self.statistic == "maximum" and super().holds_in_part()

    def over(self, series: str, flight: FlightShape) -> Reducer:
        """Mean or largest value of a quantity of each step over the stretch."""
        stretch = self.stretch(flight, flight.steps)
        return MeanOf(stretch, series) if self.statistic == "mean" else ExtremeOf(stretch, series)


class EstimationErrorSquared(OfFilter):
    """Normalised estimation error squared (NEES) of a satellite's filter: mean 6 if it is consistent."""

    figure_name = "{0.statistic} NEES"
    kind: Literal["nees"] = "nees"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.over("estimation_error_squared", flight)


class InnovationSquared(OfFilter):
    """Normalised innovation squared (NIS) of a satellite's filter: mean 6 if it is consistent.

    Each step counts with the newest measurement that was known in it, and with 0 before the second one.
    """

    figure_name = "{0.statistic} NIS"
    kind: Literal["nis"] = "nis"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.over("innovation", flight)
